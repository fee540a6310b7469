//! World files: what is refused, and how; worlds from maps.

use mobot_hw::RangeFinder as _;
use mobot_hw::sim::{
    Building, CameraModel, Look, Renderer, RobotParams, Simulation, World, WorldError,
};
use occgrid::{Cell, CellState, MapFrame, OccupancyMap, Point2, Pose2, Reading};
use proptest::prelude::*;

use crate::files::{HALL, OFFICE, SKETCH};

#[test]
fn the_three_buildings_are_worlds() {
    for (text, name, doors) in [
        (OFFICE, "office", 7),
        (SKETCH, "sketch", 9),
        (HALL, "hall", 3),
    ] {
        let world = World::from_toml(text).unwrap();
        assert_eq!(world.name(), name);
        let numbers: Vec<usize> = world.door_corners().iter().map(|c| c.door).collect();
        assert_eq!(numbers.iter().max(), Some(&(doors - 1)));
        assert_eq!(world.door_corners().len(), 8 * doors);
        assert!(world.room_at(world.start().position(), 1.0, 1.2) > 0.3);
    }
}

#[test]
fn what_is_wrong_is_named() {
    let wall = |doors: &str| format!("[[walls]]\nfrom = [0, 0]\nto = [5, 0]\ndoors = [{doors}]\n");
    for (text, expected) in [
        ("ceiling = -1.0".to_owned(), "ceiling"),
        ("colour = 3".to_owned(), "colour"),
        (
            "[[walls]]\nfrom = [0, nan]\nto = [1, 0]".to_owned(),
            "walls[0].from",
        ),
        (
            "[[walls]]\nfrom = [1, 0]\nto = [1, 0]".to_owned(),
            "walls[0]",
        ),
        (wall("{ at = 4.5, width = 0.9 }"), "walls[0].doors"),
        (wall("{ at = 1.0 }, { at = 1.5 }"), "walls[0].doors"),
        (
            wall("{ at = 1.0, open_deg = 181 }"),
            "walls[0].doors[0].open_deg",
        ),
        ("[[boxes]]\nsize = [0, 1]".to_owned(), "boxes[0].size"),
        (
            "[[cylinders]]\nbrightness = 2".to_owned(),
            "cylinders[0].brightness",
        ),
        ("[[people]]\nway = [[0, 0]]".to_owned(), "people[0].way"),
        (
            "[floor]\ntexture = { kind = \"tiles\", size = 0.0, joint = 0.1, contrast = 0.1 }"
                .to_owned(),
            "floor.texture",
        ),
        ("start = [0, 0, inf]".to_owned(), "start[2]"),
    ] {
        let message = World::from_toml(&text).map(|_| ()).unwrap_err().to_string();
        assert!(message.contains(expected), "{text}: {message}");
        assert!(!message.contains('\n'), "{message}");
    }
    assert!(matches!(
        World::from_toml("[["),
        Err(WorldError::Toml { .. })
    ));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// Any numbers, also senseless ones: a world or an error, and a world can be drawn.
    #[test]
    fn any_numbers_are_refused_or_drawn(numbers in prop::collection::vec(odd_number(), 24)) {
        let n = |i: usize| numbers[i].clone();
        let text = format!(
            "ceiling = {}\nambient = {}\nstart = [{}, {}, {}]\n\
             [floor]\nbrightness = {}\ntexture = {{ kind = \"speckle\", grain = {}, contrast = {} }}\n\
             [[walls]]\nfrom = [{}, {}]\nto = [{}, {}]\nthickness = {}\nskirting = {}\n\
             doors = [{{ at = {}, width = {}, open_deg = {} }}]\n\
             [[boxes]]\nat = [{}, {}]\nsize = [{}, {}]\nbottom = {}\nheight = {}\n\
             [[cylinders]]\nradius = {}\n",
            n(0), n(1), n(2), n(3), n(4), n(5), n(6), n(7), n(8), n(9), n(10), n(11), n(12), n(13),
            n(14), n(15), n(16), n(17), n(18), n(19), n(20), n(21), n(22), n(23),
        );
        if let Ok(world) = World::from_toml(&text) {
            let camera = CameraModel::centred(24, 12, 20.0, 1.0, 0.4);
            let mut renderer = Renderer::new(camera, Look::default()).unwrap();
            let _ = renderer.render(&world, world.start(), 0.0, 0);
            let _ = renderer.floor_edges(&world, world.start(), 0.0);
            let _ = world.range_along(world.start(), 1e6, 0.3);
        }
    }
}

fn odd_number() -> impl Strategy<Value = String> {
    prop_oneof![
        20 => (0.01..3.0_f64).prop_map(|x| format!("{x:.3}")),
        1 => Just("0".to_owned()),
        1 => Just("-1".to_owned()),
        1 => Just("nan".to_owned()),
        1 => Just("-inf".to_owned()),
        1 => Just("1e300".to_owned()),
        1 => Just("1e-300".to_owned()),
        1 => Just("99999".to_owned()),
    ]
}

/// A room of noise, with yaw.
fn noisy_map() -> OccupancyMap {
    let frame = MapFrame::new(60, 40, 0.1, Pose2::new(-2.0, 1.0, 0.4)).expect("it works");
    let mut state = 12345_u32;
    let values = (0..60 * 40)
        .map(|_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            match state >> 24 {
                0..=20 => 100,
                21..=40 => -1,
                _ => 0,
            }
        })
        .collect();
    OccupancyMap::new(frame, values, 25, 65)
}

#[test]
fn a_map_becomes_walls_along_its_occupied_cells() {
    let map = noisy_map();
    let world = World::from_map(&map, &Building::default()).unwrap();
    let full = |col: i64, row: i64| {
        (0..60).contains(&col)
            && (0..40).contains(&row)
            && map.state(Cell::new(col as u32, row as u32)) == CellState::Occupied
    };
    // every edge between occupied and not, once
    let mut edges = 0;
    for row in -1..40 {
        for col in -1..60 {
            edges += usize::from(full(col, row) != full(col + 1, row));
            edges += usize::from(full(col, row) != full(col, row + 1));
        }
    }
    let outline = world.floor_outline();
    let length: f64 = outline.iter().map(|[a, b]| a.distance(*b)).sum();
    assert!(
        (length - 0.1 * edges as f64).abs() < 1e-6,
        "{length} {edges}"
    );
    // free space on the left, an occupied cell on the right of every line
    for [a, b] in &outline {
        let l = a.distance(*b);
        let off = |d: f64| {
            let t = 0.05 / l;
            map.frame().cell_at(Point2::new(
                a.x + (b.x - a.x) * t - d * (b.y - a.y) / l,
                a.y + (b.y - a.y) * t + d * (b.x - a.x) / l,
            ))
        };
        let occupied = |c: Option<Cell>| c.is_some_and(|c| map.state(c) == CellState::Occupied);
        assert!(occupied(off(-0.01)) && !occupied(off(0.01)), "{a:?} {b:?}");
    }
    // a ray along a row of cells ends at the first occupied one
    for row in 0..40 {
        for col in 0..60 {
            if full(col, row) {
                continue;
            }
            let center = map.frame().center_of(Cell::new(col as u32, row as u32));
            let truth = (col + 1..60).find(|c| full(*c, row));
            let found = world.range_along(Pose2::new(center.x, center.y, 0.4), 100.0, 0.5);
            match (truth, found) {
                (Some(c), Some(range)) => {
                    let expected = 0.1 * (c - col) as f64 - 0.05;
                    assert!(
                        (range - expected).abs() < 1e-9,
                        "{col} {row}: {range} {expected}"
                    );
                }
                (None, None) => {}
                other => panic!("{col} {row}: {other:?}"),
            }
        }
    }
}

#[test]
fn people_walk_to_and_fro() {
    let text = "[[people]]\nway = [[0, 0], [2, 0], [2, 1]]\nspeed = 0.5\nstart = 1.0\n";
    let world = World::from_toml(text).unwrap();
    for (time, place, velocity) in [
        (0.0, [1.0, 0.0], [0.5, 0.0]),
        (3.0, [2.0, 0.5], [0.0, 0.5]),
        (5.0, [2.0, 0.5], [0.0, -0.5]),
        (12.0, [1.0, 0.0], [0.5, 0.0]),
    ] {
        let person = world.people(time)[0];
        let off = |p: Point2, [x, y]: [f64; 2]| p.distance(Point2::new(x, y));
        assert!(off(person.position, place) < 1e-12, "{time}: {person:?}");
        assert!(off(person.velocity, velocity) < 1e-12, "{time}: {person:?}");
    }
}

/// Ways of a simulated person towards a robot that stands in the way.
#[test]
fn people_who_keep_a_distance_stand_and_turn_back() {
    let met = |keeps: &str| {
        let text = format!(
            "start = [2.0, 0.0, 3.1]\n[[people]]\nway = [[0, 0], [4, 0]]\nspeed = 1.0\n{keeps}\n"
        );
        let world = World::from_toml(&text).expect("a world");
        let robot = Simulation::new(world, RobotParams::default(), 1).expect("a robot");
        let mut sonar = robot.sonar();
        let mut nearest = f64::INFINITY;
        let mut last = f64::INFINITY;
        for _ in 0..240 {
            if let Reading::Echo { range } = sonar.ping(0.0).expect("a reading").reading {
                nearest = nearest.min(range);
                last = range;
            }
        }
        (nearest, last, robot.truth().least_clearance)
    };
    let (nearest, last, room) = met("keeps = 0.6");
    // body to body, seen from the axle
    assert!((0.7..0.9).contains(&nearest), "{nearest}");
    assert!(last > 1.0 && room > 0.45, "{last} {room}");
    assert!(met("").2 < 0.01);
}
