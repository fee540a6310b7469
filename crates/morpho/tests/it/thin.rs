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
