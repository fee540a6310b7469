//! Which wall of the floor plan a sonar's echo comes from.
//!
//! A wall answers like a mirror: its echo comes from the foot of the perpendicular, and its range is the
//! distance of the wall's line, whatever the exact direction of the beam (Leonard and Durrant-Whyte,
//! *Directed Sonar Sensing for Mobile Robot Navigation*, 1992). An echo is used only where one wall stands
//! square in the beam's core and nothing else in the beam could have answered from about there.

use occgrid::{Point2, Pose2};

use super::angle::wrap;

/// Half of the beam in which a wall surely answers first [rad].
const CORE: f64 = 8.0 / 180.0 * std::f64::consts::PI;
/// Half of the beam in which anything may answer [rad].
const RIM: f64 = 16.0 / 180.0 * std::f64::consts::PI;
/// A wall answers up to so far off its normal [rad].
const SLANT: f64 = 28.0 / 180.0 * std::f64::consts::PI;
/// The foot of the perpendicular keeps this from the wall's ends [m].
const INSET: f64 = 0.1;
/// Another echo before this much past the wall's makes it doubtful which came first [m]; less than a wall is
/// thick, whose far face is in the plan too.
const APART: f64 = 0.05;

/// A wall that must have answered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WallEcho {
    /// Distance of the wall's line from the sonar [m].
    pub range: f64,
    /// Its change with x, y and the heading of the base.
    pub gradient: [f64; 3],
}

/// The wall that answers a sonar at `base_from_sonar` on a base at `map_from_base`, firing at `bearing`
/// [rad, base frame], within `reach` [m]; `None` where none does or it is doubtful which. Linear in the walls.
#[must_use]
pub fn wall_echo(
    walls: &[[Point2; 2]],
    map_from_base: Pose2,
    base_from_sonar: Pose2,
    bearing: f64,
    reach: f64,
) -> Option<WallEcho> {
    let sonar = map_from_base.transform_from(base_from_sonar.position());
    let axis = map_from_base.theta + bearing;
    let mut best: Option<(f64, [f64; 2])> = None;
    let mut others: Vec<f64> = Vec::new();
    for wall in walls {
        let Some(seen) = Seen::of(wall, sonar) else {
            continue;
        };
        if seen.range > reach + 1.0 {
            continue;
        }
        let off = wrap(seen.toward - axis).abs();
        if seen.on_wall && off <= CORE && best.is_none_or(|b| seen.range < b.0) {
            if let Some((range, _)) = best.replace((seen.range, seen.normal)) {
                others.push(range);
            }
        } else if off <= RIM + SLANT {
            // where the beam's rim meets it, and its ends
            let rim = (off - RIM).max(0.0);
            others.push(seen.range / rim.cos());
        }
        for end in wall {
            let toward = (end.y - sonar.y).atan2(end.x - sonar.x);
            if wrap(toward - axis).abs() <= RIM {
                others.push(end.distance(sonar));
            }
        }
    }
    let (range, normal) = best.filter(|b| b.0 <= reach)?;
    let foot = Point2::new(sonar.x - range * normal[0], sonar.y - range * normal[1]);
    let hidden = || walls.iter().any(|w| crosses(w, sonar, foot));
    if others.iter().any(|o| *o < range + APART) || hidden() {
        return None;
    }
    let (dx, dy) = (sonar.x - map_from_base.x, sonar.y - map_from_base.y);
    Some(WallEcho {
        range,
        gradient: [normal[0], normal[1], normal[1] * dx - normal[0] * dy],
    })
}

/// Whether a wall stands between a place and just before another.
fn crosses([a, b]: &[Point2; 2], from: Point2, to: Point2) -> bool {
    let to = Point2::new(
        from.x + (to.x - from.x) * 0.98,
        from.y + (to.y - from.y) * 0.98,
    );
    let side =
        |p: Point2, q: Point2, r: Point2| (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x);
    side(*a, *b, from) * side(*a, *b, to) < 0.0 && side(from, to, *a) * side(from, to, *b) < 0.0
}

/// A wall from a place in front of it.
struct Seen {
    range: f64,
    /// Direction to the foot of the perpendicular [rad].
    toward: f64,
    /// From the wall to the place, unit length.
    normal: [f64; 2],
    on_wall: bool,
}

impl Seen {
    fn of([a, b]: &[Point2; 2], from: Point2) -> Option<Self> {
        let long = a.distance(*b);
        if long < 2.0 * INSET {
            return None;
        }
        let along = [(b.x - a.x) / long, (b.y - a.y) / long];
        let (x, y) = (from.x - a.x, from.y - a.y);
        let way = x * along[0] + y * along[1];
        let off = along[0] * y - along[1] * x;
        let normal = [-along[1], along[0]].map(|n| n * off.signum());
        Some(Self {
            range: off.abs(),
            toward: (-normal[1]).atan2(-normal[0]),
            normal,
            on_wall: (INSET..=long - INSET).contains(&way),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn room() -> Vec<[Point2; 2]> {
        let corners =
            [[0.0, 0.0], [6.0, 0.0], [6.0, 4.0], [0.0, 4.0]].map(|[x, y]| Point2::new(x, y));
        (0..4).map(|k| [corners[k], corners[(k + 1) % 4]]).collect()
    }

    #[test]
    fn a_wall_square_ahead_answers_from_its_foot() {
        let pose = Pose2::new(3.5, 2.0, 0.05);
        let mount = Pose2::new(0.1, 0.05, 0.0);
        let echo = wall_echo(&room(), pose, mount, 0.0, 5.0).expect("the wall at x = 6");
        let at = |pose: Pose2| 6.0 - pose.transform_from(mount.position()).x;
        assert!((echo.range - at(pose)).abs() < 1e-12);
        let d = 1e-6;
        let by = |dx: f64, dy: f64, dt: f64| {
            let moved = Pose2::new(pose.x + dx, pose.y + dy, pose.theta + dt);
            (at(moved) - at(pose)) / d
        };
        let numeric = [by(d, 0.0, 0.0), by(0.0, d, 0.0), by(0.0, 0.0, d)];
        for (a, b) in echo.gradient.iter().zip(numeric) {
            assert!((a - b).abs() < 1e-5, "{echo:?} {numeric:?}");
        }
    }

    #[test]
    fn corners_and_slants_are_doubtful() {
        let mount = Pose2::default();
        let slant = Pose2::new(3.0, 2.0, 0.4);
        assert_eq!(wall_echo(&room(), slant, mount, 0.0, 5.0), None);
        let at_corner = Pose2::new(3.0, 0.4, 0.0);
        assert_eq!(wall_echo(&room(), at_corner, mount, 0.0, 5.0), None);
        let far = Pose2::new(0.5, 2.0, 0.0);
        assert_eq!(wall_echo(&room(), far, mount, 0.0, 5.0), None);
    }

    #[test]
    fn something_nearer_in_the_beam_makes_the_wall_doubtful() {
        let mut walls = room();
        walls.push([Point2::new(4.0, 2.2), Point2::new(4.3, 2.2)]);
        let pose = Pose2::new(3.0, 2.0, 0.0);
        assert_eq!(wall_echo(&walls, pose, Pose2::default(), 0.0, 5.0), None);
    }
}
