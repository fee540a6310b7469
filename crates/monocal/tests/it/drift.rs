//! A bumped camera is noticed, an unmoved one is not accused.

use monocal::{
    CalibrateParams, DriftParams, DriftStatus, FloorCamera, LineEvidence, LineObservation,
    calibrate, check_drift, paper,
};
use rand::{RngExt as _, SeedableRng as _};
use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;

use crate::calibrate::{pairs_of, paper_marks};
use crate::pinhole::Pinhole;

fn calibrated(rng: &mut Pcg64) -> FloorCamera {
    let pairs = pairs_of(&Pinhole::paper(), &paper_marks(), rng, 0.5, 0.0);
    let params = CalibrateParams {
        image_size: Some(paper::IMAGE_SIZE),
        ..CalibrateParams::default()
    };
    calibrate(&pairs, &params).expect("by construction").camera
}

/// The line through two pixels, with the noise of ends read to a tenth of a pixel.
fn observed(a: [f64; 2], b: [f64; 2], rng: &mut Pcg64) -> LineObservation {
    let (du, dv) = (b[0] - a[0], b[1] - a[1]);
    let length = du.hypot(dv);
    let theta = du.atan2(-dv);
    let along = |p: [f64; 2]| p[1] * theta.cos() - p[0] * theta.sin();
    let rho = a[0] * theta.cos() + a[1] * theta.sin();
    // about the middle the two are independent
    let sigma = 0.1;
    let (var_rho, var_theta) = (sigma * sigma / 2.0, 2.0 * sigma * sigma / (length * length));
    let lever = (along(a) + along(b)) / 2.0;
    let mut normal = || -> f64 { StandardNormal.sample(rng) };
    let turn = var_theta.sqrt() * normal();
    LineObservation {
        rho: rho + var_rho.sqrt() * normal() + lever * turn,
        theta: theta + turn,
        covariance: [
            [var_rho + lever * lever * var_theta, lever * var_theta],
            [lever * var_theta, var_theta],
        ],
    }
}

/// A corridor 2 m wide, its end, and a door's upright edge, as a camera sees them.
fn corridor(camera: &Pinhole, rng: &mut Pcg64) -> Vec<LineEvidence> {
    let heading: f64 = rng.random_range(-0.15..0.15);
    let shift: f64 = rng.random_range(-0.3..0.3);
    let at = |along: f64, across: f64| {
        let (sin, cos) = heading.sin_cos();
        camera
            .pixel([cos * along - sin * across, sin * along + cos * across])
            .expect("by construction")
    };
    let mut line = |a: [f64; 2], b: [f64; 2]| observed(a, b, rng);
    let left = line(at(2.6, 1.0 + shift), at(5.5, 1.0 + shift));
    let right = line(at(2.6, -1.0 + shift), at(5.5, -1.0 + shift));
    let end = line(at(5.8, -0.9 + shift), at(5.8, 0.9 + shift));
    let foot = at(4.0, 1.0 + shift);
    let higher = Pinhole {
        height: camera.height - 0.8,
        ..*camera
    };
    let (sin, cos) = heading.sin_cos();
    let (along, across) = (4.0, 1.0 + shift);
    let top = higher
        .pixel([cos * along - sin * across, sin * along + cos * across])
        .expect("by construction");
    let upright = line(foot, top);
    vec![
        LineEvidence::Parallel(left, right),
        LineEvidence::Perpendicular(left, end),
        LineEvidence::Perpendicular(right, end),
        LineEvidence::Apart(left, right, 2.0),
        LineEvidence::Vertical(upright),
    ]
}

#[test]
fn a_bumped_camera_is_told_from_one_that_was_not() {
    let mut rng = Pcg64::seed_from_u64(11);
    let (mut wrong, mut missed, mut off) = (0, 0, 0.0_f64);
    for trial in 0..150 {
        let camera = calibrated(&mut rng);
        let pitch = [0.0, 3.0, -1.5_f64][trial % 3].to_radians();
        let roll = [0.0, 0.0, 1.5_f64][trial % 3].to_radians();
        let truth = Pinhole::paper();
        let now = Pinhole {
            tilt: truth.tilt + pitch,
            roll: truth.roll + roll,
            ..truth
        };
        let evidence: Vec<_> = (0..20).flat_map(|_| corridor(&now, &mut rng)).collect();
        let drift = check_drift(&camera, &evidence, &DriftParams::default()).unwrap();
        off = off.max((drift.pitch - pitch).abs() / drift.pitch_sigma.max(1e-3));
        if trial < 6 {
            println!("{:.1} deg: {drift:?}", pitch.to_degrees());
        }
        match drift.status {
            DriftStatus::Agrees => missed += usize::from(pitch != 0.0),
            DriftStatus::Moved => wrong += usize::from(pitch == 0.0),
            DriftStatus::NotDetermined => missed += usize::from(pitch != 0.0),
        }
    }
    println!("falsely accused {wrong}, missed {missed}, pitch off by {off:.1} sigmas at most");
    assert_eq!((wrong, missed), (0, 0));
    assert!(off < 4.5, "{off}");
}

#[test]
fn too_little_is_no_verdict() {
    let mut rng = Pcg64::seed_from_u64(12);
    let camera = calibrated(&mut rng);
    let none = check_drift(&camera, &[], &DriftParams::default()).unwrap();
    assert_eq!(none.status, DriftStatus::NotDetermined);
    assert!(none.pitch_sigma.is_infinite());
    let blurred = |line: LineObservation| LineObservation {
        covariance: line.covariance.map(|r| r.map(|c| c * 1e5)),
        ..line
    };
    let vague: Vec<_> = corridor(&Pinhole::paper(), &mut rng)
        .into_iter()
        .filter_map(|piece| match piece {
            LineEvidence::Parallel(a, b) => Some(LineEvidence::Parallel(blurred(a), blurred(b))),
            _ => None,
        })
        .collect();
    let drift = check_drift(&camera, &vague, &DriftParams::default()).unwrap();
    assert_eq!(drift.status, DriftStatus::NotDetermined, "{drift:?}");
    // lines that are not parallel at all contradict each other whatever the turn
    let mut evidence: Vec<_> = (0..10)
        .flat_map(|_| corridor(&Pinhole::paper(), &mut rng))
        .collect();
    for piece in &mut evidence {
        if let LineEvidence::Parallel(a, b) = *piece {
            *piece = LineEvidence::Perpendicular(a, b);
        }
    }
    let drift = check_drift(&camera, &evidence, &DriftParams::default()).unwrap();
    assert_eq!(drift.status, DriftStatus::NotDetermined, "{drift:?}");
}
