//! The widest way between two places whatever the radius: where, and how narrow, its narrowest part is.

use std::collections::{BinaryHeap, HashMap};

use occgrid::Cell;
use petgraph::unionfind::UnionFind;

use crate::lattice::{Lattice, STEPS};
use crate::window::{Window, steps_from};

/// The narrowest part of the widest way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Narrowest {
    /// `(2 d)^2` there.
    pub(crate) squared_doubled: u32,
    /// The link where that is; twice the same cell where it is a cell's centre.
    pub(crate) link: [Cell; 2],
}

/// The widest way from one of `from` to one of `to` over all free cells; `None` if there is none without
/// touching a cell that is not free. `lattice` is that of clearance 0. O(n log n) in the cells reached.
pub(crate) fn widest(
    lattice: &Lattice<'_>,
    grid: Window,
    from: &[Cell],
    to: &[Cell],
) -> Option<Narrowest> {
    let index = |cell: Cell| grid.index(cell) as u32;
    let mut seen = vec![false; grid.area()];
    let mut heap: BinaryHeap<(u32, u32, u32)> = from
        .iter()
        .filter(|&&cell| lattice.has(cell))
        .map(|&cell| (lattice.squared_doubled(cell), index(cell), index(cell)))
        .collect();
    let mut narrowest: Option<Narrowest> = None;
    while let Some((width, at, before)) = heap.pop() {
        if std::mem::replace(&mut seen[at as usize], true) {
            continue;
        }
        let cell = grid.cell(at as usize);
        if narrowest.is_none_or(|n| width <= n.squared_doubled) {
            narrowest = Some(Narrowest {
                squared_doubled: width,
                link: [grid.cell(before as usize), cell],
            });
        }
        if to.contains(&cell) {
            return narrowest;
        }
        for (_, other) in steps_from(cell, grid) {
            if !seen[grid.index(other)] && lattice.has(other) {
                let width = lattice.link_squared_doubled(cell, other);
                if width >= lattice.need() {
                    heap.push((width, index(other), at));
                }
            }
        }
    }
    None
}

/// Where the parts of a lattice meet when the radius shrinks: for every two parts the narrowest place of
/// the widest way between them.
///
/// Kruskal's maximum spanning forest over the cells, of which only the unions of two named parts are
/// kept; they are linked by size and never compressed, so that a query climbs at most log2 of their
/// number.
#[derive(Debug, Clone, Default)]
pub(crate) struct Saddles {
    /// For each part the part it was linked to, and where; none for a root.
    up: Vec<Option<(u32, Narrowest)>>,
}

impl Saddles {
    /// `named` are cells of the lattice with the number of their part, 0..`parts`. Unless every part of
    /// the lattice has a name, ways through nameless parts count as well. O(n log n) in the free cells
    /// that are not on the lattice, linear in the others; 5 bytes a cell until it is done.
    pub(crate) fn new(
        lattice: &Lattice<'_>,
        free: &Lattice<'_>,
        grid: Window,
        named: impl Iterator<Item = (u32, u32)>,
        parts: usize,
    ) -> Self {
        let mut sets = UnionFind::<u32>::new(grid.area());
        let mut below = Vec::new();
        for index in 0..grid.area() as u32 {
            let cell = grid.cell(index as usize);
            if lattice.has(cell) {
                for (_, other) in
                    forward(cell, grid).filter(|&(_, other)| lattice.links(cell, other))
                {
                    sets.union(index, grid.index(other) as u32);
                }
            } else if free.has(cell) {
                below.push(u64::from(free.squared_doubled(cell)) << 32 | u64::from(index));
            }
        }
        below.sort_unstable_by_key(|&entry| std::cmp::Reverse(entry >> 32));
        let mut saddles = Self {
            up: vec![None; parts],
        };
        let mut merger = Merger {
            sets,
            part: HashMap::new(),
            size: vec![1; parts],
        };
        for (index, part) in named {
            let set = merger.sets.find_mut(index);
            let cell = grid.cell(index as usize);
            let here = Narrowest {
                squared_doubled: lattice.need(),
                link: [cell, cell],
            };
            match merger.part.get(&set) {
                Some(&other) => merger.meet(&mut saddles, part, other, here),
                None => drop(merger.part.insert(set, part)),
            }
        }
        merger.flood(&mut saddles, (lattice, free), grid, &below);
        saddles
    }

    fn root(&self, mut part: u32) -> u32 {
        while let Some((up, _)) = self.up[part as usize] {
            part = up;
        }
        part
    }

    /// The narrowest place of the widest way between two parts, `None` if there is no way. For a part and
    /// itself there is no narrowest place below the lattice's own clearance: `None` too.
    pub(crate) fn between(&self, mut a: u32, mut b: u32) -> Option<Narrowest> {
        let mut narrowest: Option<Narrowest> = None;
        while a != b {
            let width = |part: u32| self.up[part as usize].map(|(_, n)| n.squared_doubled);
            let part = if width(a) >= width(b) { &mut a } else { &mut b };
            let (up, place) = self.up[*part as usize]?;
            *part = up;
            if narrowest.is_none_or(|n| place.squared_doubled <= n.squared_doubled) {
                narrowest = Some(place);
            }
        }
        narrowest
    }
}

/// The state of Kruskal's algorithm.
struct Merger {
    sets: UnionFind<u32>,
    /// The named part of a set, by the set's representative.
    part: HashMap<u32, u32>,
    size: Vec<u32>,
}

impl Merger {
    /// Two named parts meet at a place.
    fn meet(&mut self, saddles: &mut Saddles, a: u32, b: u32, place: Narrowest) {
        let (a, b) = (saddles.root(a), saddles.root(b));
        if a == b {
            return;
        }
        let (large, small) = if self.size[a as usize] >= self.size[b as usize] {
            (a, b)
        } else {
            (b, a)
        };
        saddles.up[small as usize] = Some((large, place));
        self.size[large as usize] += self.size[small as usize];
    }

    /// Unites the ends of a link.
    fn unite(&mut self, saddles: &mut Saddles, a: u32, b: u32, place: Narrowest) {
        let (a, b) = (self.sets.find_mut(a), self.sets.find_mut(b));
        if a == b {
            return;
        }
        let (first, second) = (self.part.remove(&a), self.part.remove(&b));
        self.sets.union(a, b);
        if let (Some(first), Some(second)) = (first, second) {
            self.meet(saddles, first, second, place);
        }
        if let Some(part) = first.or(second) {
            let set = self.sets.find_mut(a);
            self.part.insert(set, part);
        }
    }

    /// Takes in the links that are not on the lattice, widest first. `below` are the cells that are not,
    /// widest first; a link counts when its narrower end is reached, unless it is narrower still.
    fn flood(
        &mut self,
        saddles: &mut Saddles,
        (lattice, free): (&Lattice<'_>, &Lattice<'_>),
        grid: Window,
        below: &[u64],
    ) {
        let mut late: BinaryHeap<(u32, u32, u32)> = BinaryHeap::new();
        for index in 0..grid.area() as u32 {
            let cell = grid.cell(index as usize);
            for (_, other) in forward(cell, grid) {
                if lattice.has(cell) && lattice.has(other) && !lattice.links(cell, other) {
                    let width = free.link_squared_doubled(cell, other);
                    late.push((width, index, grid.index(other) as u32));
                }
            }
        }
        let mut unite = |merger: &mut Self, width: u32, a: u32, b: u32| {
            let link = [grid.cell(a as usize), grid.cell(b as usize)];
            let squared_doubled = width;
            if width >= free.need() {
                merger.unite(
                    saddles,
                    a,
                    b,
                    Narrowest {
                        squared_doubled,
                        link,
                    },
                );
            }
        };
        for &entry in below {
            let (width, index) = ((entry >> 32) as u32, entry as u32);
            while late.peek().is_some_and(|&(next, ..)| next > width) {
                let Some((next, a, b)) = late.pop() else {
                    break;
                };
                unite(self, next, a, b);
            }
            let cell = grid.cell(index as usize);
            for (_, other) in steps_from(cell, grid) {
                if free.squared_doubled(other) < width {
                    continue;
                }
                match free.link_squared_doubled(cell, other) {
                    link if link == width => unite(self, width, index, grid.index(other) as u32),
                    link => late.push((link, index, grid.index(other) as u32)),
                }
            }
        }
        while let Some((width, a, b)) = late.pop() {
            unite(self, width, a, b);
        }
    }
}

/// The neighbours after a cell in raster order.
fn forward(cell: Cell, grid: Window) -> impl Iterator<Item = (u8, Cell)> {
    steps_from(cell, grid).filter(|&(step, _)| {
        let (dc, dr) = STEPS[usize::from(step)];
        (dr, dc) > (0, 0)
    })
}
