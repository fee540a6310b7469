//! Things in plan by place: a grid of square buckets, each with the numbers of what lies in it.

use occgrid::Point2;

use crate::real::length;

/// Most buckets a side.
const MAX_SIDE: f64 = 1024.0;
/// Smallest side of a bucket [m].
const SMALLEST: f64 = 0.25;

/// Numbers of line segments (a point is a segment of no length) by the buckets they cross.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Buckets {
    corner: Point2,
    side: f64,
    columns: usize,
    rows: usize,
    begins: Vec<u32>,
    entries: Vec<u32>,
}

impl Buckets {
    /// Sorts segments, each given with a margin around it.
    pub(crate) fn new(segments: &[([Point2; 2], f64)]) -> Self {
        if segments.is_empty() {
            return Self::default();
        }
        let mut low = Point2::new(f64::INFINITY, f64::INFINITY);
        let mut high = Point2::new(f64::NEG_INFINITY, f64::NEG_INFINITY);
        let mut total = 0.0;
        for ([a, b], margin) in segments {
            low = Point2::new(
                low.x.min(a.x.min(b.x) - margin),
                low.y.min(a.y.min(b.y) - margin),
            );
            high = Point2::new(
                high.x.max(a.x.max(b.x) + margin),
                high.y.max(a.y.max(b.y) + margin),
            );
            total += length(a.x - b.x, a.y - b.y) + 4.0 * margin;
        }
        let extent = (high.x - low.x).max(high.y - low.y);
        // long lines in many buckets would take more room than they save time
        let side = SMALLEST
            .max(extent / MAX_SIDE)
            .max(total / (8.0 * segments.len() as f64 + 1e5));
        let mut buckets = Self {
            corner: Point2::new(low.x - side / 2.0, low.y - side / 2.0),
            side,
            columns: ((high.x - low.x) / side) as usize + 2,
            rows: ((high.y - low.y) / side) as usize + 2,
            begins: Vec::new(),
            entries: Vec::new(),
        };
        buckets.fill(segments);
        buckets
    }

    fn fill(&mut self, segments: &[([Point2; 2], f64)]) {
        let mut begins = vec![0_u32; self.columns * self.rows + 1];
        for (segment, margin) in segments {
            self.crossed(segment, *margin, |bucket| begins[bucket + 1] += 1);
        }
        for i in 1..begins.len() {
            begins[i] += begins[i - 1];
        }
        let mut next = begins.clone();
        let mut entries = vec![0; begins[begins.len() - 1] as usize];
        for (index, (segment, margin)) in segments.iter().enumerate() {
            self.crossed(segment, *margin, |bucket| {
                entries[next[bucket] as usize] = index as u32;
                next[bucket] += 1;
            });
        }
        (self.begins, self.entries) = (begins, entries);
    }

    /// Every bucket that a segment with its margin may touch.
    fn crossed(&self, [a, b]: &[Point2; 2], margin: f64, mut found: impl FnMut(usize)) {
        let margin = margin + 1e-9;
        let rows = self.span(
            a.y.min(b.y) - margin,
            a.y.max(b.y) + margin,
            self.corner.y,
            self.rows,
        );
        let slope = (b.x - a.x) / (b.y - a.y);
        for row in rows {
            let bottom = self.corner.y + row as f64 * self.side - margin;
            let top = bottom + self.side + 2.0 * margin;
            let (low, high) = if slope.abs() < 1e6 {
                let at = |y: f64| a.x + (y - a.y) * slope;
                let (p, q) = (at(bottom), at(top));
                (p.min(q).max(a.x.min(b.x)), p.max(q).min(a.x.max(b.x)))
            } else {
                (a.x.min(b.x), a.x.max(b.x))
            };
            for column in self.span(low - margin, high + margin, self.corner.x, self.columns) {
                found(row * self.columns + column);
            }
        }
    }

    /// Columns or rows from one coordinate to another, inside the grid.
    fn span(&self, low: f64, high: f64, corner: f64, count: usize) -> std::ops::Range<usize> {
        let first = ((low - corner) / self.side).max(0.0) as usize;
        let last = ((high - corner) / self.side).floor();
        if last < 0.0 {
            return 0..0;
        }
        first.min(count)..(last as usize + 1).min(count)
    }

    fn list(&self, bucket: usize) -> &[u32] {
        &self.entries[self.begins[bucket] as usize..self.begins[bucket + 1] as usize]
    }

    /// Calls `found` with everything near a square around a point; some more than once.
    pub(crate) fn around(&self, center: Point2, reach: f64, mut found: impl FnMut(usize)) {
        if self.columns == 0 {
            return;
        }
        let columns = self.span(
            center.x - reach,
            center.x + reach,
            self.corner.x,
            self.columns,
        );
        for row in self.span(center.y - reach, center.y + reach, self.corner.y, self.rows) {
            for column in columns.clone() {
                for index in self.list(row * self.columns + column) {
                    found(*index as usize);
                }
            }
        }
    }

    /// Walks along a ray, bucket by bucket; `visit` gets what lies in each and returns how far it is
    /// worth to go on. Stops at `far`.
    pub(crate) fn walk(
        &self,
        from: Point2,
        direction: Point2,
        far: f64,
        mut visit: impl FnMut(&[u32]) -> f64,
    ) {
        let Some((enter, leave)) = self.crossing(from, direction) else {
            return;
        };
        let mut end = far.min(leave);
        let start = Point2::new(from.x + direction.x * enter, from.y + direction.y * enter);
        let place = |p: f64, corner: f64, count: usize| {
            (((p - corner) / self.side).max(0.0) as usize).min(count - 1)
        };
        let mut column = place(start.x, self.corner.x, self.columns);
        let mut row = place(start.y, self.corner.y, self.rows);
        let next = |d: f64, cell: usize, corner: f64, from: f64| {
            let line = corner + (cell + usize::from(d > 0.0)) as f64 * self.side;
            if d.abs() < 1e-300 {
                f64::INFINITY
            } else {
                (line - from) / d
            }
        };
        let mut next_x = next(direction.x, column, self.corner.x, from.x);
        let mut next_y = next(direction.y, row, self.corner.y, from.y);
        let step = |d: f64| (self.side / d).abs();
        let (step_x, step_y) = (step(direction.x), step(direction.y));
        loop {
            end = end.min(visit(self.list(row * self.columns + column)));
            if next_x.min(next_y) > end {
                return;
            }
            let (cell, count, d) = if next_x < next_y {
                next_x += step_x;
                (&mut column, self.columns, direction.x)
            } else {
                next_y += step_y;
                (&mut row, self.rows, direction.y)
            };
            *cell = if d > 0.0 {
                *cell + 1
            } else {
                cell.wrapping_sub(1)
            };
            if *cell >= count {
                return;
            }
        }
    }

    /// Where a ray enters and leaves the grid.
    fn crossing(&self, from: Point2, direction: Point2) -> Option<(f64, f64)> {
        if self.columns == 0 {
            return None;
        }
        let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
        for (o, d, corner, count) in [
            (from.x, direction.x, self.corner.x, self.columns),
            (from.y, direction.y, self.corner.y, self.rows),
        ] {
            let (low, high) = (corner, corner + count as f64 * self.side);
            if d.abs() < 1e-300 {
                if !(low..=high).contains(&o) {
                    return None;
                }
                continue;
            }
            let (t0, t1) = ((low - o) / d, (high - o) / d);
            enter = enter.max(t0.min(t1));
            leave = leave.min(t0.max(t1));
        }
        (enter <= leave).then_some((enter, leave))
    }
}
