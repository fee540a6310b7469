//! Device URIs opened: simulated devices of one robot, and drivers on emulated devices in real time.

use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;

use clap::Parser;
use mobot_cli::args::DeviceArgs;
use mobot_cli::nav::Devices;
use mobot_cli::uri::{BoxedSonar, Opened, open_guarded_by};
use mobot_hw::emulate::{
    ArduinoEmulator, Create2Emulator, Emulation, Emulator, FfEmulator, KobukiEmulator,
    MaestroEmulator, MaxBotixEmulator, Urm37Emulator, WheelCommand,
};
use mobot_hw::serial::MaxBotixModel;
use mobot_hw::sim::{RobotParams, Simulation, World};
use mobot_hw::{Bearings, FaultKind, Twist2};
use occgrid::Reading;

#[derive(Parser)]
struct Line {
    #[command(flatten)]
    devices: DeviceArgs,
}

/// Opens what was typed.
fn opened<S: Into<String>>(words: impl IntoIterator<Item = S>) -> anyhow::Result<Opened> {
    let words = words.into_iter().map(Into::into);
    let line = Line::try_parse_from(std::iter::once("mobot".to_owned()).chain(words))?;
    open_guarded_by(Path::new(env!("CARGO_BIN_EXE_mobot")), &line.devices)
}

fn why_not<const N: usize>(words: [&str; N]) -> String {
    match opened(words) {
        Ok(_) => panic!("{words:?} were opened"),
        Err(error) => format!("{error:#}"),
    }
}

#[test]
fn simulated_devices_are_of_one_robot() {
    let Opened {
        mut devices,
        sensor,
        simulation,
        ..
    } = opened([
        "--camera",
        "sim:",
        "--world",
        "office",
        "--robot-start",
        "4,0,0",
        "--sonar",
        "sim:?mount=0.1,0,3.141592653589793",
    ])
    .expect("devices");
    let robot = simulation.expect("a simulated robot");
    assert!((robot.truth().map_from_base.x - 4.0).abs() < 1e-12);
    assert!((sensor.mount.x - 0.1).abs() < 1e-12);
    devices
        .base
        .drive(Twist2::new(0.2, 0.0))
        .expect("a command");
    // time passes in the sonar, the base moves meanwhile, the camera sees it later
    let before = devices.clock.now();
    let ping = devices.sonar.ping(0.0).expect("a reading");
    assert!((ping.bearing).abs() < 1e-9, "{ping:?}");
    assert!(devices.clock.now() > before);
    devices.clock.sleep(1.0);
    let frame = devices.camera.as_mut().expect("a camera").frame();
    assert!(frame.expect("a frame").stamp > before + 1.0);
    assert!(devices.base.status().expect("a state").travel.left > 0.1);
    assert!(robot.truth().map_from_base.x > 4.1);
}

#[test]
fn the_same_line_gives_the_same_readings() {
    let readings = || {
        let mut devices = opened(["--seed", "7"]).expect("devices").devices;
        (0..20)
            .map(|k| devices.sonar.ping(f64::from(k) * 0.1).expect("a reading"))
            .collect::<Vec<_>>()
    };
    assert_eq!(readings(), readings());
}

#[test]
fn a_robot_without_turret_looks_one_way() {
    let mut devices = opened(["--turret", "none", "--sonar", "sim:?mount=0,0,0.5"])
        .expect("devices")
        .devices;
    assert_eq!(devices.sonar.bearings(), Bearings::fixed(0.5));
    devices.sonar.ping(0.5).expect("a reading");
    let error = devices.sonar.ping(0.0).expect_err("it does not turn");
    assert_eq!(error.kind, FaultKind::Refused);
}

#[test]
fn devices_that_do_not_go_together_are_refused() {
    let error = why_not(["--base", "create2:/dev/none"]);
    assert!(
        error.contains("--sonar sim:") && error.contains("--base create2:/dev/none"),
        "{error}"
    );
    let error = why_not(["--turret", "maestro:/dev/none"]);
    assert!(error.contains("all devices simulated, all real"), "{error}");
    let error = why_not(["--camera", "v4l2:/dev/video0"]);
    assert!(error.contains("all devices simulated, all real"), "{error}");
    let sonar = ["--base", "create2:/dev/none", "--sonar", "ff:/dev/none"];
    let error = why_not(sonar);
    assert!(error.contains("ff:/dev/none"), "{error}");
    let [a, b, c, d] = sonar;
    let error = why_not([a, b, c, d, "--turret", "urm37"]);
    assert!(error.contains("expected a urm37 sonar"), "{error}");
}

/// A robot in a corridor: a wall 1 m to its left, one 2 m to its right; its sonar has no noise.
fn corridor() -> Simulation {
    let world = "
        walls = [
            { from = [-9, 1], to = [9, 1], thickness = 0.02 },
            { from = [-9, -2], to = [9, -2], thickness = 0.02 },
        ]
    ";
    let mut params = RobotParams::default();
    params.sonar.sigma = 0.0;
    params.sonar.silence = 0.0;
    params.sonar.crosstalk = 0.0;
    Simulation::new(World::from_toml(world).expect("a world"), params, 1).expect("a robot")
}

fn start<const N: usize>(robot: &Simulation, emulators: [Box<dyn Emulator>; N]) -> Emulation {
    Emulation::start(robot, emulators.into(), 1).expect("pseudo-terminals")
}

/// A URI of an emulated device.
fn at(scheme: &str, emulation: &Emulation, device: usize, options: &str) -> String {
    format!("{scheme}:{}{options}", emulation.path(device).display())
}

fn hears(sonar: &mut BoxedSonar, bearing: f64, expected: f64) {
    let ping = sonar.ping(bearing).expect("a reading");
    assert!((ping.bearing - bearing).abs() < 0.06, "{ping:?}");
    let Reading::Echo { range } = ping.reading else {
        panic!("{ping:?}");
    };
    assert!((range - expected).abs() < 0.06, "{ping:?}");
}

#[test]
fn a_maestro_turns_a_maxbotix_by_its_zero_and_sense() {
    let emulators: [Box<dyn Emulator>; 3] = [
        Box::new(MaxBotixEmulator::new(MaxBotixModel::Hrlv)),
        Box::new(MaestroEmulator::default()),
        Box::new(KobukiEmulator::default()),
    ];
    let emulation = start(&corridor(), emulators);
    let open = |sonar: &str, turret: &str| {
        opened([
            "--base",
            &at("kobuki", &emulation, 2, ""),
            "--sonar",
            &at("maxbotix", &emulation, 0, sonar),
            "--turret",
            &at("maestro", &emulation, 1, turret),
        ])
        .expect("devices")
    };
    let Opened {
        mut devices,
        sensor,
        ..
    } = open("?model=hrlv", "");
    hears(&mut devices.sonar, FRAC_PI_2, 1.0);
    hears(&mut devices.sonar, -FRAC_PI_2, 2.0);
    assert!((sensor.max_range - 5.0).abs() < 1e-9);
    assert!((sensor.blanking - 0.3).abs() < 1e-9);
    drop(devices);
    // mounted the other way round it turns to the other side
    let mut devices = open("?model=hrlv", "?sign=-1").devices;
    hears(&mut devices.sonar, -FRAC_PI_2, 1.0);
    drop(devices);
    // an axle that looks to the left, and whose servo stands at 180 degrees then
    let mut devices = open(
        "?model=hrlv&mount=0,0,1.5707963267948966",
        "?centre_deg=180",
    )
    .devices;
    hears(&mut devices.sonar, FRAC_PI_2, 1.0);
    let reach = devices.sonar.bearings();
    assert!(reach.from < -FRAC_PI_2 + 0.05 && reach.to < PI, "{reach:?}");
    hears(&mut devices.sonar, -FRAC_PI_2 + 0.02, 2.0);
}

#[test]
fn a_urm37_turns_itself_unless_told_not_to() {
    let emulators: [Box<dyn Emulator>; 2] = [
        Box::new(Urm37Emulator::default()),
        Box::new(Create2Emulator::default()),
    ];
    let emulation = start(&corridor(), emulators);
    let open = |turret: &[&str]| {
        let base = at("create2", &emulation, 1, "");
        let sonar = at("urm37", &emulation, 0, "");
        let words = ["--base", &base, "--sonar", &sonar];
        opened(words.iter().chain(turret).copied())
            .expect("devices")
            .devices
    };
    hears(&mut open(&[]).sonar, FRAC_PI_2, 1.0);
    hears(
        &mut open(&["--turret", "urm37?sign=-1"]).sonar,
        FRAC_PI_2,
        2.0,
    );
    let sonar = open(&["--turret", "none"]).sonar;
    assert_eq!(sonar.bearings(), Bearings::fixed(0.0));
}

#[test]
fn every_base_drives_by_its_uri() {
    let bases: [(&str, Box<dyn Emulator>); 3] = [
        ("create2", Box::new(Create2Emulator::default())),
        ("kobuki", Box::new(KobukiEmulator::default())),
        (
            "arduino",
            Box::new(ArduinoEmulator::new(Default::default())),
        ),
    ];
    for (scheme, emulator) in bases {
        let robot = corridor();
        let emulation = start(&robot, [Box::new(FfEmulator::default()), emulator]);
        let base = at(scheme, &emulation, 1, "?max_speed=0.1");
        let sonar = at("ff", &emulation, 0, "");
        let mut devices = opened(["--base", &base, "--sonar", &sonar])
            .expect("devices")
            .devices;
        let began = devices.clock.now();
        while robot.truth().driven < 0.05 {
            devices
                .base
                .drive(Twist2::new(0.3, 0.0))
                .expect("a command");
            devices.clock.sleep(0.02);
            devices.base.status().expect("a state");
            assert!(devices.clock.now() < began + 5.0, "{scheme}");
        }
        devices.base.stop().expect("a stop");
        let stopped = devices.clock.now();
        let stands = |log: &[WheelCommand]| log.last().is_some_and(|c| c.wheels[0].abs() < 1e-9);
        while !stands(&emulation.wheel_log(1)) {
            assert!(devices.clock.now() < stopped + 0.5, "{scheme} drives on");
            devices.clock.sleep(0.002);
        }
        let log = emulation.wheel_log(1);
        let fastest = log.iter().map(|c| c.wheels[0]).fold(0.0, f64::max);
        assert!((fastest - 0.1).abs() < 0.005, "{scheme}: {fastest}");
    }
}

#[test]
fn recorded_devices_answer_again_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.mcap");
    let typed = |prefix: &str, device: &str| format!("{prefix}:{}{device}", file.display());
    let run = |words: [String; 6]| {
        let Opened { devices, .. } = opened(words).expect("devices");
        let Devices {
            mut base,
            mut sonar,
            camera,
            mut clock,
        } = devices;
        let mut camera = camera.expect("a camera");
        let mut seen = Vec::new();
        for k in 0..10 {
            base.drive(Twist2::new(0.2, 0.1)).expect("a command");
            let ping = sonar.ping(f64::from(k) * 0.2).expect("a reading");
            clock.sleep(0.01);
            let status = base.status().expect("a state");
            let frame = camera.frame().expect("a frame");
            seen.push((ping, status, frame, clock.now()));
        }
        seen
    };
    let devices = ["--base", "--sonar", "--camera"];
    let line = |device: &dyn Fn() -> String| {
        let [base, sonar, camera] = devices.map(str::to_owned);
        [base, device(), sonar, device(), camera, device()]
    };
    let lived = run(line(&|| typed("record", ",sim:")));
    let again = run(line(&|| typed("replay", "")));
    assert_eq!(lived, again);
    let mixed = [
        "--base".to_owned(),
        typed("replay", ""),
        "--sonar".to_owned(),
        "sim:".to_owned(),
    ];
    let error = opened(mixed).map(drop).unwrap_err().to_string();
    assert!(error.contains("all devices simulated, all real"), "{error}");
    let missing = why_not([
        "--base",
        "replay:/none.mcap",
        "--sonar",
        "replay:/none.mcap",
    ]);
    assert!(missing.contains("/none.mcap"), "{missing}");
}
