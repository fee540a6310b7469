//! A USB serial port (dummy_hcd and g_serial) whose cable is pulled.

use std::fs;
use std::io::{ErrorKind, Read, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use mobot_hw::serial::{MaxBotix, MaxBotixParams, Port, maxbotix, open};
use mobot_hw::{DeviceError, FaultKind, RangeFinder, SystemClock};

/// The far end of the cable.
const GADGET: &str = "/dev/ttyGS0";
/// 0 takes the device away as pulling the plug does, 1 brings it back.
const PLUG: &str = "/sys/bus/usb/devices/1-1/authorized";

fn plug(there: bool) {
    fs::write(PLUG, if there { "1" } else { "0" }).expect("a plug");
}

/// The port's name now, by what the device is: the number in it may change.
fn port_name() -> PathBuf {
    let began = Instant::now();
    loop {
        let found = fs::read_dir("/sys/class/tty").expect("ports").flatten();
        let mut names = found.map(|entry| entry.file_name().to_string_lossy().into_owned());
        if let Some(name) = names.find(|name| name.starts_with("ttyACM")) {
            let path = PathBuf::from("/dev").join(name);
            if path.exists() {
                return path;
            }
        }
        assert!(began.elapsed() < Duration::from_secs(5), "no port");
        thread::sleep(Duration::from_millis(5));
    }
}

fn open_port() -> (Port, PathBuf) {
    let path = port_name();
    let port = open(path.to_str().expect("UTF-8"), maxbotix::BAUD, false).expect("a port");
    (port, path)
}

fn gadget() -> Port {
    let began = Instant::now();
    loop {
        match open(GADGET, maxbotix::BAUD, false) {
            Ok(port) => return port,
            // for a moment after the plug was pulled
            Err(error) => assert!(began.elapsed() < Duration::from_secs(5), "{error}"),
        }
        thread::sleep(Duration::from_millis(10));
    }
}

/// Sends a sonar's readings until told to stop, whether or not somebody listens.
fn sonar(stop: &Arc<AtomicBool>) -> thread::JoinHandle<()> {
    let stop = Arc::clone(stop);
    thread::spawn(move || {
        let mut far = Some(gadget());
        while !stop.load(Ordering::Relaxed) {
            // after the plug was pulled the old port hears no more, and must be closed before it is opened again
            drop(far.take_if(|far| far.write_all(b"R050\r").is_err()));
            far.get_or_insert_with(gadget);
            thread::sleep(Duration::from_millis(49));
        }
    })
}

#[test]
#[ignore = "needs the virtual machine"]
fn a_pulled_plug_is_noticed_and_the_device_found_again() {
    plug(true);
    let stop = Arc::new(AtomicBool::new(false));
    let far = sonar(&stop);
    let (port, name) = open_port();
    let mut sonar = MaxBotix::new(port, SystemClock::start(), MaxBotixParams::default());
    println!("{}: {:?}", name.display(), sonar.ping(0.0).unwrap());
    let pulled = thread::spawn(|| {
        thread::sleep(Duration::from_millis(200));
        let begun = Instant::now();
        plug(false);
        begun
    });
    let error = loop {
        match sonar.ping(0.0) {
            Ok(_) => {}
            Err(error) => break error,
        }
    };
    let noticed = Instant::now();
    let after = noticed.saturating_duration_since(pulled.join().unwrap());
    println!("{error}, {after:?} after the plug was pulled");
    assert_eq!(error.kind(), FaultKind::Unplugged);
    assert!(after < Duration::from_millis(250));
    assert_eq!(sonar.ping(0.0).unwrap_err().kind(), FaultKind::Unplugged);
    assert!(open(name.to_str().unwrap(), maxbotix::BAUD, false).is_err());

    // the old port is still held: the device comes back under another name
    plug(true);
    let (port, new_name) = open_port();
    println!("back as {}", new_name.display());
    assert_ne!(name, new_name);
    drop(sonar);
    let mut sonar = MaxBotix::new(port, SystemClock::start(), MaxBotixParams::default());
    println!("{}: {:?}", new_name.display(), sonar.ping(0.0).unwrap());

    // closed first, it comes back under the first name
    plug(false);
    drop(sonar);
    thread::sleep(Duration::from_millis(100));
    plug(true);
    let (port, name) = open_port();
    println!("back as {}", name.display());
    let mut sonar = MaxBotix::new(port, SystemClock::start(), MaxBotixParams::default());
    println!("{}: {:?}", name.display(), sonar.ping(0.0).unwrap());
    stop.store(true, Ordering::Relaxed);
    far.join().unwrap();
}

#[test]
#[ignore = "needs the virtual machine"]
fn bytes_go_both_ways_unchanged() {
    plug(true);
    let mut far = gadget();
    let (mut port, _) = open_port();
    let all: Vec<u8> = (0..=255).collect();
    port.write_all(&all).unwrap();
    assert_eq!(hear(&mut far), all);
    far.write_all(&all).unwrap();
    assert_eq!(hear(&mut port), all);
}

/// 256 bytes.
fn hear(port: &mut Port) -> Vec<u8> {
    let mut heard = Vec::new();
    let began = Instant::now();
    while heard.len() < 256 && began.elapsed() < Duration::from_secs(2) {
        let mut bytes = [0; 64];
        match port.read(&mut bytes) {
            Ok(count) => heard.extend_from_slice(&bytes[..count]),
            Err(error) => assert_eq!(error.kind(), ErrorKind::TimedOut),
        }
    }
    heard
}
