//! Edges: OpenCV's, the plain twin's, and what the map of edges promises.

use std::fs;

use image::GrayImage;
use linefeat::{
    Canny, CannyParams, EdgeMap, EdgePixel, Gradient, ModifiedCannyParams, Norm, Region, canny,
    canny_modified, reference,
};

use crate::pictures::{KINDS, gray, mix, picture, testdata};

const SIDES: [u32; 17] = [
    0, 1, 2, 3, 4, 5, 17, 31, 32, 33, 63, 64, 65, 96, 127, 128, 129,
];

/// As the golden files have it: the wrapping sum over the edge pixels.
fn hash(edges: &EdgeMap) -> u64 {
    edges
        .pixels()
        .iter()
        .map(|p| mix(u64::from(p.v) * u64::from(edges.width()) + u64::from(p.u)))
        .fold(0, u64::wrapping_add)
}

fn norm(name: &str) -> Norm {
    match name {
        "L1" => Norm::L1,
        "L2" => Norm::L2,
        _ => panic!("no such norm: {name}"),
    }
}

#[test]
fn edges_are_opencvs() {
    let text = fs::read_to_string(testdata("golden/canny.txt")).expect("golden edges");
    let mut workspace = Canny::new();
    let mut edges = EdgeMap::new();
    let (mut cases, mut found) = (0, 0);
    for line in text.lines() {
        let words: Vec<&str> = line.split(' ').collect();
        let [name, seed, width, height, norm_name, low, high, count, want] = words[..] else {
            panic!("not a case: {line}");
        };
        let number = |text: &str| text.parse::<f64>().expect(line);
        let image = if name.ends_with(".png") {
            gray(&format!("frames/{name}"))
        } else {
            picture(
                name,
                number(seed) as u64,
                number(width) as u32,
                number(height) as u32,
            )
        };
        let params = CannyParams {
            low: number(low),
            high: number(high),
            norm: norm(norm_name),
        };
        workspace.detect(&image, &params, &mut edges);
        assert_eq!(edges.pixels().len().to_string(), count, "{line}");
        assert_eq!(format!("{:016x}", hash(&edges)), want, "{line}");
        consistent(&image, &edges);
        cases += 1;
        found += edges.pixels().len();
    }
    assert!(cases > 2000 && found > 1_000_000);
}

#[test]
fn whole_pictures_are_opencvs() {
    let mut files = 0;
    for entry in fs::read_dir(testdata("golden/canny")).expect("golden pictures") {
        let path = entry.expect("an entry").path();
        let stem = path.file_stem().expect("a name").to_string_lossy();
        let parts: Vec<&str> = stem.rsplitn(4, '-').collect();
        let [high, low, norm_name, frame] = parts[..] else {
            panic!("not a case: {stem}");
        };
        let params = CannyParams {
            low: low.parse().expect("a threshold"),
            high: high.parse().expect("a threshold"),
            norm: norm(norm_name),
        };
        let edges = canny(&gray(&format!("frames/{frame}.png")), &params);
        assert_eq!(
            edges.to_gray(),
            gray(&format!("golden/canny/{stem}.png")),
            "{stem}"
        );
        files += 1;
    }
    assert_eq!(files, 3);
}

/// The three forms of the same edges, and the gradients.
fn consistent(image: &GrayImage, edges: &EdgeMap) {
    assert_eq!((edges.width(), edges.height()), image.dimensions());
    let mut pixels = edges.pixels().iter();
    for (u, v, gray) in edges.to_gray().enumerate_pixels() {
        assert_eq!(edges.contains(u, v), gray.0 == [255]);
        if gray.0 == [255] {
            let (gx, gy) = reference::gradient::sobel(image, u, v);
            assert_eq!(pixels.next(), Some(&EdgePixel { u, v, gx, gy }));
        } else {
            assert_eq!(gray.0, [0]);
        }
    }
    assert_eq!(pixels.next(), None);
    if !edges.width().is_multiple_of(64) {
        for v in 0..edges.height() {
            let last = *edges.row(v).last().expect("a word");
            assert_eq!(last >> (edges.width() % 64), 0, "bits past the width");
        }
    }
}

fn random_case(case: u64) -> (GrayImage, CannyParams) {
    let r = mix(case ^ 0xE3D6_E5ED);
    let side = |shift: u32| SIDES[(r >> shift) as usize % SIDES.len()];
    let kind = KINDS[case as usize % KINDS.len()];
    let top = [10, 100, 700, 2400][(r >> 20) as usize % 4];
    let threshold = |shift: u32| (mix(r >> shift) % (8 * top)) as f64 / 8.0 - top as f64 / 20.0;
    let params = CannyParams {
        low: threshold(1),
        high: threshold(2),
        norm: if r & 1 == 0 { Norm::L1 } else { Norm::L2 },
    };
    (picture(kind, case, side(4), side(12)), params)
}

#[test]
fn edges_are_the_twins() {
    let mut workspace = Canny::new();
    let mut edges = EdgeMap::new();
    for case in 0..4000 {
        let (image, params) = random_case(case);
        workspace.detect(&image, &params, &mut edges);
        let want = reference::canny::canny(&image, &params);
        assert_eq!(edges.to_gray(), want, "case {case}: {params:?}");
        consistent(&image, &edges);
    }
}

#[test]
fn modified_edges_are_the_twins() {
    let mut workspace = Canny::new();
    let mut edges = EdgeMap::new();
    let mut found = 0;
    for case in 0..4000 {
        let (image, _) = random_case(case);
        let r = mix(case ^ 0x5EED);
        let real = |shift: u32, from: f64, to: f64| {
            from + (to - from) * (mix(r >> shift) >> 11) as f64 / (1_u64 << 53) as f64
        };
        let line = match r % 6 {
            0 => [0.0, 1.0, -real(1, -5.0, 130.0)],
            1 => [real(1, -1.0, 1.0), 0.0, real(2, -60.0, 60.0)],
            2 => [-1.0, 1.0, (r >> 8 & 63) as f64 - 32.0],
            3 => [f64::NAN, 1.0, 1.0],
            _ => [real(1, -1.0, 1.0), real(2, -1.0, 1.0), real(3, -60.0, 60.0)],
        };
        let params = ModifiedCannyParams {
            region: [Region::HalfPlane(line), Region::Whole][usize::from(r >> 40 & 3 == 0)],
            strong_share: real(4, 0.0, 0.4),
            low_ratio: real(5, 0.0, 1.0),
            noise_factor: real(6, 0.0, 5.0),
            min_high: real(7, 0.0, 100.0),
        };
        let thresholds = workspace.detect_modified(&image, &params, &mut edges);
        assert_eq!(
            thresholds,
            reference::canny::chosen(&image, &params),
            "case {case}"
        );
        let want = reference::canny::canny_modified(&image, &params);
        assert_eq!(edges.to_gray(), want, "case {case}: {params:?}");
        consistent(&image, &edges);
        found += edges.pixels().len();
    }
    assert!(found > 100_000, "{found}");
}

/// A region takes pixels away and changes nothing else but what only they led to.
#[test]
fn a_region_below_the_horizon() {
    let image = gray("frames/dbow2-1.png");
    let whole = canny_modified(&image, &ModifiedCannyParams::default());
    let mut workspace = Canny::new();
    let mut part = EdgeMap::new();
    let line = [0.1, 1.0, -260.0];
    let params = ModifiedCannyParams {
        region: Region::HalfPlane(line),
        ..ModifiedCannyParams::default()
    };
    let thresholds = workspace.detect_modified(&image, &params, &mut part);
    assert!(
        part.pixels()
            .iter()
            .all(|p| params.region.contains(p.u, p.v))
    );
    assert!(part.pixels().len() > 500 && part.pixels().len() < whole.pixels().len());
    let all = canny(&image, &thresholds);
    assert!(part.pixels().iter().all(|p| all.contains(p.u, p.v)));
}

/// The share of the edges of `a` that have an edge of `b` at most a pixel away.
fn shared(a: &EdgeMap, b: &EdgeMap) -> f64 {
    let near = |p: &&EdgePixel| {
        let us = p.u.saturating_sub(1)..=p.u + 1;
        us.clone()
            .any(|u| (p.v.saturating_sub(1)..=p.v + 1).any(|v| b.contains(u, v)))
    };
    a.pixels().iter().filter(near).count() as f64 / a.pixels().len() as f64
}

#[test]
fn chosen_thresholds_follow_exposure() {
    for name in [
        "dbow2-1",
        "rtabmap-20",
        "rtabmap-34",
        "vgg-000",
        "york-urban",
        "opencv-building",
    ] {
        let image = gray(&format!("frames/{name}.png"));
        let mut dark = image.clone();
        dark.iter_mut()
            .for_each(|value| *value = (u16::from(*value) * 11 / 20) as u8);
        let params = ModifiedCannyParams::default();
        let (bright, dark_edges) = (
            canny_modified(&image, &params),
            canny_modified(&dark, &params),
        );
        let kept = shared(&bright, &dark_edges).min(shared(&dark_edges, &bright));
        let fixed = canny(
            &dark,
            &Canny::new().detect_modified(&image, &params, &mut EdgeMap::new()),
        );
        let with_fixed = shared(&bright, &fixed);
        println!(
            "{name}: {} edges, {kept:.3} kept, {with_fixed:.3} with fixed thresholds",
            bright.pixels().len()
        );
        assert!(
            kept > 0.9 && kept > with_fixed,
            "{name}: {kept} {with_fixed}"
        );
    }
}

/// A frame of nothing but sensor noise has next to no edges, however much the noise is.
#[test]
fn noise_alone_is_no_edge() {
    for amplitude in [1, 3, 9, 20, 40] {
        let image = GrayImage::from_fn(640, 480, |u, v| {
            let random = mix(u64::from(v) * 640 + u64::from(u));
            // a sum of four: near enough to Gaussian
            let noise: u64 = (0..4).map(|k| (random >> (8 * k)) % (amplitude + 1)).sum();
            image::Luma([(60 + noise) as u8])
        });
        let edges = canny_modified(&image, &ModifiedCannyParams::default());
        assert!(
            edges.pixels().len() < 31,
            "{amplitude}: {}",
            edges.pixels().len()
        );
    }
}

#[test]
fn gradients_are_the_twins() {
    let mut gradient = Gradient::default();
    for case in 0..2000 {
        let (image, _) = random_case(case);
        gradient.update(&image);
        assert_eq!((gradient.width(), gradient.height()), image.dimensions());
        let mut at = 0;
        for v in 0..image.height() {
            for u in 0..image.width() {
                let got = (gradient.gx()[at], gradient.gy()[at]);
                assert_eq!(got, reference::gradient::sobel(&image, u, v), "case {case}");
                at += 1;
            }
        }
        assert_eq!((gradient.gx().len(), gradient.gy().len()), (at, at));
    }
}

/// An edge that winds inwards from one strong pixel, one pixel wide: the longest way to follow.
#[test]
fn a_spiral_is_followed_to_its_end() {
    for side in [40, 130, 300] {
        let image = spiral(side);
        let params = CannyParams {
            low: 10.0,
            high: 1000.0,
            norm: Norm::L1,
        };
        let edges = canny(&image, &params);
        assert_eq!(edges.to_gray(), reference::canny::canny(&image, &params));
        let middle = edges.pixels().iter().any(|p| p.u.abs_diff(side / 2) < 8);
        assert!(middle, "the spiral's inner end was not reached");
    }
}

/// A band that winds about the middle, faint but for its outer end.
fn spiral(side: u32) -> GrayImage {
    const PITCH: f64 = 12.0;
    let middle = f64::from(side / 2);
    GrayImage::from_fn(side, side, |u, v| {
        let (x, y) = (f64::from(u) - middle, f64::from(v) - middle);
        let (radius, turn) = (x.hypot(y), y.atan2(x) / std::f64::consts::TAU + 0.5);
        let across = (radius / PITCH + turn).rem_euclid(1.0);
        let inside = across < 0.5 && radius < middle - 4.0;
        let outer = radius > middle - PITCH - 4.0 && turn < 0.02;
        image::Luma([if inside && outer {
            255
        } else if inside {
            20
        } else {
            0
        }])
    })
}

#[test]
fn odd_thresholds() {
    let image = picture("noise", 5, 70, 40);
    let count = |low: f64, high: f64, norm| {
        let params = CannyParams { low, high, norm };
        let edges = canny(&image, &params);
        assert_eq!(edges.to_gray(), reference::canny::canny(&image, &params));
        edges.pixels().len()
    };
    for norm in [Norm::L1, Norm::L2] {
        let all = count(0.0, 0.0, norm);
        assert!(all > 900);
        assert_eq!(count(-5.0, -3.0, norm), all);
        assert_eq!(count(f64::NEG_INFINITY, 0.0, norm), all);
        assert_eq!(count(0.0, f64::INFINITY, norm), 0);
        assert_eq!(count(1e300, f64::MAX, norm), 0);
        assert_eq!(count(800.0, 100.0, norm), count(100.0, 800.0, norm));
    }
    // as OpenCV treats them
    assert_eq!(
        count(f64::NAN, 100.0, Norm::L1),
        count(0.0, 100.0, Norm::L1)
    );
    assert_eq!(count(f64::NAN, 100.0, Norm::L2), 0);
}
