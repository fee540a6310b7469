//! Floor plans as GeoJSON: walls as LineString (`kind: wall`), door corners as Point
//! (`kind: door_corner`), coordinates in metres of the map frame whatever the file's `crs` says.

use std::fmt::Write as _;

use occgrid::Point2;
use serde::Deserialize;
use serde_json::value::RawValue;
use thiserror::Error;

use super::FloorPlan;
use crate::camera_file_error::escaped;

/// Coordinates beyond this are no floor plan [m].
const FARTHEST: f64 = 1e6;

/// How large a floor plan may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PlanLimits {
    /// Length of the text [bytes].
    pub bytes: usize,
    /// Straight walls.
    pub walls: usize,
    /// Door corners.
    pub door_corners: usize,
}

impl Default for PlanLimits {
    /// 64 MiB, 200 000 walls, 100 000 door corners.
    fn default() -> Self {
        Self {
            bytes: 64 << 20,
            walls: 200_000,
            door_corners: 100_000,
        }
    }
}

/// Why a floor plan was refused.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum FloorPlanError {
    /// Not JSON, or not a FeatureCollection.
    #[error("expected a GeoJSON FeatureCollection, found {found}")]
    Syntax {
        /// What is wrong, with line and column.
        found: String,
    },
    /// A feature lacks something, or has what cannot be.
    #[error("feature {feature}: {key}: expected {expected}, found {found}")]
    Feature {
        /// The feature, 0-based in the file's order.
        feature: usize,
        /// The key.
        key: &'static str,
        /// What should be there.
        expected: &'static str,
        /// What is there.
        found: String,
    },
    /// Neither a wall nor a door corner in it.
    #[error("expected features of kind wall or door_corner, found none")]
    Empty,
    /// More than the limits allow.
    #[error("{what}: expected at most {limit}, found more")]
    TooLarge {
        /// Of what there is too much.
        what: &'static str,
        /// How much may be.
        limit: usize,
    },
}

#[derive(Deserialize)]
struct Collection<'a> {
    #[serde(rename = "type")]
    kind: String,
    #[serde(borrow)]
    features: Vec<Feature<'a>>,
}

#[derive(Deserialize)]
struct Feature<'a> {
    #[serde(borrow)]
    geometry: Option<Geometry<'a>>,
    properties: Option<Properties>,
}

#[derive(Deserialize)]
struct Geometry<'a> {
    #[serde(rename = "type")]
    kind: String,
    #[serde(borrow)]
    coordinates: Option<&'a RawValue>,
}

#[derive(Deserialize)]
struct Properties {
    kind: Option<String>,
}

impl FloorPlan {
    /// Reads a plan within the default limits.
    ///
    /// # Errors
    /// [`FloorPlanError`] names the feature and what was expected there.
    pub fn from_geojson(text: &str) -> Result<Self, FloorPlanError> {
        Self::from_geojson_within(text, &PlanLimits::default())
    }

    /// Reads a plan: LineStrings (or MultiLineStrings) of kind `wall`, Points of kind `door_corner`.
    /// Features of other kinds are passed over. A third coordinate is ignored.
    ///
    /// # Errors
    /// [`FloorPlanError`] names the feature and what was expected there.
    pub fn from_geojson_within(text: &str, limits: &PlanLimits) -> Result<Self, FloorPlanError> {
        most("bytes", text.len(), limits.bytes)?;
        let collection: Collection<'_> = serde_json::from_str(text).map_err(syntax)?;
        if collection.kind != "FeatureCollection" {
            let found = format!("type {:?}", shortened(&collection.kind));
            return Err(FloorPlanError::Syntax { found });
        }
        let mut plan = Self::default();
        for (index, feature) in collection.features.iter().enumerate() {
            let kind = feature.properties.as_ref().and_then(|p| p.kind.as_deref());
            match kind {
                Some("wall") => plan.add_walls(index, feature.geometry.as_ref())?,
                Some("door_corner") => plan.add_corner(index, feature.geometry.as_ref())?,
                _ => {}
            }
            most("walls", plan.walls.len(), limits.walls)?;
            most("door corners", plan.door_corners.len(), limits.door_corners)?;
        }
        if plan.is_empty() {
            return Err(FloorPlanError::Empty);
        }
        Ok(plan)
    }

    fn add_walls(
        &mut self,
        index: usize,
        geometry: Option<&Geometry<'_>>,
    ) -> Result<(), FloorPlanError> {
        let expected = "a LineString or MultiLineString";
        let lines: Vec<Vec<Vec<f64>>> = match geometry.map(|g| (g.kind.as_str(), g)) {
            Some(("LineString", g)) => vec![coordinates(index, g, "[[x, y], [x, y], ..]")?],
            Some(("MultiLineString", g)) => coordinates(index, g, "[[[x, y], [x, y], ..], ..]")?,
            other => return Err(wrong_geometry(index, expected, other.map(|(kind, _)| kind))),
        };
        for line in lines {
            let points: Result<Vec<Point2>, _> = line.iter().map(|p| point(index, p)).collect();
            let points = points?;
            if points.len() < 2 {
                let found = format!("{}", points.len());
                return Err(refused(index, "coordinates", "two points or more", found));
            }
            let pairs = points.windows(2).map(|pair| [pair[0], pair[1]]);
            // a point given twice in a row is no wall
            self.walls
                .extend(pairs.filter(|[a, b]| a.distance(*b) > 0.0));
        }
        Ok(())
    }

    fn add_corner(
        &mut self,
        index: usize,
        geometry: Option<&Geometry<'_>>,
    ) -> Result<(), FloorPlanError> {
        match geometry.map(|g| (g.kind.as_str(), g)) {
            Some(("Point", g)) => {
                let place: Vec<f64> = coordinates(index, g, "[x, y]")?;
                self.door_corners.push(point(index, &place)?);
                Ok(())
            }
            other => Err(wrong_geometry(
                index,
                "a Point",
                other.map(|(kind, _)| kind),
            )),
        }
    }

    /// The plan as GeoJSON: one feature a line, walls first; reading it back gives the same plan.
    #[must_use]
    pub fn to_geojson(&self) -> String {
        let mut lines = Vec::with_capacity(self.walls.len() + self.door_corners.len());
        for [a, b] in &self.walls {
            lines.push(feature("wall", "LineString", |out| {
                write!(out, "[[{:?}, {:?}], [{:?}, {:?}]]", a.x, a.y, b.x, b.y)
            }));
        }
        for p in &self.door_corners {
            lines.push(feature("door_corner", "Point", |out| {
                write!(out, "[{:?}, {:?}]", p.x, p.y)
            }));
        }
        let body = lines.join(",\n");
        format!("{{\"type\": \"FeatureCollection\", \"features\": [\n{body}\n]}}\n")
    }
}

fn feature(
    kind: &str,
    geometry: &str,
    coordinates: impl Fn(&mut String) -> std::fmt::Result,
) -> String {
    let mut text = format!(
        "{{\"type\": \"Feature\", \"properties\": {{\"kind\": \"{kind}\"}}, \"geometry\": {{\"type\": \"{geometry}\", \"coordinates\": "
    );
    // writing to a String does not fail
    let _ = coordinates(&mut text);
    text + "}}"
}

fn coordinates<'a, T: Deserialize<'a>>(
    index: usize,
    geometry: &Geometry<'a>,
    expected: &'static str,
) -> Result<T, FloorPlanError> {
    let text = geometry.coordinates.map_or("nothing", RawValue::get);
    serde_json::from_str(text).map_err(|_| refused(index, "coordinates", expected, shortened(text)))
}

fn point(index: usize, place: &[f64]) -> Result<Point2, FloorPlanError> {
    match place {
        [x, y, ..] if x.abs() <= FARTHEST && y.abs() <= FARTHEST => Ok(Point2::new(*x, *y)),
        _ => {
            let expected = "two numbers within 1000 km";
            let found = shortened(&format!("{place:?}"));
            Err(refused(index, "coordinates", expected, found))
        }
    }
}

fn wrong_geometry(feature: usize, expected: &'static str, found: Option<&str>) -> FloorPlanError {
    let found = found.map_or_else(|| "none".into(), shortened);
    refused(feature, "geometry", expected, found)
}

fn refused(
    feature: usize,
    key: &'static str,
    expected: &'static str,
    found: String,
) -> FloorPlanError {
    FloorPlanError::Feature {
        feature,
        key,
        expected,
        found,
    }
}

fn syntax(error: serde_json::Error) -> FloorPlanError {
    FloorPlanError::Syntax {
        found: shortened(&error.to_string()),
    }
}

fn most(what: &'static str, count: usize, limit: usize) -> Result<(), FloorPlanError> {
    if count > limit {
        return Err(FloorPlanError::TooLarge { what, limit });
    }
    Ok(())
}

/// The beginning of a text, control characters escaped, so that a message stays one readable line.
fn shortened(text: &str) -> String {
    let mut rest = text.chars();
    let first = rest.by_ref().take(80);
    let mut short: String = first.flat_map(escaped).collect();
    if rest.next().is_some() {
        short += "..";
    }
    short
}
