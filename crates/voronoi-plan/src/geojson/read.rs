//! Reading: one pass over the text, no tree of values, every feature judged as it comes.

mod coordinates;
mod feature;
mod keys;
mod scalar;

use std::fmt;
use std::io::Read;
use std::path::Path;

use serde::Deserializer as _;
use serde::de::{DeserializeSeed, Error as _, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde_json::value::RawValue;

use super::{MEMBER, NodeIndex, ReadLimits, RouteGraph, RouteGraphError};
use feature::{Element, RawFeature};
use scalar::{Scalar, clipped};

impl RouteGraph {
    /// Reads a route graph from GeoJSON text. Keys that are not Nav2's or ours are skipped, and so are
    /// features of other geometry types, as Nav2 skips them.
    ///
    /// # Errors
    /// [`RouteGraphError`], naming the feature and the key, where the text is no JSON, has no features,
    /// a node has no unsigned 32-bit id or no finite position, an edge has no id, names a node that is
    /// not there, has a cost or clearance that is negative or no number, two nodes or two edges have the
    /// same id, a key that counts is there twice, or the limits are passed.
    pub fn from_geojson(bytes: &[u8], limits: &ReadLimits) -> Result<Self, RouteGraphError> {
        if bytes.len() as u64 > limits.bytes {
            return Err(too_large("file", limits.bytes));
        }
        let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
        let mut reading = Reading {
            limits,
            graph: Self::default(),
            feature: None,
            edge_features: Vec::new(),
            node_features: Vec::new(),
            error: None,
        };
        let mut json = serde_json::Deserializer::from_slice(bytes);
        let outcome = json
            .deserialize_map(CollectionVisitor(&mut reading))
            .and_then(|()| json.end());
        if let Some(error) = reading.error.take() {
            return Err(error);
        }
        outcome.map_err(|error| RouteGraphError::Syntax {
            feature: reading.feature,
            message: clipped(&error.to_string(), 200),
        })?;
        reading.finish()
    }

    /// Reads a route graph from a file.
    ///
    /// # Errors
    /// [`RouteGraphError::Io`] where the file cannot be read, else as [`RouteGraph::from_geojson`].
    pub fn load(path: &Path, limits: &ReadLimits) -> Result<Self, RouteGraphError> {
        let file = std::fs::File::open(path)?;
        let length = file.metadata()?.len();
        if length > limits.bytes {
            return Err(too_large("file", limits.bytes));
        }
        let mut bytes = Vec::new();
        // one more than allowed: what has no length of its own (a pipe) is held to the limit too
        file.take(limits.bytes.saturating_add(1))
            .read_to_end(&mut bytes)?;
        Self::from_geojson(&bytes, limits)
    }
}

const fn too_large(what: &'static str, limit: u64) -> RouteGraphError {
    RouteGraphError::TooLarge { what, limit }
}

/// What has been read so far.
struct Reading<'l> {
    limits: &'l ReadLimits,
    graph: RouteGraph,
    /// The feature being read.
    feature: Option<usize>,
    /// The features that the nodes and edges came from.
    node_features: Vec<u32>,
    edge_features: Vec<u32>,
    /// A fault of ours, which serde's error type cannot carry.
    error: Option<RouteGraphError>,
}

impl Reading<'_> {
    fn add(&mut self, index: usize, element: Option<Element>) -> Result<(), RouteGraphError> {
        // a feature takes more than 2 bytes of a file of less than 2^32
        let feature = u32::try_from(index).unwrap_or(u32::MAX);
        match element {
            None => {}
            Some(Element::Node(node)) => {
                if self.graph.nodes.len() >= self.limits.nodes {
                    return Err(too_large("nodes", self.limits.nodes as u64));
                }
                self.graph.nodes.push(node);
                self.node_features.push(feature);
            }
            Some(Element::Edge(edge)) => {
                if self.graph.edges.len() >= self.limits.edges {
                    return Err(too_large("edges", self.limits.edges as u64));
                }
                self.graph.edges.push(edge);
                self.edge_features.push(feature);
            }
        }
        Ok(())
    }

    /// What can only be judged when all is there: ids.
    fn finish(self) -> Result<RouteGraph, RouteGraphError> {
        let graph = self.graph;
        let fault = |feature: u32, key, expected, found: u32| RouteGraphError::Feature {
            feature: feature as usize,
            key,
            expected,
            found: found.to_string(),
        };
        let nodes = graph.nodes.iter().map(|node| node.id);
        if let Some((feature, id)) = repeated(nodes.zip(self.node_features)) {
            return Err(fault(feature, "id", "an id that no other node has", id));
        }
        let edges = graph.edges.iter().map(|edge| edge.id);
        if let Some((feature, id)) = repeated(edges.zip(self.edge_features.iter().copied())) {
            return Err(fault(feature, "id", "an id that no other edge has", id));
        }
        let index = NodeIndex::new(&graph.nodes);
        for (edge, &feature) in graph.edges.iter().zip(&self.edge_features) {
            for (key, id) in [("startid", edge.start), ("endid", edge.end)] {
                if index.get(id).is_none() {
                    return Err(fault(feature, key, "the id of a node", id));
                }
            }
        }
        Ok(graph)
    }
}

/// The feature and id of the first id that was there before.
fn repeated(ids: impl Iterator<Item = (u32, u32)> + Clone) -> Option<(u32, u32)> {
    let mut last = None;
    let mut ascending = true;
    for (id, _) in ids.clone() {
        ascending &= last.is_none_or(|last| last < id);
        last = Some(id);
    }
    if ascending {
        return None;
    }
    let mut sorted: Vec<(u32, u32)> = ids.collect();
    sorted.sort_unstable();
    let pairs = sorted.windows(2).filter(|pair| pair[0].0 == pair[1].0);
    pairs.map(|pair| (pair[1].1, pair[1].0)).min()
}

struct CollectionVisitor<'r, 'l>(&'r mut Reading<'l>);

impl<'de> Visitor<'de> for CollectionVisitor<'_, '_> {
    type Value = ();

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a GeoJSON FeatureCollection")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        let reading = self.0;
        let mut seen_features = false;
        while let Some(key) = map.next_key::<Scalar>()? {
            let fault = |key, expected, found: String| RouteGraphError::Collection {
                key,
                expected,
                found,
            };
            match key.as_text().unwrap_or_default() {
                "type" => {
                    let found = map.next_value::<Scalar>()?;
                    if found.as_text() != Some("FeatureCollection") {
                        let found = found.to_string();
                        reading.error = Some(fault("type", "\"FeatureCollection\"", found));
                        return Err(A::Error::custom("type"));
                    }
                }
                "features" if seen_features => {
                    let found = "a second one".to_owned();
                    reading.error = Some(fault("features", "one list of features", found));
                    return Err(A::Error::custom("features"));
                }
                "features" => {
                    seen_features = true;
                    map.next_value_seed(Features(reading))?;
                    reading.feature = None;
                }
                MEMBER => {
                    let text = map.next_value::<&RawValue>()?;
                    reading.graph.voronoi = Some(text.get().into());
                }
                _ => {
                    map.next_value::<IgnoredAny>()?;
                }
            }
        }
        if !seen_features {
            reading.error = Some(RouteGraphError::Collection {
                key: "features",
                expected: "a list of features",
                found: "nothing".to_owned(),
            });
            return Err(A::Error::custom("features"));
        }
        Ok(())
    }
}

struct Features<'r, 'l>(&'r mut Reading<'l>);

impl<'de> DeserializeSeed<'de> for Features<'_, '_> {
    type Value = ();

    fn deserialize<D: serde::Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de> Visitor<'de> for Features<'_, '_> {
    type Value = ();

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("`features` to be a list")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<(), A::Error> {
        let reading = self.0;
        for index in 0.. {
            reading.feature = Some(index);
            let Some(raw) = seq.next_element::<RawFeature<'_>>()? else {
                break;
            };
            let judged = raw.judge(index);
            if let Err(error) = judged.and_then(|element| reading.add(index, element)) {
                reading.error = Some(error);
                return Err(A::Error::custom("feature"));
            }
        }
        Ok(())
    }
}
