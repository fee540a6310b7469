//! The cleaning chain on pictures whose stages can be told by eye, and its ledger's sums.

use crate::random::{CONNECTIVITIES, Random, rounds};
use morpho::{BitImage, Border, CleanError, Cleaned, Cleaner, CleanerParams, Components};
use morpho::{Difference, Element, GrowRule, Pixel, Stage, Thinning, holes};

/// `#` is free.
fn image(rows: &[&str]) -> BitImage {
    BitImage::from_fn(rows[0].len(), rows.len(), |x, y| {
        rows[y].as_bytes()[x] == b'#'
    })
}

/// Rows of a picture, for another repetition of each pixel.
fn enlarged(rows: &[&str], k: usize) -> BitImage {
    let small = image(rows);
    BitImage::from_fn(small.width() * k, small.height() * k, |x, y| {
        small.get(x / k, y / k)
    })
}

#[test]
fn stages_of_a_room_with_faults() {
    // a room of 12 x 9 with a speck of an obstacle, a whisker out of the wall, a blob outside
    let binary = image(&[
        "..................",
        ".############.....",
        ".#################",
        ".############.....",
        ".#####.######.....",
        ".############.###.",
        ".############.###.",
        ".############.###.",
        ".############.....",
        ".############.....",
    ]);
    let params = CleanerParams {
        opening_side: 3,
        closing_side: 3,
        ..CleanerParams::default()
    };
    let Cleaned { stages, ledger } = Cleaner::new(params).clean(binary).unwrap();
    let room =
        |y_from: usize| BitImage::from_fn(18, 10, |x, y| (1..13).contains(&x) && y >= y_from);
    let blob = |x: usize, y: usize| (14..17).contains(&x) && (5..8).contains(&y);
    let speck = |x: usize, y: usize| [x, y] == [6, 4];
    // the whisker goes
    let with_blob = BitImage::from_fn(18, 10, |x, y| {
        !speck(x, y) && room(1).get(x, y) || blob(x, y)
    });
    assert_eq!(stages.opened, with_blob);
    // the blob goes
    let with_speck = BitImage::from_fn(18, 10, |x, y| room(1).get(x, y) && !speck(x, y));
    assert_eq!(stages.filled, with_speck);
    // the speck fills
    assert_eq!(stages.closed, room(1));
    // only blocks within the room: columns 1 ..= 12 and rows 1 ..= 9 hold 3 x 2 whole blocks
    let grown = BitImage::from_fn(6, 4, |x, y| (1..4).contains(&x) && (1..3).contains(&y));
    assert_eq!(stages.grown, grown);

    let [binary, opened, filled, closed, grown, _] = ledger.entries.as_slice() else {
        panic!("{} entries", ledger.entries.len());
    };
    assert_eq!((binary.stage, binary.removed.pixels), (Stage::Binary, 0));
    assert_eq!((binary.free_components, binary.holes), (2, 1));
    assert_eq!(opened.removed.pixels, 5);
    assert_eq!(opened.removed.regions.len(), 1);
    assert_eq!(opened.removed.regions[0].first, Pixel::new(13, 2));
    assert_eq!(filled.removed.pixels, 9);
    assert_eq!(filled.components.vanished.len(), 1);
    assert_eq!(filled.components.vanished[0].bounds.x, 14);
    assert_eq!((closed.added.pixels, closed.holes), (1, 0));
    assert_eq!(closed.hole_kinship.vanished[0].first, Pixel::new(6, 4));
    assert_eq!(grown.free_cells, 6);
    assert_eq!(grown.removed.pixels, 12 * 9 - 6 * 9);
}

#[test]
fn the_ledger_names_what_joins_and_splits() {
    let two = image(&["##.##", "##.##"]);
    let one = image(&["#####", "##.##"]);
    for connectivity in CONNECTIVITIES {
        let joining = Difference::between(&two, &one, connectivity);
        let [joined] = joining.components.joined.as_slice() else {
            panic!("{joining:?}");
        };
        assert_eq!(joined.into.area, 9);
        assert_eq!(
            joined.from.iter().map(|r| r.first.x).collect::<Vec<_>>(),
            [0, 3]
        );
        assert_eq!((joining.added.pixels, joining.removed.pixels), (1, 0));
        let splitting = Difference::between(&one, &two, connectivity);
        let [split] = splitting.components.split.as_slice() else {
            panic!("{splitting:?}");
        };
        assert_eq!(split.from.area, 9);
        assert_eq!(split.into.len(), 2);
        assert_eq!((splitting.added.pixels, splitting.removed.pixels), (0, 1));
    }
    let one_hole = image(&["#####", "#...#", "#####"]);
    let two_holes = image(&["#####", "#.#.#", "#####"]);
    let difference = Difference::between(&one_hole, &two_holes, CONNECTIVITIES[0]);
    assert_eq!(difference.holes.split.len(), 1);
    assert_eq!(difference.holes.split[0].into.len(), 2);
}

#[test]
fn entries_add_up() {
    let mut random = Random::new(21);
    for _ in 0..rounds(300) {
        let binary = random.any_image();
        let params = CleanerParams {
            opening_side: 1 + random.below(4),
            closing_side: 1 + random.below(4),
            cell_side: 1 + random.below(3),
            grow_rule: random.pick(&[GrowRule::All, GrowRule::Majority, GrowRule::Any]),
            connectivity: random.pick(&CONNECTIVITIES),
            border: random.pick(&crate::random::BORDERS),
            thinning: random.pick(&[Thinning::ZhangSuen, Thinning::GuoHall, Thinning::Homotopic]),
            ..CleanerParams::default()
        };
        let cleaner = Cleaner::new(params.clone());
        let Cleaned { stages, ledger } = cleaner.clean(binary.clone()).unwrap();
        assert_eq!(stages.binary, binary);
        assert!(stages.opened.is_subset_of(&binary));
        assert!(stages.filled.is_subset_of(&stages.opened));
        assert!(stages.filled.is_subset_of(&stages.closed));
        assert!(stages.skeleton.is_subset_of(&stages.grown));
        let largest = Components::label(&stages.opened, params.connectivity)
            .largest()
            .map_or(0, |c| c.area);
        assert_eq!(stages.filled.count_ones(), largest);
        let mut before = 0;
        for (entry, stage) in ledger.entries.iter().zip(Stage::ALL) {
            let after = stages.get(stage);
            assert_eq!(entry.stage, stage);
            assert_eq!(entry.free_cells, after.count_ones());
            assert_eq!(entry.holes, holes(after, params.connectivity));
            for change in [&entry.removed, &entry.added] {
                let sum: usize = change.regions.iter().map(|r| r.area).sum();
                assert_eq!(change.pixels, sum);
            }
            if !matches!(stage, Stage::Binary | Stage::Grown) {
                assert_eq!(
                    before + entry.added.pixels,
                    entry.free_cells + entry.removed.pixels,
                    "{stage:?} {params:?} {binary:?}"
                );
            }
            let after_it = if stage == Stage::Opened {
                0
            } else {
                usize::MAX
            };
            assert!(entry.added.pixels <= after_it, "opening adds nothing");
            before = entry.free_cells;
        }
    }
}

#[test]
fn the_default_is_the_literal_chain() {
    let gray: Vec<u8> = (0..40 * 30)
        .map(|i| if i % 7 == 0 { 127 } else { 128 })
        .collect();
    let Cleaned { stages, .. } = Cleaner::default().clean_gray(&gray, 40, 30).unwrap();
    // 127 is occupied: one half, or more
    let free = BitImage::from_fn(40, 30, |x, y| (y * 40 + x) % 7 != 0);
    assert_eq!(stages.binary, free);
    let opened = morpho::open(&free, &Element::square(3), Border::Background);
    assert_eq!(stages.opened, opened);
}

#[test]
fn the_seed_chooses_the_region() {
    let binary = enlarged(&["##.#", "##.#"], 6);
    let cleaned = |seed| {
        let params = CleanerParams {
            seed,
            ..CleanerParams::default()
        };
        Cleaner::new(params).clean(binary.clone())
    };
    assert_eq!(cleaned(None).unwrap().stages.filled.count_ones(), 144);
    let small = cleaned(Some(Pixel::new(20, 3))).unwrap();
    assert_eq!(small.stages.filled.count_ones(), 72);
    let seed = Pixel::new(14, 3);
    assert_eq!(
        cleaned(Some(seed)),
        Err(CleanError::SeedNotFree {
            seed,
            width: 24,
            height: 12
        })
    );
    let outside = cleaned(Some(Pixel::new(24, 3)));
    assert!(matches!(outside, Err(CleanError::SeedNotFree { .. })));
}

#[test]
fn sides_of_zero_are_refused() {
    for name in ["opening_side", "closing_side", "cell_side"] {
        let mut params = CleanerParams::default();
        match name {
            "opening_side" => params.opening_side = 0,
            "closing_side" => params.closing_side = 0,
            _ => params.cell_side = 0,
        }
        let result = Cleaner::new(params).clean(BitImage::new(3, 3));
        assert_eq!(result, Err(CleanError::ZeroSide { name }));
    }
}

#[test]
fn nothing_free_stays_nothing() {
    for (width, height) in [(0, 0), (0, 5), (5, 0), (70, 3)] {
        let cleaned = Cleaner::default()
            .clean(BitImage::new(width, height))
            .unwrap();
        assert_eq!(cleaned.stages.skeleton.count_ones(), 0);
        assert_eq!(cleaned.ledger.entries.len(), 6);
    }
}
