//! Objects of which some keys count and none may be there twice.

use std::fmt;
use std::marker::PhantomData;

use serde::de::{Deserialize, Deserializer, Error, IgnoredAny, MapAccess, Visitor};

use crate::geojson::MEMBER;

/// An object that is read key by key.
pub(super) trait Keyed<'de>: Default {
    /// What an error says was expected.
    const EXPECTED: &'static str;

    /// Takes the value of a key; false where the key does not count here and its value is still there.
    fn take<A: MapAccess<'de>>(&mut self, key: Key, map: &mut A) -> Result<bool, A::Error>;
}

/// Reads an object key by key; other keys are passed over.
pub(super) fn keyed<'de, T: Keyed<'de>, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<T, D::Error> {
    struct Keys<T>(PhantomData<T>);

    impl<'de, T: Keyed<'de>> Visitor<'de> for Keys<T> {
        type Value = T;

        fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
            formatter.write_str(T::EXPECTED)
        }

        fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<T, A::Error> {
            let mut found = T::default();
            let mut seen = Seen(0);
            while let Some(key) = map.next_key::<Key>()? {
                seen.first::<A::Error>(key)?;
                if !found.take(key, &mut map)? {
                    map.next_value::<IgnoredAny>()?;
                }
            }
            Ok(found)
        }
    }

    deserializer.deserialize_map(Keys(PhantomData))
}

/// The keys that count, anywhere in a feature.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Key {
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
