//! A dark thing walks over a chequered floor, seen straight from above: where is it, and how fast?

use image::{GrayImage, Luma};
use linefeat::{FloorState, FloorView, ObstacleParams, ObstacleTracker};

/// A hundred pixels a metre; the camera hangs over the middle of the picture's lower edge.
fn main() {
    let view = FloorView {
        pixel_to_floor: [[0.0, -0.01, 3.0], [-0.01, 0.0, 2.0], [0.0, 0.0, 1.0]],
        nadir: [200.0, 300.0, 1.0],
    };
    let mut tracker = ObstacleTracker::new(view, ObstacleParams::default());
    for i in 0..15 {
        let time = f64::from(i) / 10.0;
        // at 0.8 m/s to the right, that is towards negative y
        let left = 120 + (80.0 * time) as u32;
        let frame = GrayImage::from_fn(400, 300, |u, v| {
            let thing = (left..left + 40).contains(&u) && (100..140).contains(&v);
            let tile = if (u / 25 + v / 25) % 2 == 0 { 170 } else { 200 };
            Luma([if thing { 40 } else { tile }])
        });
        tracker.update(&frame, time, [0.0; 3], &|_| FloorState::Unknown);
    }
    for track in tracker.moving() {
        let ([x, y], [vx, vy]) = (track.position, track.velocity);
        #[expect(clippy::print_stdout, reason = "an example shows what it found")]
        {
            println!("at ({x:.2}, {y:.2}) m, moving by ({vx:.2}, {vy:.2}) m/s");
        }
    }
}
