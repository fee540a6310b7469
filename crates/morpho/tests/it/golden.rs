//! Against OpenCV, scikit-image and SciPy: testdata/golden/make_morphology.py says how.
#![expect(
    clippy::unwrap_used,
    reason = "a golden file that does not parse fails the test"
)]

use std::collections::BTreeMap;

use morpho::{BitImage, Border, Components, Connectivity, Element, GrowRule, Pixel};
use morpho::{close, dilate, erode, euler, fill_holes, grow, open, reconstruct, seed_fill};

/// Takes a line off the front.
fn line(rest: &mut &[u8]) -> Option<String> {
    let end = rest.iter().position(|&b| b == b'\n')?;
    let line = String::from_utf8(rest[..end].to_vec()).unwrap();
    *rest = &rest[end + 1..];
    Some(line)
}

/// Takes a binary PBM off the front.
fn picture(rest: &mut &[u8]) -> BitImage {
    assert_eq!(line(rest).unwrap(), "P4");
    let size = line(rest).unwrap();
    let (width, height) = size.split_once(' ').unwrap();
    let (width, height) = (width.parse().unwrap(), height.parse().unwrap());
    let stride = usize::div_ceil(width, 8);
    let (pixels, behind) = rest.split_at(stride * height);
    *rest = behind;
    BitImage::from_fn(width, height, |x, y| {
        pixels[y * stride + x / 8] >> (7 - x % 8) & 1 == 1
    })
}

fn element(name: &str) -> Element {
    let parts: Vec<&str> = name.split('-').collect();
    let number = |i: usize| parts[i].parse().unwrap();
    match parts[0] {
        "rect" => Element::rectangle(number(1), number(2)),
        "disk" => Element::disk(number(1)),
        "mask" => {
            let rows = &parts[3..];
            let mask = BitImage::from_fn(rows[0].len(), rows.len(), |x, y| {
                rows[y].as_bytes()[x] == b'1'
            });
            Element::from_mask(&mask, Pixel::new(number(1), number(2))).unwrap()
        }
        other => panic!("an element of kind {other}"),
    }
}

fn border(name: &str) -> Border {
    match name {
        "neutral" => Border::Neutral,
        "0" => Border::Background,
        "1" => Border::Foreground,
        other => panic!("a border rule {other}"),
    }
}

fn connectivity(name: &str) -> Connectivity {
    match name {
        "4" => Connectivity::Four,
        "8" => Connectivity::Eight,
        other => panic!("a connectivity {other}"),
    }
}

fn rule(name: &str) -> GrowRule {
    match name {
        "all" => GrowRule::All,
        "majority" => GrowRule::Majority,
        "any" => GrowRule::Any,
        other => panic!("a growing rule {other}"),
    }
}

/// The components as the file writes them.
fn component_lines(image: &BitImage, connectivity: Connectivity) -> Vec<String> {
    Components::label(image, connectivity)
        .as_slice()
        .iter()
        .map(|c| {
            let b = c.bounds;
            format!("{},{},{},{},{}", c.area, b.x, b.y, b.width, b.height)
        })
        .collect()
}

/// What we make of the work; `None` where it is a figure, which is compared here.
fn ours(image: &BitImage, words: &[&str]) -> Option<BitImage> {
    Some(match words {
        ["erode", outside, e] => erode(image, &element(e), border(outside)),
        ["dilate", outside, e] => dilate(image, &element(e), border(outside)),
        ["open", e] => open(image, &element(e), Border::Neutral),
        ["close", e] => close(image, &element(e), Border::Neutral),
        ["fill", x, y, c] => {
            let seed = Pixel::new(x.parse().unwrap(), y.parse().unwrap());
            seed_fill(image, seed, connectivity(c))
        }
        ["holes", c] => fill_holes(image, connectivity(c)),
        ["reconstruct", c] => {
            let marker = open(image, &Element::square(5), Border::Neutral);
            reconstruct(&marker, image, connectivity(c))
        }
        ["grow", k, r] => grow(image, k.parse().unwrap(), rule(r)),
        ["components", c, components @ ..] => {
            assert_eq!(component_lines(image, connectivity(c)), components);
            return None;
        }
        ["euler", c, number] => {
            assert_eq!(euler(image, connectivity(c)).to_string(), *number);
            return None;
        }
        other => panic!("the work {other:?}"),
    })
}

#[test]
fn equals_opencv_scikit_image_and_scipy() {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../testdata/golden/morphology.pbms"
    );
    let bytes = std::fs::read(path).unwrap();
    let mut rest = bytes.as_slice();
    let mut inputs = BTreeMap::new();
    let mut compared = 0;
    while let Some(title) = line(&mut rest) {
        let image = picture(&mut rest);
        let words: Vec<&str> = title.split_whitespace().collect();
        if words[0] == "input" {
            inputs.insert(words[1].to_owned(), image);
        } else {
            let input = &inputs[words[0]];
            if let Some(result) = ours(input, &words[1..]) {
                assert_eq!(result, image, "{title} of {input:?}");
            }
            compared += 1;
        }
    }
    assert!(compared > 500, "only {compared} results in the file");
}
