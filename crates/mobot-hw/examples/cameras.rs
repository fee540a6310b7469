//! Which cameras there are; with the name of one, what it gives in a second:
//! `cargo run --features v4l2 --example cameras -- /dev/video0`.
#![expect(clippy::print_stdout, reason = "an example prints")]

#[cfg(target_os = "linux")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    use mobot_hw::v4l2::{V4l2Camera, V4l2Params, cameras};
    use mobot_hw::{Camera, Clock, PictureWatch, SystemClock};

    let Some(path) = std::env::args().nth(1) else {
        let found = cameras();
        println!("{} cameras", found.len());
        for camera in found {
            let path = camera.stable_path.unwrap_or(camera.path);
            let formats = camera.formats.join(" ");
            println!("{} {} {formats}", path.display(), camera.name);
        }
        return Ok(());
    };
    let clock = SystemClock::start();
    let mut camera = V4l2Camera::open(path, clock, V4l2Params::default())?;
    println!("{:?}", camera.settings());
    let mut watch = PictureWatch::default();
    while clock.now() < 1.0 {
        let frame = camera.frame()?;
        let age = 1e3 * (clock.now() - frame.stamp);
        let fault = watch.look(&frame.image);
        println!("frame {}, {age:.1} ms old, {fault:?}", frame.sequence);
    }
    println!("{:?}", camera.counts());
    Ok(())
}

#[cfg(not(target_os = "linux"))]
fn main() {
    println!("cameras are found on Linux only");
}
