//! One feature: what its keys hold, then what it means.

use std::fmt;

use occgrid::Point2;
use serde::de::{
    Deserialize, DeserializeSeed, Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor,
};
use serde_json::value::RawValue;

use super::scalar::Scalar;
use crate::geojson::{MEMBER, RouteEdge, RouteGraphError, RouteNode};

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

/// The positions of a geometry, whatever its nesting.
#[derive(Default)]
struct Coordinates {
    points: Vec<Point2>,
    /// Least and greatest nesting of a position: 1 for `[x, y]`.
    depths: Option<(usize, usize)>,
    /// The first thing that is no position nor a list of them.
    fault: Option<String>,
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

impl<'de: 'a, 'a> Deserialize<'de> for RawFeature<'a> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Keys;

        impl<'de> Visitor<'de> for Keys {
            type Value = RawFeature<'de>;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("a feature object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut feature = RawFeature::default();
                let mut seen = Seen(0);
                while let Some(key) = map.next_key::<Key>()? {
                    seen.first::<A::Error>(key)?;
                    match key {
                        Key::Properties => feature.properties = map.next_value()?,
                        Key::Geometry => feature.geometry = map.next_value()?,
                        _ => {
                            map.next_value::<IgnoredAny>()?;
                        }
                    }
                }
                Ok(feature)
            }
        }

        deserializer.deserialize_map(Keys)
    }
}

impl<'de: 'a, 'a> Deserialize<'de> for Properties<'a> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Keys;

        impl<'de> Visitor<'de> for Keys {
            type Value = Properties<'de>;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("`properties` to be an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut found = Properties::default();
                let mut seen = Seen(0);
                while let Some(key) = map.next_key::<Key>()? {
                    seen.first::<A::Error>(key)?;
                    match key {
                        Key::Id => found.id = map.next_value()?,
                        Key::StartId => found.startid = map.next_value()?,
                        Key::EndId => found.endid = map.next_value()?,
                        Key::Frame => found.frame = map.next_value()?,
                        Key::Cost => found.cost = map.next_value()?,
                        Key::Overridable => found.overridable = map.next_value()?,
                        Key::Clearance => found.clearance = map.next_value()?,
                        Key::Metadata => found.metadata = map.next_value()?,
                        Key::Operations => found.operations = map.next_value()?,
                        Key::Member => found.voronoi = map.next_value()?,
                        _ => {
                            map.next_value::<IgnoredAny>()?;
                        }
                    }
                }
                Ok(found)
            }
        }

        deserializer.deserialize_map(Keys)
    }
}

impl<'de> Deserialize<'de> for Geometry {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Keys;

        impl<'de> Visitor<'de> for Keys {
            type Value = Geometry;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("`geometry` to be an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut geometry = Geometry::default();
                let mut seen = Seen(0);
                while let Some(key) = map.next_key::<Key>()? {
                    seen.first::<A::Error>(key)?;
                    match key {
                        Key::Type => geometry.r#type = map.next_value()?,
                        Key::Coordinates => {
                            let mut coordinates = Coordinates::default();
                            map.next_value_seed(Nested(&mut coordinates, 0))?;
                            geometry.coordinates = Some(coordinates);
                        }
                        _ => {
                            map.next_value::<IgnoredAny>()?;
                        }
                    }
                }
                Ok(geometry)
            }
        }

        deserializer.deserialize_map(Keys)
    }
}

/// The keys that count, anywhere in a feature.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Key {
    Properties,
    Geometry,
    Type,
    Coordinates,
    Id,
    StartId,
    EndId,
    Frame,
    Cost,
    Overridable,
    Clearance,
    Metadata,
    Operations,
    Member,
    Other,
}

impl Key {
    fn named(name: &str) -> Self {
        match name {
            "properties" => Self::Properties,
            "geometry" => Self::Geometry,
            "type" => Self::Type,
            "coordinates" => Self::Coordinates,
            "id" => Self::Id,
            "startid" => Self::StartId,
            "endid" => Self::EndId,
            "frame" => Self::Frame,
            "cost" => Self::Cost,
            "overridable" => Self::Overridable,
            "clearance" => Self::Clearance,
            "metadata" => Self::Metadata,
            "operations" => Self::Operations,
            MEMBER => Self::Member,
            _ => Self::Other,
        }
    }

    const fn name(self) -> &'static str {
        match self {
            Self::Properties => "properties",
            Self::Geometry => "geometry",
            Self::Type => "type",
            Self::Coordinates => "coordinates",
            Self::Id => "id",
            Self::StartId => "startid",
            Self::EndId => "endid",
            Self::Frame => "frame",
            Self::Cost => "cost",
            Self::Overridable => "overridable",
            Self::Clearance => "clearance",
            Self::Metadata => "metadata",
            Self::Operations => "operations",
            Self::Member => MEMBER,
            Self::Other => "another key",
        }
    }
}

impl<'de> Deserialize<'de> for Key {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Name;

        impl Visitor<'_> for Name {
            type Value = Key;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("a key")
            }

            fn visit_str<E: Error>(self, name: &str) -> Result<Key, E> {
                Ok(Key::named(name))
            }
        }

        deserializer.deserialize_identifier(Name)
    }
}

/// Which keys an object has had.
struct Seen(u32);

impl Seen {
    fn first<E: Error>(&mut self, key: Key) -> Result<(), E> {
        let bit = 1_u32 << key as u32;
        if self.0 & bit != 0 && key != Key::Other {
            return Err(E::custom(format_args!("`{}` is there twice", key.name())));
        }
        self.0 |= bit;
        Ok(())
    }
}

/// Reads what `coordinates` holds at a nesting depth; yields a number where it is one.
struct Nested<'c>(&'c mut Coordinates, usize);

impl Nested<'_> {
    fn fault(self, found: &str) -> Option<f64> {
        if self.0.fault.is_none() {
            self.0.fault = Some(found.to_owned());
        }
        None
    }
}

impl<'de> DeserializeSeed<'de> for Nested<'_> {
    type Value = Option<f64>;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Self::Value, D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Nested<'_> {
    type Value = Option<f64>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("coordinates")
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Self::Value, E> {
        Ok(Some(value))
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Self::Value, E> {
        Ok(Some(value as f64))
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Self::Value, E> {
        Ok(Some(value as f64))
    }

    fn visit_unit<E: Error>(self) -> Result<Self::Value, E> {
        Ok(self.fault("null"))
    }

    fn visit_bool<E: Error>(self, value: bool) -> Result<Self::Value, E> {
        Ok(self.fault(if value { "true" } else { "false" }))
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<Self::Value, E> {
        let text = Scalar::Text(value.into()).to_string();
        Ok(self.fault(&text))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        while map.next_entry::<IgnoredAny, IgnoredAny>()?.is_some() {}
        Ok(self.fault("an object"))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
        let Self(coordinates, depth) = self;
        let depth = depth + 1;
        let (mut numbers, mut others) = (0_usize, 0_usize);
        let mut position = [0.0; 2];
        while let Some(number) = seq.next_element_seed(Nested(coordinates, depth))? {
            match number {
                Some(value) => {
                    if let Some(axis) = position.get_mut(numbers) {
                        *axis = value;
                    }
                    numbers += 1;
                }
                None => others += 1,
            }
        }
        match (numbers, others) {
            (0, _) => {}
            (1, 0) => {
                Nested(coordinates, depth).fault("a position of one number");
            }
            (_, 0) => {
                let (least, most) = coordinates.depths.unwrap_or((depth, depth));
                coordinates.depths = Some((least.min(depth), most.max(depth)));
                coordinates
                    .points
                    .push(Point2::new(position[0], position[1]));
            }
            _ => {
                Nested(coordinates, depth).fault("a position that is not numbers");
            }
        }
        Ok(None)
    }
}
