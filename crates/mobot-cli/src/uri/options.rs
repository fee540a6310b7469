//! The options of a device URI: `?key=value&key=value`.

use super::UriError;

/// Options that were typed and not yet taken, and the keys that were asked for.
#[derive(Debug, Default)]
pub struct Options {
    typed: Vec<(String, String)>,
    known: Vec<&'static str>,
}

impl Options {
    /// What follows the question mark.
    ///
    /// # Errors
    /// [`UriError::Value`] where a part is no `key=value`.
    pub fn parse(text: &str) -> Result<Self, UriError> {
        let pair = |part: &str| {
            let pair = part.split_once('=').filter(|(key, _)| !key.is_empty());
            pair.map(|(key, value)| (key.to_owned(), value.to_owned()))
                .ok_or_else(|| UriError::Value {
                    key: "options",
                    expected: "key=value&key=value",
                    found: part.to_owned(),
                })
        };
        Ok(Self {
            typed: text.split('&').map(pair).collect::<Result<_, _>>()?,
            known: Vec::new(),
        })
    }

    /// The value of an option, where it was typed.
    ///
    /// # Errors
    /// [`UriError::Value`] where `read` makes nothing of it, or where it was typed twice.
    pub fn take<T>(
        &mut self,
        key: &'static str,
        expected: &'static str,
        read: impl Fn(&str) -> Option<T>,
    ) -> Result<Option<T>, UriError> {
        self.known.push(key);
        let mut values = self.typed.extract_if(.., |(typed, _)| typed == key);
        let Some((_, found)) = values.next() else {
            return Ok(None);
        };
        if values.next().is_some() {
            return Err(UriError::Value {
                key,
                expected: "to be given once",
                found: format!("{key}={found} and another"),
            });
        }
        let value = read(&found);
        let refused = UriError::Value {
            key,
            expected,
            found,
        };
        value.map(Some).ok_or(refused)
    }

    /// A finite number within bounds.
    ///
    /// # Errors
    /// As [`Options::take`].
    pub fn number(
        &mut self,
        key: &'static str,
        expected: &'static str,
        [least, most]: [f64; 2],
    ) -> Result<Option<f64>, UriError> {
        self.take(key, expected, |text| {
            let value: f64 = text.parse().ok()?;
            (least..=most).contains(&value).then_some(value)
        })
    }

    /// Refuses what nobody took.
    ///
    /// # Errors
    /// [`UriError::Unknown`]
    pub fn finish(&self, scheme: &str) -> Result<(), UriError> {
        let Some((key, _)) = self.typed.first() else {
            return Ok(());
        };
        let known = if self.known.is_empty() {
            "none".to_owned()
        } else {
            self.known.join(", ")
        };
        Err(UriError::Unknown {
            scheme: scheme.to_owned(),
            expected: known,
            found: key.clone(),
        })
    }
}
