//! From the written building to solids: walls cut at their doors, leaves hung, furniture placed.

use occgrid::{Point2, Pose2};

use super::building::{
    Block, Building, Cylinder, Door, Hinge, Poster, Side, Texture, Walker, Wall,
};
use super::solid::{ALL_SIDES, Band, Finish, Footprint, Solid};
use super::world::{CornerKind, DoorCorner, WorldError};
use crate::real::{Placed, atan2, length};

/// Thickness of a door's leaf [m].
const LEAF: f64 = 0.04;

#[derive(Default)]
pub(crate) struct Raised {
    pub(crate) solids: Vec<Solid>,
    pub(crate) corners: Vec<DoorCorner>,
    doors: usize,
}

pub(crate) fn raise(building: &Building) -> Result<Raised, WorldError> {
    let mut raised = Raised::default();
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
    check_floor(building)?;
    for (index, wall) in building.walls.iter().enumerate() {
        let place = format!("walls[{index}]");
        check_wall(wall, &place)?;
        raised.wall(wall, building.ceiling, &place)?;
    }
    for (index, block) in building.boxes.iter().enumerate() {
        raised
            .solids
            .push(furniture(block, &format!("boxes[{index}]"))?);
    }
    for (index, cylinder) in building.cylinders.iter().enumerate() {
        raised
            .solids
            .push(round(cylinder, &format!("cylinders[{index}]"))?);
    }
    for (index, walker) in building.people.iter().enumerate() {
        check_walker(walker, &format!("people[{index}]"))?;
    }
    Ok(raised)
}

impl Raised {
    fn wall(&mut self, wall: &Wall, ceiling: f64, place: &str) -> Result<(), WorldError> {
        let line = Line::of(wall);
        let top = if wall.height > 0.0 {
            wall.height
        } else {
            ceiling
        };
        let mut doors: Vec<&Door> = wall.doors.iter().collect();
        doors.sort_by(|a, b| a.at.total_cmp(&b.at));
        let mut begin = -wall.thickness / 2.0;
        let mut free_from = 0.0;
        for door in &doors {
            within(
                door.at,
                free_from..=line.length - door.width,
                "a free part of its wall",
                || format!("{place}.doors at"),
            )?;
            self.piece(wall, &line, [begin, door.at], [0.0, top]);
            if door.height < top {
                self.piece(
                    wall,
                    &line,
                    [door.at, door.at + door.width],
                    [door.height, top],
                );
            }
            self.leaf(wall, &line, door);
            self.corners_of(wall, &line, door);
            begin = door.at + door.width;
            free_from = begin;
        }
        self.piece(
            wall,
            &line,
            [begin, line.length + wall.thickness / 2.0],
            [0.0, top],
        );
        Ok(())
    }

    /// The part of a wall between two places along it and two heights.
    fn piece(&mut self, wall: &Wall, line: &Line, along: [f64; 2], up: [f64; 2]) {
        let (middle, half) = ((along[0] + along[1]) / 2.0, (along[1] - along[0]) / 2.0);
        if half <= 0.0 {
            return;
        }
        let mut bands = Vec::new();
        if wall.skirting > up[0] {
            bands.push(Band {
                sides: ALL_SIDES,
                along: [f64::NEG_INFINITY, f64::INFINITY],
                up: [0.0, wall.skirting],
                brightness: wall.skirting_brightness,
            });
        }
        bands.extend(wall.posters.iter().map(poster));
        for door in &wall.doors {
            bands.extend(frame(door, along));
        }
        bands.retain(|b| {
            b.along[0] < along[1] && b.along[1] > along[0] && b.up[0] < up[1] && b.up[1] > up[0]
        });
        self.solids.push(Solid {
            footprint: Footprint::Block {
                placed: line.at(middle, 0.0, 0.0),
                half: [half, wall.thickness / 2.0],
            },
            bottom: up[0],
            top: up[1],
            finish: Finish {
                brightness: wall.brightness,
                texture: wall.texture,
                along: middle,
                bands,
            },
            backed: false,
        });
    }

    fn leaf(&mut self, wall: &Wall, line: &Line, door: &Door) {
        let side = sign(door.swing);
        let (pivot, reach) = match door.hinge {
            Hinge::None => return,
            Hinge::Near => (door.at, door.width / 2.0),
            Hinge::Far => (door.at + door.width, -door.width / 2.0),
        };
        let hinge = line.at(
            pivot,
            side * wall.thickness / 2.0,
            side * reach.signum() * door.open_deg.to_radians(),
        );
        let placed = hinge.compose(&Placed::at(Pose2::new(reach, -side * LEAF / 2.0, 0.0)));
        self.solids.push(Solid {
            footprint: Footprint::Block {
                placed,
                half: [door.width / 2.0, LEAF / 2.0],
            },
            bottom: 0.0,
            top: door.height,
            finish: Finish::plain(door.brightness, Texture::Plain),
            backed: false,
        });
    }

    fn corners_of(&mut self, wall: &Wall, line: &Line, door: &Door) {
        let mut edges = vec![
            (CornerKind::Opening, door.at),
            (CornerKind::Opening, door.at + door.width),
        ];
        if door.frame > 0.0 {
            edges.push((CornerKind::Frame, door.at - door.frame));
            edges.push((CornerKind::Frame, door.at + door.width + door.frame));
        }
        for side in [1.0, -1.0] {
            for (kind, along) in &edges {
                let place = line.at(*along, side * wall.thickness / 2.0, 0.0);
                self.corners.push(DoorCorner {
                    position: place.origin,
                    kind: *kind,
                    door: self.doors,
                    facing: place.turned(Point2::new(0.0, side)),
                });
            }
        }
        self.doors += 1;
    }
}

/// The centre line of a wall.
struct Line {
    from: Placed,
    length: f64,
}

impl Line {
    fn of(wall: &Wall) -> Self {
        let (dx, dy) = (wall.to[0] - wall.from[0], wall.to[1] - wall.from[1]);
        Self {
            from: Placed::at(Pose2::new(wall.from[0], wall.from[1], atan2(dy, dx))),
            length: length(dx, dy),
        }
    }

    /// A frame at a place along and across the wall, turned from the wall's direction.
    fn at(&self, along: f64, across: f64, turn: f64) -> Placed {
        self.from
            .compose(&Placed::at(Pose2::new(along, across, turn)))
    }
}

fn sign(side: Side) -> f64 {
    match side {
        Side::Left => 1.0,
        Side::Right => -1.0,
    }
}

fn poster(poster: &Poster) -> Band {
    Band {
        sides: match poster.side {
            Side::Left => 0b0100,
            Side::Right => 0b1000,
        },
        along: [poster.at, poster.at + poster.width],
        up: [poster.bottom, poster.bottom + poster.height],
        brightness: poster.brightness,
    }
}

/// A door's frame on the piece of wall that covers `along`: both jambs, the head, and the reveals.
fn frame(door: &Door, along: [f64; 2]) -> Vec<Band> {
    if door.frame <= 0.0 {
        return Vec::new();
    }
    let (near, far) = (door.at, door.at + door.width);
    let band = |sides, along, up| Band {
        sides,
        along,
        up,
        brightness: door.frame_brightness,
    };
    let head = door.height + door.frame;
    let faces = 0b1100;
    let mut bands = vec![
        band(faces, [near - door.frame, near], [0.0, head]),
        band(faces, [far, far + door.frame], [0.0, head]),
        band(
            faces,
            [near - door.frame, far + door.frame],
            [door.height, head],
        ),
    ];
    let everywhere = [f64::NEG_INFINITY, f64::INFINITY];
    if along[1] <= near && near - along[1] < 1e-9 {
        bands.push(band(0b0001, everywhere, [0.0, head]));
    }
    if along[0] >= far && along[0] - far < 1e-9 {
        bands.push(band(0b0010, everywhere, [0.0, head]));
    }
    bands
}

fn furniture(block: &Block, place: &str) -> Result<Solid, WorldError> {
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
    check_paint(block.brightness, &block.texture, place)?;
    let [x, y] = block.at;
    Ok(Solid {
        footprint: Footprint::Block {
            placed: Placed::at(Pose2::new(x, y, block.yaw_deg.to_radians())),
            half: block.size.map(|s| s / 2.0),
        },
        bottom: block.bottom,
        top: block.height,
        finish: Finish::plain(block.brightness, block.texture),
        backed: false,
    })
}

fn round(cylinder: &Cylinder, place: &str) -> Result<Solid, WorldError> {
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
    check_paint(cylinder.brightness, &cylinder.texture, place)?;
    let [x, y] = cylinder.at;
    Ok(Solid {
        footprint: Footprint::Disc {
            center: Point2::new(x, y),
            radius: cylinder.radius,
        },
        bottom: 0.0,
        top: cylinder.height,
        finish: Finish::plain(cylinder.brightness, cylinder.texture),
        backed: false,
    })
}

fn within(
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

fn check_paint(brightness: f64, texture: &Texture, place: &str) -> Result<(), WorldError> {
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

fn check_floor(building: &Building) -> Result<(), WorldError> {
    check_paint(building.floor.brightness, &building.floor.texture, "floor")?;
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

fn check_wall(wall: &Wall, place: &str) -> Result<(), WorldError> {
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
    check_paint(wall.brightness, &wall.texture, place)?;
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

fn check_walker(walker: &Walker, place: &str) -> Result<(), WorldError> {
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
    for value in walker.brightness {
        within(value, 0.0..=1.0, "0 to 1", || format!("{place}.brightness"))?;
    }
    Ok(())
}
