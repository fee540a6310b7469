//! Writing: one feature a line, floats in the shortest form that reads back the same.

use std::io::Write;

use occgrid::Point2;
use serde::{Serialize, Serializer};
use serde_json::value::RawValue;

use super::{RouteEdge, RouteGraph, RouteGraphError, RouteNode};

#[derive(Serialize)]
struct Feature<P, G> {
    r#type: &'static str,
    properties: P,
    geometry: G,
}

#[derive(Serialize)]
struct NodeProperties<'a> {
    id: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    frame: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    metadata: Option<&'a RawValue>,
    #[serde(skip_serializing_if = "Option::is_none")]
    operations: Option<&'a RawValue>,
    #[serde(skip_serializing_if = "Option::is_none")]
    voronoi_plan: Option<&'a RawValue>,
}

#[derive(Serialize)]
struct EdgeProperties<'a> {
    id: u32,
    startid: u32,
    endid: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    cost: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    overridable: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    clearance: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    metadata: Option<&'a RawValue>,
    #[serde(skip_serializing_if = "Option::is_none")]
    operations: Option<&'a RawValue>,
    #[serde(skip_serializing_if = "Option::is_none")]
    voronoi_plan: Option<&'a RawValue>,
}

#[derive(Serialize)]
struct PointGeometry {
    r#type: &'static str,
    coordinates: [f64; 2],
}

#[derive(Serialize)]
struct LineGeometry<'a> {
    r#type: &'static str,
    coordinates: [Positions<'a>; 1],
}

struct Positions<'a>(&'a [Point2]);

impl Serialize for Positions<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.iter().map(|p| [p.x, p.y]))
    }
}

impl RouteGraph {
    /// Writes the graph as GeoJSON: nodes, then edges, in their order, one a line; edges as
    /// MultiLineString with one part, as Nav2's own files have them, and an edge without a polyline
    /// as the straight line between its nodes. The same graph gives the same bytes.
    ///
    /// # Errors
    /// [`RouteGraphError::Element`] for a coordinate, cost or clearance that is not finite and for what
    /// is no JSON in a text field; [`RouteGraphError::Io`] where the writer fails. What was written
    /// until then is no whole graph: write to a buffer, or to a file that is renamed at the end.
    pub fn write(&self, mut writer: impl Write) -> Result<(), RouteGraphError> {
        writer.write_all(b"{\n\"type\": \"FeatureCollection\",\n\"name\": \"graph\",\n")?;
        if let Some(text) = &self.voronoi {
            let member: Result<&RawValue, _> = serde_json::from_str(text);
            let member = member.map_err(|error| RouteGraphError::Collection {
                key: super::MEMBER,
                expected: "JSON",
                found: error.to_string(),
            })?;
            writeln!(writer, "\"{}\": {},", super::MEMBER, member.get())?;
        }
        writer.write_all(b"\"features\": [")?;
        let mut separator: &[u8] = b"\n";
        for node in &self.nodes {
            writer.write_all(separator)?;
            separator = b",\n";
            put(&mut writer, &node.feature()?)?;
        }
        let mut straight = self.chords();
        for edge in &self.edges {
            let chord = straight.next();
            let chord = chord.as_ref().map(|line| &*line.points);
            let points = edge.polyline.as_deref().or(chord).unwrap_or_default();
            writer.write_all(separator)?;
            separator = b",\n";
            put(&mut writer, &edge.feature(points)?)?;
        }
        writer.write_all(b"\n]\n}\n")?;
        Ok(())
    }

    /// The graph as GeoJSON text; see [`RouteGraph::write`].
    ///
    /// # Errors
    /// As [`RouteGraph::write`].
    pub fn to_geojson(&self) -> Result<Vec<u8>, RouteGraphError> {
        let mut bytes = Vec::new();
        self.write(&mut bytes)?;
        Ok(bytes)
    }
}

impl RouteNode {
    fn feature(&self) -> Result<Feature<NodeProperties<'_>, PointGeometry>, RouteGraphError> {
        let fault = |key, expected, found| RouteGraphError::Element {
            what: "node",
            id: self.id,
            key,
            expected,
            found,
        };
        let raw = |key, text| raw(text).map_err(|found| fault(key, "JSON", found));
        let coordinates = [self.point.x, self.point.y];
        if let Some(found) = coordinates.iter().find(|v| !v.is_finite()) {
            return Err(fault("coordinates", "finite numbers", found.to_string()));
        }
        Ok(Feature {
            r#type: "Feature",
            properties: NodeProperties {
                id: self.id,
                frame: self.frame.as_deref(),
                metadata: raw("metadata", &self.metadata)?,
                operations: raw("operations", &self.operations)?,
                voronoi_plan: raw(super::MEMBER, &self.voronoi)?,
            },
            geometry: PointGeometry {
                r#type: "Point",
                coordinates,
            },
        })
    }
}

impl RouteEdge {
    fn feature<'a>(
        &'a self,
        points: &'a [Point2],
    ) -> Result<Feature<EdgeProperties<'a>, LineGeometry<'a>>, RouteGraphError> {
        let fault = |key, expected, found| RouteGraphError::Element {
            what: "edge",
            id: self.id,
            key,
            expected,
            found,
        };
        let raw = |key, text| raw(text).map_err(|found| fault(key, "JSON", found));
        let mut coordinates = points.iter().flat_map(|p| [p.x, p.y]);
        if let Some(found) = coordinates.find(|v| !v.is_finite()) {
            return Err(fault("coordinates", "finite numbers", found.to_string()));
        }
        for (key, value) in [("cost", self.cost), ("clearance", self.clearance)] {
            if let Some(found) = value.filter(|v| !v.is_finite()) {
                return Err(fault(key, "a finite number", found.to_string()));
            }
        }
        Ok(Feature {
            r#type: "Feature",
            properties: EdgeProperties {
                id: self.id,
                startid: self.start,
                endid: self.end,
                cost: self.cost,
                overridable: self.overridable,
                clearance: self.clearance,
                metadata: raw("metadata", &self.metadata)?,
                operations: raw("operations", &self.operations)?,
                voronoi_plan: raw(super::MEMBER, &self.voronoi)?,
            },
            geometry: LineGeometry {
                r#type: "MultiLineString",
                coordinates: [Positions(points)],
            },
        })
    }
}

fn raw(text: &Option<Box<str>>) -> Result<Option<&RawValue>, String> {
    text.as_deref()
        .map(|text| serde_json::from_str(text).map_err(|error| error.to_string()))
        .transpose()
}

fn put(writer: &mut impl Write, feature: &impl Serialize) -> Result<(), RouteGraphError> {
    serde_json::to_writer(writer, feature).map_err(|error| RouteGraphError::Io {
        message: error.to_string(),
    })
}
