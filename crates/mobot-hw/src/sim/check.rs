//! Which numbers of a building make sense.

use super::building::{Block, Building, Cylinder, Door, Texture, Walker, Wall};
use super::world::WorldError;
use crate::real::length;

/// Everything apart from walls and things, which are checked one by one.
pub(crate) fn building(building: &Building) -> Result<(), WorldError> {
    for (index, value) in building.start.iter().enumerate() {
        within(*value, -1e5..=1e5, "finite, up to 100000", || {
            format!("start[{index}]")
        })?;
    }
    within(building.ceiling, 0.1..=100.0, "0.1 to 100 m", || {
        "ceiling".to_owned()
    })?;
    within(building.ambient, 0.0..=10.0, "0 to 10", || {
        "ambient".to_owned()
    })?;
    for (what, count, most) in [
        ("lamps", building.lamps.len(), 10_000.0),
        ("floor.patches", building.floor.patches.len(), 1_000.0),
        ("people", building.people.len(), 1_000.0),
    ] {
        within(count as f64, 0.0..=most, "fewer of them", || {
            what.to_owned()
        })?;
    }
    floor(building)
}

pub(crate) fn within(
    value: f64,
    range: std::ops::RangeInclusive<f64>,
    expected: &'static str,
    what: impl Fn() -> String,
) -> Result<(), WorldError> {
    if range.contains(&value) {
        return Ok(());
    }
    Err(WorldError::Value {
        what: what(),
        expected,
        found: value,
    })
}

pub(crate) fn paint(brightness: f64, texture: &Texture, place: &str) -> Result<(), WorldError> {
    within(brightness, 0.0..=1.0, "0 to 1", || {
        format!("{place}.brightness")
    })?;
    let (size, rest) = match *texture {
        Texture::Plain => return Ok(()),
        Texture::Tiles {
            size,
            joint,
            contrast,
        } => (size, [joint / size, contrast]),
        Texture::Speckle { grain, contrast } => (grain, [contrast, 0.0]),
        Texture::Stripes {
            period,
            contrast,
            angle,
        } => (period, [contrast, (angle / 100.0).abs()]),
    };
    within(size, 1e-3..=1e4, "0.001 to 10000 m", || {
        format!("{place}.texture's size")
    })?;
    for value in rest {
        within(
            value,
            0.0..=1.0,
            "joint below size, contrast 0 to 1",
            || format!("{place}.texture"),
        )?;
    }
    Ok(())
}

fn floor(building: &Building) -> Result<(), WorldError> {
    paint(building.floor.brightness, &building.floor.texture, "floor")?;
    for (index, patch) in building.floor.patches.iter().enumerate() {
        let place = || format!("floor.patches[{index}]");
        for value in patch.at.iter().chain([&patch.yaw_deg]) {
            within(*value, -1e5..=1e5, "finite, up to 100000", place)?;
        }
        for value in patch.size.iter().chain([&patch.softness, &patch.factor]) {
            within(*value, 0.0..=1e4, "0 to 10000", place)?;
        }
    }
    for (index, lamp) in building.lamps.iter().enumerate() {
        let place = || format!("lamps[{index}]");
        for value in lamp.at {
            within(value, -1e5..=1e5, "finite, up to 100000", place)?;
        }
        within(lamp.height, 1e-3..=100.0, "0.001 to 100 m", place)?;
        within(lamp.power, 0.0..=1e3, "0 to 1000", place)?;
    }
    Ok(())
}

pub(crate) fn wall(wall: &Wall, place: &str) -> Result<(), WorldError> {
    for value in wall.from.iter().chain(&wall.to) {
        within(*value, -1e5..=1e5, "finite, up to 100000", || {
            format!("{place}.from or to")
        })?;
    }
    let long = length(wall.to[0] - wall.from[0], wall.to[1] - wall.from[1]);
    within(long, 1e-3..=1e4, "points 0.001 to 10000 m apart", || {
        place.to_owned()
    })?;
    within(wall.height, 0.0..=100.0, "0 to 100 m", || {
        format!("{place}.height")
    })?;
    within(wall.thickness, 0.0..=10.0, "0 to 10 m", || {
        format!("{place}.thickness")
    })?;
    within(wall.skirting, 0.0..=10.0, "0 to 10 m", || {
        format!("{place}.skirting")
    })?;
    within(wall.skirting_brightness, 0.0..=1.0, "0 to 1", || {
        format!("{place}.skirting_brightness")
    })?;
    paint(wall.brightness, &wall.texture, place)?;
    let decorations = wall.doors.len().max(wall.posters.len());
    within(
        decorations as f64,
        0.0..=1_000.0,
        "at most 1000 doors, 1000 posters",
        || place.to_owned(),
    )?;
    for (index, door) in wall.doors.iter().enumerate() {
        check_door(door, &format!("{place}.doors[{index}]"))?;
    }
    for (index, poster) in wall.posters.iter().enumerate() {
        let place = || format!("{place}.posters[{index}]");
        for value in [poster.at, poster.width, poster.bottom, poster.height] {
            within(value, -1e4..=1e4, "finite, up to 10000 m", place)?;
        }
        within(poster.brightness, 0.0..=1.0, "0 to 1", place)?;
    }
    Ok(())
}

fn check_door(door: &Door, place: &str) -> Result<(), WorldError> {
    within(door.width, 1e-2..=100.0, "0.01 to 100 m", || {
        format!("{place}.width")
    })?;
    within(door.height, 1e-2..=100.0, "0.01 to 100 m", || {
        format!("{place}.height")
    })?;
    within(door.frame, 0.0..=1.0, "0 to 1 m", || {
        format!("{place}.frame")
    })?;
    within(door.open_deg, 0.0..=180.0, "0 to 180", || {
        format!("{place}.open_deg")
    })?;
    within(door.frame_brightness, 0.0..=1.0, "0 to 1", || {
        format!("{place}.frame_brightness")
    })?;
    within(door.brightness, 0.0..=1.0, "0 to 1", || {
        format!("{place}.brightness")
    })
}

pub(crate) fn walker(walker: &Walker, place: &str) -> Result<(), WorldError> {
    within(
        walker.way.len() as f64,
        2.0..=1e4,
        "2 to 10000 points",
        || format!("{place}.way"),
    )?;
    for value in walker.way.iter().flatten().chain([&walker.start]) {
        within(*value, -1e5..=1e5, "finite, up to 100000", || {
            format!("{place}.way or start")
        })?;
    }
    within(walker.speed, 0.0..=100.0, "0 to 100 m/s", || {
        format!("{place}.speed")
    })?;
    within(walker.keeps, 0.0..=100.0, "0 to 100 m", || {
        format!("{place}.keeps")
    })?;
    for value in walker.brightness {
        within(value, 0.0..=1.0, "0 to 1", || format!("{place}.brightness"))?;
    }
    Ok(())
}

pub(crate) fn block(block: &Block, place: &str) -> Result<(), WorldError> {
    for value in block.at.iter().chain([&block.yaw_deg]) {
        within(*value, -1e5..=1e5, "finite, up to 100000", || {
            format!("{place}.at or yaw_deg")
        })?;
    }
    for value in block.size {
        within(value, 1e-3..=1e4, "0.001 to 10000 m", || {
            format!("{place}.size")
        })?;
    }
    within(block.bottom, 0.0..=100.0, "0 to 100 m", || {
        format!("{place}.bottom")
    })?;
    within(
        block.height,
        block.bottom + 1e-3..=100.0,
        "above its bottom",
        || format!("{place}.height"),
    )?;
    paint(block.brightness, &block.texture, place)?;
    Ok(())
}

pub(crate) fn cylinder(cylinder: &Cylinder, place: &str) -> Result<(), WorldError> {
    for value in cylinder.at {
        within(value, -1e5..=1e5, "finite, up to 100000", || {
            format!("{place}.at")
        })?;
    }
    within(cylinder.radius, 1e-3..=1e4, "0.001 to 10000 m", || {
        format!("{place}.radius")
    })?;
    within(cylinder.height, 1e-3..=100.0, "0.001 to 100 m", || {
        format!("{place}.height")
    })?;
    paint(cylinder.brightness, &cylinder.texture, place)?;
    Ok(())
}
