//! The cells that are not free, in a tree of 8 x 8 blocks, and the search for the one nearest to a segment.
//!
//! A word holds an 8 x 8 block: bit `8 (row % 8) + col % 8` tells whether the child at that place holds an
//! obstacle; children are cells at level 0 and the words of the level below above it. A block is entered
//! only where the segment is nearer to it than to the best cell so far (branch and bound), so the work
//! depends on what lies about the segment, not on the size of the map or of its empty halls.

use occgrid::{CellState, OccupancyMap};

use super::UnknownIs;
use super::segment::{Segment, Square};

/// Children a side of a block.
const FAN: usize = 8;

/// One level: a word a block, row-major.
#[derive(Debug, Clone)]
struct Level {
    cols: usize,
    words: Vec<u64>,
    /// Side of a child [cells].
    child_side: f64,
}

/// The obstacles of a map.
#[derive(Debug, Clone)]
pub(super) struct ObstacleTree {
    /// Finest first; the last has one word.
    levels: Vec<Level>,
}

/// A cell and the squared distance to it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Nearest {
    pub(super) distance2: f64,
    /// [`None`] while only an upper bound is known.
    pub(super) cell: Option<Square>,
}

impl Nearest {
    /// Nothing nearer than the bound [cells] is asked for.
    pub(super) const fn bounded_by(distance: f64) -> Self {
        Self {
            distance2: distance * distance,
            cell: None,
        }
    }

    /// Takes a cell if it is nearer.
    pub(super) fn offer(&mut self, segment: &Segment, cell: Square) {
        let distance2 = segment.distance2(&cell);
        if distance2 < self.distance2 {
            *self = Self {
                distance2,
                cell: Some(cell),
            };
        }
    }
}

impl ObstacleTree {
    pub(super) fn new(map: &OccupancyMap, unknown: UnknownIs) -> Self {
        let finest = Self::finest(map, unknown);
        let mut rows = (map.frame().height() as usize).div_ceil(FAN);
        let mut levels = vec![finest];
        while let Some(below) = levels.last().filter(|level| level.words.len() > 1) {
            let above = below.above(rows);
            rows = rows.div_ceil(FAN);
            levels.push(above);
        }
        Self { levels }
    }

    fn finest(map: &OccupancyMap, unknown: UnknownIs) -> Level {
        let mut obstacle = [0_u64; 256];
        for value in i8::MIN..=i8::MAX {
            let is_obstacle = match map.classify(value) {
                CellState::Free => false,
                CellState::Occupied => true,
                CellState::Unknown => unknown == UnknownIs::Occupied,
            };
            obstacle[usize::from(value.cast_unsigned())] = u64::from(is_obstacle);
        }
        let width = map.frame().width() as usize;
        let height = map.frame().height() as usize;
        let cols = width.div_ceil(FAN);
        let mut words = vec![0_u64; cols * height.div_ceil(FAN)];
        for (row, values) in map.values().chunks_exact(width).enumerate() {
            let blocks = &mut words[row / FAN * cols..][..cols];
            for (word, eight) in blocks.iter_mut().zip(values.chunks(FAN)) {
                let mut bits = 0;
                for (i, value) in eight.iter().enumerate() {
                    bits |= obstacle[usize::from(value.cast_unsigned())] << i;
                }
                *word |= bits << (FAN * (row % FAN));
            }
        }
        Level {
            cols,
            words,
            child_side: 1.0,
        }
    }

    /// Improves `best` to the nearest obstacle cell, if one is nearer than it.
    pub(super) fn nearest(&self, segment: &Segment, best: &mut Nearest) {
        let top = self.levels.len() - 1;
        self.descend(top, 0, 0, segment, best);
    }

    fn descend(&self, level: usize, col: usize, row: usize, segment: &Segment, best: &mut Nearest) {
        let Level {
            cols,
            words,
            child_side,
        } = &self.levels[level];
        let (side, left, top) = (*child_side, (col * FAN) as f64, (row * FAN) as f64);
        let mut bits = words[row * cols + col] & reach(segment, best, left, top, side);
        let square = |bit: usize| Square {
            x: (left + (bit % FAN) as f64) * side,
            y: (top + (bit / FAN) as f64) * side,
            side,
        };
        if level == 0 {
            while bits != 0 && best.distance2 > 0.0 {
                best.offer(segment, square(bits.trailing_zeros() as usize));
                bits &= bits - 1;
            }
            return;
        }
        let mut children = [(0.0_f64, 0_usize); FAN * FAN];
        let mut count = 0;
        while bits != 0 {
            let bit = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let distance2 = segment.distance2(&square(bit));
            if distance2 < best.distance2 {
                children[count] = (distance2, bit);
                count += 1;
            }
        }
        let children = &mut children[..count];
        children.sort_unstable_by(|p, q| p.0.total_cmp(&q.0).then(p.1.cmp(&q.1)));
        for &(distance2, bit) in children.iter() {
            if distance2 >= best.distance2 {
                break;
            }
            let (child_col, child_row) = (col * FAN + bit % FAN, row * FAN + bit / FAN);
            self.descend(level - 1, child_col, child_row, segment, best);
        }
    }
}

impl Level {
    /// The level above this one, which has `rows` rows of words.
    fn above(&self, rows: usize) -> Self {
        let cols = self.cols.div_ceil(FAN);
        let mut words = vec![0_u64; cols * rows.div_ceil(FAN)];
        for (index, &word) in self.words.iter().enumerate() {
            let (col, row) = (index % self.cols, index / self.cols);
            let bit = row % FAN * FAN + col % FAN;
            words[row / FAN * cols + col / FAN] |= u64::from(word != 0) << bit;
        }
        Self {
            cols,
            words,
            child_side: self.child_side * FAN as f64,
        }
    }
}

/// The children of a block that the segment's bounding box, grown by the best distance, can touch.
fn reach(segment: &Segment, best: &Nearest, left: f64, top: f64, side: f64) -> u64 {
    // a whisker more than the distance, so that rounding never hides a cell
    let grow = best.distance2.sqrt() * (1.0 + 1e-12) + 1e-9;
    let span = |low: f64, high: f64, origin: f64| -> Option<(u32, u32)> {
        let first = ((low - grow) / side - origin).floor().max(0.0);
        let last = ((high + grow) / side - origin).floor().min(7.0);
        (first <= last && last >= 0.0 && first <= 7.0).then_some((first as u32, last as u32))
    };
    let Some((first_col, last_col)) = span(segment.min_x(), segment.max_x(), left) else {
        return 0;
    };
    let Some((first_row, last_row)) = span(segment.min_y(), segment.max_y(), top) else {
        return 0;
    };
    let one_row = (0xFF_u64 >> (7 - last_col)) & (0xFF << first_col);
    let rows = (u64::MAX >> (8 * (7 - last_row))) & (u64::MAX << (8 * first_row));
    (one_row * 0x0101_0101_0101_0101) & rows
}
