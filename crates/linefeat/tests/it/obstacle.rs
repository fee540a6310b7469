//! Moving things in rendered scenes, against where they truly are.

use std::collections::BTreeSet;
use std::ops::Range;

use image::GrayImage;
use linefeat::{FloorState, FloorView, ObstacleParams, ObstacleTracker, Track};
use mobot_hw::sim::{
    Block, Building, CameraModel, Cylinder, Floor, Lamp, Look, Renderer, Texture, Walker, Wall,
    World,
};
use occgrid::{Point2, Pose2};

/// Frames a second.
const RATE: f64 = 10.0;

/// The view of a camera without lens distortion, by the pinhole's equations.
pub(crate) fn view_of(camera: &CameraModel) -> FloorView {
    let (st, ct) = camera.tilt.sin_cos();
    let (h, f) = (camera.mount_height, camera.fx);
    let [cx, cy] = [camera.cx, camera.cy];
    // pixel ~ floor_to_pixel (x, y, 1): depth is ct x + st h
    let depth = [ct, 0.0, st * h];
    let floor_to_pixel = [
        [cx * depth[0], -f, cx * depth[2]],
        [cy * depth[0] - f * st, 0.0, cy * depth[2] + f * ct * h],
        depth,
    ];
    let mut pixel_to_floor = inverse(floor_to_pixel);
    let bottom = pixel_to_floor[2][1] * f64::from(camera.height) + pixel_to_floor[2][2];
    if bottom < 0.0 {
        pixel_to_floor = pixel_to_floor.map(|row| row.map(|c| -c));
    }
    FloorView {
        pixel_to_floor,
        nadir: [cx * st, cy * st + f * ct, st],
    }
}

fn inverse(m: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let cofactor = |r: usize, c: usize| {
        let [r0, r1] = [(r + 1) % 3, (r + 2) % 3];
        let [c0, c1] = [(c + 1) % 3, (c + 2) % 3];
        m[r0][c0] * m[r1][c1] - m[r0][c1] * m[r1][c0]
    };
    let determinant: f64 = (0..3).map(|c| m[0][c] * cofactor(0, c)).sum();
    std::array::from_fn(|i| std::array::from_fn(|j| cofactor(j, i) / determinant))
}

/// A hall of 9 by 7 metres, its near left corner at (-1, -3.5).
fn hall(texture: Texture) -> Building {
    let corners = [
        [-1.0, -3.5],
        [8.0, -3.5],
        [8.0, 3.5],
        [-1.0, 3.5],
        [-1.0, -3.5],
    ];
    Building {
        floor: Floor {
            brightness: 0.55,
            texture,
            ..Floor::default()
        },
        ambient: 0.6,
        lamps: vec![
            Lamp {
                at: [2.0, 1.0],
                ..Lamp::default()
            },
            Lamp {
                at: [6.0, -1.0],
                ..Lamp::default()
            },
        ],
        walls: corners
            .windows(2)
            .map(|w| Wall {
                from: w[0],
                to: w[1],
                ..Wall::default()
            })
            .collect(),
        ..Building::default()
    }
}

fn textures() -> [Texture; 3] {
    [
        Texture::Speckle {
            grain: 0.03,
            contrast: 0.15,
        },
        Texture::Tiles {
            size: 0.4,
            joint: 0.008,
            contrast: 0.3,
        },
        Texture::Plain,
    ]
}

/// What the map knows: the hall's floor, and nothing about what came later.
fn map_of_hall([x, y]: [f64; 2]) -> FloorState {
    if x > -0.9 && x < 7.9 && y.abs() < 3.4 {
        FloorState::Free
    } else {
        FloorState::Solid
    }
}

fn nothing_known(_: [f64; 2]) -> FloorState {
    FloorState::Unknown
}

/// One thing of the size of a person on a straight way.
#[derive(Clone, Copy, Debug)]
struct Mover {
    from: [f64; 2],
    velocity: [f64; 2],
    size: [f64; 2],
    brightness: f64,
}

impl Mover {
    fn at(&self, time: f64) -> [f64; 2] {
        std::array::from_fn(|i| self.from[i] + self.velocity[i] * time)
    }

    fn block(&self, time: f64) -> Block {
        Block {
            at: self.at(time),
            size: self.size,
            height: 1.7,
            brightness: self.brightness,
            ..Block::default()
        }
    }
}

/// Something repeatable between 0 and 1.
fn mixed(seed: u64) -> f64 {
    let mut z = seed
        .wrapping_mul(0x9E37_79B9_7F4A_7C15)
        .wrapping_add(0x1234_5678_9ABC_DEF1);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

/// Runs a scene of `seconds` and hands every frame's tracks to `judge`.
fn run(
    camera: &CameraModel,
    seconds: f64,
    seed: u64,
    building: impl Fn(f64) -> Building,
    pose: impl Fn(f64) -> Pose2,
    floor: &dyn Fn([f64; 2]) -> FloorState,
    mut judge: impl FnMut(f64, &ObstacleTracker, &GrayImage),
) {
    let mut renderer = Renderer::new(*camera, Look::default()).expect("valid");
    let mut tracker = ObstacleTracker::new(view_of(camera), ObstacleParams::default());
    for i in 0..(seconds * RATE) as u64 {
        let time = i as f64 / RATE;
        let world = World::new(&building(time)).expect("valid");
        let at = pose(time);
        let frame = renderer.render(&world, at, time, seed * 10_007 + i);
        // odometry: a little noise on every pose
        let off = |k: u64, scale: f64| (mixed(seed * 31 + i * 7 + k) - 0.5) * scale;
        let odometry = [
            at.x + off(1, 0.004),
            at.y + off(2, 0.004),
            at.theta + off(3, 0.002),
        ];
        tracker.update(&frame, time, odometry, floor);
        judge(time, &tracker, &frame);
    }
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

#[test]
fn the_view_is_the_camera_s() {
    let camera = CameraModel::paper();
    let view = view_of(&camera);
    for point in [[2.0, 0.0], [3.0, 0.8], [5.5, -1.2]] {
        let pixel = camera
            .pixel_of(Pose2::default(), Point2::new(point[0], point[1]), 0.0)
            .expect("valid");
        assert!(distance(view.floor_point(pixel).expect("valid"), point) < 1e-9);
    }
    assert!(distance(view.camera_foot(), [0.0, 0.0]) < 1e-9);
    // above the horizon there is no floor
    assert_eq!(view.floor_point([240.0, -1000.0]), None);
}

/// Ways that stay in sight of the paper's camera for two seconds, passing 3 m ahead.
fn ways(seed: u64) -> Mover {
    let m = |k: u64| mixed(seed * 101 + k);
    let speed = 0.4 + 1.1 * m(0);
    let side = if m(1) < 0.5 { 1.0 } else { -1.0 };
    let across = m(2) < 0.6;
    let (from, velocity) = if across {
        let x = 2.8 + 0.7 * m(3);
        (
            [x, -side * 0.9 * speed],
            [0.15 * (m(4) - 0.5), side * speed],
        )
    } else {
        let toward = if m(5) < 0.5 { 1.0 } else { -1.0 };
        let y = 1.2 * (m(3) - 0.5);
        (
            [3.4 + toward * 0.9 * speed, y],
            [-toward * speed, 0.3 * (m(4) - 0.5)],
        )
    };
    Mover {
        from,
        velocity,
        size: [0.3 + 0.2 * m(6), 0.3 + 0.2 * m(7)],
        brightness: if m(8) < 0.5 { 0.15 } else { 0.85 },
    }
}

#[derive(Debug, Default)]
struct Score {
    position: Vec<f64>,
    velocity: Vec<f64>,
    nees: Vec<f64>,
    late: u32,
    things: u32,
    false_tracks: BTreeSet<u32>,
}

fn percentile(values: &[f64], p: f64) -> f64 {
    let mut v = values.to_vec();
    v.sort_by(f64::total_cmp);
    v[((v.len() - 1) as f64 * p) as usize]
}

fn watch(
    camera: &CameraModel,
    movers: &[Mover],
    drive: [f64; 2],
    texture: Texture,
    seed: u64,
    score: &mut Score,
) {
    let seconds = 2.1;
    let pose = |t: f64| {
        let theta = drive[1] * t;
        let (s, c) = (0.5 * theta).sin_cos();
        Pose2::new(drive[0] * t * c, drive[0] * t * s, theta)
    };
    let mut known = vec![false; movers.len()];
    run(
        camera,
        seconds,
        seed,
        |t| {
            let mut b = hall(texture);
            b.boxes.extend(movers.iter().map(|m| m.block(t)));
            b
        },
        pose,
        &map_of_hall,
        |t, tracker, _| {
            for track in tracker.moving() {
                let of = |m: &&Mover| distance(m.at(t), track.position);
                let Some(mover) = movers.iter().min_by(|a, b| of(a).total_cmp(&of(b))) else {
                    score.false_tracks.insert(track.id);
                    continue;
                };
                if of(&mover) > 0.6 {
                    score.false_tracks.insert(track.id);
                }
            }
            for (i, m) in movers.iter().enumerate() {
                let near: Option<&Track> = tracker
                    .moving()
                    .filter(|track| distance(m.at(t), track.position) < 0.6)
                    .min_by(|a, b| {
                        distance(m.at(t), a.position).total_cmp(&distance(m.at(t), b.position))
                    });
                // a second after it came into sight
                if let Some(track) = near {
                    known[i] = true;
                    if t >= 1.0 - 1e-9 && is_whole(camera, pose(t), m, t) {
                        let range = distance(m.at(t), [pose(t).x, pose(t).y]);
                        if range < 3.7 && range > 2.3 {
                            let off = [
                                track.position[0] - m.at(t)[0],
                                track.position[1] - m.at(t)[1],
                                track.velocity[0] - m.velocity[0],
                                track.velocity[1] - m.velocity[1],
                            ];
                            score.position.push(off[0].hypot(off[1]));
                            score.velocity.push(off[2].hypot(off[3]));
                            score.nees.push(mahalanobis(&track.covariance, off));
                        }
                    }
                }
            }
        },
    );
    score.things += movers.len() as u32;
    score.late += known.iter().filter(|k| !**k).count() as u32;
}

/// Whether the picture shows the whole foot of a mover, now and as it was when it was compared with.
fn is_whole(camera: &CameraModel, pose: Pose2, mover: &Mover, time: f64) -> bool {
    [time, time - 0.2].iter().all(|&time| {
        let [x, y] = mover.at(time);
        [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)]
            .iter()
            .all(|(a, b)| {
                let corner = Point2::new(x + a * mover.size[0] / 2.0, y + b * mover.size[1] / 2.0);
                camera.pixel_of(pose, corner, 0.0).is_some_and(|[u, v]| {
                    u > 4.0
                        && u < f64::from(camera.width) - 5.0
                        && v < f64::from(camera.height) - 5.0
                })
            })
    })
}

/// x^T P^-1 x by Gaussian elimination.
fn mahalanobis(p: &[[f64; 4]; 4], x: [f64; 4]) -> f64 {
    let mut rows: Vec<[f64; 5]> = (0..4)
        .map(|i| [p[i][0], p[i][1], p[i][2], p[i][3], x[i]])
        .collect();
    for i in 0..4 {
        for j in i + 1..4 {
            let factor = rows[j][i] / rows[i][i];
            let above = rows[i];
            for (entry, above) in rows[j].iter_mut().zip(above).skip(i) {
                *entry -= factor * above;
            }
        }
    }
    let mut y = [0.0; 4];
    for i in (0..4).rev() {
        let rest: f64 = (i + 1..4).map(|j| rows[i][j] * y[j]).sum();
        y[i] = (rows[i][4] - rest) / rows[i][i];
    }
    (0..4).map(|i| x[i] * y[i]).sum()
}

/// Seeds of scenes; those of the long run are not those that anything was tuned on.
fn scenes() -> Range<u64> {
    if std::env::var_os("MOBOT_LONG").is_some() {
        120..240
    } else {
        0..12
    }
}

#[test]
fn one_or_two_moving_boxes_are_found_where_they_are() {
    let mut score = Score::default();
    for seed in scenes() {
        let camera = if seed % 2 == 0 {
            CameraModel::paper()
        } else {
            CameraModel::vga()
        };
        let mut movers = vec![ways(seed)];
        if seed % 3 == 0 {
            let other = ways(seed + 1000);
            let apart = |t: f64| distance(movers[0].at(t), other.at(t));
            if (0..22).all(|i| apart(f64::from(i) / 10.0) > 1.2) {
                movers.push(other);
            }
        }
        let drive = [[0.0, 0.0], [0.3, 0.0], [0.2, 0.2]][(seed % 3) as usize];
        let texture = textures()[(seed / 2 % 3) as usize];
        watch(&camera, &movers, drive, texture, seed, &mut score);
    }
    let within = score.position.iter().filter(|&&off| off <= 0.10).count();
    println!("{within} of {} looks within 10 cm", score.position.len());
    println!(
        "{} things, {} never known; position mean {:.3} median {:.3} 95 % {:.3} max {:.3}; velocity mean {:.3} 95 % {:.3} max {:.3}; nees mean {:.2}; false {:?}; {} looks",
        score.things,
        score.late,
        score.position.iter().sum::<f64>() / score.position.len() as f64,
        percentile(&score.position, 0.5),
        percentile(&score.position, 0.95),
        percentile(&score.position, 1.0),
        score.velocity.iter().sum::<f64>() / score.velocity.len() as f64,
        percentile(&score.velocity, 0.95),
        percentile(&score.velocity, 1.0),
        score.nees.iter().sum::<f64>() / score.nees.len() as f64,
        score.false_tracks,
        score.position.len(),
    );
    assert!(score.late * 20 <= score.things, "{score:?}");
    assert!(
        score.false_tracks.len() * 20 <= score.things as usize,
        "{score:?}"
    );
    // 10 cm at 3 m, 0.2 m/s after a second
    assert!(percentile(&score.position, 0.95) <= 0.10, "{score:?}");
    assert!(percentile(&score.velocity, 0.95) <= 0.20, "{score:?}");
    // covariances of four dimensions that are not too small
    let nees = score.nees.iter().sum::<f64>() / score.nees.len() as f64;
    assert!(nees <= 4.5, "{nees}");
}

/// Four pieces of furniture, one of them on legs, one striped.
fn furniture(seed: u64) -> Vec<Block> {
    let m = |k: u64| mixed(seed * 977 + k);
    let texture = |i: u64| match i {
        2 => Texture::Stripes {
            period: 0.2,
            contrast: 0.6,
            angle: 0.0,
        },
        _ => Texture::Plain,
    };
    (0..4)
        .map(|i| Block {
            at: [2.0 + 4.5 * m(i * 5), 4.0 * (m(i * 5 + 1) - 0.5)],
            size: [0.3 + m(i * 5 + 2), 0.3 + m(i * 5 + 3)],
            yaw_deg: 90.0 * m(i * 5 + 4),
            bottom: if i == 1 { 0.65 } else { 0.0 },
            height: if i == 1 { 0.75 } else { 0.4 + 1.2 * m(40 + i) },
            brightness: 0.15 + 0.7 * m(50 + i),
            texture: texture(i),
        })
        .collect()
}

#[test]
fn a_static_scene_has_no_moving_tracks() {
    let (mut false_tracks, mut frames) = (0, 0);
    for seed in scenes() {
        let camera = if seed % 2 == 0 {
            CameraModel::paper()
        } else {
            CameraModel::vga()
        };
        let m = |k: u64| mixed(seed * 977 + k);
        let blocks = furniture(seed);
        let bin = Cylinder {
            at: [3.0, 1.4],
            radius: 0.15,
            height: 1.1,
            ..Cylinder::default()
        };
        let furnish = |_: f64| {
            let mut b = hall(textures()[(seed % 3) as usize]);
            b.boxes.extend(blocks.iter().copied());
            b.cylinders.push(bin);
            b
        };
        let pose = |t: f64| {
            let (v, w) = (0.5 * m(60), 0.8 * (m(61) - 0.5));
            let (sin, cos) = (0.5 * w * t).sin_cos();
            Pose2::new(v * t * cos, v * t * sin, w * t)
        };
        // a map made by a sonar: what stands there, and a hand's breadth around it
        let mapped = |p: [f64; 2]| {
            let near = |b: &Block| distance(b.at, p) < b.size[0].hypot(b.size[1]) / 2.0 + 0.15;
            if blocks.iter().any(near) || distance(bin.at, p) < 0.3 {
                FloorState::Solid
            } else {
                map_of_hall(p)
            }
        };
        let floor: &dyn Fn([f64; 2]) -> FloorState = if seed % 4 < 2 {
            &nothing_known
        } else {
            &mapped
        };
        let mut seen = BTreeSet::new();
        run(&camera, 2.5, seed, furnish, pose, floor, |_, tracker, _| {
            frames += 1;
            seen.extend(tracker.moving().map(|track| track.id));
        });
        false_tracks += seen.len();
    }
    println!("{false_tracks} false tracks in {frames} frames");
    assert!(
        false_tracks * 100 <= frames,
        "{false_tracks} false tracks in {frames} frames"
    );
}

#[test]
fn people_who_walk_are_followed() {
    let camera = CameraModel::vga();
    let (mut off, mut known) = (Vec::new(), 0);
    for (seed, way) in [[[4.2, -1.6], [4.0, 1.6]], [[5.5, 0.6], [2.2, -0.3]]]
        .into_iter()
        .enumerate()
    {
        let walker = Walker {
            way: way.to_vec(),
            speed: 1.1,
            ..Walker::default()
        };
        let furnish = |_: f64| {
            let mut b = hall(textures()[0]);
            b.people.push(walker.clone());
            b
        };
        let world = World::new(&furnish(0.0)).expect("valid");
        let pose = |t: f64| Pose2::new(0.2 * t, 0.0, 0.0);
        run(
            &camera,
            2.2,
            seed as u64,
            furnish,
            pose,
            &map_of_hall,
            |t, tracker, _| {
                let person = world.people(t)[0];
                let at = [person.position.x, person.position.y];
                let tracks = tracker.moving().map(|track| distance(track.position, at));
                if t > 1.0 {
                    let nearest = tracks.fold(f64::INFINITY, f64::min);
                    known += usize::from(nearest < 0.3);
                    off.push(nearest);
                }
            },
        );
    }
    assert!(
        known * 10 >= off.len() * 9,
        "{known} of {}: {off:.2?}",
        off.len()
    );
}

#[test]
fn nodding_and_brighter_light_are_no_motion() {
    let mut false_tracks = BTreeSet::new();
    let camera = CameraModel::paper();
    let world = World::new(&hall(textures()[1])).expect("valid");
    let mut tracker = ObstacleTracker::new(view_of(&camera), ObstacleParams::default());
    for i in 0..30_u64 {
        let nod = (mixed(i) - 0.5) * 1.5_f64.to_radians();
        let look = Look {
            exposure: 1.2 + 0.1 * mixed(i + 100),
            ..Look::default()
        };
        let camera = CameraModel {
            tilt: camera.tilt + nod,
            ..camera
        };
        let frame = Renderer::new(camera, look).expect("valid").render(
            &world,
            Pose2::new(0.02 * i as f64, 0.0, 0.0),
            0.0,
            i,
        );
        let time = i as f64 / RATE;
        tracker.update(&frame, time, [0.02 * i as f64, 0.0, 0.0], &nothing_known);
        false_tracks.extend(tracker.moving().map(|track| track.id));
    }
    assert!(false_tracks.is_empty(), "{false_tracks:?}");
}

#[test]
fn frames_of_no_use_are_passed_over() {
    let view = view_of(&CameraModel::paper());
    let mut tracker = ObstacleTracker::new(view, ObstacleParams::default());
    let sizes = [
        (0, 0),
        (1, 1),
        (2, 2),
        (480, 220),
        (480, 220),
        (64, 3),
        (480, 1),
        (480, 1),
    ];
    for (i, (w, h)) in sizes.into_iter().enumerate() {
        // time that stands still or goes back, too
        for time in [i as f64 * 0.1, i as f64 * 0.1, 0.0, f64::NAN] {
            tracker.update(&GrayImage::new(w, h), time, [0.0; 3], &nothing_known);
            assert_eq!(tracker.moving().count(), 0);
        }
    }
}
