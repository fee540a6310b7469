//! Our side of `benches/peers/run`: holds the map, does one piece of work a line of stdin.
//!
//! `size`, `seed`, `time WORK COUNT` (ms of each), `dump WORK PATH` (raw output), `graph_figures`, `pose_error`
//! (m, rad, status), `agree WORK PEER` and `version PEER` for peers that are Rust crates.

use std::fmt::Write as _;
use std::hint::black_box;
use std::io::{BufRead as _, Write as _};
use std::time::Instant;

use image::{GrayImage, Luma};
use linefeat::{
    Canny, CannyParams, Detector, DetectorParams, EdgeMap, Hough, HoughParams, Line, Norm, Voting,
};
use mobot_benches::{BuildingMap, FREE_FROM, frames::Frame, view::View};
use mobot_hw::sim::Distortion;
use morpho::{
    BitImage, Border, Components, Connectivity, Element, FillWorkspace, Pixel, Workspace, distance,
    thin,
};
use occgrid::{MapFrame, OccupancyGrid, Pose2, Reading, Shot, SonarModel, reference};
use voronoi_plan::{FreeSpace, GraphParams, VoronoiGraph};

/// Thresholds of the `canny` rows.
const CANNY: CannyParams = CannyParams {
    low: 50.0,
    high: 150.0,
    norm: Norm::L1,
};
/// Radius of the robot of the `map_to_graph` row [m].
const RADIUS: f64 = 0.25;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut bench = Bench::new();
    let mut stdout = std::io::stdout();
    for line in std::io::stdin().lock().lines() {
        let line = line?;
        let words: Vec<&str> = line.split_whitespace().collect();
        let answer = match words[..] {
            ["size"] => format!("ok {} {}", bench.map.width, bench.map.height),
            ["seed"] => format!("ok {} {}", bench.seed.x, bench.seed.y),
            ["time", work, count] => {
                let mut answer = "ok".to_owned();
                for _ in 0..count.parse()? {
                    let start = Instant::now();
                    bench.run(work);
                    write!(answer, " {}", start.elapsed().as_secs_f64() * 1e3)?;
                }
                answer
            }
            ["dump", work, path] => {
                std::fs::write(path, bench.output(work))?;
                "ok".to_owned()
            }
            ["graph_figures"] => bench.graph_figures(),
            ["pose_error"] => {
                let fix = bench.view.locate();
                let [off, turned] = bench.view.error(&fix);
                format!("ok {off} {turned} {}", fix.status.name())
            }
            ["agree", work, peer] => format!("ok {}", bench.agree(work, peer)),
            ["version", peer] if peer.starts_with("imageproc") => "ok 0.27".to_owned(),
            ["version", _] => format!("ok {}", env!("CARGO_PKG_VERSION")),
            _ => format!("unknown: {line}"),
        };
        writeln!(stdout, "{answer}")?;
        stdout.flush()?;
    }
    Ok(())
}

/// The map and every buffer that the pieces of work reuse, ours and the peers'.
struct Bench {
    map: BuildingMap,
    frame: MapFrame,
    bits: BitImage,
    picture: GrayImage,
    seed: Pixel,
    out: BitImage,
    workspace: Workspace,
    fill: FillWorkspace,
    components: Components,
    labels: Vec<u32>,
    distances: Vec<u32>,
    distance_workspace: distance::Workspace,
    gray_out: GrayImage,
    grid: OccupancyGrid,
    plain_grid: Vec<f32>,
    model: SonarModel,
    shots: Vec<Shot>,
    graph: Option<VoronoiGraph>,
    robot: Frame,
    robot_edges: EdgeMap,
    corridor: Frame,
    canny: Canny,
    edges: EdgeMap,
    edge_picture: GrayImage,
    detector: Detector,
    hough: Hough,
    lines: Vec<Line>,
    view: View,
}

impl Bench {
    fn new() -> Self {
        let map = BuildingMap::large();
        let (width, height) = (map.width, map.height);
        let bits = map.bits();
        let picture = morpho::to_gray_image(&bits);
        let frame = MapFrame::new(
            width as u32,
            height as u32,
            map.resolution,
            Pose2::default(),
        )
        .expect("a valid frame");
        let components = Components::label(&bits, Connectivity::Eight);
        let seed = components.largest().expect("free cells").first;
        let grid = OccupancyGrid::from_log_odds(frame, vec![0.0; width * height]).expect("a grid");
        Self {
            seed,
            out: BitImage::new(width, height),
            workspace: Workspace::new(),
            fill: FillWorkspace::new(),
            components,
            labels: Vec::new(),
            distances: Vec::new(),
            distance_workspace: distance::Workspace::default(),
            gray_out: GrayImage::new(width as u32, height as u32),
            grid,
            plain_grid: vec![0.0; width * height],
            model: SonarModel {
                sigma: 0.05,
                max_range: 5.0,
                ..SonarModel::default()
            },
            shots: shots(&map),
            graph: None,
            robot: Frame::robot(),
            robot_edges: linefeat::canny(&Frame::robot().image, &CANNY),
            corridor: Frame::corridor(),
            canny: Canny::new(),
            edges: EdgeMap::new(),
            edge_picture: GrayImage::default(),
            detector: Detector::new(DetectorParams::default()),
            hough: Hough::new(),
            lines: Vec::new(),
            view: View::corridor(Distortion::None),
            map,
            frame,
            bits,
            picture,
        }
    }

    fn run(&mut self, work: &str) {
        let (bits, ws, out) = (&self.bits, &mut self.workspace, &mut self.out);
        let border = Border::Neutral;
        match work {
            "erode_3x3" => morpho::erode_into(bits, &Element::square(3), border, ws, out),
            "dilate_3x3" => morpho::dilate_into(bits, &Element::square(3), border, ws, out),
            "open_3x3" => morpho::open_into(bits, &Element::square(3), border, ws, out),
            "open_15x15" => morpho::open_into(bits, &Element::square(15), border, ws, out),
            "open_disk7" => morpho::open_into(bits, &Element::disk(7), border, ws, out),
            "threshold_pack" => {
                let (width, height) = (self.map.width, self.map.height);
                morpho::threshold_into(&self.map.gray, width, height, FREE_FROM, out);
            }
            "seed_fill" => {
                morpho::seed_fill_into(bits, self.seed, Connectivity::Eight, &mut self.fill, out);
            }
            "components" => self.components.relabel(bits, Connectivity::Eight),
            "components_image" => {
                self.components.relabel(bits, Connectivity::Eight);
                self.components.to_labels_into(&mut self.labels);
            }
            "distance" => distance::squared_into(
                bits,
                border,
                &mut self.distance_workspace,
                &mut self.distances,
            ),
            "thin_zs" => self.out = thin::zhang_suen(bits),
            "thin_homotopic" => self.out = thin::homotopic(bits),
            "map_to_graph" => self.graph = Some(self.build_graph()),
            "canny" | "canny_l2" | "canny_corridor" => {
                let frame = if work == "canny_corridor" {
                    &self.corridor
                } else {
                    &self.robot
                };
                let norm = if work == "canny_l2" {
                    Norm::L2
                } else {
                    Norm::L1
                };
                let params = CannyParams { norm, ..CANNY };
                self.canny.detect(&frame.image, &params, &mut self.edges);
                self.edges.write_gray(&mut self.edge_picture);
            }
            "hough_standard" | "hough_modified" => {
                let mut params = HoughParams::default();
                if work == "hough_standard" {
                    (params.voting, params.votes) = (Voting::AllDirections, 100);
                }
                self.hough
                    .detect(&self.robot_edges, &params, &mut self.lines)
                    .expect("bins");
            }
            "segments" => {
                self.detector.detect(&self.robot.image);
            }
            "segments_corridor" => {
                self.detector.detect(&self.corridor.image);
            }
            "frame_to_pose" => {
                black_box(self.view.locate());
            }
            "imageproc_hough" => {
                let options = imageproc::hough::LineDetectionOptions {
                    vote_threshold: 100,
                    suppression_radius: 4,
                };
                black_box(imageproc::hough::detect_lines(&self.edge_picture, options));
            }
            "imageproc_canny" => {
                let (low, high) = (CANNY.low as f32, CANNY.high as f32);
                self.gray_out = imageproc::edges::canny(&self.robot.image, low, high);
            }
            "sonar_update" => {
                self.grid
                    .integrate(&self.model, &self.shots)
                    .expect("inside the grid");
            }
            "plain_sonar_update" => {
                for shot in &self.shots {
                    reference::update(&self.frame, &mut self.plain_grid, &self.model, shot);
                }
            }
            "imageproc_erode_3x3" => {
                self.gray_out = imageproc::morphology::erode(
                    &self.picture,
                    imageproc::distance_transform::Norm::LInf,
                    1,
                );
            }
            "imageproc_open_3x3" => {
                self.gray_out = imageproc::morphology::open(
                    &self.picture,
                    imageproc::distance_transform::Norm::LInf,
                    1,
                );
            }
            "imageproc_components" => {
                black_box(self.imageproc_labels());
            }
            "imageproc_distance" => {
                black_box(self.imageproc_distances());
            }
            _ => panic!("no such work: {work}"),
        }
    }

    /// From the picture in memory to the graph: threshold and packing included.
    fn build_graph(&self) -> VoronoiGraph {
        let (width, height) = (self.map.width, self.map.height);
        let free = morpho::threshold(&self.map.gray, width, height, FREE_FROM);
        let space = FreeSpace::new(self.frame, free);
        let params = GraphParams {
            radius: RADIUS,
            ..GraphParams::default()
        };
        VoronoiGraph::build(&space, &params).expect("a graph")
    }

    fn output(&mut self, work: &str) -> Vec<u8> {
        match work {
            "map" => return self.map.gray.clone(),
            "frame" => return self.robot.image.as_raw().clone(),
            "frame_corridor" => return self.corridor.image.as_raw().clone(),
            _ => {}
        }
        self.run(work);
        let little = |values: &[u32]| values.iter().flat_map(|v| v.to_le_bytes()).collect();
        match work {
            "components" => little(&self.components.to_labels()),
            "components_image" => little(&self.labels),
            "distance" => little(&self.distances),
            "hough_standard" | "hough_modified" => {
                let numbers = |l: &Line| [l.rho, l.theta, f64::from(l.votes)];
                let numbers = self.lines.iter().flat_map(numbers);
                numbers.flat_map(f64::to_le_bytes).collect()
            }
            _ if work.starts_with("segments") => {
                let found = self.detector.segments().iter();
                let numbers = found.flat_map(|s| [s.start, s.end].concat());
                numbers.flat_map(f64::to_le_bytes).collect()
            }
            _ if work.starts_with("canny") => self.edge_picture.as_raw().clone(),
            _ => morpho::to_gray(&self.out),
        }
    }

    fn graph_figures(&mut self) -> String {
        self.run("map_to_graph");
        self.graph.as_ref().map_or("no graph".to_owned(), |graph| {
            let length: f64 = graph.arcs.iter().map(|arc| arc.length).sum();
            format!(
                "ok {} {} {} {} {}",
                graph.nodes.len(),
                graph.arcs.len(),
                graph.components(),
                graph.cycles(),
                length / self.map.resolution,
            )
        })
    }

    /// Whether our output equals that of a peer that runs in this process.
    fn agree(&mut self, work: &str, peer: &str) -> bool {
        self.run(work);
        match peer {
            "imageproc_components" => same_partition(
                &self.components.to_labels(),
                self.imageproc_labels().as_raw(),
            ),
            "imageproc_distance" => {
                let theirs = self.imageproc_distances();
                self.distances
                    .iter()
                    .zip(theirs.iter())
                    .all(|(&ours, &theirs)| ours == (theirs * theirs).round() as u32)
            }
            // it smooths first, so that fewer edges are left: those must be near ours
            "imageproc_canny" => {
                self.run(peer);
                let theirs = self
                    .gray_out
                    .enumerate_pixels()
                    .filter(|(.., p)| p.0 == [255]);
                let (mut near, mut all) = (0, 0);
                for (u, v, _) in theirs {
                    let mut places = (0..25).map(|k| (u + k % 5, v + k / 5));
                    near += usize::from(
                        places.any(|(u, v)| u >= 2 && v >= 2 && self.edges.contains(u - 2, v - 2)),
                    );
                    all += 1;
                }
                all > 1000 && near * 10 > all * 9
            }
            // it knows whole degrees and pixels, and finds neighbours that we hold for one line
            "imageproc_hough" => {
                self.run("canny");
                let options = imageproc::hough::LineDetectionOptions {
                    vote_threshold: 100,
                    suppression_radius: 4,
                };
                let mut theirs = imageproc::hough::detect_lines(&self.edge_picture, options);
                // its bin there is two pixels wide
                theirs.retain(|line| line.r.abs() >= 1.0);
                let near = |other: &&imageproc::hough::PolarLine| {
                    let theta = f64::from(other.angle_in_degrees).to_radians();
                    let turn = |line: &Line| (line.theta - theta).abs();
                    let shift = |line: &Line| (line.rho - f64::from(other.r)).abs();
                    (self.lines.iter()).any(|line| turn(line) < 0.06 && shift(line) < 25.0)
                };
                let count = theirs.iter().filter(near).count();
                count > 5 && count * 10 > theirs.len() * 9
            }
            "plain_sonar_update" => {
                let (width, height) = (self.map.width, self.map.height);
                self.grid = OccupancyGrid::from_log_odds(self.frame, vec![0.0; width * height])
                    .expect("a grid");
                self.plain_grid.fill(0.0);
                self.run(work);
                self.run(peer);
                self.grid.log_odds() == self.plain_grid
            }
            _ => {
                self.run(peer);
                morpho::to_gray(&self.out) == *self.gray_out.as_raw()
            }
        }
    }

    fn imageproc_labels(&self) -> image::ImageBuffer<Luma<u32>, Vec<u32>> {
        imageproc::region_labelling::connected_components(
            &self.picture,
            imageproc::region_labelling::Connectivity::Eight,
            Luma([0]),
        )
    }

    /// Euclidean distances to the nearest background pixel.
    fn imageproc_distances(&self) -> Vec<f64> {
        let mut background = self.picture.clone();
        image::imageops::invert(&mut background);
        imageproc::distance_transform::euclidean_squared_distance_transform(&background)
            .into_raw()
            .into_iter()
            .map(f64::sqrt)
            .collect()
    }
}

/// Twenty shots all round at each of 50 free places, as the paper's robot takes them, echoes and silence.
fn shots(map: &BuildingMap) -> Vec<Shot> {
    // so far from the edge that no beam leaves the map: the plain loop's grid cannot grow
    let inner = |at: usize, side: usize| (128..side - 128).contains(&at);
    let free: Vec<usize> = (0..map.gray.len())
        .filter(|&i| map.gray[i] >= FREE_FROM)
        .filter(|&i| inner(i % map.width, map.width) && inner(i / map.width, map.height))
        .collect();
    let mut shots = Vec::new();
    for stop in 0..50 {
        let index = free[(stop * 2 + 1) * free.len() / 100];
        let (col, row) = (index % map.width, index / map.width);
        let place = Pose2::new(
            (col as f64 + 0.5) * map.resolution,
            (map.height - row) as f64 * map.resolution - 0.5 * map.resolution,
            0.1 * stop as f64,
        );
        for k in 0..20 {
            let range = 0.5 + 0.22 * k as f64;
            shots.push(Shot {
                stamp: shots.len() as f64,
                map_from_base: place,
                bearing: (18.0 * f64::from(k)).to_radians(),
                reading: if k % 4 == 3 {
                    Reading::NoEcho { listened: 5.0 }
                } else {
                    Reading::Echo {
                        range: range.min(4.9),
                    }
                },
            });
        }
    }
    shots
}

/// Whether two label images part the foreground alike.
fn same_partition(ours: &[u32], theirs: &[u32]) -> bool {
    let mut to_theirs = std::collections::BTreeMap::new();
    let mut to_ours = std::collections::BTreeMap::new();
    ours.iter().zip(theirs).all(|(&a, &b)| {
        (a == 0) == (b == 0)
            && *to_theirs.entry(a).or_insert(b) == b
            && *to_ours.entry(b).or_insert(a) == a
    })
}
