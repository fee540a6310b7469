//! The kernel's virtual camera (vivid), which can be told to fail.

use std::time::{Duration, Instant};

use image::GrayImage;
use mobot_hw::v4l2::{PixelFormat, V4l2Camera, V4l2Params, V4l2Settings, cameras};
use mobot_hw::{
    Camera, CameraError, CameraFrame, Clock, DeviceError, FaultKind, PictureFault, PictureWatch,
    SystemClock,
};

const PATH: &str = "/dev/video0";
// entries of the menus "Test Pattern" and "OSD Text Mode"
const BLACK: i32 = 5;
const WHITE: i32 = 6;
const RAMP: i32 = 20;
const NOISE: i32 = 21;
const NO_TEXT: i32 = 2;

type Vivid = V4l2Camera<SystemClock>;

fn params() -> V4l2Params {
    V4l2Params {
        size_px: Some([640, 360]),
        rate_hz: Some(30.0),
        ..V4l2Params::default()
    }
}

fn open(params: V4l2Params) -> Vivid {
    V4l2Camera::open(PATH, SystemClock::start(), params).expect("a camera")
}

fn press(camera: &mut Vivid, name: &str, value: i32) {
    let controls = camera.controls().expect("controls");
    let id = controls
        .iter()
        .find(|control| control.name == name)
        .unwrap_or_else(|| panic!("no {name} in {controls:?}"))
        .id;
    camera.set_control(id, value).expect("set");
}

fn show(camera: &mut Vivid, pattern: i32) {
    press(camera, "OSD Text Mode", NO_TEXT);
    press(camera, "Test Pattern", pattern);
    for _ in 0..6 {
        camera.frame().expect("a frame"); // those filled before
    }
}

fn frames(camera: &mut Vivid, count: usize) -> Vec<CameraFrame> {
    (0..count)
        .map(|_| camera.frame().expect("a frame"))
        .collect()
}

#[test]
#[ignore = "needs the virtual machine"]
fn streams_and_is_never_stale() {
    let clock = SystemClock::start();
    let mut camera = V4l2Camera::open(PATH, clock, params()).unwrap();
    println!("{:?}", camera.settings());
    let began = Instant::now();
    let mut ages = Vec::new();
    let mut last: Option<CameraFrame> = None;
    for _ in 0..60 {
        let frame = camera.frame().unwrap();
        ages.push(clock.now() - frame.stamp);
        if let Some(last) = &last {
            assert!(frame.sequence > last.sequence && frame.stamp > last.stamp);
        }
        last = Some(frame);
    }
    ages.sort_by(f64::total_cmp);
    println!(
        "60 frames in {:.2} s, ages {:.4} to {:.4} s, {:?}",
        began.elapsed().as_secs_f64(),
        ages[0],
        ages[59],
        camera.counts()
    );
    assert!(ages[0] >= 0.0 && ages[59] < 0.25);
    let before = last.unwrap();
    let passed = camera.counts().passed_over;
    std::thread::sleep(Duration::from_secs(1));
    let frame = camera.frame().unwrap();
    let age = clock.now() - frame.stamp;
    println!(
        "after a second without a look: {age:.4} s old, {} frames on, {:?}",
        frame.sequence - before.sequence,
        camera.counts()
    );
    assert!(age < 0.1, "{age}");
    assert!(frame.sequence - before.sequence >= 25);
    assert!(camera.counts().passed_over >= passed + 3);
}

#[test]
#[ignore = "needs the virtual machine"]
fn every_format_shows_the_same() {
    let mut ramps: Vec<(PixelFormat, GrayImage)> = Vec::new();
    for format in PixelFormat::ALL {
        let asked = V4l2Params {
            format: Some(format),
            ..params()
        };
        if format == PixelFormat::Mjpeg {
            let error = V4l2Camera::open(PATH, SystemClock::start(), asked).unwrap_err();
            assert_eq!(error.kind(), FaultKind::Refused);
            println!("{error}");
            continue;
        }
        let mut camera = open(asked);
        let V4l2Settings {
            size_px,
            rate_hz,
            format: found,
            ..
        } = camera.settings();
        assert_eq!((size_px, found), ([640, 360], format));
        assert!((rate_hz.unwrap() - 30.0).abs() < 0.1);
        show(&mut camera, WHITE);
        let white = camera.frame().unwrap().image;
        println!("{format}: white is {}", white.get_pixel(320, 180).0[0]);
        assert_eq!(
            PictureWatch::default().look(&white),
            Some(PictureFault::Bright)
        );
        show(&mut camera, BLACK);
        let black = camera.frame().unwrap().image;
        assert_eq!(
            PictureWatch::default().look(&black),
            Some(PictureFault::Dark)
        );
        show(&mut camera, RAMP);
        ramps.push((format, camera.frame().unwrap().image));
    }
    for (format, ramp) in &ramps {
        let row: Vec<u8> = (0..640).map(|u| ramp.get_pixel(u, 180).0[0]).collect();
        println!("{format}: {:?}", row.iter().step_by(64).collect::<Vec<_>>());
        assert!(row.is_sorted(), "{format}");
        assert!(row[0] < 30 && row[639] > 220, "{format}");
    }
    assert_eq!(ramps.len(), 4);
}

#[test]
#[ignore = "needs the virtual machine"]
fn what_it_cannot_do_is_refused() {
    let error = |params| V4l2Camera::open(PATH, SystemClock::start(), params).unwrap_err();
    for asked in [
        V4l2Params {
            size_px: Some([641, 359]),
            ..params()
        },
        V4l2Params {
            exposure: Some(0.01),
            ..params()
        },
        V4l2Params {
            white_balance_k: Some(4500),
            ..params()
        },
    ] {
        let error = error(asked);
        println!("{error}");
        assert_eq!(error.kind(), FaultKind::Refused);
    }
    let other = V4l2Camera::open("/dev/null", SystemClock::start(), params()).unwrap_err();
    assert_eq!(other.kind(), FaultKind::Refused, "{other}");
    let missing = V4l2Camera::open("/dev/video99", SystemClock::start(), params()).unwrap_err();
    assert_eq!(missing.kind(), FaultKind::System, "{missing}");
    let first = open(params());
    let busy = error(params());
    println!("{busy}");
    assert!(matches!(busy, CameraError::Busy { .. }) && busy.kind() == FaultKind::Refused);
    drop(first);
    open(params());
}

#[test]
#[ignore = "needs the virtual machine"]
fn controls_are_set_and_read_back() {
    let mut camera = open(params());
    let controls = camera.controls().unwrap();
    println!("{} controls", controls.len());
    let brightness = 0x0098_0900;
    for value in [0, 255, 128] {
        assert_eq!(camera.set_control(brightness, value).unwrap(), value);
        assert_eq!(camera.control(brightness).unwrap(), value);
    }
    let beyond = camera.set_control(brightness, 256).unwrap_err();
    println!("{beyond}");
    assert_eq!(beyond.kind(), FaultKind::Refused);
    let (autogain, gain) = (0x0098_0912, 0x0098_0913);
    camera.set_control(autogain, 1).unwrap();
    camera.hold().unwrap();
    assert_eq!(camera.control(autogain).unwrap(), 0);
    assert_eq!(camera.set_control(gain, 77).unwrap(), 77);
    camera.hold().unwrap();
    assert_eq!(camera.control(gain).unwrap(), 77);
    let found = cameras();
    println!("{found:?}");
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].driver, "vivid");
}

#[test]
#[ignore = "needs the virtual machine"]
fn damaged_and_dropped_frames_are_counted() {
    let mut camera = open(params());
    frames(&mut camera, 5);
    let before = camera.counts();
    press(&mut camera, "Inject V4L2_BUF_FLAG_ERROR", 1);
    frames(&mut camera, 10);
    let after = camera.counts();
    println!("{before:?} {after:?}");
    assert_eq!(after.damaged, before.damaged + 1);
    press(&mut camera, "Percentage of Dropped Buffers", 50);
    let given = frames(&mut camera, 40);
    let dropping = camera.counts();
    press(&mut camera, "Percentage of Dropped Buffers", 0);
    println!("{dropping:?}");
    let missed = dropping.missed - after.missed;
    assert!(missed >= 10, "{missed}");
    let made = given[39].sequence - given[0].sequence;
    assert!(made > 49, "{made}");
}

#[test]
#[ignore = "needs the virtual machine"]
fn a_failed_stream_begins_again() {
    let mut camera = open(params());
    let before = frames(&mut camera, 5).pop().unwrap();
    press(&mut camera, "Inject Fatal Streaming Error", 1);
    let began = Instant::now();
    let frame = camera.frame().unwrap();
    println!("frame {:?} after the failure", began.elapsed());
    assert!(frame.sequence > before.sequence && frame.stamp > before.stamp);
    frames(&mut camera, 5);
    // where it cannot begin again, that is said, and tried at the next call
    press(&mut camera, "Inject VIDIOC_STREAMON Error", 1);
    press(&mut camera, "Inject Fatal Streaming Error", 1);
    let error = camera.frame().unwrap_err();
    println!("{error}");
    assert_eq!(error.kind(), FaultKind::System);
    frames(&mut camera, 5);
}

#[test]
#[ignore = "needs the virtual machine"]
fn the_drivers_count_may_wrap() {
    let mut camera = open(params());
    press(&mut camera, "Wrap Sequence Number", 1);
    press(&mut camera, "Inject Fatal Streaming Error", 1); // the count begins with the stream, near its end
    let given = frames(&mut camera, 150);
    press(&mut camera, "Wrap Sequence Number", 0);
    println!(
        "{} to {}, {:?}",
        given[0].sequence,
        given[149].sequence,
        camera.counts()
    );
    assert!(
        given
            .windows(2)
            .all(|w| (1..60).contains(&(w[1].sequence - w[0].sequence)))
    );
}

#[test]
#[ignore = "needs the virtual machine"]
fn stuck_pictures_are_seen() {
    let mut camera = open(params());
    let mut watch = PictureWatch::default();
    show(&mut camera, NOISE);
    let faults: Vec<_> = frames(&mut camera, 20)
        .iter()
        .filter_map(|frame| watch.look(&frame.image))
        .collect();
    assert_eq!(faults, []);
    show(&mut camera, RAMP);
    let faults: Vec<_> = frames(&mut camera, 12)
        .iter()
        .map(|frame| watch.look(&frame.image))
        .collect();
    assert_eq!(faults[..9], [None; 9]);
    assert_eq!(faults[9..], [Some(PictureFault::Frozen); 3]);
}

#[test]
#[ignore = "needs the virtual machine"]
fn unplugged_and_plugged_in_again() {
    let mut camera = open(params());
    frames(&mut camera, 5);
    press(&mut camera, "Disconnect", 1);
    let began = Instant::now();
    let error = loop {
        match camera.frame() {
            Ok(_) => assert!(began.elapsed() < Duration::from_secs(1)),
            Err(error) => break error,
        }
    };
    println!("{error} after {:?}", began.elapsed());
    assert_eq!(error.kind(), FaultKind::Unplugged);
    assert!(began.elapsed() < Duration::from_millis(250));
    assert_eq!(camera.frame().unwrap_err().kind(), FaultKind::Unplugged);
    let held = V4l2Camera::open(PATH, SystemClock::start(), params()).unwrap_err();
    assert_eq!(held.kind(), FaultKind::Unplugged, "{held}");
    drop(camera);
    let began = Instant::now();
    let mut camera = loop {
        match V4l2Camera::open(PATH, SystemClock::start(), params()) {
            Ok(camera) => break camera,
            Err(error) => assert!(began.elapsed() < Duration::from_secs(3), "{error}"),
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    println!("back after {:?}", began.elapsed());
    frames(&mut camera, 5);
}
