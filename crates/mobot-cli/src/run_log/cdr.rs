//! ROS 2's message bytes: little-endian CDR, every number aligned to its size. (Object Management Group,
//! DDSI-RTPS 2.5, section 10; as ROS 2 and its bags use it.)

use thiserror::Error;

/// Bytes before a message: little-endian CDR, no options. Alignment counts from behind them.
const HEADER: [u8; 4] = [0, 1, 0, 0];

/// Why bytes are not a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum CdrError {
    /// Not little-endian CDR.
    #[error("expected little-endian CDR, found other bytes at its start")]
    Header,
    /// Bytes are missing.
    #[error("byte {at}: expected more bytes, found the end")]
    End {
        /// Where a field begins that is not there.
        at: usize,
    },
    /// A text that is none.
    #[error("byte {at}: expected UTF-8 text that ends in a zero byte")]
    Text {
        /// Where it begins.
        at: usize,
    },
    /// A truth value that is neither 0 nor 1.
    #[error("byte {at}: expected 0 or 1, found {found}")]
    Bool {
        /// Where it is.
        at: usize,
        /// The byte.
        found: u8,
    },
}

/// A message being written.
#[derive(Debug)]
pub struct CdrWriter {
    bytes: Vec<u8>,
}

impl CdrWriter {
    fn align(&mut self, size: usize) {
        let over = (self.bytes.len() - HEADER.len()) % size;
        if over != 0 {
            self.bytes.resize(self.bytes.len() + size - over, 0);
        }
    }
}

/// A message being read.
#[derive(Debug)]
pub struct CdrReader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> CdrReader<'a> {
    fn take(&mut self, size: usize) -> Result<&'a [u8], CdrError> {
        let at = self.at;
        let taken = self.bytes.get(at..).and_then(|rest| rest.get(..size));
        self.at += taken.map_or(0, <[u8]>::len);
        taken.ok_or(CdrError::End { at })
    }

    fn align(&mut self, size: usize) {
        let over = (self.at - HEADER.len()) % size;
        if over != 0 {
            self.at += size - over;
        }
    }

    fn number<const N: usize>(&mut self) -> Result<[u8; N], CdrError> {
        self.align(N);
        let at = self.at;
        let bytes = self.take(N)?;
        bytes.try_into().map_err(|_| CdrError::End { at })
    }
}

/// The bytes of a message.
#[must_use]
pub fn to_bytes<T: Cdr>(message: &T) -> Vec<u8> {
    let mut out = CdrWriter {
        bytes: HEADER.to_vec(),
    };
    message.put(&mut out);
    out.bytes
}

/// The message of some bytes; bytes behind it are ignored.
///
/// # Errors
/// [`CdrError`]
pub fn from_bytes<T: Cdr>(bytes: &[u8]) -> Result<T, CdrError> {
    if !bytes.starts_with(&HEADER) {
        return Err(CdrError::Header);
    }
    T::get(&mut CdrReader {
        bytes,
        at: HEADER.len(),
    })
}

/// The definition of a message and of all that is in it, as ROS 2 writes them (`ros2msg`).
#[must_use]
pub fn definition<T: Cdr>() -> String {
    let mut parts = Vec::new();
    T::define(&mut parts);
    let line = "=".repeat(80);
    let mut text = String::new();
    for (name, fields) in parts {
        if !text.is_empty() {
            text += &format!("{line}\nMSG: {name}\n");
        }
        text += &fields;
    }
    text
}

/// Something that has a place in a message.
pub trait Cdr: Sized {
    /// Its name in a message's definition.
    fn ros_name() -> String;

    /// Adds the definitions of itself and of what it is made of, where they are not among them.
    fn define(_parts: &mut Vec<(String, String)>) {}

    /// Writes it.
    fn put(&self, out: &mut CdrWriter);

    /// Reads it.
    ///
    /// # Errors
    /// [`CdrError`]
    fn get(bytes: &mut CdrReader<'_>) -> Result<Self, CdrError>;

    /// Writes many, one behind the other.
    fn put_all(all: &[Self], out: &mut CdrWriter) {
        for one in all {
            one.put(out);
        }
    }

    /// Reads many. Memory grows with what is there, not with what was promised.
    ///
    /// # Errors
    /// [`CdrError`]
    fn get_all(count: usize, bytes: &mut CdrReader<'_>) -> Result<Vec<Self>, CdrError> {
        let mut all = Vec::new();
        for _ in 0..count {
            all.push(Self::get(bytes)?);
        }
        Ok(all)
    }
}

macro_rules! numbers {
    ($($number:ty => $name:literal),*) => {$(
        impl Cdr for $number {
            fn ros_name() -> String {
                $name.into()
            }
            fn put(&self, out: &mut CdrWriter) {
                out.align(size_of::<Self>());
                out.bytes.extend(self.to_le_bytes());
            }
            fn get(bytes: &mut CdrReader<'_>) -> Result<Self, CdrError> {
                bytes.number().map(Self::from_le_bytes)
            }
        }
    )*};
}

numbers!(u32 => "uint32", u64 => "uint64", i32 => "int32", f32 => "float32", f64 => "float64");

impl Cdr for u8 {
    fn ros_name() -> String {
        "uint8".into()
    }
    fn put(&self, out: &mut CdrWriter) {
        out.bytes.push(*self);
    }
    fn get(bytes: &mut CdrReader<'_>) -> Result<Self, CdrError> {
        bytes.number().map(|[byte]| byte)
    }
    fn put_all(all: &[Self], out: &mut CdrWriter) {
        out.bytes.extend_from_slice(all);
    }
    fn get_all(count: usize, bytes: &mut CdrReader<'_>) -> Result<Vec<Self>, CdrError> {
        bytes.take(count).map(<[u8]>::to_vec)
    }
}

impl Cdr for i8 {
    fn ros_name() -> String {
        "int8".into()
    }
    fn put(&self, out: &mut CdrWriter) {
        out.bytes.push(self.cast_unsigned());
    }
    fn get(bytes: &mut CdrReader<'_>) -> Result<Self, CdrError> {
        u8::get(bytes).map(u8::cast_signed)
    }
    fn get_all(count: usize, bytes: &mut CdrReader<'_>) -> Result<Vec<Self>, CdrError> {
        let taken = bytes.take(count)?;
        Ok(taken.iter().map(|byte| byte.cast_signed()).collect())
    }
}

impl Cdr for bool {
    fn ros_name() -> String {
        "bool".into()
    }
    fn put(&self, out: &mut CdrWriter) {
        out.bytes.push(u8::from(*self));
    }
    fn get(bytes: &mut CdrReader<'_>) -> Result<Self, CdrError> {
        let at = bytes.at;
        match u8::get(bytes)? {
            0 => Ok(false),
            1 => Ok(true),
            found => Err(CdrError::Bool { at, found }),
        }
    }
}

impl Cdr for String {
    fn ros_name() -> String {
        "string".into()
    }
    fn put(&self, out: &mut CdrWriter) {
        (self.len() as u32 + 1).put(out);
        out.bytes.extend_from_slice(self.as_bytes());
        out.bytes.push(0);
    }
    fn get(bytes: &mut CdrReader<'_>) -> Result<Self, CdrError> {
        let length = u32::get(bytes)? as usize;
        let at = bytes.at;
        let text = bytes.take(length)?;
        let text = match text {
            // some writers leave the zero byte out where there is no text
            [] => text,
            [text @ .., 0] => text,
            _ => return Err(CdrError::Text { at }),
        };
        let text = std::str::from_utf8(text).map_err(|_| CdrError::Text { at })?;
        Ok(text.into())
    }
}

impl<T: Cdr> Cdr for Vec<T> {
    fn ros_name() -> String {
        T::ros_name() + "[]"
    }
    fn define(parts: &mut Vec<(String, String)>) {
        T::define(parts);
    }
    fn put(&self, out: &mut CdrWriter) {
        (self.len() as u32).put(out);
        T::put_all(self, out);
    }
    fn get(bytes: &mut CdrReader<'_>) -> Result<Self, CdrError> {
        let count = u32::get(bytes)? as usize;
        T::get_all(count, bytes)
    }
}

impl<const N: usize> Cdr for [f64; N] {
    fn ros_name() -> String {
        format!("float64[{N}]")
    }
    fn put(&self, out: &mut CdrWriter) {
        f64::put_all(self, out);
    }
    fn get(bytes: &mut CdrReader<'_>) -> Result<Self, CdrError> {
        let mut all = [0.0; N];
        for one in &mut all {
            *one = f64::get(bytes)?;
        }
        Ok(all)
    }
}

/// A message or a part of one: its name in ROS, its fields in their order. Fields are public and bear
/// ROS's names.
macro_rules! ros_message {
    ($(#[$doc:meta])* $name:ident = $ros:literal { $($field:ident: $kind:ty),* $(,)? }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq)]
        #[expect(missing_docs, reason = "fields are those of ROS's messages")]
        pub struct $name {
            $(pub $field: $kind),*
        }

        impl $crate::run_log::cdr::Cdr for $name {
            fn ros_name() -> String {
                $ros.into()
            }
            fn define(parts: &mut Vec<(String, String)>) {
                if parts.iter().any(|(name, _)| name == $ros) {
                    return;
                }
                let mut fields = String::new();
                $(
                    fields += &<$kind as $crate::run_log::cdr::Cdr>::ros_name();
                    fields += concat!(" ", stringify!($field), "\n");
                )*
                parts.push(($ros.into(), fields));
                $(<$kind as $crate::run_log::cdr::Cdr>::define(parts);)*
            }
            fn put(&self, out: &mut $crate::run_log::cdr::CdrWriter) {
                $(self.$field.put(out);)*
            }
            fn get(
                bytes: &mut $crate::run_log::cdr::CdrReader<'_>,
            ) -> Result<Self, $crate::run_log::cdr::CdrError> {
                Ok(Self {
                    $($field: $crate::run_log::cdr::Cdr::get(bytes)?),*
                })
            }
        }
    };
}

pub(crate) use ros_message;
