//! The positions of a geometry, at whatever nesting.

use std::fmt;

use occgrid::Point2;
use serde::de::{
    Deserialize, DeserializeSeed, Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor,
};

use super::scalar::Scalar;

/// The positions of a geometry, whatever its nesting.
#[derive(Default)]
pub(super) struct Coordinates {
    pub(super) points: Vec<Point2>,
    /// Least and greatest nesting of a position: 1 for `[x, y]`.
    pub(super) depths: Option<(usize, usize)>,
    /// The first thing that is no position nor a list of them.
    pub(super) fault: Option<String>,
}

impl<'de> Deserialize<'de> for Coordinates {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut coordinates = Self::default();
        Nested(&mut coordinates, 0).deserialize(deserializer)?;
        Ok(coordinates)
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
