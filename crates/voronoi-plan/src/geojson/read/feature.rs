//! One feature: what its keys hold, then what it means.

use occgrid::Point2;
use serde::de::{Deserialize, Deserializer, MapAccess};
use serde_json::value::RawValue;

use super::coordinates::Coordinates;
use super::keys::{Key, Keyed, keyed};
use super::scalar::Scalar;
use crate::geojson::{RouteEdge, RouteGraphError, RouteNode};

/// What a feature is.
pub(super) enum Element {
    Node(RouteNode),
    Edge(RouteEdge),
}

/// A feature as it stands in the file.
#[derive(Default)]
pub(super) struct RawFeature<'a> {
    properties: Option<Properties<'a>>,
    geometry: Option<Geometry>,
}

/// The keys of `properties` that count.
#[derive(Default)]
struct Properties<'a> {
    id: Scalar,
    startid: Scalar,
    endid: Scalar,
    frame: Scalar,
    cost: Scalar,
    overridable: Scalar,
    clearance: Scalar,
    metadata: Option<&'a RawValue>,
    operations: Option<&'a RawValue>,
    voronoi: Option<&'a RawValue>,
}

#[derive(Default)]
struct Geometry {
    r#type: Scalar,
    coordinates: Option<Coordinates>,
}

/// A fault of one key: key, expected, found.
type Fault = (&'static str, &'static str, String);

impl RawFeature<'_> {
    /// What the feature is; `None` for geometries that are neither node nor edge.
    pub(super) fn judge(self, feature: usize) -> Result<Option<Element>, RouteGraphError> {
        self.element()
            .map_err(|(key, expected, found)| RouteGraphError::Feature {
                feature,
                key,
                expected,
                found,
            })
    }

    fn element(self) -> Result<Option<Element>, Fault> {
        let Some(geometry) = self.geometry else {
            return Err(("geometry", "an object", "nothing".to_owned()));
        };
        let is_node = match geometry.r#type.as_text() {
            Some("Point") => true,
            Some("LineString" | "MultiLineString") => false,
            Some(_) => return Ok(None),
            None => {
                let found = geometry.r#type.to_string();
                return Err(("geometry.type", "the name of a geometry", found));
            }
        };
        let Some(properties) = self.properties else {
            return Err(("properties", "an object", "nothing".to_owned()));
        };
        if is_node {
            let point = geometry.position()?;
            properties.node(point).map(|node| Some(Element::Node(node)))
        } else {
            let line = geometry.line()?;
            properties.edge(line).map(|edge| Some(Element::Edge(edge)))
        }
    }
}

impl Properties<'_> {
    fn node(self, point: Point2) -> Result<RouteNode, Fault> {
        let frame = match self.frame {
            Scalar::Missing => None,
            Scalar::Text(name) => Some(name),
            found => return Err(("frame", "the name of a frame", found.to_string())),
        };
        Ok(RouteNode {
            id: id("id", &self.id)?,
            point,
            frame,
            metadata: structure("metadata", self.metadata, "an object", &["{"])?,
            operations: structure(
                "operations",
                self.operations,
                "a list or object",
                &["{", "["],
            )?,
            voronoi: self.voronoi.map(|text| text.get().into()),
        })
    }

    fn edge(self, polyline: Option<Vec<Point2>>) -> Result<RouteEdge, Fault> {
        let overridable = match self.overridable {
            Scalar::Missing => None,
            Scalar::Bool(value) => Some(value),
            found => return Err(("overridable", "true or false", found.to_string())),
        };
        Ok(RouteEdge {
            id: id("id", &self.id)?,
            start: id("startid", &self.startid)?,
            end: id("endid", &self.endid)?,
            cost: not_negative("cost", &self.cost)?,
            overridable,
            polyline,
            clearance: not_negative("clearance", &self.clearance)?,
            metadata: structure("metadata", self.metadata, "an object", &["{"])?,
            operations: structure(
                "operations",
                self.operations,
                "a list or object",
                &["{", "["],
            )?,
            voronoi: self.voronoi.map(|text| text.get().into()),
        })
    }
}

fn id(key: &'static str, found: &Scalar) -> Result<u32, Fault> {
    let fault = || (key, "an unsigned integer below 2^32", found.to_string());
    found.as_u32().ok_or_else(fault)
}

fn not_negative(key: &'static str, found: &Scalar) -> Result<Option<f64>, Fault> {
    if found.is_missing() {
        return Ok(None);
    }
    match found.as_f64() {
        Some(value) if value >= 0.0 => Ok(Some(value)),
        _ => Err((key, "a number >= 0", found.to_string())),
    }
}

fn structure(
    key: &'static str,
    found: Option<&RawValue>,
    expected: &'static str,
    starts: &[&str],
) -> Result<Option<Box<str>>, Fault> {
    let Some(text) = found.map(RawValue::get) else {
        return Ok(None);
    };
    if starts.iter().any(|start| text.starts_with(start)) {
        return Ok(Some(text.into()));
    }
    let value: Scalar = serde_json::from_str(text).unwrap_or_default();
    Err((key, expected, value.to_string()))
}

impl Geometry {
    const KEY: &'static str = "geometry.coordinates";

    /// The position of a Point.
    fn position(self) -> Result<Point2, Fault> {
        let fault = |found: String| (Self::KEY, "[x, y], two finite numbers", found);
        let Some(coordinates) = self.coordinates else {
            return Err(fault("nothing".to_owned()));
        };
        if let Some(found) = coordinates.fault {
            return Err(fault(found));
        }
        match (coordinates.points.first(), coordinates.depths) {
            (Some(point), Some((1, 1))) => Ok(*point),
            (Some(_), _) => Err(fault("a list of positions".to_owned())),
            (None, _) => Err(fault("an empty list".to_owned())),
        }
    }

    /// The line of an edge, the parts of a MultiLineString in turn. Nav2 looks at neither the nesting
    /// nor whether there are coordinates at all, so both nestings pass for both types, and none too.
    fn line(self) -> Result<Option<Vec<Point2>>, Fault> {
        let fault = |found: String| (Self::KEY, "lists of positions [x, y]", found);
        let Some(coordinates) = self.coordinates else {
            return Ok(None);
        };
        if let Some(found) = coordinates.fault {
            return Err(fault(found));
        }
        match coordinates.depths {
            None => Ok(None),
            Some((2, 2) | (3, 3)) => Ok(Some(coordinates.points)),
            Some((1, _)) => Err(fault("one position".to_owned())),
            Some((least, most)) => Err(fault(format!("positions nested {least} to {most} deep"))),
        }
    }
}

impl<'de> Keyed<'de> for RawFeature<'de> {
    const EXPECTED: &'static str = "a feature object";

    fn take<A: MapAccess<'de>>(&mut self, key: Key, map: &mut A) -> Result<bool, A::Error> {
        match key {
            Key::Properties => self.properties = map.next_value()?,
            Key::Geometry => self.geometry = map.next_value()?,
            _ => return Ok(false),
        }
        Ok(true)
    }
}

impl<'de> Keyed<'de> for Properties<'de> {
    const EXPECTED: &'static str = "`properties` to be an object";

    fn take<A: MapAccess<'de>>(&mut self, key: Key, map: &mut A) -> Result<bool, A::Error> {
        match key {
            Key::Id => self.id = map.next_value()?,
            Key::StartId => self.startid = map.next_value()?,
            Key::EndId => self.endid = map.next_value()?,
            Key::Frame => self.frame = map.next_value()?,
            Key::Cost => self.cost = map.next_value()?,
            Key::Overridable => self.overridable = map.next_value()?,
            Key::Clearance => self.clearance = map.next_value()?,
            Key::Metadata => self.metadata = map.next_value()?,
            Key::Operations => self.operations = map.next_value()?,
            Key::Member => self.voronoi = map.next_value()?,
            _ => return Ok(false),
        }
        Ok(true)
    }
}

impl<'de> Keyed<'de> for Geometry {
    const EXPECTED: &'static str = "`geometry` to be an object";

    fn take<A: MapAccess<'de>>(&mut self, key: Key, map: &mut A) -> Result<bool, A::Error> {
        match key {
            Key::Type => self.r#type = map.next_value()?,
            Key::Coordinates => self.coordinates = Some(map.next_value()?),
            _ => return Ok(false),
        }
        Ok(true)
    }
}

impl<'de: 'a, 'a> Deserialize<'de> for RawFeature<'a> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        keyed(deserializer)
    }
}

impl<'de: 'a, 'a> Deserialize<'de> for Properties<'a> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        keyed(deserializer)
    }
}

impl<'de> Deserialize<'de> for Geometry {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        keyed(deserializer)
    }
}
