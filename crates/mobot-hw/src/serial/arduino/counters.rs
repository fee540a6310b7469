//! Encoder counts that come as text without a checksum: a digit lost or turned is a jump.

/// What the wheels have rolled [counts].
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Counters {
    last: Option<[i32; 2]>,
    doubted: Option<[i32; 2]>,
    pub(super) totals: [i64; 2],
    /// When the last good reading came [s].
    pub(super) heard: f64,
}

impl Counters {
    /// Takes a reading. Says no where it is the first one, or a wheel would have rolled more than `most` counts
    /// since the last one. Where the next reading is of the same mind, it is right: the last one was wrong or,
    /// with counts near 0, the firmware has begun anew.
    pub(super) fn update(&mut self, counts: [i32; 2], most: f64, now: f64) -> bool {
        let rolled = |from: [i32; 2]| [0, 1].map(|side| counts[side].wrapping_sub(from[side]));
        let near = |from| rolled(from).iter().all(|n| f64::from(*n).abs() <= most);
        let confirmed = self.doubted.take().is_some_and(near);
        let follows = self.last.is_some_and(near);
        if !follows && !confirmed {
            self.doubted = Some(counts);
            return false;
        }
        if let Some(before) = self.last
            && (follows || !near([0, 0]))
        {
            for (total, rolled) in self.totals.iter_mut().zip(rolled(before)) {
                *total += i64::from(rolled);
            }
        }
        self.last = Some(counts);
        self.heard = now;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_jump_is_doubted_and_two_are_the_truth() {
        let mut counters = Counters::default();
        assert!(!counters.update([10, -1000], 50.0, 0.0));
        assert!(!counters.update([1000, -1000], 50.0, 0.0));
        assert!(counters.update([1000, -1000], 50.0, 0.0));
        assert!(counters.update([1010, -1020], 50.0, 0.0));
        assert!(!counters.update([101, -1030], 50.0, 0.0));
        assert!(counters.update([1020, -1040], 50.0, 0.0));
        assert_eq!(counters.totals, [20, -40]);
        assert!(!counters.update([3, 4], 50.0, 0.0));
        assert!(counters.update([5, 7], 50.0, 0.0));
        assert_eq!(counters.totals, [20, -40]);
        assert!(counters.update([15, 8], 50.0, 0.0));
        assert_eq!(counters.totals, [30, -39]);
        // far from 0 the last reading was wrong
        assert!(!counters.update([515, 8], 50.0, 0.0));
        assert!(counters.update([516, 8], 50.0, 0.0));
        assert_eq!(counters.totals, [531, -39]);
    }
}
