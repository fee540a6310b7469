//! A simulated robot looks, listens all round, and drives until something is near. With the name of a
//! folder it also writes what it saw and heard there, as frame.png and sweep.svg.
#![expect(clippy::print_stdout, reason = "an example prints")]

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;

use image::GrayImage;
use mobot_hw::sim::{RobotParams, Simulation, World};
use mobot_hw::{Camera, Clock, DifferentialDrive, Odometry, Ping, RangeFinder, Twist2};
use occgrid::{Pose2, Reading};

/// Twenty shots, 18 degrees apart, as the paper fires them.
fn sweep<R: RangeFinder>(sonar: &mut R) -> Result<Vec<Ping>, R::Error> {
    (0..20)
        .map(|k| sonar.ping(TAU * f64::from(k) / 20.0 - PI))
        .collect()
}

/// Drives straight on until an echo from ahead is nearer than `keep` [m]; gives the pose by the wheels.
fn drive_until_near<D, R, C>(
    base: &mut D,
    sonar: &mut R,
    clock: &mut C,
    keep: f64,
) -> Result<Pose2, Box<dyn std::error::Error>>
where
    D: DifferentialDrive<Error: 'static>,
    R: RangeFinder<Error: 'static>,
    C: Clock,
{
    let mut odometry = Odometry::new(Pose2::default(), base.track());
    loop {
        let near = matches!(sonar.ping(0.0)?.reading, Reading::Echo { range } if range < keep);
        let status = base.status()?;
        odometry.update(status.travel);
        if near || status.in_trouble() || clock.now() > 60.0 {
            base.stop()?;
            return Ok(odometry.pose());
        }
        base.drive(Twist2::new(0.3, 0.0))?;
        clock.sleep(0.05);
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let world = World::from_toml(include_str!("corridor.toml"))?;
    let simulation = Simulation::new(world, RobotParams::default(), 1)?;

    let frame = simulation.camera().frame()?;
    println!("the camera at {:.2} s:", frame.stamp);
    print_picture(&frame.image);

    let pings = sweep(&mut simulation.turret())?;
    for ping in &pings {
        println!("{:6.1} deg  {:?}", ping.bearing.to_degrees(), ping.reading);
    }
    if let Some(folder) = std::env::args_os().nth(1).map(std::path::PathBuf::from) {
        std::fs::create_dir_all(&folder)?;
        frame.image.save(folder.join("frame.png"))?;
        let svg = draw_sweep(
            &simulation.outline(),
            simulation.truth().map_from_base,
            &pings,
        )?;
        std::fs::write(folder.join("sweep.svg"), svg)?;
    }

    let believed = drive_until_near(
        &mut simulation.base(),
        &mut simulation.turret(),
        &mut simulation.clock(),
        0.8,
    )?;
    let truth = simulation.truth();
    println!("by its wheels it drove {:.3} m", believed.x);
    println!(
        "in truth {:.3} m, {} collisions, at least {:.2} m of room",
        truth.driven, truth.collisions, truth.least_clearance
    );
    Ok(())
}

/// Every sixth column and every twelfth row, in ten shades.
fn print_picture(image: &GrayImage) {
    for y in (6..image.height()).step_by(12) {
        let row = (3..image.width()).step_by(6).map(|x| {
            let shade = usize::from(image.get_pixel(x, y).0[0]) * 10 / 256;
            char::from(b"@%#*+=-:. "[shade])
        });
        println!("{}", row.collect::<String>());
    }
}

/// Walls in black, the robot as a circle, every echo as an arc across its beam, silence as a thin line.
fn draw_sweep(
    walls: &[[occgrid::Point2; 2]],
    map_from_base: Pose2,
    pings: &[Ping],
) -> Result<String, std::fmt::Error> {
    let mut svg = String::from(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"-0.2 -4.2 8.4 5.4\" width=\"840\">\n\
         <rect x=\"-0.2\" y=\"-4.2\" width=\"8.4\" height=\"5.4\" fill=\"#fff\"/>\n\
         <g fill=\"none\" stroke-linecap=\"round\">\n",
    );
    let mut line = |from: [f64; 2], to: [f64; 2], style: &str| {
        writeln!(
            svg,
            "<path d=\"M{:.3} {:.3}L{:.3} {:.3}\" {style}/>",
            from[0], -from[1], to[0], -to[1]
        )
    };
    for [a, b] in walls {
        line(
            [a.x, a.y],
            [b.x, b.y],
            "stroke=\"#222\" stroke-width=\".03\"",
        )?;
    }
    let at = map_from_base.position();
    for ping in pings {
        let place = |off: f64, range: f64| {
            let (sin, cos) = (map_from_base.theta + ping.bearing + off).sin_cos();
            [at.x + range * cos, at.y + range * sin]
        };
        match ping.reading {
            Reading::Echo { range } => {
                line(
                    [at.x, at.y],
                    place(0.0, range),
                    "stroke=\"#9bd\" stroke-width=\".015\"",
                )?;
                let half = 9.0_f64.to_radians();
                line(
                    place(-half, range),
                    place(half, range),
                    "stroke=\"#d33\" stroke-width=\".04\"",
                )?;
            }
            _ => line(
                [at.x, at.y],
                place(0.0, 0.6),
                "stroke=\"#ccc\" stroke-width=\".015\"",
            )?,
        }
    }
    writeln!(
        svg,
        "<circle cx=\"{:.3}\" cy=\"{:.3}\" r=\".175\" fill=\"#fff\" stroke=\"#222\" stroke-width=\".02\"/>\n</g>\n</svg>",
        at.x, -at.y
    )?;
    Ok(svg)
}
