//! Corridors as the simulator draws them: its camera, walls and textures share nothing with this crate.

use image::GrayImage;
use mobot_hw::sim::{
    Block, Building, CameraModel, Door, Floor, Hinge, Lamp, Look, Patch, Poster, Renderer, Side,
    Texture, Wall, World,
};
use monocal::FloorPlan;
use occgrid::{Point2, Pose2};
use rand::RngExt as _;
use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;

/// A rendered frame and the truth about it.
pub(crate) struct Shot {
    pub(crate) image: GrayImage,
    pub(crate) plan: FloorPlan,
    pub(crate) map_from_base: Pose2,
    /// The camera, nodding as it did.
    pub(crate) eye: CameraModel,
    /// Door number of each door corner of the plan.
    pub(crate) door_of: Vec<usize>,
    /// Whether the camera sees each door corner of the plan.
    pub(crate) visible: Vec<bool>,
}

/// One sigma of how far the camera rolls [rad].
const ROLL: f64 = 0.2 * std::f64::consts::PI / 180.0;

/// A corridor of random width with random doors, textures, light and clutter, from a random place in it, by
/// the paper's camera nodding by up to one degree and rolling; it lies along x, along y or slanted in the map.
pub(crate) fn shot(rng: &mut Pcg64, seed: u64) -> Shot {
    let width = rng.random_range(1.7..2.6);
    let thickness = 0.12;
    let mut building = Building {
        floor: floor(rng, width),
        ambient: rng.random_range(0.4..0.7),
        lamps: (0..6)
            .map(|k| Lamp {
                at: [f64::from(k) * 3.0 + rng.random_range(-0.5..0.5), 0.0],
                power: rng.random_range(0.8..1.6),
                ..Lamp::default()
            })
            .collect(),
        ..Building::default()
    };
    let look = wall_look(rng);
    for side in [1.0, -1.0] {
        let y = side * (width / 2.0 + thickness / 2.0);
        building.walls.push(Wall {
            from: [-2.0, y],
            to: [18.0, y],
            thickness,
            doors: doors(rng),
            posters: posters(rng, side),
            ..look.clone()
        });
    }
    for x in [-2.0, 18.0] {
        let half = width / 2.0 + thickness;
        building.walls.push(Wall {
            from: [x, -half],
            to: [x, half],
            thickness,
            ..look.clone()
        });
    }
    for _ in 0..rng.random_range(0..3) {
        let side = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        building.boxes.push(Block {
            at: [
                rng.random_range(2.0..14.0),
                side * (width / 2.0 - rng.random_range(0.15..0.25)),
            ],
            size: [rng.random_range(0.2..0.8), 0.3],
            height: rng.random_range(0.3..1.2),
            brightness: rng.random_range(0.2..0.9),
            ..Block::default()
        });
    }
    let world = World::new(&building).expect("a building");
    let corridor_from_base = Pose2::new(
        rng.random_range(0.0..10.0),
        rng.random_range(-0.25..0.25) * width / 2.0,
        rng.random_range(-0.25..0.25),
    );
    let mut camera = CameraModel::paper();
    camera.tilt += rng.random_range(-1.0..1.0_f64).to_radians();
    let sensor = Look {
        noise: rng.random_range(1.0..3.0),
        blur_px: rng.random_range(0.5..1.0),
        ..Look::default()
    };
    let rolls: f64 = StandardNormal.sample(rng);
    camera.roll += ROLL * rolls;
    let mut renderer = Renderer::new(camera, sensor).expect("a camera");
    let image = renderer.render(&world, corridor_from_base, 0.0, seed);
    let seen = renderer.door_corners(&world, corridor_from_base, 0.0);
    let corners = world.door_corners();
    // the building is drawn along x; where it lies in the map is nothing to the picture
    let along = match rng.random_range(0..4) {
        0 => 0.0,
        1 => std::f64::consts::FRAC_PI_2,
        _ => rng.random_range(-3.1..3.1),
    };
    let map_from_corridor = Pose2::new(
        rng.random_range(-9.0..9.0),
        rng.random_range(-9.0..9.0),
        along,
    );
    let mut plan = plan(&building, &world);
    for point in plan
        .walls
        .iter_mut()
        .flatten()
        .chain(&mut plan.door_corners)
    {
        *point = map_from_corridor.transform_from(*point);
    }
    Shot {
        image,
        eye: *renderer.camera(),
        door_of: corners.iter().map(|c| c.door).collect(),
        visible: corners
            .iter()
            .map(|c| seen.iter().any(|s| s.corner == *c))
            .collect(),
        plan,
        map_from_base: map_from_corridor.compose(corridor_from_base),
    }
}

/// What a person would draw: the faces of the walls, and the corners of the doors.
fn plan(building: &Building, world: &World) -> FloorPlan {
    let mut walls = Vec::new();
    for wall in &building.walls {
        let (from, to) = (wall.from, wall.to);
        let length = (to[0] - from[0]).hypot(to[1] - from[1]);
        let half = 0.5 * wall.thickness / length;
        let across = [(from[1] - to[1]) * half, (to[0] - from[0]) * half];
        for sign in [1.0, -1.0] {
            let face = |p: [f64; 2]| Point2::new(p[0] + sign * across[0], p[1] + sign * across[1]);
            walls.push([face(from), face(to)]);
        }
    }
    FloorPlan {
        walls,
        door_corners: world.door_corners().iter().map(|c| c.position).collect(),
    }
}

fn floor(rng: &mut Pcg64, width: f64) -> Floor {
    let contrast = rng.random_range(0.05..0.25);
    let texture = match rng.random_range(0..4) {
        0 => Texture::Plain,
        1 => Texture::Tiles {
            size: rng.random_range(0.25..0.5),
            joint: 0.006,
            contrast,
        },
        _ => Texture::Speckle {
            grain: rng.random_range(0.01..0.03),
            contrast,
        },
    };
    let patches = (0..rng.random_range(0..4)).map(|_| Patch {
        at: [
            rng.random_range(1.0..14.0),
            rng.random_range(-0.5..0.5) * width,
        ],
        size: [rng.random_range(0.3..1.5), rng.random_range(0.3..1.0)],
        yaw_deg: rng.random_range(0.0..90.0),
        factor: rng.random_range(0.5..1.4),
        softness: rng.random_range(0.0..0.15),
    });
    Floor {
        patches: patches.collect(),
        brightness: rng.random_range(0.3..0.65),
        texture,
    }
}

fn wall_look(rng: &mut Pcg64) -> Wall {
    let brightness = rng.random_range(0.45..0.9);
    Wall {
        brightness,
        texture: match rng.random_range(0..3) {
            0 => Texture::Speckle {
                grain: 0.01,
                contrast: 0.06,
            },
            _ => Texture::Plain,
        },
        skirting: if rng.random_bool(0.7) { 0.08 } else { 0.0 },
        skirting_brightness: rng.random_range(0.1..0.35),
        ..Wall::default()
    }
}

fn doors(rng: &mut Pcg64) -> Vec<Door> {
    let mut doors = Vec::new();
    let mut at = rng.random_range(0.5..2.5);
    while at < 18.5 {
        let width = rng.random_range(0.8..1.0);
        let closed = rng.random_bool(0.7);
        doors.push(Door {
            at,
            width,
            frame: if rng.random_bool(0.8) { 0.07 } else { 0.0 },
            frame_brightness: rng.random_range(0.1..0.4),
            hinge: if closed || rng.random_bool(0.5) {
                Hinge::Near
            } else {
                Hinge::None
            },
            swing: if rng.random_bool(0.5) {
                Side::Left
            } else {
                Side::Right
            },
            open_deg: if closed {
                0.0
            } else {
                rng.random_range(60.0..100.0)
            },
            brightness: rng.random_range(0.2..0.8),
            ..Door::default()
        });
        at += width + rng.random_range(0.8..2.5);
    }
    doors
}

fn posters(rng: &mut Pcg64, side: f64) -> Vec<Poster> {
    (0..rng.random_range(0..4))
        .map(|_| Poster {
            at: rng.random_range(0.0..19.0),
            bottom: rng.random_range(0.15..1.0),
            brightness: rng.random_range(0.1..0.9),
            side: if side > 0.0 { Side::Right } else { Side::Left },
            ..Poster::default()
        })
        .collect()
}
