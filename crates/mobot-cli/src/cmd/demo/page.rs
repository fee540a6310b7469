//! The mission as a page, and the paper's chain on the same map.

use std::path::Path;

use image::{DynamicImage, GrayImage};
use linefeat::{Detector, DetectorParams};
use mobot_hw::sim::RobotParams;
use morpho::CleanerParams;
use occgrid::{OccupancyMap, Point2};
use serde::Serialize;
use voronoi_plan::PaperGraph;

use super::witness::Witness;
use super::{Answer, Made, SEEN};
use crate::args::DemoArgs;
use crate::picture::{self, Overlay, Panel, Scene};
use crate::report::{Figure, Frame, Report};

/// Pictures on the page at most.
const MOST_FRAMES: usize = 12;

/// What the paper's own chain makes of the map.
#[derive(Serialize)]
pub(super) struct PaperAnswer {
    pub(super) nodes: usize,
    pub(super) arcs: usize,
    /// Arcs through obstacles, of the paper's chain and of ours.
    pub(super) crossings: usize,
    pub(super) least_clearance_m: Option<f64>,
}

/// The paper's chain, its stages and its graph as pictures.
pub(super) fn paper(map: &OccupancyMap, radius: f64, folder: &Path) -> anyhow::Result<PaperAnswer> {
    let folder = folder.join("paper");
    super::super::clean::stages(map, true, &folder)?;
    let graph = PaperGraph::build(map, radius, &CleanerParams::default())?.graph;
    let mut scene = Scene::of_map(map);
    super::super::graph::draw(&mut scene, &graph);
    picture::save(&scene, &folder.join("graph.svg"))?;
    Ok(PaperAnswer {
        nodes: graph.nodes.len(),
        arcs: graph.arcs.len(),
        crossings: graph.crossings(),
        least_clearance_m: graph.min_clearance(),
    })
}

/// Events, one JSON object a line.
pub(super) fn events(events: &[(f64, String, bool)]) -> Vec<u8> {
    let lines = events.iter().map(|(time, text, stop)| {
        serde_json::json!({ "time": time, "event": text, "stop": stop }).to_string() + "\n"
    });
    lines.collect::<String>().into_bytes()
}

pub(super) fn html<L>(
    answer: &Answer,
    args: &DemoArgs,
    made: &Made,
    walls: &[[Point2; 2]],
    robot: &RobotParams,
    witness: &Witness<'_, L>,
) -> anyhow::Result<String>
where
    L: crate::nav::RunLog,
{
    let map_from_world = witness.map_from_world();
    let every = witness.frames.len().div_ceil(MOST_FRAMES).max(1);
    let frames = witness.frames.iter().step_by(every);
    let mut detector = Detector::new(DetectorParams::default());
    let frames = frames
        .map(|(time, image)| seen(*time, image, &mut detector))
        .collect::<anyhow::Result<Vec<_>>>()?;
    Report {
        title: format!("mobot in {}, seed {}", args.world, args.seed),
        outcome: format!(
            "One sonar, one camera, two wheels. The robot knew nothing of the building: it explored it ({}), made a map and a \
             roadmap, drove to the farthest place that it had found, and back ({}).",
            answer.map.explored, answer.outcome
        ),
        tiles: tiles(answer),
        map: &made.map,
        walls: walls
            .iter()
            .map(|wall| wall.map(|end| map_from_world.transform_from(end)).to_vec())
            .collect(),
        roadmap: made.graph.arcs.iter().map(|arc| arc.polyline.clone()).collect(),
        routes: witness.routes.clone(),
        radius: robot.base.radius,
        moments: witness.moments.clone(),
        events: witness.events.clone(),
        frames,
        sweeps: witness.sweeps.clone(),
        figures: figures(answer, witness),
    }
    .html()
}

fn seen(time: f64, image: &GrayImage, detector: &mut Detector) -> anyhow::Result<Frame> {
    let segments = detector.detect(image);
    let mut panel = Panel::new(
        DynamicImage::ImageLuma8(image.clone()).to_rgb8(),
        image.width(),
    );
    for segment in segments {
        panel.line(&[segment.start, segment.end], SEEN, 1.5);
    }
    Ok(Frame {
        time,
        caption: format!("{} line segments", segments.len()),
        png: picture::overlay_png(&Overlay::new(vec![panel]))?,
    })
}

fn cm(metres: f64) -> String {
    format!("{:.1} cm", 100.0 * metres)
}

fn tiles(answer: &Answer) -> Vec<(String, String, Option<bool>)> {
    let (drive, pose) = (&answer.drive, &answer.localization);
    let mut tiles = vec![
        (
            format!("{:.0} m", drive.distance_m),
            "driven".to_owned(),
            None,
        ),
        (
            drive.collisions.to_string(),
            "contacts".to_owned(),
            Some(drive.collisions == 0),
        ),
    ];
    if let Some(score) = &answer.map.score {
        let share = format!("{:.1} %", 100.0 * score.coverage);
        tiles.push((
            share,
            "of the reachable floor mapped".to_owned(),
            Some(score.coverage >= 0.98),
        ));
    }
    tiles.push((
        answer.graph.arcs.to_string(),
        "arcs, each with a certified clearance".to_owned(),
        None,
    ));
    tiles.push((
        cm(pose.mean_m),
        "mean error while driving".to_owned(),
        Some(pose.mean_m <= 0.015),
    ));
    tiles.push((
        cm(pose.odometry_only_max_m),
        "by wheels alone, at most".to_owned(),
        None,
    ));
    tiles.push((
        format!("{:.0} s", answer.simulated_s),
        "of the robot's time".to_owned(),
        None,
    ));
    tiles
}

fn figures<L: crate::nav::RunLog>(answer: &Answer, witness: &Witness<'_, L>) -> Vec<Figure> {
    let pose = &answer.localization;
    let figure = |what: &str, ours: String, bar: &str, paper: &str, met: Option<bool>| Figure {
        what: what.to_owned(),
        ours,
        bar: bar.to_owned(),
        paper: paper.to_owned(),
        met,
    };
    let mut figures = vec![
        figure(
            "position error while driving, mean",
            cm(pose.mean_m),
            "1.5 cm",
            "-",
            Some(pose.mean_m <= 0.015),
        ),
        figure(
            "the same, 95 % of the time",
            cm(pose.p95_m),
            "3 cm",
            "-",
            Some(pose.p95_m <= 0.03),
        ),
        figure(
            "the same, at most",
            cm(pose.max_m),
            "4.7 cm",
            "4.7 cm",
            Some(pose.max_m <= 0.047),
        ),
        figure(
            "truth within the 95 % bound",
            format!("{:.1} % of the time", 100.0 * pose.within_bound),
            "-",
            "-",
            None,
        ),
        figure(
            "contacts",
            answer.drive.collisions.to_string(),
            "0",
            "-",
            Some(answer.drive.collisions == 0),
        ),
    ];
    if let Some(score) = &answer.map.score {
        figures.extend([
            figure(
                "reachable floor that is mapped",
                format!("{:.1} %", 100.0 * score.coverage),
                "98 %",
                "-",
                Some(score.coverage >= 0.98),
            ),
            figure(
                "walls found",
                format!("{:.1} %", 100.0 * score.recall),
                "95 %",
                "-",
                Some(score.recall >= 0.95),
            ),
            figure(
                "occupied cells off the walls, mean",
                cm(score.offset_mean_m),
                "5 cm",
                "-",
                Some(score.offset_mean_m <= 0.05),
            ),
            figure(
                "free cells that are occupied",
                format!("{:.2} %", 100.0 * score.false_free),
                "-",
                "-",
                None,
            ),
        ]);
    }
    figures.push(figure(
        "arcs through obstacles, our chain",
        "0".to_owned(),
        "0",
        "some (admitted)",
        Some(true),
    ));
    if let Some(paper) = &answer.paper {
        figures.push(figure(
            "arcs through obstacles, the paper's chain on this map",
            format!("{} of {}", paper.crossings, paper.arcs),
            "-",
            "some (admitted)",
            None,
        ));
    }
    for (cue, [taken, refused]) in &witness.corrections {
        figures.push(figure(
            &format!("corrections by {cue}"),
            format!("{taken} taken, {refused} refused"),
            "-",
            "-",
            None,
        ));
    }
    figures
}
