//! Two of three: protocols without a checksum let one wrong reading in some hundreds pass, but hardly the
//! same one twice.

use occgrid::Reading;

/// Readings further apart than this do not agree [m]: twice what a robot of 0.5 m/s drives in a cycle.
const AGREE: f64 = 0.1;

/// Collects up to three readings of one ping.
#[derive(Debug, Clone, Default)]
pub(crate) struct Gate {
    seen: Vec<Reading>,
}

impl Gate {
    /// One more reading. Gives it where it agrees with an earlier one; [`Reading::Fault`] where none of
    /// three agree.
    pub(crate) fn pass(&mut self, reading: Reading) -> Option<Reading> {
        if self.seen.iter().any(|seen| agree(*seen, reading)) {
            return Some(reading);
        }
        self.seen.push(reading);
        (self.seen.len() >= 3).then_some(Reading::Fault)
    }
}

fn agree(a: Reading, b: Reading) -> bool {
    match (a, b) {
        (Reading::Echo { range: a }, Reading::Echo { range: b }) => (a - b).abs() <= AGREE,
        (Reading::NoEcho { .. }, Reading::NoEcho { .. })
        | (Reading::TooClose, Reading::TooClose) => true,
        _ => false,
    }
}
