//! Straight pieces of a boundary: where to cut a chain, and the line through many points.

use super::outline::Chain;

/// Sums of point coordinates: the line of least squared distance through any union of point sets.
#[derive(Clone, Copy, Default)]
pub(super) struct Moments {
    n: f64,
    sum: [f64; 2],
    xx: f64,
    xy: f64,
    yy: f64,
}

impl Moments {
    pub(super) fn of(points: &[[f64; 2]]) -> Self {
        points.iter().fold(Self::default(), |m, &[x, y]| Self {
            n: m.n + 1.0,
            sum: [m.sum[0] + x, m.sum[1] + y],
            xx: m.xx + x * x,
            xy: m.xy + x * y,
            yy: m.yy + y * y,
        })
    }

    pub(super) fn plus(self, other: &Self) -> Self {
        Self {
            n: self.n + other.n,
            sum: [self.sum[0] + other.sum[0], self.sum[1] + other.sum[1]],
            xx: self.xx + other.xx,
            xy: self.xy + other.xy,
            yy: self.yy + other.yy,
        }
    }

    /// Centre and unit direction, the latter pointing as `along` does.
    pub(super) fn line(&self, along: [f64; 2]) -> Line {
        let center = [self.sum[0] / self.n, self.sum[1] / self.n];
        let xx = self.xx / self.n - center[0] * center[0];
        let xy = self.xy / self.n - center[0] * center[1];
        let yy = self.yy / self.n - center[1] * center[1];
        let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
        let (sin, cos) = angle.sin_cos();
        let sign = (cos * along[0] + sin * along[1]).signum();
        Line {
            center,
            direction: [sign * cos, sign * sin],
        }
    }
}

/// A line with a sense: free cells to the left of travel as the picture shows it.
#[derive(Clone, Copy)]
pub(super) struct Line {
    pub(super) center: [f64; 2],
    pub(super) direction: [f64; 2],
}

impl Line {
    pub(super) fn along(&self, p: [f64; 2]) -> f64 {
        (p[0] - self.center[0]) * self.direction[0] + (p[1] - self.center[1]) * self.direction[1]
    }

    pub(super) fn across(&self, p: [f64; 2]) -> f64 {
        (p[1] - self.center[1]) * self.direction[0] - (p[0] - self.center[0]) * self.direction[1]
    }

    pub(super) fn at(&self, along: f64) -> [f64; 2] {
        [
            self.center[0] + along * self.direction[0],
            self.center[1] + along * self.direction[1],
        ]
    }
}

/// A straight piece of boundary, in grid coordinates [cells].
#[derive(Clone, Copy)]
pub(super) struct Piece {
    pub(super) moments: Moments,
    pub(super) line: Line,
    /// Where it starts and ends, on the line.
    pub(super) ends: [[f64; 2]; 2],
}

impl Piece {
    fn new(moments: Moments, from: [f64; 2], to: [f64; 2]) -> Self {
        let line = moments.line([to[0] - from[0], to[1] - from[1]]);
        Self {
            moments,
            line,
            ends: [line.at(line.along(from)), line.at(line.along(to))],
        }
    }

    pub(super) fn length(&self) -> f64 {
        (self.ends[1][0] - self.ends[0][0]).hypot(self.ends[1][1] - self.ends[0][1])
    }

    /// Both, as one line from the first's start to the second's end.
    pub(super) fn joined(&self, next: &Self) -> Self {
        Self::new(self.moments.plus(&next.moments), self.ends[0], next.ends[1])
    }

    /// Whether `next` continues this piece: it goes on in the same direction, and lies on the same line.
    pub(super) fn continues_as(&self, next: &Self, tolerance: f64) -> bool {
        let (a, b) = (self.line.direction, next.line.direction);
        let same_way = a[0] * b[0] + a[1] * b[1] > SAME_WAY;
        let near = |line: &Line, ends: &[[f64; 2]; 2]| {
            ends.iter().all(|&end| line.across(end).abs() <= tolerance)
        };
        same_way
            && if self.length() >= next.length() {
                near(&self.line, &next.ends)
            } else {
                near(&next.line, &self.ends)
            }
    }
}

/// Cosine of the angle that two collinear pieces may differ by (6 degrees: short pieces are rough).
const SAME_WAY: f64 = 0.9945;

/// Straight pieces of a chain: cut where it leaves its chord by more than `tolerance` [cells]
/// (Ramer 1972; Douglas, Peucker 1973), pieces shorter than `shortest` [cells] and edges of the unknown left out.
pub(super) fn pieces(chain: &Chain, tolerance: f64, shortest: f64, out: &mut Vec<Piece>) {
    let points = &chain.crossings;
    let mut open = vec![(0, points.len() - 1)];
    while let Some((from, to)) = open.pop() {
        match farthest(&points[from..=to]) {
            Some((index, distance)) if distance > tolerance => {
                open.push((from + index, to));
                open.push((from, from + index));
            }
            _ => {
                // the points next to a bend belong to both sides of it
                let trim = usize::from(to - from >= 8);
                let moments = Moments::of(&points[from + trim..=to - trim]);
                let piece = Piece::new(moments, chain.corners[from], chain.corners[to + 1]);
                let backed = chain.backed[to + 1] - chain.backed[from];
                if piece.length() >= shortest && 2 * backed as usize > to - from {
                    out.push(piece);
                }
            }
        }
    }
}

/// The point farthest from the chord (for a closed stretch: from its ends), and how far it is.
fn farthest(points: &[[f64; 2]]) -> Option<(usize, f64)> {
    let (first, last) = (*points.first()?, *points.last()?);
    let chord = [last[0] - first[0], last[1] - first[1]];
    let length = chord[0].hypot(chord[1]);
    let distance = |p: &[f64; 2]| {
        let d = [p[0] - first[0], p[1] - first[1]];
        if length < 1.0 {
            d[0].hypot(d[1])
        } else {
            (d[0] * chord[1] - d[1] * chord[0]).abs() / length
        }
    };
    let inner = points
        .iter()
        .enumerate()
        .skip(1)
        .take(points.len().max(2) - 2);
    inner
        .map(|(index, p)| (index, distance(p)))
        .max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)))
}
