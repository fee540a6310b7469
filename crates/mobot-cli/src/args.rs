//! What was typed: the command line, one struct a subcommand. Jobs are built from these in `cmd`.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};

mod demo;
mod devices;
mod explore;
mod mission;

pub use demo::DemoArgs;
pub use devices::{DeviceArgs, DevicesArgs, EmulateArgs};
pub use explore::{ExploreArgs, HandArg};
pub use mission::{DriveArgs, Goal};

/// Sonar logs to maps, maps to certified roadmaps, roadmaps to routes; camera frames to floor metres.
#[derive(Debug, Parser)]
#[command(name = "mobot", version, about, disable_help_subcommand = true)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
    /// Print exactly one JSON object on stdout.
    #[arg(long, global = true)]
    pub json: bool,
    /// No progress on stderr.
    #[arg(long, short, global = true)]
    pub quiet: bool,
}

/// The subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Build a map from a sonar log.
    Map(MapArgs),
    /// Clean a map step by step, one picture a stage.
    Clean(CleanArgs),
    /// Extract the Voronoi roadmap of a map, every arc with a certified clearance.
    Graph(GraphArgs),
    /// Check any route graph against a map, independently of how it was made.
    Check(CheckArgs),
    /// Plan a certified route on a map.
    Plan(PlanArgs),
    /// Derive a floor plan, walls and candidates for doors, from a map.
    Floorplan(FloorplanArgs),
    /// Find the edges and straight lines of a camera frame.
    Lines(LinesArgs),
    /// Find the robot's pose from a camera frame, a floor plan and a prior.
    Locate(LocateArgs),
    /// Say which sonar readings made a cell what it is.
    Why(WhyArgs),
    /// Calibrate a camera over a floor from pixel-to-floor pairs.
    Calibrate(CalibrateArgs),
    /// The floor point that a pixel sees, with its error bars.
    Floor(FloorArgs),
    /// Draw the floor of a frame as seen from above.
    Birdseye(BirdseyeArgs),
    /// Explore a building and map it: surveys by sonar, along the walls, then to what is left.
    Explore(Box<ExploreArgs>),
    /// List ports and cameras, and ask the named devices who they are.
    Devices(Box<DevicesArgs>),
    /// Emulate devices of a simulated robot on pseudo-terminals, until interrupted.
    Emulate(EmulateArgs),
    /// The whole mission in a simulated building: explore, map, plan, drive there and back; and a page about it.
    Demo(DemoArgs),
    /// Drive to a goal on a map: plan, follow, localize, keep clear, arrive.
    Drive(Box<DriveArgs>),
    /// Run a mission again from its log: its devices answer as they did, its decisions are compared.
    Replay(ReplayArgs),
    /// Own a base's port; programs start this.
    #[command(hide = true)]
    Guard(GuardArgs),
}

/// `mobot replay`
#[derive(Debug, Args)]
pub struct ReplayArgs {
    /// Log that `mobot drive` or `mobot explore` has written.
    #[arg(value_name = "RUN.mcap")]
    pub log: PathBuf,
}

/// How an echo's evidence is spread over range (Choi, Ryu, Kim 1999, section 2.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ProfileArg {
    /// Free in front, occupied at the echo, nothing behind.
    Smooth,
    /// The paper's words: also lowers cells just behind the echo.
    Literal,
}

/// `mobot map`
#[derive(Debug, Args)]
pub struct MapArgs {
    /// Sonar log: CSV with header stamp,x,y,theta,bearing,kind,range.
    pub log: PathBuf,
    /// Sensor parameters: flat TOML.
    #[arg(long, value_name = "S.toml")]
    pub sensor: PathBuf,
    /// Side of a cell [m].
    #[arg(long, default_value_t = 0.05, value_name = "R")]
    pub resolution: f64,
    /// Range profile of an echo; the sensor file's, or smooth.
    #[arg(long)]
    pub profile: Option<ProfileArg>,
    /// Explain the whole log at once by a forward model: narrower walls, open doorways.
    #[arg(long)]
    pub refine: bool,
    /// Cells with probability of occupancy at or below this are free.
    #[arg(long, default_value_t = 0.35, value_name = "P")]
    pub free: f64,
    /// Cells with probability of occupancy at or above this are occupied.
    #[arg(long, default_value_t = 0.65, value_name = "P")]
    pub occupied: f64,
    /// The grid may grow to this many cells.
    #[arg(long, default_value_t = 1 << 26, value_name = "N")]
    pub max_cells: usize,
    /// Where the map goes; image and log-odds are written beside it.
    #[arg(short, long, value_name = "MAP.yaml")]
    pub output: PathBuf,
    /// Name the image MAP.pgm, not MAP.000001.pgm; an interrupted save may then pair the new image with
    /// the old YAML.
    #[arg(long)]
    pub plain_names: bool,
    /// Draw the map (.svg or .png).
    #[arg(long, value_name = "P")]
    pub picture: Option<PathBuf>,
}

/// The map that a command reads.
#[derive(Debug, Args)]
pub struct MapInput {
    /// Map: ROS / Nav2 map_server YAML.
    #[arg(value_name = "MAP.yaml")]
    pub map: PathBuf,
    /// Read the image even where it is outside the YAML's folder.
    #[arg(long)]
    pub allow_outside: bool,
    /// Class pixels exactly on a threshold as ROS 1's map_server does (strictly), not as Nav2 does.
    #[arg(long)]
    pub ros1: bool,
}

/// `mobot clean`
#[derive(Debug, Args)]
pub struct CleanArgs {
    #[command(flatten)]
    #[expect(missing_docs, reason = "flattened: its fields are documented")]
    pub input: MapInput,
    /// Folder for the pictures and the ledger.
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// The paper's chain word for word: closing may fill obstacles, 3 x 3 cells become one.
    #[arg(long)]
    pub paper: bool,
}

/// `mobot graph`
#[derive(Debug, Args)]
pub struct GraphArgs {
    #[command(flatten)]
    #[expect(missing_docs, reason = "flattened: its fields are documented")]
    pub input: MapInput,
    /// Radius of the robot [m].
    #[arg(long, value_name = "R", allow_hyphen_values = true)]
    pub radius: f64,
    /// Where the graph goes: Nav2 route GeoJSON.
    #[arg(short, long, value_name = "G.geojson")]
    pub output: PathBuf,
    /// The paper's chain word for word; arcs that cross obstacles are counted, not hidden.
    #[arg(long)]
    pub paper: bool,
    /// Cut arcs into straight ones, for programs that drive straight from node to node as Nav2's route
    /// server does.
    #[arg(long, conflicts_with = "paper")]
    pub straight: bool,
    /// Draw map and arcs, coloured by clearance (.svg or .png).
    #[arg(long, value_name = "P")]
    pub picture: Option<PathBuf>,
}

/// `mobot check`
#[derive(Debug, Args)]
pub struct CheckArgs {
    /// Route graph: Nav2 route GeoJSON, ours or anybody's.
    #[arg(value_name = "G.geojson")]
    pub graph: PathBuf,
    #[command(flatten)]
    #[expect(missing_docs, reason = "flattened: its fields are documented")]
    pub input: MapInput,
    /// Radius of the robot [m].
    #[arg(long, value_name = "R", allow_hyphen_values = true)]
    pub radius: f64,
    /// Unknown cells are no obstacles.
    #[arg(long)]
    pub unknown_free: bool,
    /// Ignore what is drawn: check straight lines from node to node, as Nav2's route server drives them.
    #[arg(long)]
    pub straight: bool,
    /// Draw map and edges, violations marked (.svg or .png).
    #[arg(long, value_name = "P")]
    pub picture: Option<PathBuf>,
}

/// `mobot plan`
#[derive(Debug, Args)]
pub struct PlanArgs {
    #[command(flatten)]
    #[expect(missing_docs, reason = "flattened: its fields are documented")]
    pub input: MapInput,
    /// Radius of the robot [m].
    #[arg(long, value_name = "R", allow_hyphen_values = true)]
    pub radius: f64,
    /// Start in the map frame [m].
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true, value_parser = point, required_unless_present = "queries", requires = "to")]
    pub from: Option<[f64; 2]>,
    /// Goal in the map frame [m].
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true, value_parser = point, requires = "from")]
    pub to: Option<[f64; 2]>,
    /// Many queries: CSV with header x0,y0,x1,y1; one JSON line a query, in order.
    #[arg(long, value_name = "Q.csv", conflicts_with_all = ["from", "to", "picture"])]
    pub queries: Option<PathBuf>,
    /// A graph saved by `mobot graph` for this map and radius, instead of making it anew.
    #[arg(long, value_name = "G.geojson")]
    pub graph: Option<PathBuf>,
    /// Draw map, arcs and route (.svg or .png).
    #[arg(long, value_name = "P")]
    pub picture: Option<PathBuf>,
}

/// `mobot why`
#[derive(Debug, Args)]
pub struct WhyArgs {
    #[command(flatten)]
    #[expect(missing_docs, reason = "flattened: its fields are documented")]
    pub input: MapInput,
    /// Sonar log from which the map was made.
    pub log: PathBuf,
    /// Place in the map frame [m].
    #[arg(allow_hyphen_values = true)]
    pub x: f64,
    /// Place in the map frame [m].
    #[arg(allow_hyphen_values = true)]
    pub y: f64,
    /// Sensor parameters; without it, the copy that `mobot map` left beside the map.
    #[arg(long, value_name = "S.toml")]
    pub sensor: Option<PathBuf>,
    /// Range profile of an echo; the sensor file's, or smooth.
    #[arg(long)]
    pub profile: Option<ProfileArg>,
    /// Show this many readings at most.
    #[arg(long, default_value_t = 20, value_name = "N")]
    pub most: usize,
}

/// Which half of the pairs is measured with errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum NoiseArg {
    /// Pixels are read with errors, marks are placed exactly.
    Pixel,
    /// Marks are measured on the floor with errors, pixels are exact.
    Floor,
    /// Both, by their sigmas.
    Both,
}

/// `mobot calibrate`
#[derive(Debug, Args)]
pub struct CalibrateArgs {
    /// Pairs: CSV with header u,v,x,y; pixel (u right, v down), floor point [m] (x forward, y left).
    #[arg(
        value_name = "PAIRS.csv",
        required_unless_present = "target_sheet",
        requires = "output"
    )]
    pub pairs: Option<PathBuf>,
    /// Where the camera goes: JSON.
    #[arg(short, long, value_name = "CAMERA.json", requires = "pairs")]
    pub output: Option<PathBuf>,
    /// What is noisy.
    #[arg(long, value_enum, default_value_t = NoiseArg::Pixel)]
    pub noise: NoiseArg,
    /// Expected error of a pixel coordinate, one sigma [px].
    #[arg(
        long,
        default_value_t = 0.5,
        value_name = "S",
        allow_hyphen_values = true
    )]
    pub pixel_sigma: f64,
    /// Expected error of a floor coordinate, one sigma [m].
    #[arg(
        long,
        default_value_t = 0.005,
        value_name = "S",
        allow_hyphen_values = true
    )]
    pub floor_sigma: f64,
    /// Take the sigmas as they are instead of measuring them from the residuals.
    #[arg(long)]
    pub given_sigma: bool,
    /// The lens: ROS camera_info YAML.
    #[arg(long, value_name = "CAMERA_INFO.yaml")]
    pub lens: Option<PathBuf>,
    /// Size of the picture [px]; that of --image or --lens where they are given.
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub image_size: Option<[u32; 2]>,
    /// A frame of the camera, to draw on.
    #[arg(long, value_name = "IMAGE")]
    pub image: Option<PathBuf>,
    /// Draw pairs, metric grid, pixel footprint and error ellipses (.svg or .png).
    #[arg(long, value_name = "P")]
    pub picture: Option<PathBuf>,
    /// Write a sheet to print: a floor mark, where to lay it, and what to do (.svg).
    #[arg(long, value_name = "SHEET.svg")]
    pub target_sheet: Option<PathBuf>,
}

/// `mobot floor`
#[derive(Debug, Args)]
pub struct FloorArgs {
    /// Camera, as `mobot calibrate` writes it.
    #[arg(value_name = "CAMERA.json")]
    pub camera: PathBuf,
    /// Column [px].
    #[arg(allow_hyphen_values = true)]
    pub u: f64,
    /// Row, downwards [px].
    #[arg(allow_hyphen_values = true)]
    pub v: f64,
    /// How well the pixel is known, one sigma of each coordinate [px]; the camera's own without it.
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    pub pixel_sigma: Option<f64>,
}

/// `mobot birdseye`
#[derive(Debug, Args)]
pub struct BirdseyeArgs {
    /// A frame: PNG, JPEG or PNM, 8 bits a channel.
    pub image: PathBuf,
    /// Camera, as `mobot calibrate` writes it.
    #[arg(long, value_name = "CAMERA.json")]
    pub camera: PathBuf,
    /// Where the picture goes (.png).
    #[arg(short, long, value_name = "P.png")]
    pub output: PathBuf,
    /// Side of a pixel of the picture [m]; as fine as the frame at its best without it.
    #[arg(long, value_name = "R", allow_hyphen_values = true)]
    pub metres_per_pixel: Option<f64>,
    /// Show the floor only where a pixel of the frame covers at most this [m].
    #[arg(
        long,
        default_value_t = 0.05,
        value_name = "R",
        allow_hyphen_values = true
    )]
    pub coarsest: f64,
}

/// `WxH` in pixels, neither of them 0.
fn size(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once(['x', 'X']).and_then(|(width, height)| {
        let side = |s: &str| {
            s.trim()
                .parse::<u32>()
                .ok()
                .filter(|s| (1..=100_000).contains(s))
        };
        Some([side(width)?, side(height)?])
    });
    sides.ok_or_else(|| format!("expected WIDTHxHEIGHT in pixels, found {text:?}"))
}

/// `mobot floorplan`
#[derive(Debug, Args)]
pub struct FloorplanArgs {
    #[command(flatten)]
    #[expect(missing_docs, reason = "flattened: its fields are documented")]
    pub input: MapInput,
    /// Where the plan goes: GeoJSON, walls and door corners.
    #[arg(short, long, value_name = "PLAN.geojson")]
    pub output: PathBuf,
    /// The narrowest and the widest doorway [m].
    #[arg(long, value_name = "LEAST,MOST", default_value = "0.6,1.4", value_parser = point)]
    pub doors: [f64; 2],
    /// How much an opening must look like a doorway, 0 to 1.
    #[arg(long, value_name = "C", default_value_t = 0.6)]
    pub confidence: f64,
    /// Draw walls, doorways and their confidence on the map (.svg or .png).
    #[arg(long, value_name = "P")]
    pub picture: Option<PathBuf>,
}

/// `mobot guard`
#[derive(Debug, Args)]
pub struct GuardArgs {
    /// What `mobot_hw::guard::run` takes.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    pub words: Vec<String>,
}

/// `mobot lines`
#[derive(Debug, Args)]
pub struct LinesArgs {
    /// Camera frame: PNG, JPEG or PNM, 8 bits.
    #[arg(value_name = "IMAGE")]
    pub image: PathBuf,
    /// Draw the segments over the frame (.png or .svg).
    #[arg(long, value_name = "P")]
    pub overlay: Option<PathBuf>,
    /// Write the edge picture, 0 or 255, as PNG.
    #[arg(long, value_name = "E.png", requires = "canny")]
    pub edges: Option<PathBuf>,
    /// Thresholds of the Canny edges.
    #[arg(long, value_name = "LOW,HIGH", value_parser = point)]
    pub canny: Option<[f64; 2]>,
    /// Take the gradient's length, not the sum of its parts.
    #[arg(long, requires = "canny")]
    pub l2: bool,
}

/// `mobot locate`
#[derive(Debug, Args)]
pub struct LocateArgs {
    /// Camera frame: PNG, JPEG or PNM, 8 bits.
    #[arg(value_name = "IMAGE")]
    pub image: PathBuf,
    /// The camera, as `mobot calibrate` writes it.
    #[arg(long, value_name = "CAMERA.json")]
    pub camera: PathBuf,
    /// Floor plan: GeoJSON, drawn by hand or by `mobot floorplan`.
    #[arg(long, value_name = "PLAN.geojson")]
    pub plan: PathBuf,
    /// Where the robot is thought to be, map frame [m, m, rad].
    #[arg(long, value_name = "X,Y,THETA", allow_hyphen_values = true, value_parser = triple)]
    pub prior: [f64; 3],
    /// One sigma of each of these [m, m, rad].
    #[arg(long, value_name = "X,Y,THETA", default_value = "0.15,0.15,0.06", value_parser = triple)]
    pub prior_sigma: [f64; 3],
    /// Draw lines by kind, corners with ellipses, a metric grid and the plan over the frame (.png or .svg).
    #[arg(long, value_name = "P")]
    pub overlay: Option<PathBuf>,
}

/// `X,Y`, both finite.
fn point(text: &str) -> Result<[f64; 2], String> {
    numbers(text, "two numbers")
}

/// `X,Y,THETA`, all finite.
fn triple(text: &str) -> Result<[f64; 3], String> {
    numbers(text, "three numbers X,Y,THETA")
}

fn numbers<const N: usize>(text: &str, expected: &str) -> Result<[f64; N], String> {
    let number = |part: &str| match part.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(format!("expected a finite number, found {part:?}")),
    };
    let parts: Vec<f64> = text.split(',').map(number).collect::<Result<_, _>>()?;
    let count = parts.len();
    parts
        .try_into()
        .map_err(|_| format!("expected {expected}, found {count} parts"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn points_are_two_finite_numbers() {
        assert_eq!(point("1.5,-2"), Ok([1.5, -2.0]));
        for bad in ["", "1", "1,2,3", "1,nan", "inf,2", "a,b"] {
            assert!(point(bad).is_err(), "{bad:?}");
        }
    }

    #[test]
    fn negative_coordinates_need_no_quoting() {
        let cli = Cli::try_parse_from([
            "mobot", "plan", "m.yaml", "--radius", "0.2", "--from", "-1,-2", "--to", "3,4",
        ]);
        assert!(matches!(
            cli.map(|c| c.command),
            Ok(Command::Plan(PlanArgs {
                from: Some([-1.0, -2.0]),
                ..
            }))
        ));
    }
}
