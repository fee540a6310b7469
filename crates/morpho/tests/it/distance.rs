//! The distance transform against its definition.

use morpho::{BitImage, Border, distance, reference};

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

    fn image(&mut self, width: usize, height: usize) -> BitImage {
        let percent = [5, 30, 50, 70, 90, 95, 99][self.below(7) as usize];
        BitImage::from_fn(width, height, |_, _| self.below(100) < percent)
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

/// Pixels taken out one by one are those of the whole.
fn check_samples(image: &BitImage, border: Border, squares: &[u32], random: &mut Random) {
    let (width, height) = (image.width(), image.height());
    let wanted = random.image(width, height);
    let want: Vec<u32> = (0..width * height)
        .filter(|&i| wanted.get(i % width, i / width))
        .map(|i| squares[i])
        .collect();
    let found = distance::sampled_to_squares(image, &wanted, border);
    assert!(found == want, "{image:?} {wanted:?}");
}

const SIDES: [usize; 14] = [0, 1, 2, 3, 5, 8, 17, 31, 63, 64, 65, 127, 128, 129];

#[test]
fn equals_the_definition() {
    let mut random = Random(0x9E37_79B9_7F4A_7C15);
    for round in 0..rounds(150) {
        let width = SIDES[random.below(14) as usize];
        let height = SIDES[random.below(if round % 8 == 0 { 14 } else { 9 }) as usize];
        let image = random.image(width, height);
        for border in [Border::Background, Border::Foreground] {
            let squares = distance::squared_to_squares(&image, border);
            assert_eq!(
                distance::squared(&image, border),
                reference::distance::squared(&image, border),
                "{image:?}"
            );
            assert_eq!(
                squares,
                reference::distance::squared_to_squares(&image, border),
                "{image:?}"
            );
            check_samples(&image, border, &squares, &mut random);
            for least in [0, 1, 2, 9, 10, 16, 17, 100, 1000] {
                let want = BitImage::from_fn(width, height, |x, y| {
                    image.get(x, y) && squares[y * width + x] >= least
                });
                assert_eq!(
                    distance::at_least(&image, least, border),
                    want,
                    "{least} of {image:?}"
                );
            }
        }
    }
}

/// Reaches longer than a block looks, and none at all.
#[test]
fn equals_the_definition_over_long_reaches() {
    let mut random = Random(0xD1B5_4A32_D192_ED03);
    for round in 0..rounds(20) {
        let width = [1, 130, 257, 400, 641][random.below(5) as usize];
        let height = [1, 20, 40, 150][random.below(4) as usize];
        let obstacles: Vec<_> = (0..round % 7)
            .map(|_| {
                (
                    random.below(width as u64) as usize,
                    random.below(height as u64) as usize,
                )
            })
            .collect();
        let image = BitImage::from_fn(width, height, |x, y| !obstacles.contains(&(x, y)));
        for border in [Border::Background, Border::Neutral] {
            let squares = distance::squared_to_squares(&image, border);
            assert!(
                distance::squared(&image, border) == reference::distance::squared(&image, border),
                "{width} x {height}, {obstacles:?}"
            );
            assert!(
                squares == reference::distance::squared_to_squares(&image, border),
                "{width} x {height}, {obstacles:?}"
            );
            check_samples(&image, border, &squares, &mut random);
            for least in [4000, 4 * 64 * 64, 70_000] {
                let want = BitImage::from_fn(width, height, |x, y| {
                    image.get(x, y) && squares[y * width + x] >= least
                });
                assert!(
                    distance::at_least(&image, least, border) == want,
                    "{least} on {width} x {height}, {obstacles:?}"
                );
            }
        }
    }
}

/// Memory that saw another image leaves no trace.
#[test]
fn workspaces_are_used_again() {
    let mut random = Random(0x0123_4567_89AB_CDEF);
    let (mut workspace, mut distances) = (distance::Workspace::default(), Vec::new());
    for _ in 0..100 {
        let (width, height) = (random.below(200) as usize, random.below(60) as usize);
        let image = random.image(width, height);
        let border = if random.below(2) == 0 {
            Border::Background
        } else {
            Border::Foreground
        };
        distance::squared_into(&image, border, &mut workspace, &mut distances);
        assert_eq!(distances, distance::squared(&image, border), "{image:?}");
        distance::squared_to_squares_into(&image, border, &mut workspace, &mut distances);
        assert_eq!(
            distances,
            distance::squared_to_squares(&image, border),
            "{image:?}"
        );
    }
}

#[test]
fn without_background_there_is_no_distance() {
    let free = BitImage::from_fn(70, 3, |_, _| true);
    assert!(
        distance::squared(&free, Border::Foreground)
            .iter()
            .all(|&d| d == u32::MAX)
    );
    assert_eq!(
        distance::at_least(&free, u32::MAX, Border::Foreground),
        free
    );
}

/// OpenCV's and SciPy's distances (testdata/golden/make_distance.py).
#[test]
fn equals_opencv() {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../testdata/golden/distance.bin"
    );
    let data = std::fs::read(path).unwrap();
    let mut rest = data.as_slice();
    let mut images = 0;
    while let [w0, w1, h0, h1, planes @ ..] = rest {
        let [width, height] = [[*w0, *w1], [*h0, *h1]].map(|b| usize::from(u16::from_le_bytes(b)));
        let (bits, after) = planes.split_at((width * height).div_ceil(8));
        let (numbers, after) = after.split_at(4 * width * height);
        let image = BitImage::from_fn(width, height, |x, y| {
            let at = y * width + x;
            bits[at / 8] >> (at % 8) & 1 == 1
        });
        let (numbers, _) = numbers.as_chunks::<4>();
        let want: Vec<u32> = numbers.iter().map(|&b| u32::from_le_bytes(b)).collect();
        assert_eq!(
            distance::squared(&image, Border::Foreground),
            want,
            "{image:?}"
        );
        images += 1;
        rest = after;
    }
    assert_eq!(images, 30);
}
