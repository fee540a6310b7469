//! A frame of the simulated office through a webcam's lens, its camera and the floor plan, for `mobot locate`.
//!
//!     cargo run --release -p mobot-cli --example office_frame -- out
//!     mobot locate out/frame.png --camera out/camera.json --plan out/plan.geojson --prior 1.6,0,0 --overlay out/seen.svg

#![expect(clippy::print_stdout, reason = "an example")]

use std::path::PathBuf;

use anyhow::Context as _;
use mobot_cli::{nav, world};
use mobot_hw::sim::{CameraModel, Distortion, Look, Renderer};
use monocal::FloorPlan;
use occgrid::Pose2;

fn main() -> anyhow::Result<()> {
    let out = PathBuf::from(std::env::args_os().nth(1).context("expected a folder")?);
    std::fs::create_dir_all(&out)?;
    let office = world::load("office", None)?;
    let model = CameraModel {
        distortion: Distortion::PlumbBob {
            coefficients: [-0.32, 0.12, 0.0008, -0.0006, 0.0],
        },
        ..CameraModel::vga()
    };
    let map_from_base = Pose2::new(1.5, 0.1, 0.03);
    let frame = Renderer::new(model, Look::default())?.render(&office, map_from_base, 0.0, 1);
    frame.save(out.join("frame.png"))?;
    let camera = nav::calibrated(&model).context("expected marks in sight")?;
    std::fs::write(out.join("camera.json"), camera.to_json())?;
    let plan = FloorPlan {
        walls: office.floor_outline(),
        door_corners: office.door_corners().iter().map(|c| c.position).collect(),
    };
    std::fs::write(out.join("plan.geojson"), plan.to_geojson())?;
    let Pose2 { x, y, theta } = map_from_base;
    println!("taken at x {x} m, y {y} m, theta {theta} rad");
    Ok(())
}
