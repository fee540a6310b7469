//! What a step did to an image: removed, added, joined, split, and where.

use std::collections::BTreeSet;

use crate::bit_image::runs;
use crate::{BitImage, Bounds, Component, Components, Connectivity, Pixel};

/// A connected patch of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Region {
    /// Its pixels.
    pub area: usize,
    /// The smallest rectangle around it.
    pub bounds: Bounds,
    /// Its first pixel in raster order: a place that surely belongs to it.
    pub first: Pixel,
}

impl From<&Component> for Region {
    fn from(component: &Component) -> Self {
        Self {
            area: component.area,
            bounds: component.bounds,
            first: component.first,
        }
    }
}

/// The pixels that changed one way.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Change {
    /// How many pixels.
    pub pixels: usize,
    /// The connected patches that they form, in raster order.
    pub regions: Vec<Region>,
}

/// Components that became one.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Joined {
    /// The component after.
    pub into: Region,
    /// The two or more components before.
    pub from: Vec<Region>,
}

/// A component that became several.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Split {
    /// The component before.
    pub from: Region,
    /// The two or more components after.
    pub into: Vec<Region>,
}

/// How the components of one image became those of another. A component before and one after
/// belong together if they share a pixel.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Kinship {
    /// Components after that hold pixels of several components before.
    pub joined: Vec<Joined>,
    /// Components before whose pixels lie in several components after.
    pub split: Vec<Split>,
    /// Components before of which no pixel is left.
    pub vanished: Vec<Region>,
    /// Components after of which no pixel was there.
    pub appeared: Vec<Region>,
}

/// Everything that differs between an image before and after a step.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Difference {
    /// Foreground that became background.
    pub removed: Change,
    /// Background that became foreground.
    pub added: Change,
    /// The fate of the foreground components.
    pub components: Kinship,
    /// The fate of the holes. A hole that only opened to the outside counts as vanished.
    pub holes: Kinship,
}

impl Difference {
    /// Compares two images of one size, foreground connected by `connectivity` and background by
    /// its dual.
    ///
    /// # Panics
    /// If the sizes differ.
    #[must_use]
    pub fn between(before: &BitImage, after: &BitImage, connectivity: Connectivity) -> Self {
        Self {
            removed: surplus(before, after, connectivity),
            added: surplus(after, before, connectivity),
            components: kinship(before, after, connectivity),
            holes: kinship(
                &holes_only(before, connectivity),
                &holes_only(after, connectivity),
                connectivity.dual(),
            ),
        }
    }
}

/// What `image` has and `other` lacks.
fn surplus(image: &BitImage, other: &BitImage, connectivity: Connectivity) -> Change {
    let mut rest = image.clone();
    rest.subtract(other);
    let regions = Components::label(&rest, connectivity);
    Change {
        pixels: rest.count_ones(),
        regions: regions.as_slice().iter().map(Region::from).collect(),
    }
}

fn holes_only(image: &BitImage, connectivity: Connectivity) -> BitImage {
    let mut holes = crate::fill_holes(image, connectivity);
    holes.subtract(image);
    holes
}

fn kinship(before: &BitImage, after: &BitImage, connectivity: Connectivity) -> Kinship {
    let old = Components::label(before, connectivity);
    let new = Components::label(after, connectivity);
    let mut pairs = BTreeSet::new();
    let mut shared = before.clone();
    shared.intersect(after);
    for y in 0..shared.height() {
        for run in runs(shared.row(y)) {
            pairs.insert([old.label_at(run.start, y), new.label_at(run.start, y)]);
        }
    }
    let swapped = pairs.iter().map(|&[a, b]| [b, a]).collect();
    let (descendants, ancestors) = (
        relatives(&old, &new, &pairs),
        relatives(&new, &old, &swapped),
    );
    let mut kinship = Kinship::default();
    for (from, into) in old.as_slice().iter().zip(descendants) {
        match into.len() {
            0 => kinship.vanished.push(from.into()),
            1 => {}
            _ => kinship.split.push(Split {
                from: from.into(),
                into,
            }),
        }
    }
    for (into, from) in new.as_slice().iter().zip(ancestors) {
        match from.len() {
            0 => kinship.appeared.push(into.into()),
            1 => {}
            _ => kinship.joined.push(Joined {
                into: into.into(),
                from,
            }),
        }
    }
    kinship
}

/// For every component of `of` those of `others` that it is paired with.
fn relatives(of: &Components, others: &Components, pairs: &BTreeSet<[u32; 2]>) -> Vec<Vec<Region>> {
    let mut lists = vec![Vec::new(); of.count()];
    for &[label, other] in pairs {
        lists[label as usize - 1].push(Region::from(&others.as_slice()[other as usize - 1]));
    }
    lists
}
