//! Simulated buildings by name: built in, from a world file, or from any ROS map.

use std::path::Path;

use anyhow::{Context as _, bail};
use mobot_hw::sim::{Building, Floor, Lamp, Texture, World};
use occgrid::{Cell, LoadOptions, MapFrame, OccupancyMap, Point2, load_map};
use voronoi_plan::{ClearanceField, FreeSpace};

/// The buildings that need no file.
pub const BUILT_IN: [(&str, &str); 3] = [
    ("sketch", include_str!("../worlds/sketch.toml")),
    ("office", include_str!("../worlds/office.toml")),
    ("hall", include_str!("../worlds/hall.toml")),
];

/// Largest world file [bytes].
const MOST_BYTES: u64 = 4 << 20;
/// Distance between the lamps of a building that came from a map, at least [m].
const LAMPS: f64 = 5.0;

/// A world by its built-in name, from a world file (.toml) or from a ROS map (.yaml). The robot starts at
/// `start` (x, y [m], heading [rad]), or where the world says; in a map that is the place with the most room.
///
/// # Errors
/// For what is no world; the message says what was expected.
pub fn load(world: &str, start: Option<[f64; 3]>) -> anyhow::Result<World> {
    if let Some((_, text)) = BUILT_IN.iter().find(|(name, _)| *name == world) {
        return from_toml(text, start);
    }
    let path = Path::new(world);
    let world = match path.extension().and_then(|e| e.to_str()) {
        Some("toml") => from_toml(&crate::cmd::read_text(path, MOST_BYTES)?, start)
            .with_context(|| format!("{}", path.display()))?,
        Some("yaml" | "yml") => {
            let map = load_map(path, &LoadOptions::default())?.map;
            from_map(&map, start).with_context(|| format!("{}", path.display()))?
        }
        _ => {
            let names = BUILT_IN.map(|(name, _)| name).join(", ");
            bail!("world {world:?}: expected {names}, a world file (.toml) or a map (.yaml)")
        }
    };
    Ok(world)
}

fn from_toml(text: &str, start: Option<[f64; 3]>) -> anyhow::Result<World> {
    let building = Building::from_toml(text)?;
    Ok(World::new(&Building {
        start: start.unwrap_or(building.start),
        ..building
    })?)
}

/// Walls where the map is occupied, a tiled floor, lamps in rows.
fn from_map(map: &OccupancyMap, start: Option<[f64; 3]>) -> anyhow::Result<World> {
    let start = match start {
        Some(start) => start,
        None => roomiest(map).context("expected free cells to start in, found none")?,
    };
    let building = Building {
        start,
        floor: Floor {
            texture: Texture::Tiles {
                size: 0.4,
                joint: 0.006,
                contrast: 0.3,
            },
            ..Floor::default()
        },
        lamps: lamps(map.frame()),
        ..Building::default()
    };
    Ok(World::from_map(map, &building)?)
}

/// The free place that is farthest from everything else, heading along the map's x axis.
fn roomiest(map: &OccupancyMap) -> Option<[f64; 3]> {
    let clearance = ClearanceField::new(&FreeSpace::from_map(map));
    let squares = clearance.squared_doubled();
    let most = *squares.iter().max().filter(|most| **most > 0)?;
    let at = squares.iter().position(|square| *square == most)? as u32;
    let width = map.frame().width();
    let place = map.frame().center_of(Cell::new(at % width, at / width));
    Some([place.x, place.y, 0.0])
}

/// A lamp every few metres, at most 15 a side.
fn lamps(frame: &MapFrame) -> Vec<Lamp> {
    let counts = [frame.width(), frame.height()].map(|cells| {
        (f64::from(cells) * frame.resolution() / LAMPS)
            .clamp(1.0, 15.0)
            .floor()
    });
    let place = |col: f64, row: f64| -> Point2 {
        frame.map_from_grid(occgrid::GridPoint {
            col: (col + 0.5) / counts[0] * f64::from(frame.width()),
            row: (row + 0.5) / counts[1] * f64::from(frame.height()),
        })
    };
    let rows = 0..counts[1] as u32;
    rows.flat_map(|row| (0..counts[0] as u32).map(move |col| (col, row)))
        .map(|(col, row)| {
            let at = place(f64::from(col), f64::from(row));
            Lamp {
                at: [at.x, at.y],
                ..Lamp::default()
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn built_in_worlds_are_whole_and_start_where_told() {
        for (name, text) in BUILT_IN {
            assert_eq!(load(name, None).expect("a world").name(), name);
            let path = format!(
                "{}/../../testdata/worlds/{name}.toml",
                env!("CARGO_MANIFEST_DIR")
            );
            assert_eq!(std::fs::read_to_string(path).expect("a file"), text);
        }
        let start = load("hall", Some([3.0, 2.5, 1.0]))
            .expect("a world")
            .start();
        assert!((start.x, start.y, start.theta) == (3.0, 2.5, 1.0));
    }

    #[test]
    fn a_map_becomes_a_world_with_room_at_its_start() {
        let map = format!(
            "{}/../../testdata/maps/nav2/TenByTen/TenByTen.yaml",
            env!("CARGO_MANIFEST_DIR")
        );
        let world = load(&map, None).expect("a world");
        assert!(world.room_at(world.start().position(), 2.0, 1.0) > 1.0);
    }

    #[test]
    fn what_is_no_world_is_refused() {
        for bad in ["offce", "", "/none.toml", "/none.yaml", "x.png"] {
            assert!(load(bad, None).is_err(), "{bad}");
        }
    }
}
