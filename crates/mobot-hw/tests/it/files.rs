//! Buildings and golden files.

use mobot_hw::sim::{Building, World};

pub(crate) const OFFICE: &str = include_str!("../../../../testdata/worlds/office.toml");
pub(crate) const SKETCH: &str = include_str!("../../../../testdata/worlds/sketch.toml");
pub(crate) const HALL: &str = include_str!("../../../../testdata/worlds/hall.toml");

pub(crate) fn building(name: &str) -> Building {
    let text = match name {
        "office" => OFFICE,
        "sketch" => SKETCH,
        "hall" => HALL,
        _ => panic!("no world {name}"),
    };
    Building::from_toml(text).expect("it works")
}

/// Without people, who walk in and out of golden answers.
pub(crate) fn empty_world(name: &str) -> World {
    let mut building = building(name);
    building.people.clear();
    World::new(&building).expect("a world")
}

/// The rows of a CSV file below its header, each as (first fields as text, the rest as numbers).
pub(crate) fn rows(text: &str, names: usize) -> Vec<(Vec<String>, Vec<f64>)> {
    text.lines()
        .skip(1)
        .map(|line| {
            let fields: Vec<&str> = line.split(',').collect();
            let (words, numbers) = fields.split_at(names);
            (
                words.iter().map(|w| (*w).to_owned()).collect(),
                numbers
                    .iter()
                    .map(|n| n.parse().expect("a number"))
                    .collect(),
            )
        })
        .collect()
}
