//! From rendered frames to poses: the whole way, edges, segments, floor features, pose fix.

use linefeat::{
    CannyParams, FloorFeatures, FloorParams, FloorView, Segment, SegmentParams, canny,
    floor_features, segments,
};
use monocal::{
    CornerObservation, EdgeObservation, FixStatus, FloorCamera, LocateParams, Match, Observations,
    PoseFix, locate,
};
use rand::SeedableRng as _;
use rand_pcg::Pcg64;

use crate::corridor::{Shot, shot};
use crate::localize::{camera, error, nees, prior};

pub(crate) fn view(camera: &FloorCamera) -> FloorView {
    FloorView {
        pixel_to_floor: camera.homography.pixel_to_floor(),
        nadir: camera.geometry().expect("a mounting").nadir,
    }
}

pub(crate) fn observations(segments: &[Segment], features: &FloorFeatures) -> Observations {
    let edges = features.edges.iter().map(|edge| {
        let s = &segments[edge.segment];
        EdgeObservation {
            start: s.start,
            end: s.end,
            covariance: edge.covariance,
            confidence: edge.confidence,
        }
    });
    let corners = features.corners.iter().map(|corner| CornerObservation {
        pixel: corner.pixel,
        covariance: corner.covariance,
        confidence: corner.confidence,
        edge: corner.edge,
    });
    Observations {
        edges: edges.collect(),
        corners: corners.collect(),
    }
}

/// Whether a seen corner that is one door's was taken for another's, whatever the pose.
fn wrong_door(shot: &Shot, seen: &Observations, fix: &PoseFix) -> bool {
    let pixel = |corner: usize| {
        let place = shot.plan.door_corners[corner];
        shot.eye.pixel_of(shot.map_from_base, place, 0.0)
    };
    fix.matched.iter().any(|m| {
        let Match::Corner {
            corner,
            door_corner,
        } = *m
        else {
            return false;
        };
        let [u, v] = seen.corners[corner].pixel;
        let visible = (0..shot.plan.door_corners.len()).filter(|c| shot.visible[*c]);
        let apart = visible.filter_map(|c| pixel(c).map(|p| (c, (p[0] - u).hypot(p[1] - v))));
        let nearest = apart.min_by(|a, b| a.1.total_cmp(&b.1));
        nearest.is_some_and(|(c, px)| px < 8.0 && shot.door_of[c] != shot.door_of[door_corner])
    })
}

/// Seeds from here on were not looked at while parameters were chosen; those below 1 000 were. The short form
/// runs the latter, so that it notices changes; figures come from the long form.
const UNSEEN: u64 = 20_000;

/// 60 corridors, or 1 000 with MOBOT_LONG=1. The errors are those of frames whose status is ok: x, y and
/// heading measured by the frame alone to 2 cm and 0.5 degrees; the others say that they are not.
#[test]
fn rendered_corridors_give_the_pose() {
    let long = std::env::var("MOBOT_LONG").is_ok_and(|v| v == "1");
    let frames = if long { 1000 } else { 60 };
    let camera = camera();
    let view = view(&camera);
    // the plan is exact here
    let params = LocateParams {
        plan_sigma: 0.0,
        ..LocateParams::default()
    };
    let (mut errors, mut headings, mut sum_nees) = (Vec::new(), 0.0, 0.0);
    let (mut wrong, mut covered) = (0, 0);
    let mut statuses = [0; 5];
    for k in 0..frames {
        let seed = if long { UNSEEN + k } else { k };
        let mut rng = Pcg64::seed_from_u64(seed);
        let shot = shot(&mut rng, seed);
        let edges = canny(
            &shot.image,
            &CannyParams {
                low: 40.0,
                high: 100.0,
                ..CannyParams::default()
            },
        );
        let lines = segments(&shot.image, &edges, &SegmentParams::default());
        let features = floor_features(&shot.image, &lines, &view, &FloorParams::default());
        let seen = observations(&lines, &features);
        let prior = prior(shot.map_from_base, [0.1, 0.1, 0.05], &mut rng);
        let fix = locate(&seen, &shot.plan, &camera, &prior, &params);
        statuses[fix.status as usize] += 1;
        if fix.status != FixStatus::Ok {
            continue;
        }
        let e = error(&fix, shot.map_from_base);
        errors.push(e[0].hypot(e[1]));
        headings += e[2] * e[2];
        sum_nees += nees(&fix, shot.map_from_base);
        wrong += u32::from(wrong_door(&shot, &seen, &fix));
        covered += u32::from(nees(&fix, shot.map_from_base) <= 7.815);
    }
    errors.sort_by(f64::total_cmp);
    let count = errors.len();
    let mean = errors.iter().sum::<f64>() / count as f64;
    let (most, largest) = (errors[count * 95 / 100], errors[count - 1]);
    let heading = (headings / count as f64).sqrt().to_degrees();
    let nees = sum_nees / count as f64;
    println!(
        "ok, partial, ambiguous, none, lost {statuses:?}; mean {mean:.4} m, 95 % {most:.4} m, max {largest:.4} m, heading {heading:.3} deg, NEES {nees:.2}, wrong doors {wrong}, in the 95 % region {covered}"
    );
    assert!(count as u64 * 3 > frames, "{statuses:?}");
    assert!(
        mean <= 0.015 && most <= 0.03 && largest <= 0.047,
        "{mean} {most} {largest}"
    );
    assert!(heading <= 0.3, "{heading}");
    assert_eq!(wrong, 0);
    let bound = 1.96 * (6.0 / count as f64).sqrt();
    assert!((nees - 3.0).abs() < bound, "NEES {nees}, 3 +- {bound}");
}
