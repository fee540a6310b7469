//! Drivers on real ports against emulated devices on pseudo-terminals, in real time.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use mobot_hw::emulate::{
    ArduinoEmulator, Create2Emulator, DeviceFaults, Emulation, Emulator, FfEmulator,
    KobukiEmulator, LineFaults, MaestroEmulator, MaxBotixEmulator, Srf02Emulator, Stuck,
    Urm37Emulator, Us100Emulator, WheelCommand,
};
use mobot_hw::serial::{
    Arduino, ArduinoParams, Create2, Create2Params, FfParams, FfSonar, Kobuki, KobukiParams,
    Maestro, MaestroParams, MaxBotix, MaxBotixModel, MaxBotixParams, Port, SerialError, Srf02,
    Srf02Params, Urm37, Urm37Params, Us100, Us100Params, open,
};
use mobot_hw::sim::{RobotParams, Simulation, SonarParams, World};
use mobot_hw::{
    BaseStatus, DifferentialDrive, PanActuator as _, RangeFinder, SystemClock, Turret, Twist2,
};
use occgrid::Reading;

/// A robot in a corridor whose sonar has no noise: ahead it hears the far wall, or a person or a thing.
fn robot() -> Simulation {
    let world = World::from_toml(include_str!("../../examples/corridor.toml")).expect("a world");
    let params = RobotParams {
        sonar: SonarParams {
            sigma: 0.0,
            silence: 0.0,
            crosstalk: 0.0,
            resolution: 0.0,
            ..SonarParams::default()
        },
        ..RobotParams::default()
    };
    Simulation::new(world, params, 1).expect("a robot")
}

fn port(emulation: &Emulation, device: usize, baud: u32) -> Port {
    let path = emulation.path(device).to_str().expect("a name");
    open(path, baud, false).expect("a port")
}

fn start<const N: usize>(emulators: [Box<dyn Emulator>; N]) -> Emulation {
    Emulation::start(&robot(), emulators.into(), 1).expect("pseudo-terminals")
}

/// Left of the robot the corridor's wall is a metre away.
const LEFT: f64 = std::f64::consts::FRAC_PI_2;

fn hears_the_wall(sonar: &mut impl RangeFinder<Error = SerialError>, bearing: f64) {
    let ping = sonar.ping(bearing).expect("a reading");
    let Reading::Echo { range } = ping.reading else {
        panic!("{ping:?}");
    };
    // units of up to an inch, firmware that cuts off; a jamb or the frame of a door stands out a little
    assert!((0.85..=1.03).contains(&range), "{ping:?}");
}

#[test]
fn sonars_hear_the_wall_beside_them() {
    let emulation = start([
        Box::new(MaestroEmulator::default()),
        Box::new(MaxBotixEmulator::new(MaxBotixModel::Hrlv)),
        Box::new(FfEmulator::default()),
        Box::new(Us100Emulator::default()),
        Box::new(Srf02Emulator::default()),
    ]);
    let clock = SystemClock::start();
    let params = MaestroParams {
        limits_us: [1000.0, 2000.0],
        ..MaestroParams::default()
    };
    let mut pan = Maestro::new(port(&emulation, 0, 9600), clock, params);
    pan.turn_to(LEFT).expect("a turn");
    let params = MaxBotixParams {
        model: MaxBotixModel::Hrlv,
        ..MaxBotixParams::default()
    };
    let sonar = MaxBotix::new(port(&emulation, 1, 9600), clock, params);
    let mut turret = Turret { sonar, pan };
    let ping = turret.ping(LEFT).expect("a reading");
    assert!((ping.bearing - LEFT).abs() < 0.01);
    hears_the_wall(&mut turret.sonar, 0.0);
    let ff = FfSonar::new(port(&emulation, 2, 9600), clock, FfParams::default());
    hears_the_wall(&mut { ff }, 0.0);
    let us100 = Us100::new(port(&emulation, 3, 9600), clock, Us100Params::default());
    hears_the_wall(&mut { us100 }, 0.0);
    let srf02 = Srf02::new(port(&emulation, 4, 9600), clock, Srf02Params::default());
    hears_the_wall(&mut { srf02 }, 0.0);
}

#[test]
fn a_urm37_turns_and_hears_in_one() {
    let emulation = start([Box::new(Urm37Emulator::default())]);
    let clock = SystemClock::start();
    let mut sonar = Urm37::new(port(&emulation, 0, 9600), clock, Urm37Params::default());
    hears_the_wall(&mut sonar, LEFT);
    hears_the_wall(&mut sonar, -LEFT);
}

/// Drives straight on for a second, then stops; gives the state after.
fn drives_and_stops<D: DifferentialDrive<Error = SerialError>>(base: &mut D) -> BaseStatus {
    let began = Instant::now();
    while began.elapsed() < Duration::from_secs(1) {
        base.drive(Twist2::new(0.2, 0.0)).expect("a command");
        base.status().expect("a state");
        std::thread::sleep(Duration::from_millis(20));
    }
    base.stop().expect("a stop");
    std::thread::sleep(Duration::from_millis(400));
    base.status().expect("a state")
}

fn drove(status: BaseStatus, log: &[WheelCommand]) {
    let travel = status.travel;
    assert!((0.1..0.3).contains(&travel.left), "{travel:?}");
    assert!((travel.left - travel.right).abs() < 0.01, "{travel:?}");
    let fastest = log.iter().flat_map(|c| c.wheels).fold(0.0, f64::max);
    assert!((fastest - 0.2).abs() < 0.01, "{log:?}");
    let last = log.last().expect("a command").wheels;
    assert!(last.iter().all(|w| w.abs() < 1e-9), "{log:?}");
}

#[test]
fn a_create_2_drives_stops_counts_and_vanishes() {
    let emulation = start([Box::new(Create2Emulator::default())]);
    let clock = SystemClock::start();
    let params = Create2Params::default();
    let mut base = Create2::open(port(&emulation, 0, 115_200), clock, params).expect("a base");
    drove(drives_and_stops(&mut base), &emulation.wheel_log(0));

    // a tenth of a hundred bytes is wrong: the counters stay right
    let bad = LineFaults {
        dropped: 0.003,
        doubled: 0.003,
        flipped: 0.004,
        ..LineFaults::default()
    };
    let before = base.status().expect("a state").travel;
    emulation.set_faults(0, bad);
    for _ in 0..50 {
        let travel = base.status().expect("a state").travel;
        assert!((travel.left - before.left).abs() < 1e-9, "{travel:?}");
    }

    let silent = LineFaults {
        silent: true,
        ..LineFaults::default()
    };
    emulation.set_faults(0, silent);
    std::thread::sleep(Duration::from_millis(20));
    let began = Instant::now();
    // what was on its way may still come
    let result = base.status().and_then(|_| base.status());
    assert!(
        matches!(
            result,
            Err(SerialError::Silent { .. } | SerialError::Garbled { .. })
        ),
        "{result:?}"
    );
    // a busy machine may add to the 110 ms
    assert!(began.elapsed() < Duration::from_millis(400));

    let unplugged = LineFaults {
        unplugged: true,
        ..LineFaults::default()
    };
    emulation.set_faults(0, unplugged);
    // the plug is pulled by the emulation's own thread, when that gets its turn
    let began = Instant::now();
    let mut status = base.status();
    while status != Err(SerialError::Unplugged) && began.elapsed() < Duration::from_millis(500) {
        status = base.status();
    }
    let drive = base.drive(Twist2::default());
    assert_eq!(status, Err(SerialError::Unplugged));
    assert_eq!(drive, Err(SerialError::Unplugged));
}

#[test]
fn a_kobuki_drives_stops_and_counts() {
    let emulation = start([Box::new(KobukiEmulator::default())]);
    let clock = SystemClock::start();
    let params = KobukiParams::default();
    let mut base = Kobuki::open(port(&emulation, 0, 115_200), clock, params).expect("a base");
    drove(drives_and_stops(&mut base), &emulation.wheel_log(0));
}

#[test]
fn an_arduino_drives_stops_counts_turns_and_hears() {
    let params = ArduinoParams::default();
    let emulation = start([Box::new(ArduinoEmulator::new(params))]);
    let clock = SystemClock::start();
    let mut arduino = Arduino::open(port(&emulation, 0, 57_600), clock, params).expect("a base");
    arduino.turn_to(LEFT).expect("a turn");
    hears_the_wall(&mut arduino, 0.0);
    drove(drives_and_stops(&mut arduino), &emulation.wheel_log(0));
}

/// Python with the package pycreate2, in a virtual environment of its own below the build's folder.
fn python_with_pycreate2() -> Option<PathBuf> {
    let venv = Path::new(env!("CARGO_TARGET_TMPDIR")).join("pycreate2-0.8.0");
    let python = venv.join("bin/python");
    let has = |python: &Path| {
        let run = Command::new(python)
            .args(["-c", "import pycreate2"])
            .output();
        run.is_ok_and(|o| o.status.success())
    };
    if !has(&python) {
        let made = Command::new("python3")
            .args(["-m", "venv"])
            .arg(&venv)
            .output();
        made.ok()?;
        let packages = [
            "-m",
            "pip",
            "install",
            "--quiet",
            "pycreate2==0.8.0",
            "setuptools<81",
        ];
        Command::new(&python).args(packages).output().ok()?;
    }
    has(&python).then_some(python)
}

#[test]
fn a_foreign_client_drives_the_emulated_create_2() {
    let Some(python) = python_with_pycreate2() else {
        println!("skipped: no Python 3 with venv, or pycreate2 cannot be installed");
        return;
    };
    let emulation = start([Box::new(Create2Emulator::default())]);
    let script = "
import sys, time, pycreate2
bot = pycreate2.Create2(sys.argv[1])
bot.start()
bot.safe()
before = bot.get_sensors()
bot.drive_direct(100, 150)
time.sleep(1)
moving = bot.get_sensors()
bot.drive_stop()
after = bot.get_sensors()
print('told', before.open_interface_mode, moving.velocity_right, moving.velocity_left, after.velocity_right,
      (after.encoder_counts_left - before.encoder_counts_left) % 65536,
      (after.encoder_counts_right - before.encoder_counts_right) % 65536)
";
    let run = Command::new(python)
        .args(["-c", script])
        .arg(emulation.path(0))
        .output()
        .expect("Python runs");
    let text = String::from_utf8_lossy(&run.stdout).into_owned();
    let line = text
        .lines()
        .find_map(|l| l.strip_prefix("told "))
        .unwrap_or_default();
    let told: Vec<i64> = line.split(' ').flat_map(str::parse).collect();
    let [mode, right, left, stopped, left_counts, right_counts] = told[..] else {
        panic!("{text} {}", String::from_utf8_lossy(&run.stderr));
    };
    assert_eq!([mode, right, left, stopped], [2, 100, 150, 0]);
    // a second at 0.15 and 0.1 m/s and the time of the calls, at 0.4446 mm a count
    assert!((250..700).contains(&left_counts), "{text}");
    let ratio = left_counts as f64 / right_counts as f64;
    assert!((ratio - 1.5).abs() < 0.08, "{text}");
    let log = emulation.wheel_log(0);
    assert!(
        log.iter()
            .any(|c| (c.wheels[0] - 0.15).abs() < 1e-9 && (c.wheels[1] - 0.1).abs() < 1e-9)
    );
    let last = log.last().expect("a command").wheels;
    assert!(last.iter().all(|w| w.abs() < 1e-9));
}

/// A MaxBotix that looks straight ahead, opened as a program opens it.
fn maxbotix(emulation: &Emulation, device: usize) -> MaxBotix<Port, SystemClock> {
    let port = port(emulation, device, 9600);
    MaxBotix::new(port, SystemClock::start(), MaxBotixParams::default())
}

#[test]
fn an_unplugged_sonar_comes_back_under_the_same_link() {
    let emulation = start([Box::new(MaxBotixEmulator::default())]);
    let link = emulation.path(0).to_owned();
    let before = std::fs::read_link(&link).expect("a link");
    let mut sonar = maxbotix(&emulation, 0);
    sonar.ping(0.0).expect("a reading");
    let unplugged = LineFaults {
        unplugged: true,
        ..LineFaults::default()
    };
    emulation.set_faults(0, unplugged);
    let began = Instant::now();
    let error = sonar.ping(0.0).expect_err("it is gone");
    assert_eq!(error, SerialError::Unplugged);
    assert!(began.elapsed() < Duration::from_millis(100));
    assert!(!link.exists());
    // while the old terminal is held open, the new one has another name
    emulation.set_faults(0, LineFaults::default());
    while !link.exists() {
        assert!(began.elapsed() < Duration::from_secs(2));
        std::thread::sleep(Duration::from_millis(2));
    }
    assert_ne!(std::fs::read_link(&link).expect("a link"), before);
    maxbotix(&emulation, 0).ping(0.0).expect("a reading");
    drop(emulation);
    assert!(!link.parent().expect("a folder").exists());
}

#[test]
fn a_stuck_sonar_repeats_itself_and_a_stuck_servo_stands_still() {
    let emulation = start([
        Box::new(FfEmulator::default()),
        Box::new(Urm37Emulator::default()),
    ]);
    let clock = SystemClock::start();
    let mut ff = FfSonar::new(port(&emulation, 0, 9600), clock, FfParams::default());
    let mut urm37 = Urm37::new(port(&emulation, 1, 9600), clock, Urm37Params::default());
    let ahead = ff.ping(0.0).expect("a reading").reading;
    let stuck = DeviceFaults {
        stuck: Stuck::All,
        ..DeviceFaults::default()
    };
    emulation.set_device_faults(0, stuck);
    hears_the_wall(&mut urm37, LEFT);
    // the pan points at the wall now, and the one beside it does not see that
    assert_eq!(ff.ping(0.0).expect("a reading").reading, ahead);
    emulation.set_device_faults(0, DeviceFaults::default());
    hears_the_wall(&mut ff, 0.0);
    emulation.set_device_faults(1, stuck);
    urm37.ping(0.0).expect("a reading");
    hears_the_wall(&mut ff, 0.0);
}

#[test]
fn a_slow_sonar_fires_half_as_often_and_a_slow_line_is_late() {
    let emulation = start([Box::new(MaxBotixEmulator::default())]);
    let mut sonar = maxbotix(&emulation, 0);
    let mut cycle = || {
        sonar.ping(0.0).expect("a reading");
        let began = Instant::now();
        for _ in 0..4 {
            sonar.ping(0.0).expect("a reading");
        }
        began.elapsed().as_secs_f64() / 4.0
    };
    let usual = cycle();
    let slow = DeviceFaults {
        slow: 3.0,
        ..DeviceFaults::default()
    };
    emulation.set_device_faults(0, slow);
    let slower = cycle();
    assert!(slower > 1.7 * usual, "{usual} {slower}");
    emulation.set_device_faults(0, DeviceFaults::default());
    let late = LineFaults {
        delay: 0.4,
        ..LineFaults::default()
    };
    emulation.set_faults(0, late);
    // opened anew, so that nothing of before is heard
    drop(sonar);
    let began = Instant::now();
    maxbotix(&emulation, 0).ping(0.0).expect("a reading");
    assert!(began.elapsed() > Duration::from_millis(390));
}

#[test]
fn bases_tell_of_cliffs_and_lifted_wheels() {
    let robot = robot();
    let bases: Vec<Box<dyn Emulator>> = vec![
        Box::new(Create2Emulator::default()),
        Box::new(KobukiEmulator::default()),
    ];
    let emulation = Emulation::start(&robot, bases, 1).expect("pseudo-terminals");
    let clock = SystemClock::start();
    let params = KobukiParams::default();
    let mut kobuki = Kobuki::open(port(&emulation, 1, 115_200), clock, params).expect("a base");
    let params = Create2Params::default();
    let mut create = Create2::open(port(&emulation, 0, 115_200), clock, params).expect("a base");

    for (cliff, lifted) in [(true, false), (false, true)] {
        create.rearm().expect("safe mode");
        create.drive(Twist2::new(0.1, 0.0)).expect("a command");
        create.status().expect("a state");
        robot.set_cliff(cliff);
        robot.set_lifted(lifted);
        std::thread::sleep(Duration::from_millis(60));
        for base in [
            &mut create as &mut dyn DifferentialDrive<Error = SerialError>,
            &mut kobuki,
        ] {
            let status = base.status().expect("a state");
            assert_eq!([status.cliff, status.wheel_drop], [cliff, lifted]);
        }
        // the base stopped by itself, and takes no more commands to move
        let last = emulation.wheel_log(0).last().expect("a command").wheels;
        assert!(last.iter().all(|w| w.abs() < 1e-9));
        assert!(create.drive(Twist2::new(0.1, 0.0)).is_err());
        robot.set_cliff(false);
        robot.set_lifted(false);
    }
}

#[test]
fn a_stuck_encoder_counts_no_more_while_its_wheel_turns() {
    let robot = robot();
    let emulation = Emulation::start(&robot, vec![Box::new(Create2Emulator::default())], 1)
        .expect("pseudo-terminals");
    let clock = SystemClock::start();
    let params = Create2Params::default();
    let mut base = Create2::open(port(&emulation, 0, 115_200), clock, params).expect("a base");
    let left = DeviceFaults {
        stuck: Stuck::Left,
        ..DeviceFaults::default()
    };
    emulation.set_device_faults(0, left);
    let travel = drives_and_stops(&mut base).travel;
    assert!(travel.left.abs() < 1e-9 && travel.right > 0.1, "{travel:?}");
    assert!(robot.truth().driven > 0.1);
}
