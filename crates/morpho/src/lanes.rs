//! A row in lanes: 64 bits that hold 32 columns of the result in the middle and 16 columns more on
//! either side, so that windows of that reach need shifts alone, no carry from word to word.

use crate::element::ElementRun;
use crate::window::Lattice;

/// Columns on either side of those that come out.
const REACH: usize = 16;

const LOW: u64 = 0xffff_ffff;

/// The two lanes for the columns of the middle one of three words.
#[inline(always)]
fn part([a, b, c]: [u64; 3]) -> [u64; 2] {
    [
        b << REACH | a >> (64 - REACH),
        b >> REACH | c << (64 - REACH),
    ]
}

/// The word of the columns that begin at `first` of either lane, 0 to 32.
#[inline(always)]
fn join([low, high]: [u64; 2], first: usize) -> u64 {
    low >> first & LOW | high << (32 - first) & !LOW
}

/// The meets over 2^POWER columns to the right.
#[inline(always)]
fn raise<L: Lattice, const POWER: usize>(mut lane: u64) -> u64 {
    for power in 0..POWER {
        lane = L::meet(lane, lane >> (1 << power));
    }
    lane
}

/// A window of columns that reaches no farther than a lane, as two of 2^power columns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Near {
    /// Where in a lane the windows of its first column begin.
    starts: [usize; 2],
}

impl Near {
    /// The columns of the run, if they suit.
    pub(crate) fn new(run: &ElementRun) -> Option<Self> {
        let reach = REACH.cast_signed();
        let second = run.dx1 + 1 - (1 << run.power());
        (-reach <= run.dx0 && run.dx1 <= reach).then(|| Self {
            starts: [run.dx0, second].map(|dx| (reach + dx).cast_unsigned()),
        })
    }

    /// The meets over the window for the columns of the middle one of three words; `POWER` is the
    /// window's.
    #[inline(always)]
    pub(crate) fn meet<L: Lattice, const POWER: usize>(&self, words: [u64; 3]) -> u64 {
        let lanes = part(words).map(raise::<L, POWER>);
        let [first, second] = self.starts;
        L::meet(join(lanes, first), join(lanes, second))
    }
}

/// The opening of a row by some columns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Opening {
    /// By how much two windows of 2^power columns lie apart.
    apart: usize,
}

impl Opening {
    /// By the columns of the run, if they suit.
    pub(crate) fn new(run: &ElementRun) -> Option<Self> {
        let columns = (run.dx1 - run.dx0 + 1).cast_unsigned();
        (columns <= REACH + 1).then_some(Self {
            apart: columns - (1 << run.power()),
        })
    }

    /// The columns of the middle one of three words that the opening keeps; `POWER` is the
    /// window's.
    #[inline(always)]
    pub(crate) fn kept<const POWER: usize>(&self, words: [u64; 3]) -> u64 {
        join(
            part(words).map(|lane| self.kept_in_lane::<POWER>(lane)),
            REACH,
        )
    }

    /// Whole runs of ones are kept: from the first column where the window fits, a carry runs to
    /// the run's end.
    #[inline(always)]
    fn kept_in_lane<const POWER: usize>(&self, lane: u64) -> u64 {
        let fits = raise::<crate::window::And, POWER>(lane);
        let fits = fits & fits >> self.apart;
        let starts = fits & !(fits << 1);
        lane & !lane.wrapping_add(starts)
    }
}
