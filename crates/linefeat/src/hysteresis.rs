//! Weak pixels that strong ones lead to, 64 pixels at a time.

/// Every pixel of `weak` that a chain of neighbours (eight a pixel) within `weak` joins to a pixel of
/// `found`, which is a part of `weak`. `stack` is used for what two sweeps leave over.
pub(crate) fn follow(weak: &[u64], found: &mut [u64], stride: usize, stack: &mut Vec<usize>) {
    if stride == 0 {
        return;
    }
    let height = weak.len() / stride;
    for v in 1..height {
        let (above, here) = found.split_at_mut(v * stride);
        row(
            &weak[v * stride..][..stride],
            &above[(v - 1) * stride..],
            &mut here[..stride],
        );
    }
    if height > 0 {
        // the first row has no row above
        let (first, _) = found.split_at_mut(stride);
        spread(&weak[..stride], first);
    }
    for v in (0..height.saturating_sub(1)).rev() {
        let (here, below) = found.split_at_mut((v + 1) * stride);
        row(
            &weak[v * stride..][..stride],
            &below[..stride],
            &mut here[v * stride..],
        );
    }
    // what the sweep upwards found may lead down again
    stack.clear();
    for v in 1..height {
        let above = &found[(v - 1) * stride..][..stride];
        for w in 0..stride {
            let at = v * stride + w;
            if weak[at] & !found[at] & beside(above, w) != 0 {
                stack.push(at);
            }
        }
    }
    while let Some(at) = stack.pop() {
        let (v, w) = (at / stride, at % stride);
        let mut reached = 0;
        for v in v.saturating_sub(1)..(v + 2).min(height) {
            reached |= beside(&found[v * stride..][..stride], w);
        }
        let now = fill(weak[at], found[at] | reached & weak[at]);
        if now == found[at] {
            continue;
        }
        found[at] = now;
        for v in v.saturating_sub(1)..(v + 2).min(height) {
            for w in w.saturating_sub(1)..(w + 2).min(stride) {
                let other = v * stride + w;
                if weak[other] & !found[other] != 0 {
                    stack.push(other);
                }
            }
        }
    }
}

/// `here` gets what `beside_row` leads to, and what that leads to along the row.
#[inline(always)]
fn row(weak: &[u64], beside_row: &[u64], here: &mut [u64]) {
    for w in 0..weak.len() {
        if weak[w] != 0 {
            here[w] |= beside(beside_row, w) & weak[w];
        }
    }
    spread(weak, here);
}

/// Fills along the row.
#[inline(always)]
fn spread(weak: &[u64], here: &mut [u64]) {
    let mut carry = 0;
    for w in 0..weak.len() {
        if weak[w] & !here[w] != 0 {
            here[w] = fill(weak[w], here[w] | carry & weak[w]);
        }
        carry = here[w] >> 63;
    }
    let mut carry = 0;
    for w in (0..weak.len()).rev() {
        if carry & weak[w] & !here[w] != 0 {
            here[w] = fill(weak[w], here[w] | carry);
        }
        carry = here[w] << 63;
    }
}

/// The pixels of word `w` beside, or at, a pixel of the row.
#[inline(always)]
fn beside(row: &[u64], w: usize) -> u64 {
    let here = row[w];
    let left = if w > 0 { row[w - 1] >> 63 } else { 0 };
    let right = row.get(w + 1).map_or(0, |word| word << 63);
    here | here << 1 | left | here >> 1 | right
}

/// Whole runs of `weak` that hold a bit of `seeds`.
#[inline(always)]
fn fill(weak: u64, seeds: u64) -> u64 {
    if seeds == 0 {
        return 0;
    }
    // upwards the carry of an addition runs through, downwards the bits are doubled
    let mut found = (weak.wrapping_add(seeds) ^ weak) & weak | seeds;
    let mut free = weak;
    for shift in [1, 2, 4, 8, 16, 32] {
        found |= found >> shift & free;
        free &= free >> shift;
    }
    found
}
