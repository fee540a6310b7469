//! Pose fixes from features projected by a pinhole that shares nothing with the crate.

use monocal::{
    CornerObservation, EdgeObservation, FixStatus, FloorCamera, FloorHomography, FloorPlan,
    LocateParams, Match, Observations, PoseFix, Prior, locate,
};
use occgrid::{Point2, Pose2};
use rand::{RngExt as _, SeedableRng as _};
use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;

use crate::pinhole::Pinhole;

const SIZE: [u32; 2] = [480, 220];

fn normal(rng: &mut Pcg64) -> f64 {
    StandardNormal.sample(rng)
}

pub(crate) fn camera() -> FloorCamera {
    let homography = FloorHomography::new(Pinhole::paper().pixel_to_floor()).expect("a camera");
    FloorCamera {
        image_size: Some(SIZE),
        ..FloorCamera::exact(homography)
    }
}

/// A corridor along x with doors on both sides: opening and frame, 7 cm apart, give four corners a door.
fn corridor(doors: &[(f64, f64)]) -> FloorPlan {
    let wall = |y: f64| [Point2::new(-20.0, y), Point2::new(40.0, y)];
    let corners = doors
        .iter()
        .flat_map(|&(at, y)| [at - 0.07, at, at + 0.9, at + 0.97].map(|x| Point2::new(x, y)));
    FloorPlan {
        walls: vec![wall(-1.0), wall(1.0)],
        door_corners: corners.collect(),
    }
}

/// What a nodding pinhole sees of a plan, with noise, and which is which.
fn see(
    plan: &FloorPlan,
    map_from_base: Pose2,
    nod: f64,
    sigma_px: f64,
    rng: &mut Pcg64,
) -> (Observations, Vec<Match>) {
    let eye = Pinhole {
        tilt: Pinhole::paper().tilt + nod,
        ..Pinhole::paper()
    };
    let base = map_from_base.inverse();
    let pixel = |p: Point2| {
        let p = base.transform_from(p);
        let [u, v] = eye.pixel([p.x, p.y])?;
        let inside = (0.0..480.0).contains(&u) && (0.0..220.0).contains(&v);
        inside.then_some([u, v])
    };
    let mut seen = Observations::default();
    let mut truth = Vec::new();
    for (wall, [a, b]) in plan.walls.iter().enumerate() {
        let steps = (a.distance(*b) / 0.02) as u32;
        let at = |k: u32| {
            let t = f64::from(k) / f64::from(steps);
            Point2::new(a.x + t * (b.x - a.x), a.y + t * (b.y - a.y))
        };
        let places: Vec<[f64; 2]> = (0..=steps).filter_map(|k| pixel(at(k))).collect();
        let (Some(&start), Some(&end)) = (places.first(), places.last()) else {
            continue;
        };
        let along = [end[0] - start[0], end[1] - start[1]];
        let length = along[0].hypot(along[1]);
        if length < 30.0 {
            continue;
        }
        // both ends of the line move along its normal
        let n = [-along[1] / length, along[0] / length];
        let moved = [start, end].map(|p| {
            let e = sigma_px * normal(rng);
            [p[0] + e * n[0], p[1] + e * n[1]]
        });
        // along the line as its normal turns, theta being 0 or more and below pi
        let theta = n[1].atan2(n[0]).rem_euclid(std::f64::consts::PI);
        let t = |p: [f64; 2]| p[1] * theta.cos() - p[0] * theta.sin();
        let (ta, tb) = (t(start), t(end));
        // of (rho, theta) where rho - t theta has the same variance at both ends
        let s = sigma_px * sigma_px / (tb - ta).powi(2);
        let covariance = [
            [s * (ta * ta + tb * tb), s * (ta + tb)],
            [s * (ta + tb), 2.0 * s],
        ];
        truth.push(Match::Edge {
            edge: seen.edges.len(),
            wall,
        });
        seen.edges.push(EdgeObservation {
            start: moved[0],
            end: moved[1],
            covariance,
            confidence: 0.8,
        });
    }
    for (door_corner, &corner) in plan.door_corners.iter().enumerate() {
        if let Some([u, v]) = pixel(corner) {
            truth.push(Match::Corner {
                corner: seen.corners.len(),
                door_corner,
            });
            seen.corners.push(CornerObservation {
                pixel: [u + sigma_px * normal(rng), v + sigma_px * normal(rng)],
                covariance: [[sigma_px * sigma_px, 0.0], [0.0, sigma_px * sigma_px]],
                confidence: 0.7,
                edge: None,
            });
        }
    }
    (seen, truth)
}

/// A prior drawn about the truth.
pub(crate) fn prior(truth: Pose2, sigmas: [f64; 3], rng: &mut Pcg64) -> Prior {
    let mut covariance = [[0.0; 3]; 3];
    for k in 0..3 {
        covariance[k][k] = sigmas[k] * sigmas[k];
    }
    Prior {
        pose: Pose2::new(
            truth.x + sigmas[0] * normal(rng),
            truth.y + sigmas[1] * normal(rng),
            truth.theta + sigmas[2] * normal(rng),
        ),
        covariance,
    }
}

pub(crate) fn error(fix: &PoseFix, truth: Pose2) -> [f64; 3] {
    let turn = fix.pose.theta - truth.theta;
    [
        fix.pose.x - truth.x,
        fix.pose.y - truth.y,
        turn.sin().atan2(turn.cos()),
    ]
}

/// Normalised estimation error squared: error by the inverse of the fix's covariance.
pub(crate) fn nees(fix: &PoseFix, truth: Pose2) -> f64 {
    let e = nalgebra::Vector3::from(error(fix, truth));
    let p = nalgebra::Matrix3::from_fn(|r, c| fix.covariance[r][c]);
    e.dot(&(p.try_inverse().expect("a covariance") * e))
}

/// A corridor with doors at irregular places, 1 000 frames of projected features from a camera that nods by
/// up to one degree, priors drawn from their covariance.
#[test]
fn projected_features_give_the_pose_with_honest_error_bars() {
    let plan = corridor(&[
        (2.0, 1.0),
        (4.3, -1.0),
        (6.9, 1.0),
        (8.0, -1.0),
        (11.0, 1.0),
    ]);
    let camera = camera();
    let mut rng = Pcg64::seed_from_u64(1);
    let params = LocateParams {
        bias_px: 0.0,
        crowd_px: 0.0,
        plan_sigma: 0.0,
        ..LocateParams::default()
    };
    let (mut sum_nees, mut worst, mut fixed, mut refused) = (0.0, 0.0_f64, 0, 0);
    for _ in 0..1000 {
        let truth = Pose2::new(
            rng.random_range(0.0..8.0),
            rng.random_range(-0.4..0.4),
            rng.random_range(-0.25..0.25),
        );
        let nod = rng.random_range(-1.0..1.0_f64).to_radians();
        let (seen, _) = see(&plan, truth, nod, 0.3, &mut rng);
        let prior = prior(truth, [0.2, 0.2, 0.05], &mut rng);
        let fix = locate(&seen, &plan, &camera, &prior, &params);
        match fix.status {
            FixStatus::Ok => {
                let e = error(&fix, truth);
                worst = worst.max(e[0].hypot(e[1]));
                sum_nees += nees(&fix, truth);
                fixed += 1;
            }
            FixStatus::Ambiguous => refused += 1,
            _ => {}
        }
    }
    assert!(fixed > 900, "{fixed} fixes, {refused} refused");
    assert!(worst < 0.047, "worst {worst} m");
    // 95 % of chi-square with 3 degrees of freedom a fix, about normal for so many
    let mean = sum_nees / f64::from(fixed);
    let bound = 1.96 * (6.0 / f64::from(fixed)).sqrt();
    assert!((mean - 3.0).abs() < bound, "NEES {mean}, 3 +- {bound}");
}

/// The sign of the covariance of rho and theta is the normal form's, whichever end is named first.
#[test]
fn either_end_of_an_edge_may_come_first() {
    let plan = corridor(&[(2.0, 1.0), (4.3, -1.0)]);
    let camera = camera();
    let mut rng = Pcg64::seed_from_u64(4);
    for _ in 0..20 {
        let truth = Pose2::new(1.0, rng.random_range(-0.3..0.3), 0.1);
        let (seen, _) = see(&plan, truth, 0.005, 0.3, &mut rng);
        let mut turned = seen.clone();
        for edge in &mut turned.edges {
            std::mem::swap(&mut edge.start, &mut edge.end);
        }
        let prior = prior(truth, [0.1, 0.1, 0.05], &mut rng);
        let [one, other] = [&seen, &turned]
            .map(|seen| locate(seen, &plan, &camera, &prior, &LocateParams::default()));
        assert_eq!(one.matched, other.matched);
        for r in 0..3 {
            assert!((error(&one, other.pose)[r]).abs() < 1e-6);
            let (a, b) = (one.covariance[r][r], other.covariance[r][r]);
            assert!((a - b).abs() < 1e-6 * a, "{a} {b}");
        }
    }
}

/// Without doors, heading and the place across are measured, the place along is not and says so.
#[test]
fn a_bare_corridor_gives_heading_and_lateral_only() {
    let plan = corridor(&[]);
    let camera = camera();
    let mut rng = Pcg64::seed_from_u64(2);
    for _ in 0..50 {
        let truth = Pose2::new(
            3.0,
            rng.random_range(-0.3..0.3),
            rng.random_range(-0.2..0.2),
        );
        let (seen, _) = see(&plan, truth, 0.005, 0.3, &mut rng);
        let prior = prior(truth, [0.2, 0.15, 0.05], &mut rng);
        let fix = locate(&seen, &plan, &camera, &prior, &LocateParams::default());
        assert_eq!(fix.status, FixStatus::Partial);
        assert!(!fix.observed.x && fix.observed.y && fix.observed.theta);
        assert!(
            (fix.pose.x - prior.pose.x).abs() < 0.02,
            "the prior stays along x"
        );
        assert!(fix.axes[0].direction[1].abs() > 0.99 && fix.axes[1].sigma > 1.0);
    }
}

/// Doors every 1.2 m that look alike, and a prior too wide to tell them apart: refused, not guessed.
#[test]
fn a_wrong_door_among_look_alikes_is_refused() {
    let doors: Vec<(f64, f64)> = (0..20).map(|k| (f64::from(k) * 1.2 - 4.0, 1.0)).collect();
    let plan = corridor(&doors);
    let camera = camera();
    let mut rng = Pcg64::seed_from_u64(3);
    let mut refused = 0;
    for _ in 0..60 {
        let truth = Pose2::new(rng.random_range(3.0..6.0), 0.1, 0.05);
        let (seen, _) = see(&plan, truth, 0.0, 0.3, &mut rng);
        let prior = prior(truth, [1.0, 0.15, 0.05], &mut rng);
        let fix = locate(&seen, &plan, &camera, &prior, &LocateParams::default());
        if fix.status == FixStatus::Ok {
            assert!(error(&fix, truth)[0].abs() < 0.3, "a wrong door");
        }
        refused += u32::from(fix.status == FixStatus::Ambiguous);
    }
    assert!(refused > 50, "{refused} of 60 refused");
}
