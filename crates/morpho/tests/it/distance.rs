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

const SIDES: [usize; 14] = [0, 1, 2, 3, 5, 8, 17, 31, 63, 64, 65, 127, 128, 129];

#[test]
fn equals_the_definition() {
    let mut random = Random(0x9E37_79B9_7F4A_7C15);
    for round in 0..400 {
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
            for least in [0, 1, 2, 9, 16, 100] {
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
