//! What a camera at a pose sees of a plan: predicted places of features and how they move with the unknowns.

use nalgebra::{Matrix2, Matrix2x3, Matrix3, SMatrix, SVector, Vector2, Vector3};
use occgrid::Point2;

use super::{LocateParams, Match, Observations, Prior};
use crate::chart;
use crate::homography::{matrix, rows};
use crate::{CameraMatrix, FloorCamera, FloorHomography, FloorPlan, GroundPoint, PixelPoint};

/// x, y, theta; nod, roll; eight of the homography's chart.
pub(super) const UNKNOWNS: usize = 13;
pub(super) type Unknowns = SVector<f64, UNKNOWNS>;
pub(super) type Spread = SMatrix<f64, UNKNOWNS, UNKNOWNS>;
pub(super) type Rows = SMatrix<f64, 2, UNKNOWNS>;

/// Where the unknowns are thought to be.
#[derive(Clone)]
pub(super) struct Belief {
    pub(super) mean: Unknowns,
    pub(super) spread: Spread,
}

/// A prior wider than this is searched in parts, each as wide [m].
const PART_SIGMA: f64 = 0.3;
/// Parts of a wide prior to either side, at most.
const MOST_PARTS: i32 = 5;

impl Belief {
    /// Narrower beliefs that together cover this one, where steps from its middle would be too long to be
    /// linear: the middle first, then along the axis in which the position is most uncertain.
    pub(super) fn parts(&self) -> Vec<Self> {
        let position = self.spread.fixed_view::<2, 2>(0, 0).into_owned();
        let eigen = nalgebra::SymmetricEigen::new(position);
        let widest = eigen.eigenvalues.imax();
        let sigma = eigen.eigenvalues[widest].max(0.0).sqrt();
        if sigma <= PART_SIGMA {
            return vec![self.clone()];
        }
        let axis = eigen.eigenvectors.column(widest);
        let mut direction = Unknowns::zeros();
        direction.fixed_rows_mut::<2>(0).copy_from(&axis);
        let less = sigma * sigma - PART_SIGMA * PART_SIGMA;
        let narrow = self.spread - direction * direction.transpose() * less;
        let spread = match nalgebra::Cholesky::new(narrow) {
            Some(_) => narrow,
            None => self.spread,
        };
        let reach = ((2.5 * sigma / (2.0 * PART_SIGMA)).ceil() as i32).min(MOST_PARTS);
        let mut shifts: Vec<i32> = (-reach..=reach).collect();
        shifts.sort_by_key(|shift| shift.abs());
        let parts = shifts.into_iter().map(|shift| Self {
            mean: self.mean + direction * (2.0 * PART_SIGMA * f64::from(shift)),
            spread,
        });
        parts.collect()
    }
}

/// A feature of the frame, in undistorted pixels: two measured distances along normals.
#[derive(Clone)]
pub(super) struct Feature {
    pub(super) kind: Kind,
    /// Places (u, v); of a corner, its own twice.
    pub(super) places: [Vector2<f64>; 2],
    /// Directions in which they are measured.
    pub(super) normals: [Vector2<f64>; 2],
    /// Covariance of the two measured distances [px^2].
    pub(super) noise: Matrix2<f64>,
    /// Probability that it is what it seems.
    pub(super) confidence: f64,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Edge(usize),
    Corner(usize),
}

/// What of the plan may be in view.
pub(super) struct Landmarks {
    pub(super) walls: Vec<(usize, [Point2; 2])>,
    pub(super) corners: Vec<(usize, Point2)>,
}

/// A predicted feature: residual (predicted minus seen) along its normals, and its rates.
pub(super) struct Prediction {
    pub(super) residual: Vector2<f64>,
    pub(super) rows: Rows,
    /// Covariance of the residual but for the unknowns' [px^2].
    pub(super) noise: Matrix2<f64>,
}

/// The camera with what may be wrong about it.
pub(super) struct Model<'a> {
    camera: &'a FloorCamera,
    params: &'a LocateParams,
    basis: SMatrix<f64, 9, 8>,
    entries: chart::Entries,
    /// The undistorted picture's camera matrix; `None` where nothing tells how nodding moves the picture.
    lens: Option<CameraMatrix>,
}

/// Features farther than this from the picture's border are no features of the frame [px].
const OUTSIDE_PX: f64 = 4.0;
/// The plan is looked at up to this far from the prior [m].
const SIGHT: f64 = 20.0;
/// How much larger the systematic part of a corner's place is than that of an edge's.
const CORNER_BIAS: f64 = 2.0;
/// A corner constructed on a floor edge is this uncertain across it [px].
const ACROSS_EDGE_PX: f64 = 3.0;
/// However short an edge is, it may be seen this far from where its wall is predicted [px].
const LEAST_REACH_PX: f64 = 60.0;
/// What a wall hides is at least this far behind it [m].
const THICK: f64 = 0.03;
/// How far a floor edge may reach past the end of its wall [m].
const PAST_WALL: f64 = 0.15;

impl<'a> Model<'a> {
    pub(super) fn new(camera: &'a FloorCamera, params: &'a LocateParams) -> Self {
        Self {
            camera,
            params,
            basis: chart::basis(&camera.homography),
            entries: chart::entries(&camera.homography),
            lens: camera.geometry().ok().map(|g| g.matrix),
        }
    }

    /// The prior over all unknowns; `None` for a prior that is not finite or not positive definite.
    pub(super) fn start(&self, prior: &Prior) -> Option<Belief> {
        let mut mean = Unknowns::zeros();
        mean[0] = prior.pose.x;
        mean[1] = prior.pose.y;
        mean[2] = prior.pose.theta;
        let mut spread = Spread::zeros();
        for r in 0..3 {
            for c in 0..3 {
                spread[(r, c)] = 0.5 * (prior.covariance[r][c] + prior.covariance[c][r]);
            }
        }
        let nods = f64::from(u8::from(self.lens.is_some()));
        let least = 1e-9;
        spread[(3, 3)] = nods * self.params.pitch_sigma.powi(2) + least * least;
        spread[(4, 4)] = nods * self.params.roll_sigma.powi(2) + least * least;
        for r in 0..8 {
            for c in 0..8 {
                spread[(5 + r, 5 + c)] = self.camera.covariance[r][c];
            }
            // an exact calibration still needs an information matrix
            spread[(5 + r, 5 + r)] += 1e-24;
        }
        let finite = mean.iter().chain(spread.iter()).all(|v| v.is_finite());
        let definite = nalgebra::Cholesky::new(spread).is_some();
        (finite && definite).then_some(Belief { mean, spread })
    }

    pub(super) fn features(&self, observations: &Observations) -> Vec<Feature> {
        let edges = observations.edges.iter().enumerate();
        let edges = edges.filter_map(|(index, edge)| {
            let ends = [edge.start, edge.end].map(Vector2::from);
            let along = (ends[1] - ends[0]).try_normalize(1.0)?;
            let normal = Vector2::new(-along.y, along.x);
            // rate of the normal form's distance at each end, by rho and theta
            let rates = Matrix2::from_fn(|r, c| if c == 0 { -1.0 } else { along.dot(&ends[r]) });
            let noise = rates * square(&edge.covariance) * rates.transpose();
            let places = [self.ideal(ends[0])?, self.ideal(ends[1])?];
            let along = (places[1] - places[0]).try_normalize(1.0)?;
            let noise = noise + Matrix2::identity() * self.params.bias_px.powi(2);
            Some(Feature {
                kind: Kind::Edge(index),
                places,
                normals: [Vector2::new(-along.y, along.x); 2].map(|n| n * n.dot(&normal).signum()),
                noise,
                confidence: edge.confidence,
            })
        });
        let corners = observations.corners.iter().enumerate();
        let corners = corners.filter_map(|(index, corner)| {
            let mut noise = square(&corner.covariance);
            if let Some(edge) = corner.edge.and_then(|e| observations.edges.get(e)) {
                let along = Vector2::from(edge.end) - Vector2::from(edge.start);
                let across = Vector2::new(-along.y, along.x).try_normalize(1.0)?;
                noise += across * across.transpose() * ACROSS_EDGE_PX.powi(2);
            }
            noise += Matrix2::identity() * (CORNER_BIAS * self.params.bias_px).powi(2);
            let place = self.ideal(corner.pixel.into())?;
            Some(Feature {
                kind: Kind::Corner(index),
                places: [place; 2],
                normals: [Vector2::x(), Vector2::y()],
                noise,
                confidence: corner.confidence,
            })
        });
        let usable = |f: &Feature| {
            let numbers = f.places.iter().flatten().chain(f.noise.iter());
            numbers.chain([&f.confidence]).all(|v| v.is_finite())
                && nalgebra::Cholesky::new(f.noise).is_some()
                && f.confidence > 0.0
        };
        edges.chain(corners).filter(usable).collect()
    }

    /// Walls and corners that can be in view from about the prior.
    pub(super) fn landmarks(&self, plan: &FloorPlan, start: &Belief) -> Landmarks {
        let here = Point2::new(start.mean[0], start.mean[1]);
        let reach = SIGHT + 3.0 * (start.spread[(0, 0)] + start.spread[(1, 1)]).sqrt();
        let near = |a: Point2, b: Point2| {
            let (dx, dy) = (b.x - a.x, b.y - a.y);
            let length = dx * dx + dy * dy;
            let share = ((here.x - a.x) * dx + (here.y - a.y) * dy) / length.max(1e-12);
            let share = share.clamp(0.0, 1.0);
            here.distance(Point2::new(a.x + share * dx, a.y + share * dy)) <= reach
        };
        let walls = plan.walls.iter().copied().enumerate();
        let corners = plan.door_corners.iter().copied().enumerate();
        Landmarks {
            walls: walls.filter(|(_, [a, b])| near(*a, *b)).collect(),
            corners: corners.filter(|(_, p)| near(*p, *p)).collect(),
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

    /// The camera at these unknowns; `None` for a homography that has become none.
    pub(super) fn view(&self, at: &Unknowns) -> Option<View<'_>> {
        View::new(self, at)
    }

    /// Where a feature would be seen if it were this landmark; `None` where it cannot be seen so.
    pub(super) fn predict(
        &self,
        feature: &Feature,
        landmarks: &Landmarks,
        choice: usize,
        view: &View<'_>,
    ) -> Option<Prediction> {
        let points = match feature.kind {
            Kind::Corner(_) => [landmarks.corners[choice].1; 2],
            Kind::Edge(_) => view.on_wall(feature, landmarks.walls[choice].1)?,
        };
        let mut out = Prediction {
            residual: Vector2::zeros(),
            rows: Rows::zeros(),
            noise: feature.noise,
        };
        let mut plan = Matrix2::<f64>::zeros();
        let seen = [view.see(points[0])?, view.see(points[1])?];
        let mut normals = feature.normals;
        if matches!(feature.kind, Kind::Edge(_)) {
            // across the wall as predicted, so that sliding along it changes nothing
            let along = seen[1].pixel - seen[0].pixel;
            let across = Vector2::new(-along.y, along.x).try_normalize(1e-9)?;
            normals = [across * across.dot(&normals[0]).signum(); 2];
            let lies = (seen[1].pixel - seen[0].pixel).norm();
            let length = (feature.places[1] - feature.places[0]).norm();
            let off = seen
                .iter()
                .zip(feature.places)
                .map(|(s, p)| (s.pixel - p).norm());
            // not the vanishing point, into which far walls and long edges all run
            if lies < 0.5 * length || off.fold(0.0, f64::max) > length.max(LEAST_REACH_PX) {
                return None;
            }
        }
        for (i, seen) in seen.iter().enumerate() {
            let normal = normals[i];
            out.residual[i] = normal.dot(&(seen.pixel - feature.places[i]));
            out.rows.set_row(i, &(normal.transpose() * seen.rates));
            plan.set_row(i, &(normal.transpose() * seen.by_ground));
        }
        out.noise += plan * plan.transpose() * self.params.plan_sigma.powi(2);
        Some(out)
    }

    /// Whether a feature is seen within `reach_px` of where a corner is predicted; walls are always.
    pub(super) fn close(
        &self,
        feature: &Feature,
        landmarks: &Landmarks,
        choice: usize,
        view: &View<'_>,
        reach_px: f64,
    ) -> bool {
        let Kind::Corner(_) = feature.kind else {
            return true;
        };
        let pixel = view.pixel(landmarks.corners[choice].1);
        pixel.is_some_and(|pixel| (pixel - feature.places[0]).norm() <= reach_px)
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
            Kind::Edge(_) => match view.on_wall(feature, landmarks.walls[choice].1) {
                Some([a, b]) => Point2::new(0.5 * (a.x + b.x), 0.5 * (a.y + b.y)),
                None => return true,
            },
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

    fn ideal(&self, place: Vector2<f64>) -> Option<Vector2<f64>> {
        let pixel = PixelPoint::new(place.x, place.y);
        let ideal = match &self.camera.lens {
            Some(lens) => lens.undistort(pixel)?,
            None => pixel,
        };
        Some(Vector2::new(ideal.u, ideal.v))
    }
}

/// A point of the plan in the picture.
struct Seen {
    pixel: Vector2<f64>,
    rates: Rows,
    /// By the floor point in base axes [px/m].
    by_ground: Matrix2<f64>,
}

/// A pixel after nod and roll, and how it moves.
struct Nodded {
    pixel: Vector2<f64>,
    /// By the pixel before.
    turned: Matrix2<f64>,
    by_nod: Vector2<f64>,
    by_roll: Vector2<f64>,
}

/// The camera at one value of the unknowns.
pub(super) struct View<'a> {
    model: &'a Model<'a>,
    position: Vector2<f64>,
    turn: [f64; 2],
    nod: [f64; 2],
    roll: [f64; 2],
    pixel_to_floor: Matrix3<f64>,
    floor_to_pixel: Matrix3<f64>,
}

impl<'a> View<'a> {
    fn new(model: &'a Model<'a>, at: &Unknowns) -> Option<Self> {
        let entries = model.entries + model.basis * at.fixed_rows::<8>(5);
        let pixel_to_floor = matrix(&std::array::from_fn(|r| {
            std::array::from_fn(|c| entries[3 * r + c])
        }));
        let (sin, cos) = at[2].sin_cos();
        let pair = |angle: f64| [angle.cos(), angle.sin()];
        Some(Self {
            model,
            position: Vector2::new(at[0], at[1]),
            turn: [cos, sin],
            nod: pair(at[3]),
            roll: pair(at[4]),
            pixel_to_floor,
            floor_to_pixel: pixel_to_floor.try_inverse()?,
        })
    }

    fn ground(&self, point: Point2) -> GroundPoint {
        let [cos, sin] = self.turn;
        let d = Vector2::new(point.x, point.y) - self.position;
        GroundPoint::new(cos * d.x + sin * d.y, cos * d.y - sin * d.x)
    }

    fn pixel(&self, point: Point2) -> Option<Vector2<f64>> {
        let ground = self.ground(point);
        let q = self.floor_to_pixel * Vector3::new(ground.x, ground.y, 1.0);
        if q.z <= 1e-12 {
            return None;
        }
        let still = q.xy() / q.z;
        match &self.model.lens {
            Some(lens) => Some(self.nodded(lens, still)?.pixel),
            None => Some(still),
        }
    }

    fn see(&self, point: Point2) -> Option<Seen> {
        let ground = self.ground(point);
        let q = self.floor_to_pixel * Vector3::new(ground.x, ground.y, 1.0);
        // the third component is 1 / D, positive before the camera
        if q.z <= 1e-12 {
            return None;
        }
        let still = Vector3::new(q.x / q.z, q.y / q.z, 1.0);
        let divide = Matrix2x3::new(1.0, 0.0, -still.x, 0.0, 1.0, -still.y) / q.z;
        let by_ground = divide * self.floor_to_pixel.fixed_columns::<2>(0);
        let [cos, sin] = self.turn;
        let by_pose = Matrix2x3::new(-cos, -sin, ground.y, sin, -cos, -ground.x);
        let mut rates = Rows::zeros();
        rates
            .fixed_columns_mut::<3>(0)
            .copy_from(&(by_ground * by_pose));
        // q moves by -G dH q
        let spin = divide * self.floor_to_pixel * -q.z;
        let by_entries = SMatrix::<f64, 2, 9>::from_fn(|r, c| spin[(r, c / 3)] * still[c % 3]);
        rates
            .fixed_columns_mut::<8>(5)
            .copy_from(&(by_entries * self.model.basis));
        let Some(lens) = self.model.lens else {
            let pixel = still.xy();
            return Some(Seen {
                pixel,
                rates,
                by_ground,
            });
        };
        let Nodded {
            pixel,
            turned,
            by_nod,
            by_roll,
        } = self.nodded(&lens, still.xy())?;
        let mut rates = turned * rates;
        rates.set_column(3, &by_nod);
        rates.set_column(4, &by_roll);
        Some(Seen {
            pixel,
            rates,
            by_ground: turned * by_ground,
        })
    }

    /// Where a pixel moves when the camera nods down and rolls.
    fn nodded(&self, lens: &CameraMatrix, still: Vector2<f64>) -> Option<Nodded> {
        let (a, b) = ((still.x - lens.cx) / lens.fx, (still.y - lens.cy) / lens.fy);
        let ([cn, sn], [cr, sr]) = (self.nod, self.roll);
        // nodding down lifts the scene: about the axis to the right
        let (y, z) = (cn * b - sn, sn * b + cn);
        let (x, y2) = (cr * a - sr * y, sr * a + cr * y);
        if z <= 1e-6 {
            return None;
        }
        let (u, v) = (x / z, y2 / z);
        let scale = Vector2::new(lens.fx, lens.fy);
        let by = |dx: f64, dy: f64, dz: f64| {
            Vector2::new((dx - u * dz) / z, (dy - v * dz) / z).component_mul(&scale)
        };
        let by_a = by(cr, sr, 0.0) / lens.fx;
        let by_b = by(-sr * cn, cr * cn, sn) / lens.fy;
        let by_nod = by(sr * z, -cr * z, y);
        let by_roll = by(-y2, x, 0.0);
        Some(Nodded {
            pixel: Vector2::new(lens.cx + lens.fx * u, lens.cy + lens.fy * v),
            turned: Matrix2::from_columns(&[by_a, by_b]),
            by_nod,
            by_roll,
        })
    }

    /// The floor point (map) that a pixel sees, the camera nodding as it does.
    fn floor(&self, pixel: Vector2<f64>) -> Option<Vector2<f64>> {
        let mut p = pixel;
        if let Some(lens) = &self.model.lens {
            let (x, y) = ((p.x - lens.cx) / lens.fx, (p.y - lens.cy) / lens.fy);
            let ([cn, sn], [cr, sr]) = (self.nod, self.roll);
            let (x, y) = (cr * x + sr * y, cr * y - sr * x);
            let (y, z) = (cn * y + sn, cn - sn * y);
            if z <= 1e-6 {
                return None;
            }
            p = Vector2::new(lens.cx + lens.fx * x / z, lens.cy + lens.fy * y / z);
        }
        let h = self.pixel_to_floor * Vector3::new(p.x, p.y, 1.0);
        if h.z <= 1e-9 {
            return None;
        }
        let (x, y) = (h.x / h.z, h.y / h.z);
        let [cos, sin] = self.turn;
        Some(self.position + Vector2::new(cos * x - sin * y, sin * x + cos * y))
    }

    /// The points of a wall's line that a seen edge's ends would be; `None` where the edge is not on the wall.
    fn on_wall(&self, feature: &Feature, [a, b]: [Point2; 2]) -> Option<[Point2; 2]> {
        let origin = Vector2::new(a.x, a.y);
        let along = Vector2::new(b.x - a.x, b.y - a.y);
        let length = along.norm();
        let along = along / length;
        let mut places = [0.0; 2];
        for (place, pixel) in places.iter_mut().zip(feature.places) {
            *place = along.dot(&(self.floor(pixel)? - origin));
        }
        let [low, high] = [places[0].min(places[1]), places[0].max(places[1])];
        // ends may stray as far as the edge is long: it may have grown along a door's threshold
        let covered = high.min(length + PAST_WALL) - low.max(-PAST_WALL);
        if covered < 0.7 * (high - low) || high - low < 1e-3 {
            return None;
        }
        Some(places.map(|t| {
            let p = origin + along * t;
            Point2::new(p.x, p.y)
        }))
    }
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

fn square(m: &[[f64; 2]; 2]) -> Matrix2<f64> {
    let off = 0.5 * (m[0][1] + m[1][0]);
    Matrix2::new(m[0][0], off, off, m[1][1])
}

/// The homography of a camera that nodded down.
pub(super) fn nodded(camera: &FloorCamera, pitch: f64) -> Option<FloorHomography> {
    let lens = camera.geometry().ok()?.matrix;
    let (sin, cos) = pitch.sin_cos();
    let inner = Matrix3::new(
        lens.fx, 0.0, lens.cx, //
        0.0, lens.fy, lens.cy, //
        0.0, 0.0, 1.0,
    );
    let back = Matrix3::new(1.0, 0.0, 0.0, 0.0, cos, sin, 0.0, -sin, cos);
    let moved = matrix(&camera.homography.pixel_to_floor()) * inner * back * inner.try_inverse()?;
    FloorHomography::new(rows(&moved)).ok()
}
