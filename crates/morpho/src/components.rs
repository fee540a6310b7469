//! Connected components, holes, the Euler number.

use crate::bit_image::runs;
use crate::{BitImage, Connectivity, Pixel};

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Bounds {
    /// Leftmost column.
    pub x: usize,
    /// Topmost row.
    pub y: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// One connected component.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Component {
    /// Its number, from 1 in the raster order of the components' first pixels.
    pub label: u32,
    /// Its pixels.
    pub area: usize,
    /// The smallest rectangle around it.
    pub bounds: Bounds,
    /// Its first pixel in raster order.
    pub first: Pixel,
}

/// A horizontal run of foreground, and the component it belongs to.
#[derive(Clone, Copy, Debug)]
struct Run {
    start: u32,
    end: u32,
    /// While labelling: the index of a run of the same component, its own for a root.
    label: u32,
}

/// The connected foreground components of an image, as labelled horizontal runs.
#[derive(Clone, Debug, Default)]
pub struct Components {
    width: usize,
    height: usize,
    components: Vec<Component>,
    runs: Vec<Run>,
    /// Where each row's runs begin in `runs`, and their end.
    rows: Vec<usize>,
}

impl Components {
    /// Labels the foreground components of `image`. Time is linear in words plus runs.
    ///
    /// # Panics
    /// If the image has 2^32 columns or runs.
    #[must_use]
    pub fn label(image: &BitImage, connectivity: Connectivity) -> Self {
        let mut components = Self::default();
        components.relabel(image, connectivity);
        components
    }

    /// [`label`](Self::label) in the memory of an earlier result.
    ///
    /// # Panics
    /// If the image has 2^32 columns or runs.
    pub fn relabel(&mut self, image: &BitImage, connectivity: Connectivity) {
        assert!(u32::try_from(image.width()).is_ok(), "an image too wide");
        self.width = image.width();
        self.height = image.height();
        self.runs.clear();
        self.rows.clear();
        self.components.clear();
        self.rows.push(0);
        let mut above = 0;
        for y in 0..self.height {
            let begin = self.runs.len();
            for run in runs(image.row(y)) {
                let label = self.runs.len() as u32;
                self.runs.push(Run {
                    start: run.start as u32,
                    end: run.end as u32,
                    label,
                });
            }
            join(&mut self.runs, above, begin, connectivity);
            above = begin;
            self.rows.push(self.runs.len());
        }
        assert!(u32::try_from(self.runs.len()).is_ok(), "too many runs");
        self.number();
    }

    /// Turns the forest into labels. A root is its component's first run, so that counting roots
    /// in order numbers the components in raster order.
    fn number(&mut self) {
        for y in 0..self.height {
            for i in self.rows[y]..self.rows[y + 1] {
                let Run { start, end, label } = self.runs[i];
                let (x, area) = (start as usize, (end - start) as usize);
                if label as usize == i {
                    self.components.push(Component {
                        label: self.components.len() as u32 + 1,
                        area,
                        bounds: Bounds {
                            x,
                            y,
                            width: area,
                            height: 1,
                        },
                        first: Pixel::new(x, y),
                    });
                    self.runs[i].label = self.components.len() as u32;
                } else {
                    // the parent stands before this run and has its final label already
                    let label = self.runs[label as usize].label;
                    self.runs[i].label = label;
                    let component = &mut self.components[label as usize - 1];
                    component.area += area;
                    let bounds = &mut component.bounds;
                    let right = (bounds.x + bounds.width).max(end as usize);
                    bounds.x = bounds.x.min(x);
                    bounds.width = right - bounds.x;
                    bounds.height = y + 1 - bounds.y;
                }
            }
        }
    }

    /// How many components there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.components.len()
    }

    /// The components, by label.
    #[must_use]
    pub fn as_slice(&self) -> &[Component] {
        &self.components
    }

    /// The largest component, of equals the first in raster order; `None` if there is none.
    #[must_use]
    pub fn largest(&self) -> Option<&Component> {
        self.components
            .iter()
            .max_by_key(|c| (c.area, std::cmp::Reverse(c.label)))
    }

    /// The label of pixel (x, y); 0 for background and outside the image. Time is logarithmic in
    /// the row's runs.
    #[must_use]
    pub fn label_at(&self, x: usize, y: usize) -> u32 {
        if x >= self.width || y >= self.height {
            return 0;
        }
        let row = &self.runs[self.rows[y]..self.rows[y + 1]];
        let next = row.partition_point(|run| run.end as usize <= x);
        match row.get(next) {
            Some(run) if run.start as usize <= x => run.label,
            _ => 0,
        }
    }

    /// The component that holds pixel (x, y).
    #[must_use]
    pub fn at(&self, x: usize, y: usize) -> Option<&Component> {
        let label = self.label_at(x, y) as usize;
        self.components.get(label.wrapping_sub(1))
    }

    /// The label of every pixel, row after row; 0 is background.
    #[must_use]
    pub fn to_labels(&self) -> Vec<u32> {
        let mut labels = Vec::new();
        self.to_labels_into(&mut labels);
        labels
    }

    /// [`to_labels`](Self::to_labels) into a vector whose memory is reused.
    pub fn to_labels_into(&self, labels: &mut Vec<u32>) {
        labels.resize(self.width * self.height, 0);
        let mut end = 0;
        for y in 0..self.height {
            for run in &self.runs[self.rows[y]..self.rows[y + 1]] {
                let start = y * self.width + run.start as usize;
                paint(labels, end, start, 0);
                end = y * self.width + run.end as usize;
                paint(labels, start, end, run.label);
            }
        }
        labels[end..].fill(0);
    }

    /// The image of the components that `keep` says yes to.
    #[must_use]
    pub fn select(&self, keep: impl FnMut(&Component) -> bool) -> BitImage {
        let kept: Vec<bool> = self.components.iter().map(keep).collect();
        let mut image = BitImage::new(self.width, self.height);
        for y in 0..self.height {
            let row = image.row_mut(y);
            for run in &self.runs[self.rows[y]..self.rows[y + 1]] {
                if kept[run.label as usize - 1] {
                    fill_run(row, run.start as usize, run.end as usize);
                }
            }
        }
        image
    }
}

/// Fills `start..end`, and maybe some behind: short stretches go faster by the block, and what comes
/// behind is painted later.
#[inline(always)]
fn paint(labels: &mut [u32], start: usize, end: usize, label: u32) {
    let mut at = start;
    while at < end {
        let Some(block) = labels[at..].first_chunk_mut::<16>() else {
            return labels[at..end].fill(label);
        };
        *block = [label; 16];
        at += block.len();
    }
}

/// Joins the runs of one row, `runs[begin..]`, with those of the row above that they touch.
fn join(runs: &mut [Run], above: usize, begin: usize, connectivity: Connectivity) {
    let reach = match connectivity {
        Connectivity::Four => 0,
        Connectivity::Eight => 1,
    };
    let (mut upper, mut lower) = (above, begin);
    while upper < begin && lower < runs.len() {
        let (a, b) = (runs[upper], runs[lower]);
        if a.start < b.end + reach && b.start < a.end + reach {
            union(runs, upper as u32, lower as u32);
        }
        if a.end < b.end {
            upper += 1;
        } else {
            lower += 1;
        }
    }
}

/// The root of run `i`, halving the path to it.
fn find(runs: &mut [Run], mut i: u32) -> u32 {
    loop {
        let parent = runs[i as usize].label;
        if parent == i {
            return i;
        }
        let grandparent = runs[parent as usize].label;
        runs[i as usize].label = grandparent;
        i = grandparent;
    }
}

/// Makes one component of two runs'; the earlier root stays root.
fn union(runs: &mut [Run], i: u32, j: u32) {
    let (i, j) = (find(runs, i), find(runs, j));
    runs[i.max(j) as usize].label = i.min(j);
}

/// Sets the bits `start..end` of a row.
fn fill_run(row: &mut [u64], start: usize, end: usize) {
    let (first, last) = (start / 64, (end - 1) / 64);
    let head = u64::MAX << (start % 64);
    let tail = u64::MAX >> (63 - (end - 1) % 64);
    if first == last {
        row[first] |= head & tail;
    } else {
        row[first] |= head;
        row[first + 1..last].fill(u64::MAX);
        row[last] |= tail;
    }
}

/// The number of holes: background components, of the dual connectivity, that do not reach the
/// outside of the image (which is background).
#[must_use]
pub fn holes(image: &BitImage, connectivity: Connectivity) -> usize {
    let components = Components::label(image, connectivity).count();
    (components.cast_signed() - euler(image, connectivity)).unsigned_abs()
}

/// The Euler number: components minus holes, counted locally. As vertices - edges + faces: for
/// four-connectivity of the complex of pixel centres, their links and full 2 x 2 blocks, for eight
/// of the union of closed pixel squares (Gray 1971, Local properties of binary images).
#[must_use]
pub fn euler(image: &BitImage, connectivity: Connectivity) -> isize {
    let blank = vec![0; image.stride()];
    let mut sum = 0;
    for y in 0..=image.height() {
        let above = if y > 0 { image.row(y - 1) } else { &blank };
        let row = if y < image.height() {
            image.row(y)
        } else {
            &blank
        };
        let (mut carry_row, mut carry_both) = (0, 0);
        for (&a, &b) in above.iter().zip(row) {
            let both = match connectivity {
                Connectivity::Four => a & b,
                Connectivity::Eight => a | b,
            };
            let (left_row, left_both) = (b << 1 | carry_row, both << 1 | carry_both);
            (carry_row, carry_both) = (b >> 63, both >> 63);
            sum += match connectivity {
                Connectivity::Four => {
                    ones(b) - ones(b & left_row) - ones(both) + ones(both & left_both)
                }
                Connectivity::Eight => {
                    ones(b) - ones(b | left_row) - ones(both) + ones(both | left_both)
                }
            };
        }
        if connectivity == Connectivity::Eight {
            // edges and corners right of column 64 k
            sum += carry_both.cast_signed() as isize - carry_row.cast_signed() as isize;
        }
    }
    sum
}

fn ones(word: u64) -> isize {
    word.count_ones() as isize
}
