//! Setting a webcam as they commonly are: quick in JPEG and slow in raw pixels, with automatics that rule their values.

use std::cell::RefCell;
use std::path::Path;

use rustix::io::Errno;

use super::*;
use crate::v4l2::control::{self, EXPOSURE, FOCUS, GAIN, WHITE_BALANCE};
use crate::v4l2::negotiate::{self, Disagreed};
use crate::v4l2::{PixelFormat, V4l2Params, set_light};
use crate::{CameraError, DeviceError, FaultKind};

/// Format, size, the most frames a second.
const MODES: [(&[u8; 4], [u32; 2], u32); 5] = [
    (b"YUYV", [640, 480], 30),
    (b"YUYV", [1280, 720], 10),
    (b"MJPG", [640, 480], 30),
    (b"MJPG", [1280, 720], 30),
    (b"H264", [1280, 720], 30),
];
const EXPOSURE_AUTO: u32 = 0x009A_0901;
const BALANCE_AUTO: u32 = 0x0098_090C;

struct Knob {
    id: u32,
    range: [i32; 3],
    value: i32,
    /// Takes values only while that control has that value.
    under: Option<(u32, i32)>,
}

struct Webcam {
    knobs: RefCell<Vec<Knob>>,
    /// What was set, in order.
    log: RefCell<Vec<(u32, i32)>>,
    format: RefCell<([u8; 4], [u32; 2])>,
    fps: RefCell<u32>,
    /// How it treats values under an automatic.
    refusal: Option<Errno>,
}

impl Webcam {
    fn new(refusal: Option<Errno>) -> Self {
        let knob = |id, range, value, under| Knob {
            id,
            range,
            value,
            under,
        };
        let knobs = vec![
            knob(0x0098_0900, [-64, 64, 1], 0, None),
            knob(BALANCE_AUTO, [0, 1, 1], 1, None),
            knob(0x0098_0913, [0, 100, 1], 7, None),
            knob(0x0098_091A, [2800, 6500, 10], 4600, Some((BALANCE_AUTO, 0))),
            knob(EXPOSURE_AUTO, [0, 3, 1], 3, None),
            knob(0x009A_0902, [1, 5000, 1], 157, Some((EXPOSURE_AUTO, 1))),
            knob(0x009A_0903, [0, 1, 1], 1, None),
        ];
        Self {
            knobs: RefCell::new(knobs),
            log: RefCell::default(),
            format: RefCell::new((*b"YUYV", [640, 480])),
            fps: RefCell::new(30),
            refusal,
        }
    }

    fn value(&self, id: u32) -> i32 {
        control::get(self, id).expect("a value")
    }

    fn log(&self) -> Vec<(u32, i32)> {
        self.log.take()
    }
}

impl Requests for Webcam {
    fn describe_format(&self, value: &mut FormatDescription) -> Result<()> {
        let formats = [b"YUYV", b"MJPG", b"H264"];
        value.fourcc = **formats.get(value.index as usize).ok_or(Errno::INVAL)?;
        Ok(())
    }

    fn read_format(&self, value: &mut Format) -> Result<()> {
        let (fourcc, [width, height]) = *self.format.borrow();
        (value.pix.fourcc, value.pix.width, value.pix.height) = (fourcc, width, height);
        Ok(())
    }

    /// The nearest size, as drivers do.
    fn set_format(&self, value: &mut Format) -> Result<()> {
        let pix = &mut value.pix;
        let modes = MODES.iter().filter(|(fourcc, ..)| **fourcc == pix.fourcc);
        let (fourcc, [width, height], most) = modes
            .min_by_key(|(_, size, _)| size[0].abs_diff(pix.width))
            .unwrap_or(&MODES[0]);
        (pix.fourcc, pix.width, pix.height) = (**fourcc, *width, *height);
        (pix.field, pix.bytes_per_line) = (1, if pix.fourcc == *b"YUYV" { 2 * width } else { 0 });
        *self.format.borrow_mut() = (pix.fourcc, [*width, *height]);
        let fps = *self.fps.borrow();
        self.fps.replace(fps.min(*most));
        Ok(())
    }

    fn read_parm(&self, value: &mut StreamParm) -> Result<()> {
        value.capability = 0x1000;
        (value.numerator, value.denominator) = (1, *self.fps.borrow());
        Ok(())
    }

    fn set_parm(&self, value: &mut StreamParm) -> Result<()> {
        let format = *self.format.borrow();
        let most = MODES.iter().find(|(f, size, _)| (**f, *size) == format);
        let most = most.expect("a mode").2;
        *self.fps.borrow_mut() = most.min(value.denominator / value.numerator);
        self.read_parm(value)
    }

    fn query_control(&self, value: &mut ControlQuery) -> Result<()> {
        let knobs = self.knobs.borrow();
        let next = value.id & 0x8000_0000 != 0;
        let id = value.id & 0x7FFF_FFFF;
        let fits = |knob: &&Knob| if next { knob.id > id } else { knob.id == id };
        let knob = knobs.iter().find(fits).ok_or(Errno::INVAL)?;
        (value.id, value.kind) = (knob.id, 1);
        [value.minimum, value.maximum, value.step] = knob.range;
        Ok(())
    }

    fn read_control(&self, value: &mut ControlValue) -> Result<()> {
        let knobs = self.knobs.borrow();
        let knob = knobs.iter().find(|knob| knob.id == value.id);
        value.value = knob.ok_or(Errno::INVAL)?.value;
        Ok(())
    }

    fn set_control(&self, value: &mut ControlValue) -> Result<()> {
        self.log.borrow_mut().push((value.id, value.value));
        // like UVC cameras, it knows manual and aperture priority only
        if value.id == EXPOSURE_AUTO && ![1, 3].contains(&value.value) {
            return Err(Errno::RANGE);
        }
        let mut knobs = self.knobs.borrow_mut();
        let place = knobs.iter().position(|knob| knob.id == value.id);
        let place = place.ok_or(Errno::INVAL)?;
        if let Some((id, free)) = knobs[place].under
            && knobs.iter().any(|knob| knob.id == id && knob.value != free)
        {
            return self.refusal.map_or(Ok(()), Err);
        }
        knobs[place].value = value.value;
        Ok(())
    }
}

fn params(size_px: [u32; 2], rate_hz: f64) -> V4l2Params {
    V4l2Params {
        size_px: Some(size_px),
        rate_hz: Some(rate_hz),
        ..V4l2Params::default()
    }
}

#[test]
fn the_format_is_one_that_gives_size_and_rate() {
    let webcam = Webcam::new(None);
    let agree = |params: &V4l2Params| {
        let agreed = negotiate::agree(&webcam, params).expect("agreement");
        let layout = agreed.layout;
        assert_eq!(webcam.format.borrow().0, layout.format.fourcc());
        (layout.format, [layout.width, layout.height], agreed.rate)
    };
    let (yuyv, mjpeg) = (PixelFormat::Yuyv, PixelFormat::Mjpeg);
    let (small, large) = ([640, 480], [1280, 720]);
    assert_eq!(agree(&params(small, 30.0)), (yuyv, small, Some(30.0)));
    assert_eq!(agree(&params(large, 10.0)), (yuyv, large, Some(10.0)));
    assert_eq!(agree(&params(large, 30.0)), (mjpeg, large, Some(30.0)));
    // faster than there is
    assert_eq!(agree(&params(large, 60.0)), (mjpeg, large, Some(30.0)));
    assert_eq!(agree(&params(small, 60.0)), (yuyv, small, Some(30.0)));
    let named = V4l2Params {
        format: Some(mjpeg),
        ..params(small, 15.0)
    };
    assert_eq!(agree(&named), (mjpeg, small, Some(15.0)));
    // as it stands
    webcam.format.replace((*b"MJPG", large));
    webcam.fps.replace(30);
    assert_eq!(agree(&V4l2Params::default()), (mjpeg, large, Some(30.0)));

    let disagreed = negotiate::agree(&webcam, &params([800, 600], 30.0)).expect_err("no such size");
    assert!(matches!(disagreed, Disagreed::Size { .. }), "{disagreed:?}");
    let grey = V4l2Params {
        format: Some(PixelFormat::Grey),
        ..params(small, 30.0)
    };
    let disagreed = negotiate::agree(&webcam, &grey).expect_err("no such format");
    let Disagreed::Format { expected, found } = disagreed else {
        panic!("{disagreed:?}");
    };
    assert_eq!((&*expected, &*found), ("GREY", "YUYV, MJPG, H264"));
}

#[test]
fn automatics_go_off_before_values_are_set() {
    let path = Path::new("/dev/video0");
    for refusal in [None, Some(Errno::ACCESS), Some(Errno::INVAL)] {
        let webcam = Webcam::new(refusal);
        let wanted = V4l2Params {
            exposure: Some(0.0083),
            white_balance_k: Some(4204),
            ..V4l2Params::default()
        };
        set_light(&webcam, path, &wanted).expect("light");
        let order = [
            (0x009A_0903, 0),
            (EXPOSURE_AUTO, 1),
            (0x009A_0902, 83),
            (BALANCE_AUTO, 0),
            (0x0098_091A, 4200),
        ];
        assert_eq!(webcam.log(), order);
        // out of its range
        let dark = V4l2Params {
            exposure: Some(1.0),
            ..V4l2Params::default()
        };
        let error = set_light(&webcam, path, &dark).expect_err("too long");
        assert_eq!(error.kind(), FaultKind::Refused);
        assert!(error.to_string().contains("1 to 5000"), "{error}");
        assert_eq!(webcam.value(0x009A_0902), 83);
    }
    // left to the camera, but for what halves the rate in the dark
    let webcam = Webcam::new(None);
    set_light(&webcam, path, &V4l2Params::default()).expect("light");
    assert_eq!(webcam.log(), [(0x009A_0903, 0)]);
}

#[test]
fn a_value_that_is_ignored_is_noticed() {
    let webcam = Webcam::new(None);
    // under an automatic that cannot be switched off
    webcam
        .knobs
        .borrow_mut()
        .retain(|knob| knob.id != EXPOSURE_AUTO);
    webcam.knobs.borrow_mut().push(Knob {
        id: 0x00F0_0001,
        range: [0, 1, 1],
        value: 1,
        under: None,
    });
    for knob in webcam.knobs.borrow_mut().iter_mut() {
        knob.under = knob.under.map(|(id, free)| {
            if id == EXPOSURE_AUTO {
                (0x00F0_0001, 0)
            } else {
                (id, free)
            }
        });
    }
    let wanted = V4l2Params {
        exposure: Some(0.0083),
        ..V4l2Params::default()
    };
    let error = set_light(&webcam, Path::new("/dev/video0"), &wanted).expect_err("ignored");
    let CameraError::Refused { what, found, .. } = &error else {
        panic!("{error}");
    };
    assert_eq!((*what, &**found), ("exposure time", "157"));
}

#[test]
fn holding_keeps_what_the_automatics_found() {
    let webcam = Webcam::new(Some(Errno::ACCESS));
    for ruled in [EXPOSURE, GAIN, WHITE_BALANCE, FOCUS] {
        control::hold(&webcam, ruled).expect("held");
    }
    let order = [
        (EXPOSURE_AUTO, 1),
        (0x009A_0902, 157),
        (BALANCE_AUTO, 0),
        (0x0098_091A, 4600),
    ];
    assert_eq!(webcam.log(), order);
    let listed = control::list(&webcam).expect("controls");
    assert_eq!(listed.len(), 7);
    assert!(listed.is_sorted_by_key(|control| control.id));
    // to the nearest step, and never beyond the last
    let set = |value| control::set(&webcam, 0x0098_091A, value).expect("set");
    assert_eq!(
        [2800, 2804, 2805, 6499, 6500].map(set),
        [2800, 2800, 2810, 6500, 6500]
    );
}
