//! Our lines against OpenCV's, on rendered edges with known truth and on frames.

use std::f64::consts::PI;

use linefeat::{CannyParams, Hough, HoughParams, SegmentParams, Voting, canny, hough, segments};

use crate::pictures::{gray, testdata};

const TILE: [u32; 2] = [128, 96];
const ACROSS: u32 = 10;

/// Errors of one method over all tiles: theta [rad] and the distance of the line at the tile's middle [px].
#[derive(Default)]
struct Errors(Vec<[f64; 2]>);

impl Errors {
    fn add(&mut self, [rho, theta]: [f64; 2], [true_rho, true_theta]: [f64; 2]) {
        let (sin, cos) = true_theta.sin_cos();
        let centre = TILE.map(|side| 0.5 * (f64::from(side) - 1.0));
        // the point of the true line nearest to the tile's centre
        let off = true_rho - centre[0] * cos - centre[1] * sin;
        let point = [centre[0] + off * cos, centre[1] + off * sin];
        let turn = (theta - true_theta + 0.5 * PI).rem_euclid(PI) - 0.5 * PI;
        let distance = rho - point[0] * theta.cos() - point[1] * theta.sin();
        self.0.push([turn, distance]);
    }

    fn rms(&self) -> [f64; 2] {
        [0, 1].map(|i| {
            let squares: f64 = self.0.iter().map(|error| error[i] * error[i]).sum();
            (squares / self.0.len() as f64).sqrt()
        })
    }
}

fn no_worse(ours: [f64; 2], theirs: [f64; 2], part: f64) -> bool {
    ours[0] <= part * theirs[0] && ours[1] <= part * theirs[1]
}

#[test]
fn lines_lie_nearer_the_truth_than_opencvs() {
    let mosaic = gray("golden/lines.png");
    let table = std::fs::read_to_string(testdata("golden/lines.csv")).expect("a table");
    let [
        mut refitted,
        mut modified,
        mut standard,
        mut cv_hough,
        mut cv_lsd,
    ] = std::array::from_fn(|_| Errors::default());
    for (i, row) in (0u32..).zip(table.lines().skip(1)) {
        let numbers: Vec<f64> = row
            .split(',')
            .map(|n| n.parse().expect("a number"))
            .collect();
        let truth = [numbers[1], numbers[2]];
        cv_hough.add([numbers[3], numbers[4]], truth);
        cv_lsd.add([numbers[5], numbers[6]], truth);
        let corner = [i % ACROSS * TILE[0], i / ACROSS * TILE[1]];
        let tile = image::imageops::crop_imm(&mosaic, corner[0], corner[1], TILE[0], TILE[1]);
        let tile = tile.to_image();
        let contrast = numbers[0].abs();
        let thresholds = CannyParams {
            low: 0.8 * contrast,
            high: 1.6 * contrast,
            ..CannyParams::default()
        };
        let edges = canny(&tile, &thresholds);
        let found = segments(&tile, &edges, &SegmentParams::default());
        let longest = found
            .iter()
            .max_by(|a, b| a.length_px().total_cmp(&b.length_px()))
            .expect("a segment");
        assert_eq!(longest.contrast > 0.0, numbers[0] > 0.0, "tile {i}");
        refitted.add([longest.rho, longest.theta], truth);
        let params = HoughParams {
            votes: 20,
            ..HoughParams::default()
        };
        let line = hough(&edges, &params).expect("bins")[0];
        modified.add([line.rho, line.theta], truth);
        let params = HoughParams {
            voting: Voting::AllDirections,
            ..params
        };
        let line = hough(&edges, &params).expect("bins")[0];
        standard.add([line.rho, line.theta], truth);
    }
    let [refitted, modified, standard, cv_hough, cv_lsd] =
        [refitted, modified, standard, cv_hough, cv_lsd].map(|errors| errors.rms());
    println!(
        "rms [rad, px]: segments {refitted:?}, modified {modified:?}, standard {standard:?}, \
         HoughLines {cv_hough:?}, LSD {cv_lsd:?}"
    );
    assert!(
        no_worse(refitted, cv_hough, 0.5),
        "{refitted:?}, HoughLines {cv_hough:?}"
    );
    assert!(
        no_worse(refitted, cv_lsd, 1.0),
        "{refitted:?}, LSD {cv_lsd:?}"
    );
    assert!(
        no_worse(modified, cv_hough, 1.0),
        "{modified:?}, HoughLines {cv_hough:?}"
    );
    assert!(
        no_worse(standard, cv_hough, 1.0),
        "{standard:?}, HoughLines {cv_hough:?}"
    );
}

/// OpenCV's bins are ours: bin k of theta at k degrees, bin r of rho around r px. Its angles are sums of
/// 32-bit degrees, so that pixels at a border between bins fall to the other side.
#[test]
fn votes_of_opencvs_lines() {
    let table = std::fs::read_to_string(testdata("golden/hough.csv")).expect("a table");
    let params = HoughParams {
        voting: Voting::AllDirections,
        ..HoughParams::default()
    };
    let (mut transform, mut frame, mut equal, mut all) = (Hough::new(), "", 0, 0);
    for row in table.lines().skip(1) {
        let fields: Vec<&str> = row.split(',').collect();
        if fields[0] != frame {
            frame = fields[0];
            let edges = canny(&gray(&format!("frames/{frame}")), &CannyParams::default());
            transform
                .detect(&edges, &params, &mut Vec::new())
                .expect("bins");
        }
        let number = |i: usize| fields[i].parse::<isize>().expect("a number");
        let votes = transform.accumulator();
        let bin = (number(2) + votes.reach() as isize) as usize;
        let ours = isize::try_from(votes.row(number(1) as usize)[bin]).expect("small");
        all += 1;
        equal += usize::from(ours == number(3));
        assert!((ours - number(3)).abs() <= 1, "{row}: {ours}");
    }
    assert!(
        all == 250 && equal * 10 >= all * 9,
        "{equal} of {all} equal"
    );
}
