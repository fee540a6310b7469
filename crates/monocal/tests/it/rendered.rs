//! From rendered frames to poses: the whole way, edges, segments, floor features, pose fix.

use linefeat::{
    CannyParams, FloorFeatures, FloorParams, FloorView, Segment, SegmentParams, canny,
    floor_features, segments,
};
use monocal::{
    CornerObservation, EdgeObservation, FixStatus, FloorCamera, LocateParams, Match, Observations,
    locate,
};
use rand::SeedableRng as _;
use rand_pcg::Pcg64;

use crate::corridor::shot;
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
            covariance: s.covariance,
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

#[test]
fn rendered() {
    let camera = camera();
    let view = view(&camera);
    let n: u64 = std::env::var("N")
        .ok()
        .and_then(|n| n.parse().ok())
        .unwrap_or(60);
    let dump = std::env::var("DUMP").is_ok();
    let params = LocateParams {
        plan_sigma: 0.0,
        bias_px: std::env::var("BIAS").map_or(0.15, |b| b.parse().unwrap()),
        ..LocateParams::default()
    };
    let (mut count, mut sum_nees, mut wrong) = ([0; 5], 0.0, 0);
    let mut errs: Vec<f64> = vec![];
    let mut heads = vec![];
    let (mut empty, mut slow) = (0, std::time::Duration::ZERO);
    let mut spent = std::time::Duration::ZERO;
    for k in 0..n {
        let mut rng = Pcg64::seed_from_u64(k);
        let shot = shot(&mut rng, k);
        let t = std::time::Instant::now();
        let edges = canny(
            &shot.image,
            &CannyParams {
                low: 40.0,
                high: 100.0,
                ..Default::default()
            },
        );
        let lines = segments(&shot.image, &edges, &SegmentParams::default());
        let features = floor_features(&shot.image, &lines, &view, &FloorParams::default());
        let seen = observations(&lines, &features);
        let prior = prior(shot.map_from_base, [0.1, 0.1, 0.05], &mut rng);
        let t2 = std::time::Instant::now();
        let fix = locate(&seen, &shot.plan, &camera, &prior, &params);
        spent += t.elapsed();
        count[fix.status as usize] += 1;
        let tl = t2.elapsed();
        if fix.matched.is_empty() && fix.status == FixStatus::Ambiguous {
            empty += 1;
        }
        slow = slow.max(tl);
        let ne = nees(&fix, shot.map_from_base);
        let e = error(&fix, shot.map_from_base);
        // truth of matches
        let pixel = |p: occgrid::Point2| shot.camera.pixel_of(shot.map_from_base, p, 0.0);
        let mut bad = 0;
        for m in &fix.matched {
            if let Match::Corner {
                corner,
                door_corner,
            } = m
            {
                let truth = pixel(shot.plan.door_corners[*door_corner]).unwrap_or([1e9; 2]);
                let c = seen.corners[*corner].pixel;
                if (c[0] - truth[0]).hypot(c[1] - truth[1]) > 4.0 {
                    bad += 1;
                }
            }
        }
        if fix.status == FixStatus::Ok {
            errs.push(e[0].hypot(e[1]));
            heads.push(e[2]);
            sum_nees += ne;
            if bad > 0 {
                wrong += 1;
            }
        }
        if dump {
            shot.image.save(format!("/tmp/pose/f{k}.png")).unwrap();
            std::fs::write(format!("/tmp/pose/f{k}.geojson"), shot.plan.to_geojson()).unwrap();
            std::fs::write("/tmp/pose/cam.json", camera.to_json()).unwrap();
            std::fs::write(format!("/tmp/pose/f{k}.prior"), format!("{},{},{}", prior.pose.x, prior.pose.y, prior.pose.theta)).unwrap();
            let mut s = String::new();
            for (i, l) in lines.iter().enumerate() {
                let fe = features
                    .edges
                    .iter()
                    .find(|e| e.segment == i)
                    .map(|e| e.confidence);
                let de = features
                    .door_edges
                    .iter()
                    .find(|e| e.segment == i)
                    .map(|e| e.confidence);
                let (kind, c) = match (fe, de) {
                    (Some(c), _) => ("floor", c),
                    (_, Some(c)) => ("door", c),
                    _ => ("none", 0.0),
                };
                s += &format!(
                    "{kind} {} {} {} {} {c}\n",
                    l.start[0], l.start[1], l.end[0], l.end[1]
                );
            }
            for (i, c) in features.corners.iter().enumerate() {
                let m = fix
                    .matched
                    .iter()
                    .any(|m| matches!(m, Match::Corner { corner, .. } if *corner == i));
                s += &format!(
                    "corner {} {} {} {} {}\n",
                    c.pixel[0],
                    c.pixel[1],
                    c.covariance[0][0].sqrt(),
                    c.confidence,
                    u8::from(m)
                );
            }
            for m in &fix.matched {
                if let Match::Edge { edge, wall } = m {
                    let o = &seen.edges[*edge];
                    s += &format!(
                        "medge {} {} {} {} {wall}\n",
                        o.start[0], o.start[1], o.end[0], o.end[1]
                    );
                }
            }
            for c in shot.world.door_corners() {
                if let Some(p) = pixel(c.position) {
                    s += &format!("truth {} {}\n", p[0], p[1]);
                }
            }
            for e in &seen.edges {
                let along = [e.end[0] - e.start[0], e.end[1] - e.start[1]];
                let l = along[0].hypot(along[1]);
                for (w, [a, b]) in shot.plan.walls.iter().enumerate().take(4) {
                    // dense truth points
                    let mut d = [f64::NAN; 2];
                    for (i, q) in [e.start, e.end].iter().enumerate() {
                        let mut best = 1e9;
                        for t in 0..20000 {
                            let t = f64::from(t) / 20000.0;
                            let p =
                                occgrid::Point2::new(a.x + t * (b.x - a.x), a.y + t * (b.y - a.y));
                            if let Some(z) = pixel(p) {
                                let t = ((z[0] - q[0]) * along[0] + (z[1] - q[1]) * along[1]) / l;
                                if t.abs() < best {
                                    best = t.abs();
                                    d[i] =
                                        ((z[0] - q[0]) * -along[1] + (z[1] - q[1]) * along[0]) / l;
                                }
                            }
                        }
                    }
                    if d[0].abs() < 15.0 {
                        eprintln!(
                            "  edge {:?}->{:?} conf {:.2} wall {w} off {:.2?} sig {:.3}",
                            e.start.map(|x| x as i32),
                            e.end.map(|x| x as i32),
                            e.confidence,
                            d,
                            (e.covariance[1][1]).sqrt() * l
                        );
                    }
                }
            }
            std::fs::write(format!("/tmp/pose/f{k}.txt"), s).unwrap();
        }
        eprintln!(
            "{k} {} lines {} edges {} corners {} matched {} bad {bad} nees {ne:.1} err {:.4} {:.4} {:.3}deg axes {:.4?} nod {:.2} est {:.2}",
            fix.status.name(),
            lines.len(),
            seen.edges.len(),
            seen.corners.len(),
            fix.matched.len(),
            e[0],
            e[1],
            e[2].to_degrees(),
            fix.axes.map(|a| a.sigma),
            shot.camera.tilt.to_degrees() - 24.0,
            fix.pitch.to_degrees()
        );
    }
    errs.sort_by(f64::total_cmp);
    let m = errs.len();
    if m > 0 {
        eprintln!(
            "TOTAL empty {empty} slow {slow:?} {count:?} ok {m} mean {:.4} p95 {:.4} max {:.4} head rms {:.4} nees {:.2} wrong {wrong} {:?}",
            errs.iter().sum::<f64>() / m as f64,
            errs[m * 95 / 100],
            errs[m - 1],
            (heads.iter().map(|h: &f64| h * h).sum::<f64>() / m as f64)
                .sqrt()
                .to_degrees(),
            sum_nees / m as f64,
            spent / n as u32
        );
    }
}
