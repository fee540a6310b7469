//! Noise belongs to the sensor: the map must not depend on the cell size beyond discretisation.

use std::f64::consts::TAU;

use occgrid::{OccupancyGrid, Point2, Pose2, Reading, Shot, SonarModel};

/// A rectangular room [m]; its walls are 0.15 m thick, outside.
const WIDTH: f64 = 6.03;
const HEIGHT: f64 = 4.57;

/// A small repeatable source of numbers in 0..1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.next()).sum::<f64>() - 6.0
    }
}

/// Distance to the wall along a ray from inside the room.
fn ray(x: f64, y: f64, angle: f64) -> f64 {
    let (sin, cos) = angle.sin_cos();
    let to_side = if cos > 0.0 {
        (WIDTH - x) / cos
    } else {
        -x / cos
    };
    let to_end = if sin > 0.0 {
        (HEIGHT - y) / sin
    } else {
        -y / sin
    };
    to_side.min(to_end)
}

/// Twelve full turns of 20 shots in a room placed anywhere; range noise 0.1 m.
fn shots(model: &SonarModel, place: Pose2, random: &mut Random) -> Vec<Shot> {
    let mut shots = Vec::new();
    for stop in 0..12 {
        let x = 0.8 + (WIDTH - 1.6) * random.next();
        let y = 0.8 + (HEIGHT - 1.6) * random.next();
        let heading = TAU * random.next();
        for k in 0..20 {
            let bearing = TAU * f64::from(k) / 20.0;
            let across = |q: i32| model.beam_width * (f64::from(q) / 20.0 - 0.5);
            let nearest = (0..=20)
                .map(|q| ray(x, y, heading + bearing + across(q)))
                .fold(f64::INFINITY, f64::min);
            let reading = if nearest <= model.max_range {
                Reading::Echo {
                    range: (nearest + 0.1 * random.normal()).max(0.0),
                }
            } else {
                Reading::NoEcho {
                    listened: model.max_range,
                }
            };
            let map_from_base = place.compose(Pose2::new(x, y, heading));
            shots.push(Shot {
                stamp: f64::from(stop),
                map_from_base,
                bearing,
                reading,
            });
        }
    }
    shots
}

/// Mean of -ln p(truth) over the same points of the floor and the walls, whatever the cells; corners, which
/// no wall faces, left out.
fn log_loss(grid: &OccupancyGrid, place: Pose2) -> f64 {
    const STEP: f64 = 0.03;
    let (mut sum, mut count) = (0.0, 0.0);
    let margin = 0.15;
    let columns = ((WIDTH + 2.0 * margin) / STEP) as i32;
    let rows = ((HEIGHT + 2.0 * margin) / STEP) as i32;
    for (column, row) in (0..columns).flat_map(|c| (0..rows).map(move |r| (c, r))) {
        let x = (f64::from(column) + 0.5) * STEP - margin;
        let y = (f64::from(row) + 0.5) * STEP - margin;
        let free = x > 0.0 && x < WIDTH && y > 0.0 && y < HEIGHT;
        let near_corner = x.min(WIDTH - x) < 0.3 && y.min(HEIGHT - y) < 0.3;
        if !free && near_corner {
            continue;
        }
        let cell = grid
            .frame()
            .cell_at(place.transform_from(Point2::new(x, y)));
        let p = cell
            .map_or(0.5, |cell| f64::from(grid.probability(cell)))
            .clamp(0.001, 0.999);
        sum -= if free { (1.0 - p).ln() } else { p.ln() };
        count += 1.0;
    }
    sum / count
}

#[test]
fn log_loss_is_the_same_for_all_cell_sizes() {
    let model = SonarModel::default();
    let sizes = [0.05, 0.1, 0.25];
    let mut loss = [0.0; 3];
    for seed in 0..24 {
        let mut random = Random(seed + 5);
        let place = Pose2::new(
            3.0 * random.next(),
            3.0 * random.next(),
            TAU * random.next(),
        );
        let shots = shots(&model, place, &mut random);
        for (loss, size) in loss.iter_mut().zip(sizes) {
            let mut grid = OccupancyGrid::new(size).expect("a valid resolution");
            grid.integrate(&model, &shots).expect("valid shots");
            *loss += log_loss(&grid, place) / 24.0;
        }
    }
    println!("log-loss {loss:.4?} for cells of {sizes:?} m");
    for other in &loss[1..] {
        assert!(
            (other / loss[0] - 1.0).abs() < 0.01,
            "log-loss {loss:?} for cells of {sizes:?} m"
        );
    }
}
