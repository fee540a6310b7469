//! What was typed: the command line, one struct a subcommand. Jobs are built from these in `cmd`.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};

/// Sonar logs to maps, maps to certified roadmaps, roadmaps to routes.
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

/// `mobot floorplan`
#[derive(Debug, Args)]
pub struct FloorplanArgs {
    #[command(flatten)]
    #[expect(missing_docs, reason = "flattened: its fields are documented")]
    pub input: MapInput,
    /// Where the plan goes: GeoJSON, walls and door corners.
    #[arg(short, long, value_name = "PLAN.geojson")]
    pub output: PathBuf,
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
