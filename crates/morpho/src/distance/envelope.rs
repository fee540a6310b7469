//! The second pass for rows with a long reach: lower envelopes of parabolas.
//!
//! The pixels left of `x` cast parabolas of one width, so of two of them the nearer one, once it is
//! the lower, stays the lower further right: a queue of those that can still win serves a walk to
//! the right; a walk to the left serves the other side.

use super::transform::{FAR, Metric};

/// What a pixel of the row casts in the direction of the walk.
#[derive(Debug, Clone, Copy)]
struct Parabola {
    vertex: i64,
    height: i64,
}

impl Parabola {
    #[inline(always)]
    const fn at(self, x: i64) -> i64 {
        let d = x - self.vertex;
        d * d + self.height
    }

    /// Whether `middle` is nowhere alone the lowest of three with ascending vertices: its crossing
    /// with `last` does not come after its crossing with `first`.
    #[inline(always)]
    const fn hides(first: Self, middle: Self, last: Self) -> bool {
        let rise = middle.at(0) - first.at(0);
        let next_rise = last.at(0) - middle.at(0);
        rise * (last.vertex - middle.vertex) >= next_rise * (middle.vertex - first.vertex)
    }
}

/// The parabolas that can still win, in the order of the walk.
#[derive(Debug, Clone, Default)]
pub(super) struct Queue {
    parabolas: Vec<Parabola>,
    front: usize,
}

impl Queue {
    fn clear(&mut self) {
        self.parabolas.clear();
        self.front = 0;
    }

    #[inline(always)]
    fn push(&mut self, new: Parabola) {
        if new.height == 0 {
            self.clear();
        }
        while let [.., first, middle] = self.parabolas[self.front..] {
            if !Parabola::hides(first, middle, new) {
                break;
            }
            self.parabolas.pop();
        }
        self.parabolas.push(new);
    }

    /// The lowest at `x`, which is at or past all vertices and never less than before.
    #[inline(always)]
    fn lowest(&mut self, x: i64) -> i64 {
        let rest = &self.parabolas[self.front..];
        let Some((&first, rest)) = rest.split_first() else {
            return FAR.into();
        };
        let mut low = first.at(x);
        for next in rest {
            let value = next.at(x);
            if value > low {
                break;
            }
            low = value;
            self.front += 1;
        }
        low
    }
}

/// Writes the distances of a row whose squared distances along the columns are `column`; `walled`:
/// there is background on either side of the row.
pub(super) fn row<M: Metric>(column: &[u32], walled: bool, queue: &mut Queue, row: &mut [u32]) {
    row.copy_from_slice(column);
    walk::<M>(column.iter().zip(row.iter_mut()), walled, queue);
    walk::<M>(column.iter().zip(row.iter_mut()).rev(), walled, queue);
    for distance in row {
        if *distance >= FAR {
            *distance = u32::MAX;
        }
    }
}

fn walk<'a, M: Metric>(
    pixels: impl Iterator<Item = (&'a u32, &'a mut u32)>,
    walled: bool,
    queue: &mut Queue,
) {
    queue.clear();
    if walled {
        queue.push(Parabola {
            vertex: M::VERTEX - M::CELL,
            height: 0,
        });
    }
    for (x, (&height, distance)) in (0..).step_by(M::CELL as usize).zip(pixels) {
        if height > 0 {
            let lowest = queue.lowest(x).min(FAR.into());
            *distance = (*distance).min(lowest as u32);
        }
        if height < FAR {
            queue.push(Parabola {
                vertex: x + M::VERTEX,
                height: height.into(),
            });
        }
    }
}
