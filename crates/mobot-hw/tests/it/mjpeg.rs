//! Streams of JPEG pictures: from other programs' encoders, broken in every way, played and live.

use std::io::{self, Cursor, Read, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use image::codecs::jpeg::JpegEncoder;
use image::{GrayImage, Luma};
use mobot_hw::stream::{MjpegCamera, MjpegParams};
use mobot_hw::{
    Camera, CameraError, Clock, DeviceError, FaultKind, FrameCounts, FrameFault, SystemClock,
};

/// Deterministic numbers, by D. Lehmer's generator.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_mul(0xd134_2543_de82_ef95).wrapping_add(1);
        ((self.0 >> 33) as usize) % bound
    }
}

/// Gives a few bytes at a time.
struct Bits<R>(R, Numbers, usize);

impl<R: Read> Read for Bits<R> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let n = 1 + self.1.below(self.2.min(bytes.len()));
        self.0.read(&mut bytes[..n])
    }
}

fn golden(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../testdata/golden")
        .join(name)
}

fn picture(n: u32) -> Vec<u8> {
    sized(n, 48, 32)
}

fn sized(n: u32, width: u32, height: u32) -> Vec<u8> {
    let mut numbers = Numbers(u64::from(n));
    let image = GrayImage::from_fn(width, height, |u, v| {
        Luma([(100 + u + v + n % 50) as u8 ^ numbers.below(32) as u8])
    });
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, 80)
        .encode_image(&image)
        .expect("a JPEG");
    bytes
}

fn played(bytes: impl Into<Vec<u8>>) -> MjpegCamera<SystemClock> {
    MjpegCamera::played(
        Cursor::new(bytes.into()),
        SystemClock::start(),
        MjpegParams::default(),
    )
}

/// Every frame there is.
fn all<C: Clock>(camera: &mut MjpegCamera<C>) -> Vec<GrayImage> {
    let mut images = Vec::new();
    loop {
        match camera.frame() {
            Ok(frame) => images.push(frame.image),
            Err(CameraError::Ended) => return images,
            Err(error) => panic!("{error}"),
        }
    }
}

#[test]
fn other_programs_frames_come_as_libjpeg_sees_them() {
    let stream = std::fs::read(golden("stream.mjpeg")).unwrap();
    let luma = image::open(golden("stream_luma.png")).unwrap().into_luma8();
    for most in [1, 2, 3, 50, 4096, 1 << 16] {
        let pieces = Bits(Cursor::new(stream.clone()), Numbers(most as u64), most);
        let mut camera = MjpegCamera::played(pieces, SystemClock::start(), MjpegParams::default());
        let images = all(&mut camera);
        assert_eq!(images.len(), 12);
        for (n, image) in images.iter().enumerate() {
            assert_eq!(image.dimensions(), (80, 56));
            let apart = image.enumerate_pixels().map(|(u, v, pixel)| {
                let theirs = luma.get_pixel(u, v + 56 * n as u32);
                pixel.0[0].abs_diff(theirs.0[0])
            });
            assert!(apart.max() <= Some(2), "frame {n}");
        }
        let counts = camera.counts();
        // two of the lures between frames look like one that ends at once
        assert_eq!((counts.given, counts.damaged), (12, 2));
    }
    let path = golden("stream.mjpeg");
    let mut file = MjpegCamera::open(
        path.to_str().unwrap(),
        SystemClock::start(),
        MjpegParams::default(),
    )
    .unwrap();
    assert_eq!(all(&mut file).len(), 12);
}

/// Where the segments of a picture's header end.
fn segment_ends(jpeg: &[u8]) -> Vec<usize> {
    let mut ends = vec![2];
    let mut at = 2;
    while jpeg[at + 1] != 0xDA {
        at += 2 + usize::from(u16::from_be_bytes([jpeg[at + 2], jpeg[at + 3]]));
        ends.push(at);
    }
    ends.push(at + 2 + usize::from(u16::from_be_bytes([jpeg[at + 2], jpeg[at + 3]])));
    ends
}

#[test]
fn a_frame_cut_anywhere_is_one_lost_frame() {
    let [a, b, c] = [0, 1, 2].map(picture);
    let (ours, theirs) = (segment_ends(&b), segment_ends(&c));
    for cut in 0..b.len() {
        let mut camera = played([&a[..], &b[..cut], &c[..]].concat());
        let images = all(&mut camera).len();
        let end = ours.iter().find(|end| **end > cut);
        if end.is_some_and(|end| cut > 2 && theirs.contains(&(end - cut))) {
            // the next frame's first bytes fill the segment, and its header goes on from there
            assert!((1..=2).contains(&images), "cut at {cut}");
        } else {
            assert_eq!(images, 2, "cut at {cut}");
            assert_eq!(camera.counts().damaged, u64::from(cut >= 2), "cut at {cut}");
        }
        // and so it is at the end
        let mut camera = played([&a[..], &b[..cut]].concat());
        assert_eq!(all(&mut camera).len(), 1, "cut at {cut}");
        assert_eq!(camera.counts().damaged, u64::from(cut >= 3), "cut at {cut}");
    }
}

#[test]
fn a_picture_that_stops_early_is_refused() {
    let whole = sized(3, 160, 120);
    let mut numbers = Numbers(7);
    let mut refused = 0;
    for _ in 0..300 {
        // as a camera's driver sends it that lost a packet: the end is there, the middle is not
        let from = 700 + numbers.below(whole.len() - 1000);
        let mut short = whole.clone();
        short.drain(from..whole.len() - 2);
        let mut camera = played(short);
        refused += usize::from(all(&mut camera).is_empty());
    }
    assert_eq!(refused, 300);
}

#[test]
fn after_damage_the_second_good_frame_comes() {
    let frames: Vec<Vec<u8>> = (0..8).map(picture).collect();
    let mut numbers = Numbers(1);
    for round in 0..1000 {
        let mut damaged = frames[..4].concat();
        for _ in 0..1 + numbers.below(20) {
            let at = numbers.below(damaged.len());
            match numbers.below(3) {
                0 => drop(damaged.remove(at)),
                1 => damaged.insert(at, damaged[at]),
                _ => damaged[at] ^= 1 << numbers.below(8),
            }
        }
        let bytes = [damaged, frames[4..].concat()].concat();
        let images = all(&mut played(bytes));
        let last = all(&mut played(frames[5..].concat()));
        assert!(images.ends_with(&last), "round {round}");
    }
}

#[test]
fn hostile_frames_are_decoded_or_refused() {
    let long = std::env::var_os("MOBOT_LONG").is_some();
    let stream = std::fs::read(golden("stream.mjpeg")).unwrap();
    let mut numbers = Numbers(11);
    let (mut given, mut damaged) = (0, 0);
    for _ in 0..if long { 20_000 } else { 100 } {
        let mut bytes = stream.clone();
        for _ in 0..1 + numbers.below(200) {
            let at = numbers.below(bytes.len());
            match numbers.below(4) {
                0 => bytes[at] = 0xFF,
                1 => bytes[at] = 0,
                2 => bytes[at] ^= 1 << numbers.below(8),
                _ => bytes.truncate(bytes.len() - numbers.below(20)),
            }
        }
        let mut camera = played(bytes);
        all(&mut camera);
        given += camera.counts().given;
        damaged += camera.counts().damaged;
    }
    assert!(given > 100 && damaged > 100, "{given} {damaged}");
}

#[test]
fn noise_gives_nothing_and_ends() {
    let mut numbers = Numbers(3);
    let mut noise: Vec<u8> = (0..10 << 20).map(|_| numbers.below(256) as u8).collect();
    noise.extend(picture(0));
    noise.extend(picture(1));
    let began = Instant::now();
    let mut camera = played(noise);
    let mut images = 0;
    loop {
        match camera.frame() {
            Ok(_) => images += 1,
            Err(CameraError::Ended) => break,
            Err(CameraError::Garbled { .. } | CameraError::Silent { .. }) => {}
            Err(error) => panic!("{error}"),
        }
    }
    assert_eq!(images, 2);
    assert!(began.elapsed() < Duration::from_secs(5));
    // made of nothing but starts of frames, and of segments that lead nowhere
    for pattern in [
        &[0xFF, 0xD8][..],
        &[0xFF, 0xD8, 0xFF, 0xE0, 0xFF, 0xFF],
        &[0xFF, 0xD8, 0xFF, 0xDA, 0x00, 0x02],
        &[0xFF, 0xD8, 0xFF, 0xE0, 0x00, 0x02, 0xFF, 0xE0, 0x00, 0x02],
        &[
            0xFF, 0xD8, 0xFF, 0xDA, 0x00, 0x02, 0x00, 0xFF, 0xC4, 0x00, 0x02,
        ],
        &[0xFF, 0xFF],
    ] {
        let mut bytes = pattern.repeat((1 << 20) / pattern.len());
        bytes.extend([0; 70_000]);
        bytes.extend([picture(0), picture(1), picture(2)].concat());
        let began = Instant::now();
        let mut images = 0;
        let mut camera = played(bytes);
        loop {
            match camera.frame() {
                Ok(_) => images += 1,
                Err(CameraError::Ended) => break,
                Err(_) => {}
            }
        }
        assert!(images >= 2, "{pattern:x?} {images}");
        assert!(began.elapsed() < Duration::from_secs(3), "{pattern:x?}");
    }
}

#[test]
fn frames_without_end_are_given_up() {
    let endless = io::Cursor::new(sized(0, 160, 120)[..2000].to_vec()).chain(io::repeat(0x55));
    let params = MjpegParams {
        timeout: 0.2,
        frame_limit: 100_000,
    };
    let mut camera = MjpegCamera::played(endless, SystemClock::start(), params);
    let error = camera.frame().unwrap_err();
    let limit = 100_000;
    assert!(
        matches!(error, CameraError::Garbled { fault: FrameFault::TooLong { limit: l }, .. } if l == limit),
        "{error}"
    );
    assert_eq!(error.kind(), FaultKind::Garbled);
}

#[test]
fn all_frames_have_one_size() {
    let [a, b] = [|n| sized(n, 48, 32), |n| sized(n, 64, 48)];
    let sides = |frames: &[Vec<u8>]| {
        let mut camera = played(frames.concat());
        let images = all(&mut camera);
        let widths: Vec<u32> = images.iter().map(GrayImage::width).collect();
        (widths, camera.counts().damaged)
    };
    assert_eq!(sides(&[a(0), a(1), b(2), b(3), a(4)]), (vec![48; 3], 2));
    // the first may be the odd one
    assert_eq!(sides(&[b(0), a(1), a(2), b(3)]), (vec![64, 48, 48], 1));
}

fn live(params: MjpegParams) -> (MjpegCamera<SystemClock>, io::PipeWriter) {
    let (reader, writer) = io::pipe().expect("a pipe");
    let camera = MjpegCamera::live(reader, SystemClock::start(), params).expect("a thread");
    (camera, writer)
}

/// Waits until the camera's thread has seen so many frames.
fn wait_for(camera: &MjpegCamera<SystemClock>, enough: impl Fn(FrameCounts) -> bool) {
    let began = Instant::now();
    while !enough(camera.counts()) {
        assert!(began.elapsed() < Duration::from_secs(10));
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn the_newest_live_frame_wins() {
    let clock = SystemClock::start();
    let (reader, mut writer) = io::pipe().unwrap();
    let mut camera = MjpegCamera::live(reader, clock, MjpegParams::default()).unwrap();
    for n in 0..500 {
        writer.write_all(&picture(n)).unwrap(); // far more than a pipe holds: the camera reads on its own
    }
    wait_for(&camera, |counts| counts.passed_over == 499);
    let before = clock.now();
    let newest = camera.frame().unwrap();
    assert_eq!(newest.image, all(&mut played(picture(499)))[0]);
    assert_eq!(newest.sequence, 499);
    assert!(newest.stamp > 0.0 && newest.stamp < before);
    // half a frame is none; its stamp is when it began
    let next = picture(500);
    let sent = clock.now();
    writer.write_all(&next[..next.len() - 1]).unwrap();
    std::thread::sleep(Duration::from_millis(100));
    writer.write_all(&next[next.len() - 1..]).unwrap();
    let frame = camera.frame().unwrap();
    assert_eq!(frame.sequence, 500);
    assert!(
        frame.stamp >= sent - 1e-3 && frame.stamp < sent + 0.09,
        "{}",
        frame.stamp - sent
    );
    // the last one is given although the writer has gone
    writer.write_all(&picture(501)).unwrap();
    drop(writer);
    assert_eq!(camera.frame().unwrap().sequence, 501);
    let error = camera.frame().unwrap_err();
    assert_eq!(error.kind(), FaultKind::Unplugged);
}

#[test]
fn silence_and_garbage_end_in_time() {
    let params = MjpegParams {
        timeout: 0.3,
        ..MjpegParams::default()
    };
    let (mut camera, mut writer) = live(params);
    for garbage in [false, true] {
        if garbage {
            writer.write_all(&picture(0)[..400]).unwrap();
            writer.write_all(&picture(1)[..300]).unwrap();
        }
        let began = Instant::now();
        let error = camera.frame().unwrap_err();
        let waited = began.elapsed().as_secs_f64();
        assert!((0.3..0.33).contains(&waited), "{waited}");
        let kind = [FaultKind::Silent, FaultKind::Garbled][usize::from(garbage)];
        assert_eq!(error.kind(), kind, "{error}");
    }
    writer.write_all(&picture(2)).unwrap();
    assert!(camera.frame().is_ok());
}

#[cfg(unix)]
#[test]
fn a_named_pipe_waits_for_its_writer() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("camera");
    let made = std::process::Command::new("mkfifo").arg(&path).status();
    assert!(made.unwrap().success());
    let params = MjpegParams {
        timeout: 0.1,
        ..MjpegParams::default()
    };
    let mut camera =
        MjpegCamera::open(path.to_str().unwrap(), SystemClock::start(), params).unwrap();
    assert_eq!(camera.frame().unwrap_err().kind(), FaultKind::Silent);
    let mut writer = std::fs::File::create(&path).unwrap();
    writer.write_all(&picture(5)).unwrap();
    assert!(camera.frame().is_ok());
    drop(writer);
    let missing = MjpegCamera::open("/nowhere/camera", SystemClock::start(), params);
    assert_eq!(missing.unwrap_err().kind(), FaultKind::System);
}
