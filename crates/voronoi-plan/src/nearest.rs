//! The nearest not-free cell, found by looking: where the distance field says only how far it is.

use morpho::BitImage;
use occgrid::{Cell, GridPoint};

/// A not-free cell, perhaps outside the map, and how near it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Nearest {
    /// `(2 d)^2`, d the distance from a cell's centre to its square [cells].
    pub(crate) squared_doubled: u32,
    col: i64,
    row: i64,
}

impl Nearest {
    /// The point of its square nearest to a point.
    pub(crate) fn point(&self, from: GridPoint) -> GridPoint {
        let clamp = |value: f64, low: i64| value.clamp(low as f64, (low + 1) as f64);
        GridPoint {
            col: clamp(from.col, self.col),
            row: clamp(from.row, self.row),
        }
    }
}

/// The nearest not-free cell to the centre of a cell of the map; everything outside is not free.
///
/// Rows outwards, words outwards in a row: about the clearance, times 1 + clearance / 64.
pub(crate) fn nearest(free: &BitImage, cell: Cell) -> Nearest {
    let (x, y) = (cell.col as usize, cell.row as usize);
    let (col, row) = (i64::from(cell.col), i64::from(cell.row));
    if !free.get(x, y) {
        return Nearest {
            squared_doubled: 0,
            col,
            row,
        };
    }
    let (width, height) = (free.width() as i64, free.height() as i64);
    let mut best = [
        (col + 1, -1, row),
        (width - col, width, row),
        (row + 1, col, -1),
        (height - row, col, height),
    ]
    .into_iter()
    .map(|(cells, col, row)| Nearest {
        squared_doubled: square_of(cells as u32),
        col,
        row,
    })
    .min_by_key(|n| n.squared_doubled)
    .unwrap_or(Nearest {
        squared_doubled: 1,
        col: -1,
        row,
    });
    for away in 0_u32.. {
        let down = square_of(away);
        if down >= best.squared_doubled {
            break;
        }
        let rows = [y.checked_sub(away as usize), Some(y + away as usize)];
        for at in rows.into_iter().flatten().filter(|&at| at < free.height()) {
            // the border is accounted for; only what is nearer counts
            let Some(rest) = best.squared_doubled.checked_sub(down + 1) else {
                break;
            };
            let reach = rest.isqrt().div_ceil(2) as usize;
            if let Some(blocked) = nearest_zero(free.row(at), x, reach) {
                let squared_doubled = down + square_of(x.abs_diff(blocked) as u32);
                if squared_doubled < best.squared_doubled {
                    best = Nearest {
                        squared_doubled,
                        col: blocked as i64,
                        row: at as i64,
                    };
                }
            }
        }
    }
    best
}

/// `(2 d)^2` to the square of the cell so many columns or rows away.
const fn square_of(cells: u32) -> u32 {
    let edge = (2 * cells).saturating_sub(1);
    edge * edge
}

/// The zero bit nearest to bit `x`, at most `reach` away, the left one of two.
fn nearest_zero(row: &[u64], x: usize, reach: usize) -> Option<usize> {
    let (word, bit) = (x / 64, x % 64);
    let mut left = None;
    let mut zeros = !row[word] << (63 - bit);
    let mut top = x;
    let mut k = word;
    loop {
        if zeros != 0 {
            left = top.checked_sub(zeros.leading_zeros() as usize);
            break;
        }
        if k == 0 || x - (k * 64 - 1) > reach {
            break;
        }
        top = k * 64 - 1;
        k -= 1;
        zeros = !row[k];
    }
    let mut right = None;
    let mut zeros = !row[word] >> bit;
    let mut bottom = x;
    let mut k = word;
    loop {
        if zeros != 0 {
            right = Some(bottom + zeros.trailing_zeros() as usize);
            break;
        }
        k += 1;
        bottom = k * 64;
        if k == row.len() || bottom - x > reach {
            break;
        }
        zeros = !row[k];
    }
    let near = [left, right].into_iter().flatten();
    near.filter(|&at| at.abs_diff(x) <= reach)
        .min_by_key(|&at| at.abs_diff(x))
}

#[cfg(test)]
mod tests {
    use super::*;
    use morpho::{Border, distance::squared_to_squares};

    #[test]
    fn it_is_as_near_as_the_distance_transform_says() {
        for seed in 0..400_u64 {
            let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
            let width = [1, 2, 63, 64, 65, 127, 128, 129, 200][seed as usize % 9];
            let height = [1, 3, 20, 90][seed as usize / 9 % 4];
            let rare = [0, 1, 4, 100][seed as usize / 36 % 4];
            let image = BitImage::from_fn(width, height, |_, _| {
                state ^= state << 13;
                state ^= state >> 7;
                state ^= state << 17;
                state >> 20 & 1023 >= rare
            });
            let distance = squared_to_squares(&image, Border::Background);
            for (i, &expected) in distance.iter().enumerate() {
                let cell = Cell::new((i % width) as u32, (i / width) as u32);
                let found = nearest(&image, cell);
                assert_eq!(found.squared_doubled, expected, "{cell:?} {image:?}");
                assert!(
                    found.col < 0
                        || found.row < 0
                        || !image.get(found.col as usize, found.row as usize)
                );
                let center = GridPoint {
                    col: f64::from(cell.col) + 0.5,
                    row: f64::from(cell.row) + 0.5,
                };
                let point = found.point(center);
                let doubled = 2.0 * (point.col - center.col).hypot(point.row - center.row);
                assert!((doubled * doubled - f64::from(expected)).abs() < 1e-6);
            }
        }
    }
}
