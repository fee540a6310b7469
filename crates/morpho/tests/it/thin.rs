//! Thinning against its definitions, and the promises of the homotopic one.

use morpho::{BitImage, reference, thin};

/// A small deterministic generator: hostile images need no quality, only variety.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn below(&mut self, n: u64) -> u64 {
        (self.next() >> 11) % n
    }

    fn side(&mut self) -> usize {
        const SIDES: [usize; 16] = [0, 1, 2, 3, 4, 5, 8, 15, 16, 17, 63, 64, 65, 127, 128, 129];
        SIDES[self.below(16) as usize]
    }

    /// Noise of 5 .. 100 %, or noise grown into blobs.
    fn image(&mut self) -> BitImage {
        let (width, height) = (self.side(), self.side());
        let percent = [5, 20, 40, 50, 60, 80, 90, 95, 98, 100][self.below(10) as usize];
        let noise = BitImage::from_fn(width, height, |_, _| self.below(100) < percent);
        if self.below(3) > 0 {
            return noise;
        }
        let reach = 1 + self.below(4) as usize;
        BitImage::from_fn(width, height, |x, y| {
            let rows = y.saturating_sub(reach)..(y + reach).min(height);
            let set: usize = rows
                .map(|v| {
                    (x.saturating_sub(reach)..(x + reach).min(width))
                        .filter(|&u| noise.get(u, v))
                        .count()
                })
                .sum();
            set * 2 >= 4 * reach * reach
        })
    }
}

/// Ten times as many with `MOBOT_LONG=1`.
fn rounds(short: u64) -> u64 {
    if std::env::var_os("MOBOT_LONG").is_some() {
        10 * short
    } else {
        short
    }
}

#[test]
fn two_pass_thinnings_equal_their_definitions() {
    let mut random = Random(0x9E37_79B9_7F4A_7C15);
    for _ in 0..rounds(300) {
        let image = random.image();
        assert_eq!(
            thin::zhang_suen(&image),
            reference::thin::zhang_suen(&image),
            "{image:?}"
        );
        assert_eq!(
            thin::guo_hall(&image),
            reference::thin::guo_hall(&image),
            "{image:?}"
        );
    }
}

/// Frames, checkerboards, stripes, specks, and lines along the border.
fn hostile(random: &mut Random) -> BitImage {
    let (width, height) = (random.side(), random.side());
    let kind = random.below(8);
    let noise = random.below(10);
    let period = 1 + random.below(7) as usize;
    BitImage::from_fn(width, height, |x, y| {
        let border = x == 0 || y == 0 || x + 1 == width || y + 1 == height;
        let shape = match kind {
            0 => true,
            1 => border,
            2 => !border,
            3 => (x + y).is_multiple_of(2),
            4 => (x / period).is_multiple_of(2) && (y / period).is_multiple_of(2),
            5 => ((x + y) / period).is_multiple_of(2),
            6 => x % (2 * period) < period || y.is_multiple_of(3 * period),
            _ => x.min(y).min(width - x).min(height - y) / period % 2 != 1,
        };
        shape ^ (random.below(100) < noise)
    })
}

#[test]
fn homotopic_thinning_equals_its_definition() {
    let mut random = Random(0xA076_1D64_78BD_642F);
    for round in 0..rounds(120) {
        let image = if round % 2 == 0 {
            random.image()
        } else {
            hostile(&mut random)
        };
        assert_eq!(
            thin::homotopic(&image),
            reference::homotopic::homotopic(&image),
            "{image:?}"
        );
        let range = [1, 4, 40, u64::from(u32::MAX)][random.below(4) as usize];
        let order: Vec<u32> = (0..image.width() * image.height())
            .map(|_| random.below(range) as u32)
            .collect();
        assert_eq!(
            thin::homotopic_ordered(&image, &order),
            reference::homotopic::homotopic_ordered(&image, &order),
            "{image:?}"
        );
    }
}

/// The parts of an image: which part each pixel belongs to, and how many there are. Foreground hangs
/// together by 8 neighbours, background by 4; one row and column more on each side are background.
struct Parts {
    width: usize,
    of: Vec<usize>,
    foreground: usize,
    background: usize,
}

impl Parts {
    fn new(image: &BitImage) -> Self {
        let (width, height) = (image.width() + 2, image.height() + 2);
        let set = |i: usize| {
            !i.is_multiple_of(width) && i >= width && image.get(i % width - 1, i / width - 1)
        };
        let mut parts = Self {
            width,
            of: vec![usize::MAX; width * height],
            foreground: 0,
            background: 0,
        };
        for start in 0..width * height {
            if parts.of[start] != usize::MAX {
                continue;
            }
            let foreground = set(start);
            let count = if foreground {
                &mut parts.foreground
            } else {
                &mut parts.background
            };
            let name = *count;
            *count += 1;
            let mut stack = vec![start];
            parts.of[start] = name;
            while let Some(at) = stack.pop() {
                for (dx, dy) in (0..9).map(|i| (i % 3, i / 3)) {
                    let (x, y) = (at % width + dx, at / width + dy);
                    let inside = (1..=width).contains(&x) && (1..=height).contains(&y);
                    if !inside || (!foreground && dx != 1 && dy != 1) {
                        continue;
                    }
                    let beside = (y - 1) * width + x - 1;
                    if set(beside) == foreground && parts.of[beside] == usize::MAX {
                        parts.of[beside] = name;
                        stack.push(beside);
                    }
                }
            }
        }
        parts
    }
}

/// Each part of the image's foreground holds exactly one part of the skeleton's, and each part of the
/// skeleton's background exactly one of the image's.
fn assert_homotopic(image: &BitImage, skeleton: &BitImage) {
    assert!(skeleton.is_subset_of(image), "{image:?}\n{skeleton:?}");
    let (before, after) = (Parts::new(image), Parts::new(skeleton));
    assert_eq!(
        before.foreground, after.foreground,
        "{image:?}\n{skeleton:?}"
    );
    assert_eq!(
        before.background, after.background,
        "{image:?}\n{skeleton:?}"
    );
    let mut old_of_new = vec![usize::MAX; after.foreground];
    let mut new_of_old = vec![usize::MAX; before.background];
    for i in 0..before.of.len() {
        let (x, y) = (i % before.width, i / before.width);
        let get = |image: &BitImage| x > 0 && y > 0 && image.get(x - 1, y - 1);
        let (key, value) = match (get(image), get(skeleton)) {
            (true, true) => (&mut old_of_new[after.of[i]], before.of[i]),
            (false, false) => (&mut new_of_old[before.of[i]], after.of[i]),
            _ => continue,
        };
        assert!(
            *key == usize::MAX || *key == value,
            "{image:?}\n{skeleton:?}"
        );
        *key = value;
    }
    for map in [&mut old_of_new, &mut new_of_old] {
        let parts = map.len();
        map.sort_unstable();
        map.dedup();
        assert_eq!(
            map.len(),
            parts,
            "two parts became one: {image:?}\n{skeleton:?}"
        );
    }
}

/// By connectivity, not by a crossing number: the foreground neighbours hang together, and so do the
/// background neighbours that reach one of the four sides.
fn is_simple(image: &BitImage, x: usize, y: usize) -> bool {
    let get = |dx: usize, dy: usize| x + dx > 0 && y + dy > 0 && image.get(x + dx - 1, y + dy - 1);
    let ring = BitImage::from_fn(3, 3, |dx, dy| (dx != 1 || dy != 1) && get(dx, dy));
    let clear = BitImage::from_fn(3, 3, |dx, dy| (dx != 1 || dy != 1) && !get(dx, dy));
    let four_parts = |set: &BitImage| {
        let mut name = [[0, 1, 2], [3, 4, 5], [6, 7, 8]];
        for _ in 0..8 {
            for v in 0..3 {
                for u in 0..3 {
                    for (a, b) in [(u, v + 1), (u + 1, v)] {
                        if a < 3 && b < 3 && set.get(u, v) && set.get(a, b) {
                            let least = name[v][u].min(name[b][a]);
                            name[v][u] = least;
                            name[b][a] = least;
                        }
                    }
                }
            }
        }
        let mut sides: Vec<_> = [(1, 0), (0, 1), (2, 1), (1, 2)]
            .into_iter()
            .filter(|&(u, v)| set.get(u, v))
            .map(|(u, v)| name[v][u])
            .collect();
        sides.sort_unstable();
        sides.dedup();
        sides.len()
    };
    Parts::new(&ring).foreground == 1 && four_parts(&clear) == 1
}

/// No pixel can go but ends, so nothing is thicker than its topology forces it to be.
fn assert_thin(image: &BitImage, skeleton: &BitImage) {
    for y in 0..skeleton.height() {
        for x in 0..skeleton.width() {
            if !skeleton.get(x, y) || !is_simple(skeleton, x, y) {
                continue;
            }
            let around = (0..9)
                .filter(|i| {
                    let (u, v) = (x + i % 3, y + i / 3);
                    *i != 4 && u > 0 && v > 0 && skeleton.get(u - 1, v - 1)
                })
                .count();
            assert_eq!(around, 1, "({x}, {y}) can go: {image:?}\n{skeleton:?}");
        }
    }
}

#[test]
fn homotopic_thinning_keeps_the_topology_and_is_one_pixel_wide() {
    let mut random = Random(0xE703_7ED1_A0B4_28DB);
    for round in 0..rounds(300) {
        let image = if round % 2 == 0 {
            random.image()
        } else {
            hostile(&mut random)
        };
        let skeleton = thin::homotopic(&image);
        assert_homotopic(&image, &skeleton);
        assert_thin(&image, &skeleton);
        let range = [1, 4, 40, u64::from(u32::MAX)][random.below(4) as usize];
        let order: Vec<u32> = (0..image.width() * image.height())
            .map(|_| random.below(range) as u32)
            .collect();
        let skeleton = thin::homotopic_ordered(&image, &order);
        assert_homotopic(&image, &skeleton);
        assert_thin(&image, &skeleton);
    }
}

/// A corridor with square ends at any angle: the skeleton is its centre line, and reaches to half its
/// width from either end.
#[test]
fn a_corridors_skeleton_is_its_centre_line() {
    for (half_length, half_width) in [(70.0, 3.2), (70.0, 7.5), (70.0, 16.7), (60.0, 30.0)] {
        for degrees in (0..180).step_by(5) {
            let (sine, cosine) = f64::from(degrees).to_radians().sin_cos();
            let along = |x: usize, y: usize| {
                let (dx, dy) = (x as f64 - 99.6, y as f64 - 100.3);
                [dx * cosine + dy * sine, dy * cosine - dx * sine]
            };
            let image = BitImage::from_fn(200, 200, |x, y| {
                let [s, t] = along(x, y);
                s.abs() <= half_length && t.abs() <= half_width
            });
            let skeleton = thin::homotopic(&image);
            let straight = half_length - half_width - 2.0;
            let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
            for (x, y) in (0..200 * 200).map(|i| (i % 200, i / 200)) {
                let [s, t] = along(x, y);
                if !skeleton.get(x, y) || s.abs() > straight {
                    continue;
                }
                assert!(
                    t.abs() <= 1.5,
                    "{t:.2} off at {s:.1}, {degrees} degrees, {half_width}"
                );
                least = least.min(s);
                most = most.max(s);
            }
            let reach = straight - 3.0;
            assert!(
                least <= -reach && most >= reach,
                "{least:.1} .. {most:.1} of {straight:.1} at {degrees} degrees, {half_width}"
            );
        }
    }
}

fn golden(name: &str) -> Vec<u8> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/");
    std::fs::read(format!("{folder}{name}")).expect("test data in place")
}

/// OpenCV's results (testdata/golden/make_thinning.py).
#[test]
fn two_pass_thinnings_equal_opencv_on_little_images() {
    let data = golden("golden/thinning.bin");
    let mut rest = data.as_slice();
    let mut images = 0;
    while let [width, height, planes @ ..] = rest {
        let (width, height) = (usize::from(*width), usize::from(*height));
        let bytes = (width * height).div_ceil(8);
        let plane = |i: usize| {
            let bits = &planes[i * bytes..(i + 1) * bytes];
            BitImage::from_fn(width, height, |x, y| {
                let at = y * width + x;
                bits[at / 8] >> (at % 8) & 1 == 1
            })
        };
        assert_eq!(thin::zhang_suen(&plane(0)), plane(1), "{:?}", plane(0));
        assert_eq!(thin::guo_hall(&plane(0)), plane(2), "{:?}", plane(0));
        images += 1;
        rest = &planes[3 * bytes..];
    }
    assert_eq!(images, 383);
}

/// OpenCV's results on real maps, as counts and hashes.
#[test]
fn two_pass_thinnings_equal_opencv_on_maps() {
    let text = String::from_utf8(golden("golden/thinning_maps.txt")).unwrap();
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let [path, width, height, ref results @ ..] = line.split(' ').collect::<Vec<_>>()[..]
        else {
            panic!("{line}");
        };
        let (width, height): (usize, usize) = (width.parse().unwrap(), height.parse().unwrap());
        let file = golden(&format!("maps/{path}"));
        let grey = &file[file.len() - width * height..];
        let free = BitImage::from_fn(width, height, |x, y| grey[y * width + x] >= 250);
        let got = [thin::zhang_suen(&free), thin::guo_hall(&free)].map(|thinned| {
            let hash = (0..width * height).fold(0xCBF2_9CE4_8422_2325_u64, |hash, i| {
                let pixel = u64::from(thinned.get(i % width, i / width));
                (hash ^ pixel).wrapping_mul(0x100_0000_01B3)
            });
            format!("{} {hash:016x}", thinned.count_ones())
        });
        assert_eq!(got.join(" "), results.join(" "), "{path}");
        assert_homotopic(&free, &thin::homotopic(&free));
    }
}
