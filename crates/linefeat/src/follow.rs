//! Gathers edge pixels along a growing line.

use std::f32::consts::PI;

use crate::direction::direction;
use crate::{EdgeMap, SegmentParams};

/// Directions of gradients by pixel: 0 where there is no edge pixel left, else an odd number, 256 a turn.
#[derive(Clone, Debug, Default)]
pub(crate) struct Compass {
    width: i32,
    height: i32,
    codes: Vec<u8>,
}

/// The pixels that were gathered, as a line in steps along one axis of the picture.
#[derive(Clone, Debug, Default)]
pub(crate) struct Path {
    /// Whether the steps go along u (else along v).
    pub(crate) along_u: bool,
    /// First and last step.
    pub(crate) first: i32,
    pub(crate) last: i32,
    /// The other coordinate at step 0, and its change a step, by least squares.
    pub(crate) offset: f64,
    pub(crate) slope: f64,
    /// Whether it gets brighter towards larger values of the other coordinate.
    pub(crate) rising: bool,
}

impl Path {
    pub(crate) fn extent(&self) -> u32 {
        self.last.abs_diff(self.first) + 1
    }
}

/// Columns and rows without edges around the codes.
const FRAME: usize = 2;
/// Steps after which the line leads, not the last pixel.
const LEADING: i32 = 12;

/// The line through the pixels so far: sums over steps and other coordinates, from those of the first.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    count: i32,
    t: f64,
    m: f64,
    tt: f64,
    tm: f64,
    turn: i32,
}

impl Sums {
    #[inline(always)]
    fn add(&mut self, t: i32, m: i32, turn: i8) {
        self.turn += i32::from(turn);
        let (t, m) = (f64::from(t), f64::from(m));
        self.count += 1;
        self.t += t;
        self.m += m;
        self.tt += t * t;
        self.tm += t * m;
    }

    /// Offset and slope.
    fn line(&self) -> (f64, f64) {
        let count = f64::from(self.count);
        let spread = count * self.tt - self.t * self.t;
        let slope = if spread > 0.0 {
            (count * self.tm - self.t * self.m) / spread
        } else {
            0.0
        };
        ((self.m - slope * self.t) / count, slope)
    }
}

impl Compass {
    /// Takes in the gradients of all edge pixels.
    pub(crate) fn update(&mut self, edges: &EdgeMap) {
        let [width, height] = [edges.width(), edges.height()].map(|side| side as usize);
        (self.width, self.height) = (width as i32, height as i32);
        self.codes.clear();
        self.codes
            .resize((width + 2 * FRAME) * (height + 2 * FRAME), 0);
        pulp::Arch::new().dispatch(Encode {
            codes: &mut self.codes,
            stride: width + 2 * FRAME,
            edges,
        });
    }

    /// Takes the pixels of the line through an edge pixel off the compass and into `path`. False if the
    /// pixel is taken already.
    pub(crate) fn follow(
        &mut self,
        [u, v]: [u32; 2],
        params: &SegmentParams,
        path: &mut Path,
    ) -> bool {
        let stride = self.width as usize + 2 * FRAME;
        let origin = (v as usize + FRAME) * stride + u as usize + FRAME;
        let code = self.codes[origin];
        if code == 0 {
            return false;
        }
        // gradients within 45 degrees of the v axis: the line runs along u
        let along_u = (code.wrapping_add(32) & 127) >= 64;
        let turn = (params.turn * (128.0 / std::f64::consts::PI)).clamp(0.0, 64.0);
        let (u, v) = (u as i32, v as i32);
        let (t0, m0, t_end, m_end) = if along_u {
            (u, v, self.width, self.height)
        } else {
            (v, u, self.height, self.width)
        };
        let mut walk = Walk {
            codes: &mut self.codes,
            origin: origin as isize,
            step_t: if along_u { 1 } else { stride as isize },
            step_m: if along_u { stride as isize } else { 1 },
            t: [-t0, t_end - 1 - t0],
            m: [-m0, m_end - 1 - m0],
            code,
            tolerance: turn as u8,
            gap: params.gap_px.min(1 << 20) as i32,
            sums: Sums::default(),
        };
        walk.take(0, 0, code);
        let last = walk.walk(1);
        let first = walk.walk(-1);
        let (offset, slope) = walk.sums.line();
        *path = Path {
            along_u,
            first: t0 + first,
            last: t0 + last,
            offset: f64::from(m0) + offset - slope * f64::from(t0),
            slope,
            rising: if along_u {
                code < 128
            } else {
                code.wrapping_add(64) < 128
            },
        };
        true
    }
}

/// One line in the making. Places are (t, m): steps along the line's axis and across from its first pixel.
struct Walk<'a> {
    codes: &'a mut [u8],
    /// Where the first pixel's code is, and how far apart those of neighbours are.
    origin: isize,
    step_t: isize,
    step_m: isize,
    /// First and last t and m in the picture.
    t: [i32; 2],
    m: [i32; 2],
    code: u8,
    tolerance: u8,
    gap: i32,
    sums: Sums,
}

impl Walk<'_> {
    #[inline(always)]
    fn index(&self, t: i32, m: i32) -> usize {
        (self.origin + t as isize * self.step_t + m as isize * self.step_m) as usize
    }

    /// Whether a code is an edge pixel's whose direction is near another.
    #[inline(always)]
    fn agrees(&self, code: u8, mean: u8) -> bool {
        code != 0 && (code.wrapping_sub(mean) as i8).unsigned_abs() <= self.tolerance
    }

    /// Adds a pixel; those beside it that show the same edge are done with too.
    #[inline(always)]
    fn take(&mut self, t: i32, m: i32, code: u8) {
        self.sums.add(t, m, code.wrapping_sub(self.code) as i8);
        let middle = self.index(t, m);
        let (before, after) = (middle - self.step_m as usize, middle + self.step_m as usize);
        for place in [before, middle, after] {
            if self.agrees(self.codes[place], code) {
                self.codes[place] = 0;
            }
        }
    }

    /// Goes on from the first pixel in one direction; the last step with a pixel.
    fn walk(&mut self, step: i32) -> i32 {
        let ((mut last, mut last_m), mut t) = ((0, 0), 0);
        let (mut offset, mut slope) = (0.0, 0.0);
        let mut next_fit = 0;
        let mut mean = self.code;
        loop {
            t += step;
            let leads = self.sums.count >= LEADING;
            let gap = if leads { self.gap } else { 0 };
            if (t - last).abs() > gap + 1 || t < self.t[0] || t > self.t[1] {
                return last;
            }
            let mut middle = last_m;
            if leads {
                if self.sums.count >= next_fit {
                    (offset, slope) = self.sums.line();
                    mean = self
                        .code
                        .wrapping_add((self.sums.turn / self.sums.count) as u8);
                    next_fit = self.sums.count + self.sums.count / 8;
                }
                // truncation of what is positive rounds
                middle = (offset + slope * f64::from(t) + 65_536.5) as i32 - 65_536;
                if middle < self.m[0] || middle > self.m[1] {
                    return last;
                }
            }
            let place = self.index(t, middle);
            let step_m = self.step_m as usize;
            let codes = [
                self.codes[place],
                self.codes[place - step_m],
                self.codes[place + step_m],
            ];
            for (code, beside) in codes.into_iter().zip([0, -1, 1]) {
                if self.agrees(code, mean) {
                    (last, last_m) = (t, middle + beside);
                    self.take(last, last_m, code);
                    break;
                }
            }
        }
    }
}

struct Encode<'a> {
    codes: &'a mut [u8],
    stride: usize,
    edges: &'a EdgeMap,
}

impl pulp::NullaryFnOnce for Encode<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        const SOME: usize = 32;
        for pixels in self.edges.pixels().chunks(SOME) {
            let (mut gx, mut gy) = ([0f32; SOME], [0f32; SOME]);
            for (i, pixel) in pixels.iter().enumerate() {
                (gx[i], gy[i]) = (f32::from(pixel.gx), f32::from(pixel.gy));
            }
            let mut codes = [0i32; SOME];
            for i in 0..SOME {
                // whole numbers by truncation of positive ones
                let turns = direction(gx[i], gy[i]) * (64.0 / PI) + 128.5;
                codes[i] = (turns as i32) << 1 | 1;
            }
            for (pixel, code) in pixels.iter().zip(codes) {
                let row = (pixel.v as usize + FRAME) * self.stride;
                self.codes[row + pixel.u as usize + FRAME] = code as u8;
            }
        }
    }
}
