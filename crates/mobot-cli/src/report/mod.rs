//! What a mission came to, as one page that needs nothing beside it: the map with the ways over it, errors
//! against time, what the sonar heard and the camera saw, events, and the paper's figures beside ours.

mod chart;

use std::fmt::Write as _;

use base64::{Engine as _, engine::general_purpose::STANDARD};
use occgrid::{OccupancyMap, Point2, Pose2, Reading};
use serde_json::json;

use crate::picture::{self, Color, Scene, escape};

/// A moment of the run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// [s]
    pub time: f64,
    /// Where the robot thought it was.
    pub estimate: Pose2,
    /// The radius within which its position should be 95 times in 100 [m].
    pub bound: f64,
    /// Where it would have thought it was by its wheels alone.
    pub odometry: Pose2,
    /// Where it was, if anybody knows.
    pub truth: Option<Pose2>,
}

/// A picture that the camera took, with what was found in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// [s]
    pub time: f64,
    /// The picture as PNG.
    pub png: Vec<u8>,
    /// What it shows.
    pub caption: String,
}

/// What the sonar heard all round from one place.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// [s]
    pub time: f64,
    /// Directions [rad, base frame] and what came of them.
    pub soundings: Vec<(f64, Reading)>,
}

/// A figure beside its bar and the paper's.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// What it is.
    pub what: String,
    /// As measured in this run.
    pub ours: String,
    /// What it has to be.
    pub bar: String,
    /// What the paper printed.
    pub paper: String,
    /// Whether it is as it has to be; `None` without a bar.
    pub met: Option<bool>,
}

/// What the page shows. All places are in the map frame.
#[derive(Debug, Clone)]
pub struct Report<'a> {
    /// The page's name.
    pub title: String,
    /// How the mission ended, in a sentence.
    pub outcome: String,
    /// A few figures for the first look: value, what it is, whether it is good.
    pub tiles: Vec<(String, String, Option<bool>)>,
    /// The map that the robot made.
    pub map: &'a OccupancyMap,
    /// The true walls, if anybody knows.
    pub walls: Vec<Vec<Point2>>,
    /// The arcs of the roadmap.
    pub roadmap: Vec<Vec<Point2>>,
    /// Routes that were planned.
    pub routes: Vec<Vec<Point2>>,
    /// The robot's radius [m].
    pub radius: f64,
    /// The run, in order of time.
    pub moments: Vec<Moment>,
    /// What happened when [s], and whether it was a stop.
    pub events: Vec<(f64, String, bool)>,
    /// Pictures, in order of time.
    pub frames: Vec<Frame>,
    /// Sweeps of the sonar.
    pub sweeps: Vec<Sweep>,
    /// Figures.
    pub figures: Vec<Figure>,
}

const TRUTH: Color = Color::INK;
const ESTIMATE: Color = Color(0, 88, 196);
const ODOMETRY: Color = Color(200, 80, 10);
const ROADMAP: Color = Color(150, 150, 160);

/// Lines that the page may hide: their class, name, colour, width and points.
type Layer = (&'static str, &'static str, Color, f64, Vec<Vec<Point2>>);

/// Moments that the page keeps at most: more would not be seen.
const MOST_MOMENTS: usize = 3000;

impl Report<'_> {
    /// The page. Time linear in what it shows.
    ///
    /// # Errors
    /// If a picture cannot be encoded.
    pub fn html(&self) -> anyhow::Result<String> {
        let moments = thinned(&self.moments, MOST_MOMENTS);
        let mut page = format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width\">\n\
             <link rel=\"icon\" href=\"data:,\">\n<title>{title}</title>\n<style>\n{}</style>\n</head>\n<body>\n<h1>{title}</h1>\n<p>{}</p>\n",
            include_str!("page.css"),
            escape(&self.outcome),
            title = escape(&self.title),
        );
        self.tiles(&mut page)?;
        self.map_section(&mut page, &moments)?;
        self.error_section(&mut page, &moments)?;
        self.scrubber(&mut page, &moments)?;
        self.sensor_section(&mut page)?;
        self.event_section(&mut page)?;
        self.figure_section(&mut page)?;
        write!(
            page,
            "<script type=\"application/json\" id=\"run\">{}</script>\n<script>\n{}</script>\n</body>\n</html>\n",
            self.data(&moments),
            include_str!("page.js")
        )?;
        Ok(page)
    }

    fn tiles(&self, page: &mut String) -> std::fmt::Result {
        page.push_str("<div class=\"tiles\">\n");
        for (value, what, good) in &self.tiles {
            let class = match good {
                Some(true) => "tile good",
                Some(false) => "tile bad",
                None => "tile",
            };
            writeln!(
                page,
                "<div class=\"{class}\"><b>{}</b><span>{}</span></div>",
                escape(value),
                escape(what)
            )?;
        }
        page.push_str("</div>\n");
        Ok(())
    }

    fn map_section(&self, page: &mut String, moments: &[Moment]) -> anyhow::Result<()> {
        let mut scene = Scene::of_map(self.map);
        let way = |pose: fn(&Moment) -> Option<Pose2>| -> Vec<Point2> {
            let poses = moments.iter().filter_map(pose);
            poses.map(|pose| pose.position()).collect()
        };
        let layers: [Layer; 6] = [
            ("roadmap", "roadmap", ROADMAP, 1.0, self.roadmap.clone()),
            ("walls", "true walls", Color::FAULT, 1.2, self.walls.clone()),
            (
                "routes",
                "planned routes",
                Color::ROUTE,
                3.0,
                self.routes.clone(),
            ),
            (
                "odometry",
                "by wheels alone",
                ODOMETRY,
                1.4,
                vec![way(|m| Some(m.odometry))],
            ),
            ("truth", "where it was", TRUTH, 1.6, vec![way(|m| m.truth)]),
            (
                "estimate",
                "where it thought it was",
                ESTIMATE,
                1.6,
                vec![way(|m| Some(m.estimate))],
            ),
        ];
        page.push_str(
            "<section class=\"map\"><h2>The map it made, and its way</h2>\n<div class=\"legend\">",
        );
        for (layer, name, color, width_px, lines) in &layers {
            if lines.iter().all(|line| line.len() < 2) {
                continue;
            }
            write!(
                page,
                "<label><input type=\"checkbox\" data-layer=\"{layer}\" checked> <i style=\"background:rgb({},{},{})\"></i>{name}</label>",
                color.0, color.1, color.2
            )?;
            scene.layer(layer);
            for line in lines {
                scene.line(line, *color, *width_px);
            }
        }
        page.push_str("</div>\n");
        page.push_str(&picture::svg(&scene)?);
        page.push_str("</section>\n");
        Ok(())
    }

    fn error_section(&self, page: &mut String, moments: &[Moment]) -> std::fmt::Result {
        let points: Vec<chart::ErrorPoint> =
            moments.iter().filter_map(chart::ErrorPoint::of).collect();
        if points.is_empty() {
            return Ok(());
        }
        page.push_str(
            "<section><h2>Error against time</h2>\n<div class=\"legend\">\
             <span><i style=\"background:var(--estimate)\"></i>position error, corrected</span>\
             <span><i style=\"background:var(--bound);height:.9em\"></i>its 95 % bound</span>\
             <span><i style=\"background:var(--odometry)\"></i>by wheels alone</span>\
             <span><i style=\"background:var(--bad)\"></i>stops</span></div>\n",
        );
        let events = self.events.iter().map(|(time, _, stop)| (*time, *stop));
        page.push_str(&chart::errors(&points, &events.collect::<Vec<_>>()));
        page.push_str("</section>\n");
        Ok(())
    }

    fn scrubber(&self, page: &mut String, moments: &[Moment]) -> std::fmt::Result {
        let (Some(first), Some(last)) = (moments.first(), moments.last()) else {
            return Ok(());
        };
        writeln!(
            page,
            "<div class=\"scrub\"><input type=\"range\" id=\"time\" aria-label=\"time\" min=\"{:.3}\" max=\"{:.3}\" step=\"0.01\" value=\"{:.3}\"><output id=\"says\"></output></div>",
            first.time, last.time, last.time
        )
    }

    fn sensor_section(&self, page: &mut String) -> std::fmt::Result {
        if !self.sweeps.is_empty() {
            page.push_str("<section><h2>What the sonar heard</h2>\n<div class=\"frames\">\n");
            for sweep in &self.sweeps {
                writeln!(
                    page,
                    "<figure data-t=\"{:.3}\">{}<figcaption>{:.1} s: {} echoes of {} shots</figcaption></figure>",
                    sweep.time,
                    chart::sweep(sweep),
                    sweep.time,
                    sweep
                        .soundings
                        .iter()
                        .filter(|(_, reading)| matches!(reading, Reading::Echo { .. }))
                        .count(),
                    sweep.soundings.len()
                )?;
            }
            page.push_str("</div></section>\n");
        }
        if !self.frames.is_empty() {
            page.push_str("<section><h2>What the camera saw</h2>\n<div class=\"frames\">\n");
            for frame in &self.frames {
                writeln!(
                    page,
                    "<figure data-t=\"{:.3}\"><img alt=\"camera frame at {:.1} s\" src=\"data:image/png;base64,{}\"><figcaption>{:.1} s: {}</figcaption></figure>",
                    frame.time,
                    frame.time,
                    STANDARD.encode(&frame.png),
                    frame.time,
                    escape(&frame.caption)
                )?;
            }
            page.push_str("</div></section>\n");
        }
        Ok(())
    }

    fn event_section(&self, page: &mut String) -> std::fmt::Result {
        if self.events.is_empty() {
            return Ok(());
        }
        page.push_str("<section><h2>What happened</h2>\n<div class=\"events\"><table><tbody>\n");
        for (time, text, _) in &self.events {
            writeln!(
                page,
                "<tr data-t=\"{time:.3}\"><td>{time:.1} s</td><td>{}</td></tr>",
                escape(text)
            )?;
        }
        page.push_str("</tbody></table></div></section>\n");
        Ok(())
    }

    fn figure_section(&self, page: &mut String) -> std::fmt::Result {
        if self.figures.is_empty() {
            return Ok(());
        }
        page.push_str(
            "<section><h2>Figures beside the paper's</h2>\n<p class=\"soft\">W. Choi, C. Ryu, H. Kim, IEEE Int. Conf. on Systems, Man, and Cybernetics 1999, pp. IV-686 to IV-691</p>\n\
             <table><thead><tr><th>figure</th><th>here</th><th>bar</th><th>paper</th></tr></thead><tbody>\n",
        );
        for figure in &self.figures {
            let class = match figure.met {
                Some(true) => "met",
                Some(false) => "missed",
                None => "",
            };
            writeln!(
                page,
                "<tr><td>{}</td><td class=\"{class}\">{}</td><td>{}</td><td>{}</td></tr>",
                escape(&figure.what),
                escape(&figure.ours),
                escape(&figure.bar),
                escape(&figure.paper)
            )?;
        }
        page.push_str("</tbody></table></section>\n");
        Ok(())
    }

    /// What the page's script moves: poses in the picture's coordinates.
    fn data(&self, moments: &[Moment]) -> String {
        let frame = self.map.frame();
        let on_picture = |pose: Pose2| {
            let at = frame.grid_from_map(pose.position());
            let nose = Point2::new(pose.x + pose.theta.cos(), pose.y + pose.theta.sin());
            let nose = frame.grid_from_map(nose);
            let turn = (nose.row - at.row).atan2(nose.col - at.col).to_degrees();
            let round = |v: f64| (v * 100.0).round() / 100.0;
            [round(at.col), round(at.row), round(turn)]
        };
        let millimetres = |metres: f64| (metres * 1e4).round() / 1e4;
        let error = |moment: &Moment, pose: Pose2| {
            moment
                .truth
                .map(|truth| millimetres(truth.position().distance(pose.position())))
        };
        let data = json!({
            "radius": self.radius / frame.resolution(),
            "t": moments.iter().map(|m| (m.time * 1e3).round() / 1e3).collect::<Vec<_>>(),
            "estimate": moments.iter().map(|m| on_picture(m.estimate)).collect::<Vec<_>>(),
            "odometry": moments.iter().map(|m| on_picture(m.odometry)).collect::<Vec<_>>(),
            "truth": moments.iter().map(|m| on_picture(m.truth.unwrap_or(m.estimate))).collect::<Vec<_>>(),
            "error": moments.iter().map(|m| error(m, m.estimate)).collect::<Vec<_>>(),
            "drift": moments.iter().map(|m| error(m, m.odometry)).collect::<Vec<_>>(),
            "bound": moments.iter().map(|m| millimetres(m.bound)).collect::<Vec<_>>(),
        });
        // nothing in it may end the script
        data.to_string().replace('<', "\\u003c")
    }
}

/// At most so many, evenly chosen, the last among them.
fn thinned(moments: &[Moment], most: usize) -> Vec<Moment> {
    let every = moments.len().div_ceil(most).max(1);
    let mut kept: Vec<Moment> = moments.iter().step_by(every).copied().collect();
    if let (Some(last), Some(kept_last)) = (moments.last(), kept.last())
        && kept_last.time < last.time
    {
        kept.push(*last);
    }
    kept
}
