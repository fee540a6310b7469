//! Maps a room that is 6 m by 4 m, with a pillar and a doorway, from full turns of 20 sonar shots, and prints
//! it. `cargo run --example map_room`

use std::f64::consts::TAU;

use occgrid::{Cell, OccupancyGrid, Point2, Pose2, Reading, Shot, SonarModel};

/// Walls as (start, end); the doorway is the gap in the right-hand wall.
const WALLS: [(Point2, Point2); 9] = [
    (Point2::new(0.0, 0.0), Point2::new(6.0, 0.0)),
    (Point2::new(6.0, 0.0), Point2::new(6.0, 1.5)),
    (Point2::new(6.0, 2.5), Point2::new(6.0, 4.0)),
    (Point2::new(6.0, 4.0), Point2::new(0.0, 4.0)),
    (Point2::new(0.0, 4.0), Point2::new(0.0, 0.0)),
    (Point2::new(2.6, 1.6), Point2::new(3.2, 1.6)),
    (Point2::new(3.2, 1.6), Point2::new(3.2, 2.2)),
    (Point2::new(3.2, 2.2), Point2::new(2.6, 2.2)),
    (Point2::new(2.6, 2.2), Point2::new(2.6, 1.6)),
];

/// Distance from `from` to the wall along a ray, if it meets it.
fn ray_to_wall(from: Point2, angle: f64, (a, b): (Point2, Point2)) -> Option<f64> {
    let (dy, dx) = angle.sin_cos();
    let (ex, ey) = (b.x - a.x, b.y - a.y);
    let across = dx * ey - dy * ex;
    let (ax, ay) = (a.x - from.x, a.y - from.y);
    let (range, along) = ((ax * ey - ay * ex) / across, (ax * dy - ay * dx) / across);
    (range > 0.0 && (0.0..=1.0).contains(&along)).then_some(range)
}

/// What a sonar hears: the nearest thing in its cone.
fn listen(model: &SonarModel, from: Point2, axis: f64) -> Reading {
    let rays = (0..=20).map(|k| axis + model.beam_width * (f64::from(k) / 20.0 - 0.5));
    let nearest = rays
        .flat_map(|angle| {
            WALLS
                .into_iter()
                .filter_map(move |wall| ray_to_wall(from, angle, wall))
        })
        .fold(f64::INFINITY, f64::min);
    if nearest <= model.max_range {
        Reading::Echo { range: nearest }
    } else {
        Reading::NoEcho {
            listened: model.max_range,
        }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let model = SonarModel {
        sigma: 0.1,
        ..SonarModel::default()
    };
    let mut grid = OccupancyGrid::new(0.125)?;
    for stop in 0..14 {
        // round the pillar, 1 m from the walls
        let angle = TAU * f64::from(stop) / 14.0;
        let base = Pose2::new(2.9 + 2.0 * angle.cos(), 2.0 + angle.sin(), angle);
        for k in 0..20 {
            let bearing = TAU * f64::from(k) / 20.0;
            let reading = listen(&model, base.position(), base.theta + bearing);
            let shot = Shot {
                stamp: f64::from(stop),
                map_from_base: base,
                bearing,
                reading,
            };
            grid.update(&model, &shot)?;
        }
    }
    let frame = *grid.frame();
    let mut picture = String::new();
    for y in (-4..36).rev() {
        for x in -4..60 {
            let point = Point2::new((f64::from(x) + 0.5) * 0.125, (f64::from(y) + 0.5) * 0.125);
            let p = frame
                .cell_at(point)
                .map_or(0.5, |cell: Cell| grid.probability(cell));
            picture.push(match p {
                p if p > 0.65 => '#',
                p if p < 0.35 => '.',
                _ => ' ',
            });
        }
        picture.push('\n');
    }
    std::io::Write::write_all(&mut std::io::stdout(), picture.as_bytes())?;
    Ok(())
}
