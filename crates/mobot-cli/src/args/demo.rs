//! `mobot demo` on the command line.

use std::path::PathBuf;

use clap::Args;

/// `mobot demo`
#[derive(Debug, Args)]
pub struct DemoArgs {
    /// Building: sketch, office, hall, a world file (.toml) or a ROS map (.yaml).
    #[arg(long, value_name = "W", default_value = "office")]
    pub world: String,
    /// Seed of all noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Folder for everything that the mission leaves.
    #[arg(long, value_name = "DIR", default_value = "mobot-demo")]
    pub out: PathBuf,
    /// The paper's own chain on the same map, its figures beside ours.
    #[arg(long)]
    pub paper: bool,
    /// Time to explore in at most [s of the simulated robot].
    #[arg(long, value_name = "SECONDS", default_value_t = 1800.0)]
    pub budget: f64,
}
