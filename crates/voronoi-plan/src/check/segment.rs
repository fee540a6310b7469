//! Exact distances between a straight segment and axis-parallel boxes, in grid coordinates [cells].

/// A point in grid coordinates [cells].
#[derive(Debug, Clone, Copy)]
pub(super) struct Vertex {
    pub(super) x: f64,
    pub(super) y: f64,
}

/// A closed box: a cell, or a block of cells.
#[derive(Debug, Clone, Copy)]
pub(super) struct Square {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) side: f64,
}

/// A straight segment; both ends may be the same point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Segment {
    pub(super) a: Vertex,
    pub(super) b: Vertex,
}

impl Square {
    const fn corners(&self) -> [Vertex; 4] {
        let (x1, y1) = (self.x + self.side, self.y + self.side);
        [
            Vertex {
                x: self.x,
                y: self.y,
            },
            Vertex { x: x1, y: self.y },
            Vertex { x: self.x, y: y1 },
            Vertex { x: x1, y: y1 },
        ]
    }

    /// Squared distance of a point, 0 inside and on the border.
    const fn distance2(&self, p: Vertex) -> f64 {
        let dx = (self.x - p.x).max(p.x - (self.x + self.side)).max(0.0);
        let dy = (self.y - p.y).max(p.y - (self.y + self.side)).max(0.0);
        dx * dx + dy * dy
    }
}

impl Segment {
    pub(super) const fn min_x(&self) -> f64 {
        self.a.x.min(self.b.x)
    }

    pub(super) const fn max_x(&self) -> f64 {
        self.a.x.max(self.b.x)
    }

    pub(super) const fn min_y(&self) -> f64 {
        self.a.y.min(self.b.y)
    }

    pub(super) const fn max_y(&self) -> f64 {
        self.a.y.max(self.b.y)
    }

    const fn at(&self, t: f64) -> Vertex {
        Vertex {
            x: self.a.x + t * (self.b.x - self.a.x),
            y: self.a.y + t * (self.b.y - self.a.y),
        }
    }

    /// The point of the segment nearest to `p`.
    fn nearest_to(&self, p: Vertex) -> Vertex {
        let (dx, dy) = (self.b.x - self.a.x, self.b.y - self.a.y);
        let length2 = dx * dx + dy * dy;
        let along = (p.x - self.a.x) * dx + (p.y - self.a.y) * dy;
        if along <= 0.0 || length2 <= 0.0 {
            self.a
        } else if along >= length2 {
            self.b
        } else {
            self.at(along / length2)
        }
    }

    /// Whether segment and square share a point: no axis separates them (separating axis theorem; the
    /// axes are x, y and the segment's normal).
    fn meets(&self, square: &Square) -> bool {
        let (x1, y1) = (square.x + square.side, square.y + square.side);
        if self.max_x() < square.x
            || self.min_x() > x1
            || self.max_y() < square.y
            || self.min_y() > y1
        {
            return false;
        }
        let (dx, dy) = (self.b.x - self.a.x, self.b.y - self.a.y);
        let sides = square
            .corners()
            .map(|c| dx * (c.y - self.a.y) - dy * (c.x - self.a.x));
        sides.iter().any(|&s| s <= 0.0) && sides.iter().any(|&s| s >= 0.0)
    }

    /// Squared distance to a square, 0 where they touch or cross.
    pub(super) fn distance2(&self, square: &Square) -> f64 {
        let ends = square.distance2(self.a).min(square.distance2(self.b));
        if ends <= 0.0 || self.meets(square) {
            return 0.0;
        }
        // apart, so the least distance is at a vertex of one of the two
        square.corners().iter().fold(ends, |least, &corner| {
            least.min(distance2(self.nearest_to(corner), corner))
        })
    }

    /// The point of the segment nearest to a square; where they cross, the middle of what they share.
    pub(super) fn nearest_point(&self, square: &Square) -> Vertex {
        if let Some((enter, leave)) = self.inside(square) {
            return self.at(f64::midpoint(enter, leave));
        }
        let mut best = (square.distance2(self.a), self.a);
        let corners = square.corners();
        let candidates = std::iter::once((square.distance2(self.b), self.b)).chain(
            corners
                .iter()
                .map(|&c| (self.nearest_to(c), c))
                .map(|(p, c)| (distance2(p, c), p)),
        );
        for candidate in candidates {
            if candidate.0 < best.0 {
                best = candidate;
            }
        }
        best.1
    }

    /// The part of the segment inside a square, as parameters along it (Liang-Barsky clipping).
    fn inside(&self, square: &Square) -> Option<(f64, f64)> {
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        let axes = [
            (self.a.x, self.b.x - self.a.x, square.x),
            (self.a.y, self.b.y - self.a.y, square.y),
        ];
        for (start, delta, low) in axes {
            let (low, high) = (low - start, low + square.side - start);
            if delta.abs() <= 0.0 {
                if low > 0.0 || high < 0.0 {
                    return None;
                }
                continue;
            }
            let (first, second) = (low / delta, high / delta);
            enter = enter.max(first.min(second));
            leave = leave.min(first.max(second));
        }
        (enter <= leave).then_some((enter, leave))
    }
}

fn distance2(p: Vertex, q: Vertex) -> f64 {
    let (dx, dy) = (p.x - q.x, p.y - q.y);
    dx * dx + dy * dy
}
