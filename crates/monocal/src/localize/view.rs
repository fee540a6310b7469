//! The camera at one value of the unknowns: where it sees points of the plan, and how they move with the unknowns.

use nalgebra::{Matrix2, Matrix2x3, Matrix3, SMatrix, Vector2, Vector3};
use occgrid::Point2;

use super::belief::{Rows, Unknowns};
use super::feature::Feature;
use super::model::Model;
use crate::homography::{matrix, rows};
use crate::{CameraMatrix, FloorCamera, FloorHomography, GroundPoint};

/// How far a floor edge may reach past the end of its wall [m].
const PAST_WALL: f64 = 0.15;

/// A point of the plan in the picture.
pub(super) struct Seen {
    pub(super) pixel: Vector2<f64>,
    pub(super) rates: Rows,
    /// By the floor point in base axes [px/m].
    pub(super) by_ground: Matrix2<f64>,
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
    pub(super) position: Vector2<f64>,
    turn: [f64; 2],
    nod: [f64; 2],
    roll: [f64; 2],
    pixel_to_floor: Matrix3<f64>,
    floor_to_pixel: Matrix3<f64>,
    /// Vanishing point of the vertical as the camera nods and rolls, homogeneous.
    nadir: Option<Vector3<f64>>,
}

impl<'a> View<'a> {
    pub(super) fn new(model: &'a Model<'a>, at: &Unknowns) -> Option<Self> {
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
            nadir: model.nadir.map(|nadir| match &model.lens {
                Some(lens) => turned(lens, nadir.into(), pair(at[3]), pair(at[4])),
                None => nadir.into(),
            }),
        })
    }

    /// Unit direction down the vertical that is seen at a place of the picture.
    pub(super) fn down(&self, place: Vector2<f64>) -> Option<Vector2<f64>> {
        towards(self.nadir?, place)
    }

    fn ground(&self, point: Point2) -> GroundPoint {
        let [cos, sin] = self.turn;
        let d = Vector2::new(point.x, point.y) - self.position;
        GroundPoint::new(cos * d.x + sin * d.y, cos * d.y - sin * d.x)
    }

    pub(super) fn pixel(&self, point: Point2) -> Option<Vector2<f64>> {
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

    pub(super) fn see(&self, point: Point2) -> Option<Seen> {
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

    /// The places along a wall's line [m] that a seen edge's ends would be; `None` where the edge is not on
    /// the wall.
    pub(super) fn on_wall(&self, feature: &Feature, [a, b]: [Point2; 2]) -> Option<[f64; 2]> {
        let length = a.distance(b);
        let along = Vector2::new(b.x - a.x, b.y - a.y) / length;
        let mut places = [0.0; 2];
        for (place, pixel) in places.iter_mut().zip(feature.places) {
            *place = along.dot(&(self.floor(pixel)? - Vector2::new(a.x, a.y)));
        }
        let [low, high] = [places[0].min(places[1]), places[0].max(places[1])];
        // ends may stray as far as the edge is long: it may have grown along a door's threshold
        let covered = high.min(length + PAST_WALL) - low.max(-PAST_WALL);
        (covered >= 0.7 * (high - low) && high - low >= 1e-3).then_some(places)
    }

    /// A direction in the map, in base axes.
    pub(super) fn turned(&self, direction: [f64; 2]) -> Vector2<f64> {
        let ([cos, sin], [x, y]) = (self.turn, direction);
        Vector2::new(cos * x + sin * y, cos * y - sin * x)
    }
}

/// Unit direction in the picture from a place to a homogeneous point.
pub(super) fn towards(point: Vector3<f64>, place: Vector2<f64>) -> Option<Vector2<f64>> {
    (point.xy() - place * point.z).try_normalize(1e-9)
}

/// Where a homogeneous pixel moves when the camera nods down and rolls (cosine, sine).
fn turned(
    lens: &CameraMatrix,
    at: Vector3<f64>,
    [cn, sn]: [f64; 2],
    [cr, sr]: [f64; 2],
) -> Vector3<f64> {
    let (a, b, w) = (
        (at.x - lens.cx * at.z) / lens.fx,
        (at.y - lens.cy * at.z) / lens.fy,
        at.z,
    );
    let (y, z) = (cn * b - sn * w, sn * b + cn * w);
    let (x, y) = (cr * a - sr * y, sr * a + cr * y);
    Vector3::new(lens.fx * x + lens.cx * z, lens.fy * y + lens.cy * z, z)
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
