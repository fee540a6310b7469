//! Filling, labelling, holes, growing, threshold: against their definitions.

use crate::random::{CONNECTIVITIES, Random, rounds};
use morpho::{BitImage, Components, Connectivity, FillWorkspace, GrowRule, Pixel};
use morpho::{euler, fill_holes, grow, holes, reconstruct, reference, threshold, to_gray};

fn small_image(random: &mut Random) -> BitImage {
    let (width, height) = (random.side(), random.side());
    random.image(width, height)
}

#[test]
fn fills_equal_their_twins() {
    let mut random = Random::new(11);
    let (mut workspace, mut out) = (FillWorkspace::new(), BitImage::new(0, 0));
    for _ in 0..rounds(2000) {
        let image = random.any_image();
        // sometimes outside
        let seed = Pixel::new(
            random.below(image.width() + 2),
            random.below(image.height() + 2),
        );
        for connectivity in CONNECTIVITIES {
            morpho::seed_fill_into(&image, seed, connectivity, &mut workspace, &mut out);
            let twin = reference::fill::seed_fill(&image, seed, connectivity);
            assert_eq!(out, twin, "{connectivity:?} from {seed:?} in {image:?}");
        }
    }
}

#[test]
fn a_fill_finds_its_way_through_a_maze() {
    // a spiral of one-pixel walls and ways: as many turns as the sides allow
    let side = 135;
    let mut image = BitImage::from_fn(side, side, |_, _| false);
    let (mut x, mut y, mut dx, mut dy) = (0_isize, 0_isize, 1_isize, 0_isize);
    let free = |image: &BitImage, x: isize, y: isize| {
        x >= 0 && y >= 0 && image.get(x.unsigned_abs(), y.unsigned_abs())
    };
    let inside = |x: isize, y: isize| {
        (0..side.cast_signed()).contains(&x) && (0..side.cast_signed()).contains(&y)
    };
    loop {
        image.set(x.unsigned_abs(), y.unsigned_abs(), true);
        let blocked = |dx: isize, dy: isize| {
            !inside(x + dx, y + dy)
                || free(&image, x + 2 * dx, y + 2 * dy)
                || free(&image, x + dx, y + dy)
        };
        if blocked(dx, dy) {
            (dx, dy) = (-dy, dx);
            if blocked(dx, dy) {
                break;
            }
        }
        (x, y) = (x + dx, y + dy);
    }
    assert!(image.count_ones() > side * side / 3);
    for connectivity in CONNECTIVITIES {
        let filled = morpho::seed_fill(&image, Pixel::new(0, 0), connectivity);
        assert_eq!(filled, image, "the whole way is one component");
    }
}

#[test]
fn reconstructions_equal_their_twins() {
    let mut random = Random::new(12);
    for _ in 0..rounds(300) {
        let mask = small_image(&mut random);
        let marker = BitImage::from_fn(mask.width(), mask.height(), |_, _| random.below(40) == 0);
        for connectivity in CONNECTIVITIES {
            let twin = reference::fill::reconstruct(&marker, &mask, connectivity);
            let fast = reconstruct(&marker, &mask, connectivity);
            assert_eq!(fast, twin, "{connectivity:?} {marker:?} {mask:?}");
        }
    }
}

#[test]
fn labels_equal_their_twins() {
    let mut random = Random::new(13);
    let mut components = Components::default();
    let mut labels = vec![7; 3];
    for _ in 0..rounds(400) {
        let image = small_image(&mut random);
        for connectivity in CONNECTIVITIES {
            let twin = reference::fill::labels(&image, connectivity);
            components.relabel(&image, connectivity);
            components.to_labels_into(&mut labels);
            assert_eq!(labels, twin, "{connectivity:?} {image:?}");
            assert_eq!(components.to_labels(), twin);
            check_components(&components, &twin, &image);
            assert_eq!(
                holes(&image, connectivity),
                reference::fill::holes(&image, connectivity),
                "{connectivity:?} {image:?}"
            );
        }
    }
}

/// The figures of every component follow from the labels.
fn check_components(components: &Components, labels: &[u32], image: &BitImage) {
    let width = image.width();
    let count = labels.iter().max().copied().unwrap_or(0);
    assert_eq!(components.count(), count as usize);
    for (i, &label) in labels.iter().enumerate() {
        assert_eq!(components.label_at(i % width, i / width), label);
    }
    for (label, component) in (1..).zip(components.as_slice()) {
        let places: Vec<[usize; 2]> = (0..labels.len())
            .filter(|&i| labels[i] == label)
            .map(|i| [i % width, i / width])
            .collect();
        let columns = || places.iter().map(|[x, _]| *x);
        let rows = || places.iter().map(|[_, y]| *y);
        let bounds = component.bounds;
        assert_eq!(component.label, label);
        assert_eq!(component.area, places.len());
        assert_eq!([component.first.x, component.first.y], places[0]);
        assert_eq!(Some(bounds.x), columns().min());
        assert_eq!(Some(bounds.y), rows().min());
        assert_eq!(Some(bounds.x + bounds.width - 1), columns().max());
        assert_eq!(Some(bounds.y + bounds.height - 1), rows().max());
        let selected = components.select(|c| c.label == label);
        assert_eq!(selected.count_ones(), component.area);
        assert!(places.iter().all(|&[x, y]| selected.get(x, y)));
    }
    let largest = components.as_slice().iter().map(|c| c.area).max();
    assert_eq!(components.largest().map(|c| c.area), largest);
}

/// By definition on one side, by local counts on the other.
#[test]
fn the_euler_number_is_components_minus_holes() {
    let mut random = Random::new(14);
    for _ in 0..rounds(500) {
        let image = random.any_image();
        for connectivity in CONNECTIVITIES {
            let components = Components::label(&image, connectivity).count();
            let mut only_holes = fill_holes(&image, connectivity);
            assert!(image.is_subset_of(&only_holes));
            only_holes.subtract(&image);
            let holes = Components::label(&only_holes, connectivity.dual()).count();
            assert_eq!(
                euler(&image, connectivity),
                components.cast_signed() - holes.cast_signed(),
                "{connectivity:?} {image:?}"
            );
        }
    }
}

#[test]
fn a_ring_has_a_hole_where_its_corners_count() {
    let ring = BitImage::from_fn(5, 5, |x, y| x.abs_diff(2) + y.abs_diff(2) == 2);
    let figures = |c| [Components::label(&ring, c).count(), holes(&ring, c)];
    assert_eq!(figures(Connectivity::Eight), [1, 1]);
    assert_eq!(figures(Connectivity::Four), [8, 0]);
}

#[test]
fn grown_cells_equal_their_twin() {
    let mut random = Random::new(15);
    for _ in 0..rounds(600) {
        let image = random.any_image();
        let limit = random.pick(&[7, 7, 7, 90]);
        let k = 1 + random.below(limit);
        for rule in [GrowRule::All, GrowRule::Majority, GrowRule::Any] {
            let twin = reference::fill::grow(&image, k, rule);
            assert_eq!(grow(&image, k, rule), twin, "{k} {rule:?} {image:?}");
        }
    }
}

#[test]
fn free_is_the_threshold_or_lighter() {
    let mut random = Random::new(16);
    for _ in 0..rounds(600) {
        let (width, height) = (random.side(), random.side());
        let level: u8 = random.pick(&[0, 1, 127, 128, 129, 250, 255]);
        let gray: Vec<u8> = (0..width * height)
            .map(|_| match random.below(3) {
                0 => level,
                1 => level.wrapping_sub(1),
                _ => random.below(256) as u8,
            })
            .collect();
        let want = BitImage::from_fn(width, height, |x, y| gray[y * width + x] >= level);
        let image = threshold(&gray, width, height, level);
        assert_eq!(image, want);
        assert_eq!(threshold(&to_gray(&image), width, height, 255), image);
        let black_and_white: Vec<u8> = gray.iter().map(|&g| u8::from(g >= level) * 255).collect();
        assert_eq!(to_gray(&image), black_and_white);
    }
}
