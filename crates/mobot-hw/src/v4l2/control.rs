//! A camera's controls. Automatics are switched off first, then values set, then read back: a value set under an
//! automatic may fail, or be ignored in silence.

use rustix::io::{Errno, Result};

use super::layout::{ControlQuery, ControlValue};
use super::requests::Requests;

/// Asks for the control after the one named.
const NEXT: u32 = 0x8000_0000;
const DISABLED: u32 = 0x1;
const READ_ONLY: u32 = 0x4;
const WRITE_ONLY: u32 = 0x40;
/// Whole numbers, switches, menus, buttons, bit masks, menus of numbers.
const SIMPLE: [u32; 6] = [1, 2, 3, 4, 8, 9];
/// Controls listed: a driver may go on for ever.
const CONTROLS: usize = 1024;

/// Something that can be set on a camera.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Control {
    /// As `linux/v4l2-controls.h` and the driver number it.
    pub id: u32,
    /// The driver's name for it.
    pub name: String,
    /// Least value; bounds and step are without meaning for a button.
    pub minimum: i32,
    /// Greatest value.
    pub maximum: i32,
    /// Values are whole steps from the least.
    pub step: i32,
    /// What it is set to when the driver is loaded.
    pub default: i32,
    /// Can be set.
    pub writable: bool,
    /// Can be read.
    pub readable: bool,
}

/// A value, and the automatic that rules it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ruled {
    pub(super) what: &'static str,
    automatic: u32,
    off: i32,
    pub(super) value: u32,
}

/// In units of 100 us; the automatic's 1 is "manual".
pub(super) const EXPOSURE: Ruled = Ruled {
    what: "exposure time",
    automatic: 0x009A_0901,
    off: 1,
    value: 0x009A_0902,
};
/// In kelvin.
pub(super) const WHITE_BALANCE: Ruled = Ruled {
    what: "white balance",
    automatic: 0x0098_090C,
    off: 0,
    value: 0x0098_091A,
};
pub(super) const GAIN: Ruled = Ruled {
    what: "gain",
    automatic: 0x0098_0912,
    off: 0,
    value: 0x0098_0913,
};
pub(super) const FOCUS: Ruled = Ruled {
    what: "focus",
    automatic: 0x009A_090C,
    off: 0,
    value: 0x009A_090A,
};
/// Lets the automatic exposure lower the frame rate.
pub(super) const EXPOSURE_MAY_SLOW: u32 = 0x009A_0903;

/// Why a control is not as wanted.
#[derive(Debug)]
pub(super) enum Unset {
    Missing,
    Range {
        minimum: i32,
        maximum: i32,
    },
    /// It was set, and is this.
    Ignored(i32),
    Failed(Errno),
}

impl From<Errno> for Unset {
    fn from(error: Errno) -> Self {
        Self::Failed(error)
    }
}

pub(super) fn list(camera: &impl Requests) -> Result<Vec<Control>> {
    let mut found = Vec::new();
    let mut last = 0;
    while found.len() < CONTROLS {
        let mut query = ControlQuery {
            id: last | NEXT,
            ..ControlQuery::default()
        };
        match camera.query_control(&mut query) {
            Ok(()) if query.id > last => last = query.id,
            Ok(()) | Err(Errno::INVAL | Errno::NOTTY) => break,
            Err(error) => return Err(error),
        }
        found.extend(control(&query));
    }
    Ok(found)
}

pub(super) fn find(camera: &impl Requests, id: u32) -> Result<Option<Control>> {
    let mut query = ControlQuery {
        id: id & !NEXT,
        ..ControlQuery::default()
    };
    match camera.query_control(&mut query) {
        Ok(()) => Ok(control(&query)),
        Err(Errno::INVAL | Errno::NOTTY) => Ok(None),
        Err(error) => Err(error),
    }
}

fn control(query: &ControlQuery) -> Option<Control> {
    let simple = SIMPLE.contains(&query.kind) && query.flags & DISABLED == 0;
    simple.then(|| Control {
        id: query.id,
        name: super::text(&query.name),
        minimum: query.minimum,
        maximum: query.maximum,
        step: query.step,
        default: query.default,
        writable: query.flags & READ_ONLY == 0,
        readable: query.flags & WRITE_ONLY == 0,
    })
}

pub(super) fn get(camera: &impl Requests, id: u32) -> Result<i32> {
    let mut value = ControlValue { id, value: 0 };
    camera.read_control(&mut value)?;
    Ok(value.value)
}

/// Sets it to the nearest step and gives what it then is, where it can be read.
pub(super) fn set(camera: &impl Requests, id: u32, value: i32) -> std::result::Result<i32, Unset> {
    let control = find(camera, id)?.ok_or(Unset::Missing)?;
    let (minimum, maximum) = (control.minimum, control.maximum);
    let button = !control.readable;
    if !button && !(minimum..=maximum).contains(&value) {
        return Err(Unset::Range { minimum, maximum });
    }
    let value = if button {
        value
    } else {
        on_step(&control, value)
    };
    camera.set_control(&mut ControlValue { id, value })?;
    if button {
        return Ok(value);
    }
    match get(camera, id)? {
        found if found == value => Ok(found),
        found => Err(Unset::Ignored(found)),
    }
}

fn on_step(control: &Control, value: i32) -> i32 {
    let step = i64::from(control.step.max(1));
    let above = i64::from(value) - i64::from(control.minimum);
    let top = (i64::from(control.maximum) - i64::from(control.minimum)) / step;
    let steps = ((above + step / 2) / step).min(top);
    i32::try_from(i64::from(control.minimum) + steps * step).unwrap_or(value)
}

/// Sets a value for good.
pub(super) fn fix(
    camera: &impl Requests,
    ruled: Ruled,
    value: i32,
) -> std::result::Result<i32, Unset> {
    find(camera, ruled.value)?.ok_or(Unset::Missing)?;
    automatic_off(camera, ruled)?;
    set(camera, ruled.value, value)
}

/// Fixes a value at what it is now; nothing where the camera has no automatic for it.
pub(super) fn hold(camera: &impl Requests, ruled: Ruled) -> std::result::Result<(), Unset> {
    if find(camera, ruled.automatic)?.is_none() {
        return Ok(());
    }
    // before: some drivers fall back to an older value when their automatic is switched off
    let now = match find(camera, ruled.value)? {
        Some(control) if control.readable => Some(get(camera, ruled.value)?),
        _ => None,
    };
    automatic_off(camera, ruled)?;
    if let Some(now) = now {
        set(camera, ruled.value, now)?;
    }
    Ok(())
}

/// Nothing where the camera has no automatic for it.
pub(super) fn automatic_off(
    camera: &impl Requests,
    ruled: Ruled,
) -> std::result::Result<(), Unset> {
    match set(camera, ruled.automatic, ruled.off) {
        Ok(_) | Err(Unset::Missing) => Ok(()),
        Err(error) => Err(error),
    }
}

/// What a value is now, if the camera has it.
pub(super) fn reading(camera: &impl Requests, ruled: Ruled) -> Option<i32> {
    get(camera, ruled.value).ok()
}
