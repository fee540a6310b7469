//! Charts of the page: errors against time, and a sweep of the sonar.

use std::fmt::Write as _;

use occgrid::Reading;

use super::{Moment, Sweep};

/// Errors at a time.
#[derive(Debug, Clone, Copy)]
pub(super) struct ErrorPoint {
    time: f64,
    error: f64,
    bound: f64,
    drift: f64,
}

impl ErrorPoint {
    /// `None` where nobody knows the truth.
    pub(super) fn of(moment: &Moment) -> Option<Self> {
        let truth = moment.truth?.position();
        Some(Self {
            time: moment.time,
            error: truth.distance(moment.estimate.position()),
            bound: moment.bound,
            drift: truth.distance(moment.odometry.position()),
        })
    }
}

const WIDTH: f64 = 1140.0;
const HEIGHT: f64 = 300.0;
const LEFT: f64 = 52.0;
const RIGHT: f64 = WIDTH - 12.0;
const TOP: f64 = 10.0;
const BOTTOM: f64 = HEIGHT - 44.0;

/// Errors against time, from a millimetre up on a logarithmic scale; under them a stroke an event.
pub(super) fn errors(points: &[ErrorPoint], events: &[(f64, bool)]) -> String {
    let from = points.first().map_or(0.0, |p| p.time);
    let to = points.last().map_or(1.0, |p| p.time).max(from + 1e-3);
    let most = points.iter().fold(0.01_f64, |most, p| {
        most.max(p.drift).max(p.bound).max(p.error)
    });
    let decades = (most / LEAST).log10().ceil().max(1.0);
    let x = |time: f64| LEFT + (RIGHT - LEFT) * (time - from) / (to - from);
    let y = |metres: f64| {
        let decade = (metres.max(LEAST) / LEAST).log10() / decades;
        BOTTOM - (BOTTOM - TOP) * decade.min(1.0)
    };
    let mut svg = format!(
        "<svg class=\"chart\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"position error against time\" \
         data-from=\"{from:.3}\" data-to=\"{to:.3}\" data-left=\"{LEFT}\" data-right=\"{RIGHT}\" data-top=\"{TOP}\" data-bottom=\"{BOTTOM}\">\n"
    );
    for decade in 0..=decades as i32 {
        let metres = LEAST * 10_f64.powi(decade);
        let name = match decade {
            0 => "1 mm".to_owned(),
            1 => "1 cm".to_owned(),
            2 => "10 cm".to_owned(),
            _ => format!("{metres:.0} m"),
        };
        let at = y(metres);
        let _ = writeln!(
            svg,
            "<path class=\"grid\" d=\"M{LEFT} {at:.1}H{RIGHT}\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{name}</text>",
            LEFT - 6.0,
            at + 4.0
        );
    }
    time_axis(&mut svg, from, to, &x);
    let mut band = String::new();
    for p in points {
        let _ = write!(band, "{:.1},{:.1} ", x(p.time), y(p.bound));
    }
    let _ = writeln!(
        svg,
        "<polygon class=\"bound\" points=\"{LEFT},{BOTTOM} {band}{RIGHT},{BOTTOM}\"/>"
    );
    line(
        &mut svg,
        "odometry",
        points.iter().map(|p| (x(p.time), y(p.drift))),
    );
    line(
        &mut svg,
        "estimate",
        points.iter().map(|p| (x(p.time), y(p.error))),
    );
    for &(time, stop) in events {
        if (from..=to).contains(&time) {
            let class = if stop { "stop" } else { "event" };
            let _ = writeln!(
                svg,
                "<path class=\"{class}\" d=\"M{:.1} {}v10\"/>",
                x(time),
                BOTTOM + 4.0
            );
        }
    }
    svg.push_str("</svg>\n");
    svg
}

/// The lowest error that the scale shows [m].
const LEAST: f64 = 1e-3;

fn time_axis(svg: &mut String, from: f64, to: f64, x: &impl Fn(f64) -> f64) {
    let about = (to - from) / 8.0;
    let power = 10_f64.powf(about.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .map(|m| m * power)
        .into_iter()
        .find(|&s| s >= about)
        .unwrap_or(about);
    let mut time = (from / step).ceil() * step;
    while time <= to {
        let _ = writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\">{time} s</text>",
            x(time),
            HEIGHT - 10.0
        );
        time += step;
    }
    let _ = writeln!(svg, "<path class=\"axis\" d=\"M{LEFT} {BOTTOM}H{RIGHT}\"/>");
}

fn line(svg: &mut String, class: &str, points: impl Iterator<Item = (f64, f64)>) {
    let _ = write!(svg, "<polyline class=\"{class}\" points=\"");
    for (x, y) in points {
        let _ = write!(svg, "{x:.1},{y:.1} ");
    }
    svg.push_str("\"/>\n");
}

const SWEEP: f64 = 260.0;

/// What one sweep heard: the robot in the middle, its nose up, a dot an echo, a ray where nothing came back.
pub(super) fn sweep(sweep: &Sweep) -> String {
    let middle = SWEEP / 2.0;
    let farthest = sweep
        .soundings
        .iter()
        .fold(1.0_f64, |most, (_, reading)| match *reading {
            Reading::Echo { range } => most.max(range),
            Reading::NoEcho { listened } => most.max(listened),
            _ => most,
        });
    let scale = (middle - 14.0) / farthest;
    let mut svg = format!(
        "<svg class=\"chart\" viewBox=\"0 0 {SWEEP} {SWEEP}\" role=\"img\" aria-label=\"sonar sweep\">\n"
    );
    for metres in 1..=farthest as u32 {
        let _ = writeln!(
            svg,
            "<circle class=\"grid\" fill=\"none\" cx=\"{middle}\" cy=\"{middle}\" r=\"{:.1}\"/>",
            f64::from(metres) * scale
        );
    }
    for &(bearing, reading) in &sweep.soundings {
        let at = |range: f64| {
            (
                middle - scale * range * bearing.sin(),
                middle - scale * range * bearing.cos(),
            )
        };
        let (class, range) = match reading {
            Reading::Echo { range } => ("beam", range),
            Reading::NoEcho { listened } => ("silent", listened),
            _ => continue,
        };
        let (x, y) = at(range);
        let _ = writeln!(
            svg,
            "<path class=\"{class}\" d=\"M{middle} {middle}L{x:.1} {y:.1}\"/>"
        );
        if class == "beam" {
            let _ = writeln!(
                svg,
                "<circle class=\"echo\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.2\"/>"
            );
        }
    }
    svg.push_str("</svg>");
    svg
}
