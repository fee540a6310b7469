//! What of a plan can be in view, and what its walls hide.

use nalgebra::Vector2;
use occgrid::Point2;

use super::Match;
use super::belief::{Belief, Unknowns};
use super::feature::{Feature, Kind};
use super::model::Model;
use super::view::View;
use crate::FloorPlan;

/// What of the plan may be in view.
pub(super) struct Landmarks {
    pub(super) walls: Vec<(usize, [Point2; 2])>,
    pub(super) corners: Vec<(usize, Point2)>,
    /// Of each corner, those in sight that are near it, as indices into `corners`.
    pub(super) beside: Vec<Vec<usize>>,
    /// Of each wall, where there may be a door: from and to, along it [m].
    pub(super) openings: Vec<Vec<[f64; 2]>>,
}

/// Features farther than this from the picture's border are no features of the frame [px].
const OUTSIDE_PX: f64 = 4.0;
/// The plan is looked at up to this far from the prior [m]..
const SIGHT: f64 = 20.0;
/// .. and no more than so many of its walls and of its corners, the nearest.
const MOST_LANDMARKS: usize = 500;
/// What a wall hides is at least this far behind it [m].
const THICK: f64 = 0.03;
/// Corners nearer to each other than this may be seen as one [m].
const BESIDE: f64 = 0.6;
/// A corner this near to a wall's line is on it [m].
const ON_WALL: f64 = 0.05;
/// Widths between two corners of a wall that may be a door's, rather than wall [m].
const DOOR: [f64; 2] = [0.5, 1.3];

impl Landmarks {
    /// The direction in which most of the walls run, by length.
    pub(super) fn main_direction(&self) -> Option<Vector2<f64>> {
        // of lines: directions doubled, so that opposite ones add up and those at right angles do not
        let double = self.walls.iter().map(|(_, [a, b])| {
            let (dx, dy) = (b.x - a.x, b.y - a.y);
            let length = dx.hypot(dy).max(1e-12);
            Vector2::new(dx * dx - dy * dy, 2.0 * dx * dy) / length
        });
        let sum: Vector2<f64> = double.sum();
        let angle = 0.5 * sum.y.atan2(sum.x);
        (sum.norm() > 1e-9).then(|| Vector2::new(angle.cos(), angle.sin()))
    }
}

impl Model<'_> {
    /// Walls and corners that can be in view from about the prior.
    pub(super) fn landmarks(&self, plan: &FloorPlan, start: &Belief) -> Landmarks {
        let here = Point2::new(start.mean[0], start.mean[1]);
        let reach = SIGHT + 3.0 * (start.spread[(0, 0)] + start.spread[(1, 1)]).sqrt();
        let walls = nearest(&plan.walls, reach, |wall| distance_to(here, *wall));
        let corners = nearest(&plan.door_corners, reach, |corner| here.distance(*corner));
        let in_sight: Vec<bool> = corners
            .iter()
            .map(|(_, corner)| in_sight(here, *corner, &walls))
            .collect();
        let beside = corners.iter().enumerate().map(|(index, (_, corner))| {
            let others = corners.iter().enumerate().filter(|(other, (_, point))| {
                *other != index && in_sight[*other] && corner.distance(*point) < BESIDE
            });
            others.map(|(other, _)| other).collect()
        });
        Landmarks {
            beside: beside.collect(),
            openings: walls
                .iter()
                .map(|(_, wall)| openings(*wall, &corners))
                .collect(),
            walls,
            corners,
        }
    }

    /// Indices into the landmarks that a feature may be.
    pub(super) fn choices(&self, feature: &Feature, landmarks: &Landmarks) -> usize {
        match feature.kind {
            Kind::Edge(_) => landmarks.walls.len(),
            Kind::Corner(_) => landmarks.corners.len(),
        }
    }

    pub(super) fn named(&self, feature: &Feature, landmarks: &Landmarks, choice: usize) -> Match {
        match feature.kind {
            Kind::Edge(edge) => Match::Edge {
                edge,
                wall: landmarks.walls[choice].0,
            },
            Kind::Corner(corner) => Match::Corner {
                corner,
                door_corner: landmarks.corners[choice].0,
            },
        }
    }

    /// Whether the plan's walls hide a landmark, as a feature would show it, from the prior's position.
    pub(super) fn hidden(
        &self,
        feature: &Feature,
        landmarks: &Landmarks,
        choice: usize,
        view: &View<'_>,
        start: &Belief,
    ) -> bool {
        let target = match feature.kind {
            Kind::Corner(_) => landmarks.corners[choice].1,
            Kind::Edge(_) => {
                let wall = landmarks.walls[choice].1;
                match view.on_wall(feature, wall) {
                    Some([from, to]) => place(wall, 0.5 * (from + to)),
                    None => return true,
                }
            }
        };
        let here = Point2::new(view.position.x, view.position.y);
        let away = here.distance(target);
        // a wall between the robot and where the prior puts it is no obstacle
        let sure = 3.0 * (start.spread[(0, 0)].max(start.spread[(1, 1)])).sqrt();
        landmarks.walls.iter().any(|(_, wall)| {
            crossing(here, target, *wall)
                .is_some_and(|share| share * away > sure && (1.0 - share) * away > THICK)
        })
    }

    /// Number of landmarks that the prior puts into the picture.
    pub(super) fn in_view(&self, landmarks: &Landmarks, at: &Unknowns) -> usize {
        let Some(view) = self.view(at) else {
            return 0;
        };
        let inside = |point: Point2| {
            view.see(point)
                .is_some_and(|seen| match self.camera.image_size {
                    Some([w, h]) => {
                        let within = |x: f64, size: u32| {
                            x >= -OUTSIDE_PX && x <= f64::from(size) + OUTSIDE_PX
                        };
                        within(seen.pixel.x, w) && within(seen.pixel.y, h)
                    }
                    None => true,
                })
        };
        let walls = landmarks.walls.iter().filter(|(_, [a, b])| {
            (0..=16).any(|k| {
                let share = f64::from(k) / 16.0;
                inside(Point2::new(
                    a.x + share * (b.x - a.x),
                    a.y + share * (b.y - a.y),
                ))
            })
        });
        walls.count() + landmarks.corners.iter().filter(|(_, p)| inside(*p)).count()
    }
}

/// What is nearest and within `reach`, in the order of the plan, with its index there.
fn nearest<T: Copy>(all: &[T], reach: f64, distance: impl Fn(&T) -> f64) -> Vec<(usize, T)> {
    let near = all.iter().copied().enumerate();
    let near = near.map(|(index, one)| (distance(&one), index, one));
    let mut near: Vec<_> = near.filter(|(away, ..)| *away <= reach).collect();
    if near.len() > MOST_LANDMARKS {
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        near.truncate(MOST_LANDMARKS);
        near.sort_by_key(|(_, index, _)| *index);
    }
    near.into_iter()
        .map(|(_, index, one)| (index, one))
        .collect()
}

fn distance_to(here: Point2, [a, b]: [Point2; 2]) -> f64 {
    let (dx, dy) = (b.x - a.x, b.y - a.y);
    let length = dx * dx + dy * dy;
    let share = ((here.x - a.x) * dx + (here.y - a.y) * dy) / length.max(1e-12);
    let share = share.clamp(0.0, 1.0);
    here.distance(Point2::new(a.x + share * dx, a.y + share * dy))
}

/// The point so far along a wall's line.
pub(super) fn place([a, b]: [Point2; 2], along: f64) -> Point2 {
    let share = along / a.distance(b);
    Point2::new(a.x + share * (b.x - a.x), a.y + share * (b.y - a.y))
}

/// Stretches of a wall between two of its corners, as wide as a door.
fn openings([a, b]: [Point2; 2], corners: &[(usize, Point2)]) -> Vec<[f64; 2]> {
    let length = a.distance(b);
    let along = [(b.x - a.x) / length, (b.y - a.y) / length];
    let mut places: Vec<f64> = corners
        .iter()
        .filter_map(|(_, p)| {
            let d = [p.x - a.x, p.y - a.y];
            let (t, off) = (
                d[0] * along[0] + d[1] * along[1],
                d[1] * along[0] - d[0] * along[1],
            );
            let on_it = off.abs() <= ON_WALL && t >= -ON_WALL && t <= length + ON_WALL;
            on_it.then_some(t)
        })
        .collect();
    places.sort_by(f64::total_cmp);
    let gaps = places.windows(2).map(|pair| [pair[0], pair[1]]);
    gaps.filter(|[from, to]| (DOOR[0]..=DOOR[1]).contains(&(to - from)))
        .collect()
}

/// Whether no wall stands before a point.
fn in_sight(here: Point2, point: Point2, walls: &[(usize, [Point2; 2])]) -> bool {
    let away = here.distance(point);
    !walls.iter().any(|(_, wall)| {
        crossing(here, point, *wall).is_some_and(|share| (1.0 - share) * away > THICK)
    })
}

/// Where on the way from `a` to `b` it crosses a wall, as a share of the way.
fn crossing(a: Point2, b: Point2, [p, q]: [Point2; 2]) -> Option<f64> {
    let (way, wall) = ([b.x - a.x, b.y - a.y], [q.x - p.x, q.y - p.y]);
    let cross = |u: [f64; 2], v: [f64; 2]| u[0] * v[1] - u[1] * v[0];
    let area = cross(way, wall);
    let to = [p.x - a.x, p.y - a.y];
    let (along_way, along_wall) = (cross(to, wall) / area, cross(to, way) / area);
    ((0.0..=1.0).contains(&along_way) && (0.0..=1.0).contains(&along_wall)).then_some(along_way)
}
