//! Pictures in which nothing is to be seen.

use image::{GrayImage, Luma};
use mobot_hw::{PictureFault, PictureWatch};

/// Mean and noise in levels, never the same twice.
fn noisy(mean: u8, noise: u32, n: u32) -> GrayImage {
    let mut state = n.wrapping_mul(0x9E37_79B9) | 1;
    GrayImage::from_fn(160, 120, |_, _| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let off = i64::from((state >> 16) % (2 * noise + 1)) - i64::from(noise);
        Luma([(i64::from(mean) + off).clamp(0, 255) as u8])
    })
}

#[test]
fn covered_and_blinded_cameras_are_told_from_dim_and_glaring_ones() {
    let look = |picture: &GrayImage| PictureWatch::default().look(picture);
    assert_eq!(look(&noisy(2, 3, 1)), Some(PictureFault::Dark));
    assert_eq!(look(&noisy(16, 6, 2)), Some(PictureFault::Dark));
    assert_eq!(look(&noisy(252, 4, 3)), Some(PictureFault::Bright));
    assert_eq!(look(&noisy(235, 2, 4)), Some(PictureFault::Bright));
    assert_eq!(look(&noisy(60, 4, 5)), None);
    // a dark corridor with a lit door at its end, and a white wall with a door frame
    let mut corridor = noisy(8, 4, 6);
    let mut wall = noisy(250, 4, 7);
    for (u, v) in (70..90).flat_map(|u| (40..80).map(move |v| (u, v))) {
        corridor.put_pixel(u, v, Luma([180]));
        wall.put_pixel(u, v, Luma([90]));
    }
    assert_eq!((look(&corridor), look(&wall)), (None, None));
}

#[test]
fn ten_equal_pictures_are_a_stuck_camera() {
    let mut watch = PictureWatch::default();
    for n in 0..100 {
        assert_eq!(watch.look(&noisy(100, 2, n)), None, "{n}");
    }
    let still = noisy(100, 2, 1000);
    for n in 1..10 {
        assert_eq!(watch.look(&still), None, "{n}");
    }
    assert_eq!(watch.look(&still), Some(PictureFault::Frozen));
    assert_eq!(watch.look(&still), Some(PictureFault::Frozen));
    assert_eq!(watch.look(&noisy(100, 2, 2000)), None);
}

#[test]
fn pictures_of_any_size_are_looked_at() {
    for (width, height) in [(0, 0), (0, 5), (1, 1), (31, 33), (3000, 2)] {
        let picture = GrayImage::from_pixel(width, height, Luma([128]));
        let empty = width * height == 0;
        let fault = PictureWatch::default().look(&picture);
        assert_eq!(fault, empty.then_some(PictureFault::Dark));
    }
}
