//! Erosion, dilation, opening, closing: against their definitions, and their laws.

use crate::random::{BORDERS, Random, rounds};
use morpho::{BitImage, Border, Element, ElementError, Pixel, Workspace};
use morpho::{
    close, close_into, dilate, dilate_into, erode, erode_into, open, open_into, reference,
};

#[test]
fn equal_their_twins() {
    let mut random = Random::new(1);
    // one workspace and one result for all: what an earlier call left behind must not show
    let (mut workspace, mut out) = (Workspace::new(), BitImage::new(0, 0));
    for _ in 0..rounds(1500) {
        let (image, element) = (random.any_image(), random.element());
        let border = random.pick(&BORDERS);
        erode_into(&image, &element, border, &mut workspace, &mut out);
        let twin = reference::ops::erode(&image, &element, border);
        assert_eq!(out, twin, "erode {border:?} {element:?} {image:?}");
        dilate_into(&image, &element, border, &mut workspace, &mut out);
        let twin = reference::ops::dilate(&image, &element, border);
        assert_eq!(out, twin, "dilate {border:?} {element:?} {image:?}");
    }
}

#[test]
fn openings_and_closings_equal_their_twins() {
    let mut random = Random::new(2);
    let (mut workspace, mut out) = (Workspace::new(), BitImage::new(0, 0));
    for round in 0..rounds(400) {
        let (width, height) = (random.side(), random.side());
        let image = random.image(width, height);
        // the twin's plane grows with the element
        let element = loop {
            let element = random.element();
            if round % 16 == 0 || element.area() < 50 {
                break element;
            }
        };
        let border = random.pick(&BORDERS);
        open_into(&image, &element, border, &mut workspace, &mut out);
        let twin = reference::ops::open(&image, &element, border);
        assert_eq!(out, twin, "open {border:?} {element:?} {image:?}");
        close_into(&image, &element, border, &mut workspace, &mut out);
        let twin = reference::ops::close(&image, &element, border);
        assert_eq!(out, twin, "close {border:?} {element:?} {image:?}");
    }
}

/// Images of so many words that they pass in several bands, and in registers, with and without words
/// left over.
#[test]
fn large_images_equal_their_twins() {
    type Operation = fn(&BitImage, &Element, Border) -> BitImage;
    let operations: [(Operation, Operation); 4] = [
        (erode, reference::ops::erode),
        (dilate, reference::ops::dilate),
        (open, reference::ops::open),
        (close, reference::ops::close),
    ];
    let mut random = Random::new(5);
    for round in 0..rounds(6) {
        let (width, height) = match round % 3 {
            0 => (4160 + random.below(70), 40),
            1 => (1024 * (1 + random.below(2)), 50),
            _ => (500 + random.below(400), 90),
        };
        let image = random.image(width, height);
        for element in [
            Element::square(3),
            Element::rectangle(2, 3),
            Element::rectangle(1, 9),
            Element::rectangle(17, 2),
            Element::rectangle(18, 1),
            Element::disk(3),
        ] {
            let border = random.pick(&BORDERS);
            for (operation, twin) in operations {
                assert_eq!(
                    operation(&image, &element, border),
                    twin(&image, &element, border),
                    "{border:?} {element:?} {width} x {height}"
                );
            }
        }
    }
}

/// Every width and height near the ends of words and of windows, every border rule.
#[test]
fn rectangles_at_every_edge_equal_their_twins() {
    let mut random = Random::new(6);
    for width in [
        1, 2, 3, 7, 16, 63, 64, 65, 128, 255, 257, 511, 512, 513, 576,
    ] {
        for height in [1, 2, 3, 4, 15, 16, 17] {
            let image = random.image(width, height);
            for [columns, rows] in [[3, 3], [15, 15], [16, 4], [17, 1], [2, 2], [33, 5]] {
                let element = Element::rectangle(columns, rows);
                let border = random.pick(&BORDERS);
                let context = format!("{border:?} {columns} x {rows} {width} x {height}");
                assert_eq!(
                    open(&image, &element, border),
                    reference::ops::open(&image, &element, border),
                    "open {context}"
                );
                assert_eq!(
                    close(&image, &element, border),
                    reference::ops::close(&image, &element, border),
                    "close {context}"
                );
                assert_eq!(
                    erode(&image, &element, border),
                    reference::ops::erode(&image, &element, border),
                    "erode {context}"
                );
            }
        }
    }
}

/// The border rule with foreground and background exchanged.
fn exchanged(border: Border) -> Border {
    match border {
        Border::Neutral => Border::Neutral,
        Border::Background => Border::Foreground,
        Border::Foreground => Border::Background,
    }
}

#[test]
fn laws_hold() {
    let mut random = Random::new(3);
    for _ in 0..rounds(1500) {
        let (image, element) = (random.any_image(), random.element());
        let border = random.pick(&BORDERS);
        let complement = image.complement();
        let context = format!("{border:?} {element:?} {image:?}");

        let mut dual = dilate(&complement, &element, exchanged(border));
        dual.invert();
        assert_eq!(erode(&image, &element, border), dual, "duality {context}");
        let opened = open(&image, &element, border);
        let mut dual = close(&complement, &element, exchanged(border));
        dual.invert();
        assert_eq!(opened, dual, "duality of open {context}");

        let closed = close(&image, &element, border);
        assert!(opened.is_subset_of(&image), "anti-extensive {context}");
        assert!(image.is_subset_of(&closed), "extensive {context}");
        if border == Border::Neutral {
            assert_eq!(
                open(&opened, &element, border),
                opened,
                "idempotent {context}"
            );
            assert_eq!(
                close(&closed, &element, border),
                closed,
                "idempotent {context}"
            );
        }
        // a smaller image stays smaller
        let mut smaller = image.clone();
        smaller.intersect(&random.image(image.width(), image.height()));
        for operation in [erode, dilate, open, close] {
            let (small, large) = (
                operation(&smaller, &element, border),
                operation(&image, &element, border),
            );
            assert!(small.is_subset_of(&large), "increasing {context}");
        }
    }
}

/// On the plane, moving the image moves the result.
#[test]
fn translation_commutes() {
    let mut random = Random::new(4);
    for _ in 0..rounds(300) {
        let element = Element::disk(random.below(4));
        let image = random.image(40, 30);
        let [dx, dy] = [random.below(90), random.below(50)];
        let placed = |x0: usize, y0: usize, image: &BitImage| {
            BitImage::from_fn(160, 110, |x, y| {
                x >= x0 && y >= y0 && image.get(x - x0, y - y0)
            })
        };
        for operation in [erode, dilate, open, close] {
            let here = operation(&placed(10, 10, &image), &element, Border::Background);
            let there = operation(
                &placed(10 + dx, 10 + dy, &image),
                &element,
                Border::Background,
            );
            let moved = BitImage::from_fn(160, 110, |x, y| {
                x >= dx && y >= dy && here.get(x - dx, y - dy)
            });
            assert_eq!(there, moved, "by ({dx}, {dy}) {element:?} {image:?}");
        }
    }
}

#[test]
fn even_sides_reach_farther_left_and_up() {
    let offsets: Vec<_> = Element::rectangle(2, 4).offsets().collect();
    let want: Vec<_> = (-2..2).flat_map(|dy| [[-1, dy], [0, dy]]).collect();
    assert_eq!(offsets, want);
}

#[test]
fn a_disk_is_its_inequality() {
    for radius in 0..40_isize {
        let disk = Element::disk(radius.unsigned_abs());
        for dy in -radius - 1..=radius + 1 {
            for dx in -radius - 1..=radius + 1 {
                let inside = dx * dx + dy * dy <= radius * radius;
                assert_eq!(disk.contains(dx, dy), inside, "({dx}, {dy}) of {radius}");
            }
        }
    }
}

#[test]
fn elements_larger_than_the_image() {
    let image = BitImage::from_fn(70, 3, |x, _| x != 69);
    let huge = Element::square(100_001);
    assert_eq!(erode(&image, &huge, Border::Neutral).count_ones(), 0);
    assert_eq!(dilate(&image, &huge, Border::Neutral).count_ones(), 210);
    let full = BitImage::from_fn(70, 3, |_, _| true);
    assert_eq!(erode(&full, &huge, Border::Neutral), full);
    assert_eq!(erode(&full, &huge, Border::Background).count_ones(), 0);
    assert_eq!(close(&image, &huge, Border::Neutral), full);
}

#[test]
fn an_empty_mask_is_no_element() {
    let error = Element::from_mask(&BitImage::new(4, 2), Pixel::new(0, 0));
    assert_eq!(
        error,
        Err(ElementError::Empty {
            width: 4,
            height: 2
        })
    );
}
