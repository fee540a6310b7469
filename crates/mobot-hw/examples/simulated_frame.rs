//! Draws what the robot sees in a simulated building.

use mobot_hw::sim::{CameraModel, Look, Renderer, World};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let world = World::from_toml(&std::fs::read_to_string(&args[0])?)?;
    let n: Vec<f64> = args[1].split(',').map(|s| s.parse().unwrap()).collect();
    let camera = if args[2] == "vga" {
        CameraModel::vga()
    } else {
        CameraModel::paper()
    };
    let mut renderer = Renderer::new(camera, Look::default())?;
    let pose = occgrid::Pose2::new(n[0], n[1], n[2]);
    let mut best = f64::INFINITY;
    let mut frame = renderer.render(&world, pose, n[3], 1);
    for _ in 0..20 {
        let start = std::time::Instant::now();
        frame = renderer.render(&world, pose, n[3], 1);
        best = best.min(start.elapsed().as_secs_f64());
    }
    eprintln!("{:.2} ms", best * 1e3);
    frame.save(&args[3])?;
    for c in renderer.door_corners(&world, pose, n[3]) {
        println!("C {} {} {:?}", c.pixel[0], c.pixel[1], c.corner.kind);
    }
    for e in renderer.floor_edges(&world, pose, n[3]) {
        let [[a, b], [c, d]] = e.pixels;
        println!("E {a} {b} {c} {d}");
    }
    Ok(())
}
