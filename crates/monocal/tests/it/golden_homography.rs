//! Fits against cv2.findHomography: without outliers both minimise the same error.

use monocal::{CalibrateParams, FloorHomography, Noise, Pair, calibrate};

use crate::csv::{lines, numbers};

#[test]
fn fits_are_those_of_opencv() {
    let rows = lines("golden/homography.csv", false);
    let mut rows = rows.iter();
    let mut groups = 0;
    while let Some(head) = rows.next() {
        let count: usize = head[1].parse().unwrap();
        let pairs: Vec<Pair> = (0..count)
            .map(|_| {
                let n = numbers(rows.next().unwrap());
                Pair::new([n[0], n[1]], [n[2], n[3]])
            })
            .collect();
        let to_pixels = numbers(rows.next().unwrap());
        let to_floor = numbers(rows.next().unwrap());
        for (noise, theirs, floor_side) in [
            (Noise::Pixel, to_pixels, false),
            (Noise::Floor, to_floor, true),
        ] {
            let params = CalibrateParams {
                noise,
                ..CalibrateParams::default()
            };
            // sets that hang together by too little, or whose noise is not that of the fit, are not compared
            let Ok(ours) = calibrate(&pairs, &params) else {
                continue;
            };
            if !ours.outliers.is_empty() {
                continue;
            }
            let homography = &ours.camera.homography;
            let square = |m: &[f64]| [[m[0], m[1], m[2]], [m[3], m[4], m[5]], [m[6], m[7], m[8]]];
            let cost = |h: &FloorHomography| -> f64 {
                let squared = |p: &Pair| {
                    if floor_side {
                        h.floor_point(p.pixel)
                            .map_or(f64::INFINITY, |f| f.distance(p.floor).powi(2))
                    } else {
                        h.pixel_of(p.floor).map_or(f64::INFINITY, |q| {
                            (q.u - p.pixel.u).powi(2) + (q.v - p.pixel.v).powi(2)
                        })
                    }
                };
                pairs.iter().map(squared).sum()
            };
            let theirs = FloorHomography::new(square(&theirs)).unwrap();
            let theirs = if floor_side {
                theirs
            } else {
                FloorHomography::new(theirs.floor_to_pixel()).unwrap()
            };
            let (our_cost, their_cost) = (cost(homography), cost(&theirs));
            assert!(
                our_cost <= their_cost * (1.0 + 1e-9) + 1e-12,
                "{noise:?} {count}: {our_cost} {their_cost}"
            );
            // where OpenCV's refinement has converged, the fits are one
            for pair in &pairs {
                let ours = homography.floor_point(pair.pixel).unwrap();
                let theirs = theirs.floor_point(pair.pixel).unwrap();
                let size = 1.0 + ours.x.hypot(ours.y);
                assert!(
                    ours.distance(theirs) < 2e-4 * size,
                    "{noise:?} {count}: {ours:?} {theirs:?}"
                );
            }
            groups += 1;
        }
    }
    assert!(groups >= 36, "{groups}");
}
