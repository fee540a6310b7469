//! From the written building to solids: walls cut at their doors, leaves hung, furniture placed.

use occgrid::{Point2, Pose2};

use super::building::{Block, Building, Cylinder, Door, Hinge, Poster, Side, Texture, Wall};
use super::check::{self, within};
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
    check::building(building)?;
    for (index, wall) in building.walls.iter().enumerate() {
        let place = format!("walls[{index}]");
        check::wall(wall, &place)?;
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
        check::walker(walker, &format!("people[{index}]"))?;
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
    check::block(block, place)?;
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
    check::cylinder(cylinder, place)?;
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
