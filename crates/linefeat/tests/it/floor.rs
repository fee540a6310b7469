//! Floor features in rendered scenes, against where walls and doors truly meet the floor.

use linefeat::{
    CannyParams, Detector, DetectorParams, FloorFeatures, FloorParams, Segment, SegmentParams,
    floor_features,
};
use mobot_hw::sim::{
    Block, Building, CameraModel, Door, Floor, FloorEdge, Hinge, Lamp, Look, Patch, Poster,
    Renderer, Side, Texture, VisibleCorner, Wall, World,
};
use occgrid::Pose2;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::obstacle::view_of;

/// A floor edge is believed from this confidence on.
const BELIEVED: f64 = 0.5;

/// Past this distance a corner is not taken for the one that was found [px].
const MIXED_UP_PX: f64 = 1.5;

/// A frame, what was found in it and what is to be found.
struct Shot {
    segments: Vec<Segment>,
    features: FloorFeatures,
    edges: Vec<FloorEdge>,
    corners: Vec<VisibleCorner>,
}

impl Shot {
    fn of(camera: CameraModel, building: &Building, pose: Pose2, rng: &mut Pcg64Mcg) -> Self {
        let look = Look {
            noise: rng.random_range(1.0..3.0),
            blur_px: rng.random_range(0.5..1.0),
            ..Look::default()
        };
        let world = World::new(building).expect("a building");
        let mut renderer = Renderer::new(camera, look).expect("a camera");
        let image = renderer.render(&world, pose, 0.0, rng.random());
        let params = DetectorParams {
            canny: CannyParams {
                low: 20.0,
                high: 50.0,
                ..CannyParams::default()
            },
            segments: SegmentParams::default(),
        };
        let mut detector = Detector::new(params);
        let segments = detector.detect(&image).to_vec();
        let features = floor_features(
            &image,
            &segments,
            &view_of(&camera),
            &FloorParams::default(),
        );
        Self {
            segments,
            features,
            edges: renderer.floor_edges(&world, pose, 0.0),
            corners: renderer.door_corners(&world, pose, 0.0),
        }
    }

    /// Whether a segment lies along a true floor edge for most of its length.
    fn is_true(&self, segment: &Segment) -> bool {
        const PLACES: u32 = 20;
        let near = (0..PLACES).filter(|&k| {
            let share = (f64::from(k) + 0.5) / f64::from(PLACES);
            let p = [0, 1].map(|i| segment.start[i] + share * (segment.end[i] - segment.start[i]));
            self.edges.iter().any(|edge| distance(p, edge.pixels) < 2.0)
        });
        near.count() as u32 * 2 > PLACES
    }

    /// How many floor edges of at least this confidence are true, and how many are not.
    fn count(&self, confidence: f64) -> [usize; 2] {
        let likely = self.features.edges.iter();
        let mut counts = [0; 2];
        for edge in likely.filter(|edge| edge.confidence >= confidence) {
            counts[usize::from(!self.is_true(&self.segments[edge.segment]))] += 1;
        }
        counts
    }

    /// True floor edges of at least 60 px, and those of them that a believed one lies along.
    fn seen(&self) -> [usize; 2] {
        let long = |edge: &&FloorEdge| {
            let [p, q] = edge.pixels;
            (p[0] - q[0]).hypot(p[1] - q[1]) >= 60.0
        };
        let found = |edge: &&FloorEdge| {
            self.features.edges.iter().any(|found| {
                let s = &self.segments[found.segment];
                let middle = [0, 1].map(|i| 0.5 * (s.start[i] + s.end[i]));
                found.confidence >= BELIEVED && distance(middle, edge.pixels) < 2.0
            })
        };
        let long: Vec<_> = self.edges.iter().filter(long).collect();
        [long.len(), long.iter().filter(|edge| found(edge)).count()]
    }
}

/// Distance of a place from a line between two others [px].
fn distance(p: [f64; 2], [a, b]: [[f64; 2]; 2]) -> f64 {
    let along = [b[0] - a[0], b[1] - a[1]];
    let square = along[0] * along[0] + along[1] * along[1];
    let t = ((p[0] - a[0]) * along[0] + (p[1] - a[1]) * along[1]) / square.max(1e-9);
    let t = t.clamp(0.0, 1.0);
    (a[0] + t * along[0] - p[0]).hypot(a[1] + t * along[1] - p[1])
}

/// What else is in a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Clutter {
    Nothing,
    Tiles,
    Shadows,
    Posters,
    Skirting,
    Furniture,
    All,
}

/// A room of 9 by 5 metres, its near right corner at (-1, -2.5), with two open doorways in each wall.
fn room(rng: &mut Pcg64Mcg, clutter: Clutter) -> Building {
    let has = |what| clutter == what || clutter == Clutter::All;
    let brightness = rng.random_range(0.65..0.9);
    let skirting_brightness = rng.random_range(0.1..0.35);
    let corners: [[f64; 2]; 5] = [
        [-1.0, -2.5],
        [8.0, -2.5],
        [8.0, 2.5],
        [-1.0, 2.5],
        [-1.0, -2.5],
    ];
    let mut building = Building {
        floor: Floor {
            brightness: rng.random_range(0.3..0.5),
            ..Floor::default()
        },
        ambient: rng.random_range(0.4..0.7),
        lamps: (0..3)
            .map(|k| Lamp {
                at: [3.0 * f64::from(k), rng.random_range(-1.0..1.0)],
                ..Lamp::default()
            })
            .collect(),
        ..Building::default()
    };
    for ends in corners.windows(2) {
        let length = (ends[1][0] - ends[0][0]).hypot(ends[1][1] - ends[0][1]);
        building.walls.push(Wall {
            from: ends[0],
            to: ends[1],
            brightness,
            skirting: if has(Clutter::Skirting) { 0.08 } else { 0.0 },
            skirting_brightness,
            doors: (0..2)
                .map(|k| Door {
                    at: length * (f64::from(k) + rng.random_range(0.2..0.5)) / 2.0,
                    frame: 0.0,
                    hinge: Hinge::None,
                    ..Door::default()
                })
                .collect(),
            posters: if has(Clutter::Posters) {
                posters(rng, length)
            } else {
                Vec::new()
            },
            ..Wall::default()
        });
    }
    if has(Clutter::Tiles) {
        building.floor.texture = Texture::Tiles {
            size: rng.random_range(0.25..0.5),
            joint: 0.006,
            contrast: rng.random_range(0.1..0.3),
        };
    }
    if has(Clutter::Shadows) {
        building.floor.patches = shadows(rng);
    }
    if has(Clutter::Furniture) {
        building.boxes = furniture(rng);
    }
    building
}

fn posters(rng: &mut Pcg64Mcg, length: f64) -> Vec<Poster> {
    let one = |k: u32| Poster {
        at: length * (f64::from(k) + rng.random_range(0.1..0.6)) / 3.0,
        bottom: rng.random_range(0.15..1.0),
        brightness: rng.random_range(0.1..0.9),
        side: Side::Left,
        ..Poster::default()
    };
    (0..3).map(one).collect()
}

fn shadows(rng: &mut Pcg64Mcg) -> Vec<Patch> {
    let one = |_| Patch {
        at: [rng.random_range(1.5..6.0), rng.random_range(-1.5..1.5)],
        size: [rng.random_range(0.5..1.5), rng.random_range(0.3..1.0)],
        yaw_deg: rng.random_range(0.0..90.0),
        factor: rng.random_range(0.5..1.4),
        softness: rng.random_range(0.0..0.15),
    };
    (0..3).map(one).collect()
}

fn furniture(rng: &mut Pcg64Mcg) -> Vec<Block> {
    let one = |_| Block {
        at: [rng.random_range(2.5..6.0), rng.random_range(-2.0..2.0)],
        size: [rng.random_range(0.3..0.8), rng.random_range(0.3..0.8)],
        height: rng.random_range(0.3..1.2),
        brightness: rng.random_range(0.2..0.9),
        ..Block::default()
    };
    (0..2).map(one).collect()
}

/// A frame in a room from a random place that looks at a wall 2 to 5 m away.
fn shot(rng: &mut Pcg64Mcg, clutter: Clutter) -> Shot {
    let camera = if rng.random_bool(0.5) {
        CameraModel::paper()
    } else {
        CameraModel::vga()
    };
    let building = room(rng, clutter);
    let pose = Pose2::new(
        rng.random_range(0.0..5.0),
        rng.random_range(-0.8..0.8),
        rng.random_range(-1.3..1.3),
    );
    Shot::of(camera, &building, pose, rng)
}

fn frames() -> u32 {
    if std::env::var_os("MOBOT_LONG").is_some() {
        400
    } else {
        24
    }
}

/// What may be taken for a floor edge, and how often a frame it may be believed to be one. Shadows, and the
/// tops of furniture whose front is out of the picture, cannot be told from floor edges by one look.
#[test]
fn what_is_no_floor_edge_is_seldom_believed() {
    let mut rng = Pcg64Mcg::seed_from_u64(71);
    for (clutter, most_false, least_seen) in [
        (Clutter::Nothing, 0.05, 0.85),
        (Clutter::Tiles, 0.5, 0.85),
        (Clutter::Shadows, 0.6, 0.75),
        (Clutter::Posters, 0.6, 0.85),
        (Clutter::Skirting, 0.5, 0.65),
        (Clutter::Furniture, 1.2, 0.8),
        (Clutter::All, 2.5, 0.65),
    ] {
        let (mut believed, mut candidates, mut seen) = ([0; 2], [0; 2], [0; 2]);
        let add = |sum: &mut [usize; 2], new: [usize; 2]| *sum = [sum[0] + new[0], sum[1] + new[1]];
        for _ in 0..frames() {
            let shot = shot(&mut rng, clutter);
            add(&mut believed, shot.count(BELIEVED));
            add(&mut candidates, shot.count(0.0));
            add(&mut seen, shot.seen());
        }
        let a_frame = |n: usize| n as f64 / f64::from(frames());
        let share = seen[1] as f64 / seen[0] as f64;
        println!(
            "{clutter:?}: believed a frame {:.2} true, {:.2} false; candidates {:.2} true, {:.2} false; {:.1} % of the long ones believed",
            a_frame(believed[0]),
            a_frame(believed[1]),
            a_frame(candidates[0]),
            a_frame(candidates[1]),
            100.0 * share
        );
        assert!(a_frame(believed[1]) <= most_false, "{clutter:?}");
        assert!(share >= least_seen, "{clutter:?}");
    }
}

/// A level camera sees the ceiling, too; nothing above the horizon is on the floor.
#[test]
fn ceiling_lines_are_no_floor_edges() {
    let mut rng = Pcg64Mcg::seed_from_u64(73);
    let (mut above, mut found) = (0, 0);
    for _ in 0..6 {
        let building = room(&mut rng, Clutter::Posters);
        let camera = CameraModel::centred(640, 480, 350.0, 1.0, 0.0);
        let pose = Pose2::new(0.0, 0.0, rng.random_range(-0.6..0.6));
        let shot = Shot::of(camera, &building, pose, &mut rng);
        let is_above = |s: &Segment| s.start[1].min(s.end[1]) < camera.cy;
        above += shot.segments.iter().filter(|s| is_above(s)).count();
        for edge in &shot.features.edges {
            assert!(!is_above(&shot.segments[edge.segment]), "{edge:?}");
        }
        found += shot.count(BELIEVED)[0];
    }
    assert!(above > 30 && found > 6, "{above} {found}");
}

/// Confidence of a corner whose lines are plain: share of the building's among such.
const PLAIN_CORNER: f64 = 0.83;

/// Door corners at floor edges. Those farther from any true corner than the two may be mixed up are of other
/// verticals: the far side of a reveal.
#[test]
fn corners_of_doors_lie_within_their_regions() {
    let mut rng = Pcg64Mcg::seed_from_u64(72);
    let (mut inside, mut all, mut others, mut sum) = (0, 0, 0, [0.0; 2]);
    for _ in 0..8 * frames() {
        let shot = shot(&mut rng, Clutter::Nothing);
        let at_edges = shot.features.corners.iter().filter(|c| c.edge.is_some());
        for corner in at_edges.filter(|c| c.confidence >= PLAIN_CORNER) {
            let off = |truth: &VisibleCorner| [0, 1].map(|i| corner.pixel[i] - truth.pixel[i]);
            let length = |off: &[f64; 2]| off[0].hypot(off[1]);
            let nearest = |a: &[f64; 2], b: &[f64; 2]| length(a).total_cmp(&length(b));
            let Some(off) = shot.corners.iter().map(off).min_by(nearest) else {
                continue;
            };
            if length(&off) > MIXED_UP_PX {
                others += 1;
                continue;
            }
            let [[a, b], [_, d]] = corner.covariance;
            let square = d * off[0] * off[0] - 2.0 * b * off[0] * off[1] + a * off[1] * off[1];
            all += 1;
            inside += usize::from(square / (a * d - b * b) < 5.991);
            sum = [sum[0] + off[0], sum[1] + off[1]];
        }
    }
    let share = f64::from(inside as u32) / f64::from(all);
    let mean = sum.map(|s| s / f64::from(all));
    println!("{inside} of {all} corners ({share:.3}), mean error {mean:.3?} px; {others} others");
    assert!(all as u32 > 4 * frames(), "{all}");
    // four standard errors of the share around 94 to 96 %
    let error = (0.95 * 0.05 / f64::from(all)).sqrt();
    assert!(
        (0.94 - 2.0 * error..=0.96 + 2.0 * error).contains(&share),
        "{share}"
    );
    assert!(others * 5 <= all, "{others} of {all}");
}
