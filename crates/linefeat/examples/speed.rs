use linefeat::*;
use std::time::Instant;
fn main() {
    for path in std::env::args().skip(1) {
        let image = image::open(&path).unwrap().to_luma8();
        let edges = canny(&image, &CannyParams::default());
        let n = edges.pixels().len();
        for voting in [
            Voting::AllDirections,
            Voting::NearGradient {
                spread: 4f64.to_radians(),
            },
        ] {
            let params = HoughParams {
                votes: 100,
                voting,
                ..Default::default()
            };
            let mut hough = Hough::new();
            let mut lines = Vec::new();
            let mut best = f64::MAX;
            for _ in 0..30 {
                let t = Instant::now();
                hough.detect(&edges, &params, &mut lines).unwrap();
                best = best.min(t.elapsed().as_secs_f64() * 1e3);
            }
            println!(
                "{path} edges {n} {voting:?} {best:.3} ms lines {}",
                lines.len()
            );
        }
    }
}
