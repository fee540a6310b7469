//! A calibration at a glance: pairs and a metric grid in the camera's picture; beside it the floor from
//! above with what a pixel covers, the error ellipses and the residuals.

use image::{Rgb, RgbImage};
use monocal::{Calibration, FloorCamera, GroundPoint, Pair, PixelPoint};

use super::overlay::{Overlay, Panel};
use super::scene::Color;

/// The longer side of the camera's picture on the page, about [px].
const LONG_SIDE_PX: u32 = 1100;
/// The height of the floor's picture, at least and at most [px].
const FLOOR_HEIGHT_PX: [f64; 2] = [480.0, 1000.0];
/// Its greatest width over its height.
const WIDEST_FLOOR: f64 = 1.6;
const FITS: Color = Color(0, 120, 70);
const PREDICTED: Color = Color(230, 120, 0);
const GRID: Color = Color(40, 110, 220);
const FAINT: Color = Color(150, 150, 150);

/// Colours of a pixel's footprint, from fine to coarse.
const BANDS: [[u8; 3]; 6] = [
    [240, 249, 232],
    [204, 235, 197],
    [168, 221, 181],
    [123, 204, 196],
    [112, 180, 212],
    [170, 170, 190],
];

/// The part of the floor that is shown: where the pairs are, and around.
struct View {
    near: f64,
    far: f64,
    left: f64,
    right: f64,
    /// Between grid lines [m].
    step: f64,
}

/// Draws a calibration over a frame of the camera, or over white.
#[must_use]
pub fn calibration(found: &Calibration, pairs: &[Pair], frame: Option<RgbImage>) -> Overlay {
    let camera = &found.camera;
    let picture = frame.unwrap_or_else(|| blank(camera, pairs));
    let size = [picture.width(), picture.height()];
    let view = View::of_pairs(pairs);
    let seen = camera_panel(found, pairs, picture, &view);
    let height = seen.size()[1].clamp(FLOOR_HEIGHT_PX[0], FLOOR_HEIGHT_PX[1]);
    let (above, magnified) = floor_panel(found, pairs, size, &view, height);
    let panels = vec![seen, above];
    let spacing = view.step;
    let mut overlay = Overlay::new(panels);
    overlay.note(
        Color::INK,
        format!(
            "{} pairs (green: fit, red: do not), orange: where the calibration sees their floor points; grid lines every {spacing} m",
            pairs.len()
        ),
    );
    let held_out = found.held_out.map_or(String::new(), |e| {
        format!(
            "; each left out: mean {:.1} mm, max {:.1} mm",
            1000.0 * e.mean,
            1000.0 * e.max
        )
    });
    overlay.note(
        Color::INK,
        format!(
            "residual mean {:.1} mm, max {:.1} mm{held_out}",
            1000.0 * found.residual.mean,
            1000.0 * found.residual.max
        ),
    );
    overlay.note(
        Color::INK,
        format!(
            "floor from above: 95 % ellipses of points read to {:.2} px and errors of pairs, both {magnified} times enlarged; colours: a pixel's longer side on the floor",
            camera.pixel_sigma_px
        ),
    );
    overlay
}

/// White of the picture's size, or of that of the pairs.
fn blank(camera: &FloorCamera, pairs: &[Pair]) -> RgbImage {
    let [width, height] = camera.image_size.unwrap_or_else(|| {
        let largest = |of: fn(&Pair) -> f64| pairs.iter().map(of).fold(16.0, f64::max);
        [largest(|p| p.pixel.u), largest(|p| p.pixel.v)].map(|v| v.min(4000.0) as u32 + 20)
    });
    RgbImage::from_pixel(width.min(8192), height.min(8192), Rgb([255, 255, 255]))
}

fn camera_panel(found: &Calibration, pairs: &[Pair], picture: RgbImage, view: &View) -> Panel {
    let camera = &found.camera;
    let size = [picture.width(), picture.height()];
    let mut panel = Panel::new(picture, LONG_SIDE_PX);
    draw_grid(&mut panel, camera, view, size);
    for (pair, error) in pairs.iter().zip(&found.errors) {
        let color = if error.fits { FITS } else { Color::FAULT };
        cross(&mut panel, pair.pixel.into(), color, size);
        if let Some(seen) = camera.pixel_of(pair.floor) {
            panel.line(&[pair.pixel.into(), seen.into()], PREDICTED, 2.0);
            panel.dot(seen.into(), PREDICTED, 2.0);
        }
    }
    panel
}

fn cross(panel: &mut Panel, [u, v]: [f64; 2], color: Color, size: [u32; 2]) {
    let arm = f64::from(size[0].max(size[1])) / 120.0;
    panel.line(&[[u - arm, v - arm], [u + arm, v + arm]], color, 2.0);
    panel.line(&[[u - arm, v + arm], [u + arm, v - arm]], color, 2.0);
}

/// Lines of equal x and y on the floor, as the camera sees them.
fn draw_grid(panel: &mut Panel, camera: &FloorCamera, view: &View, size: [u32; 2]) {
    let step = view.step;
    let along = |from: f64, to: f64, point: &dyn Fn(f64) -> GroundPoint| -> Vec<Vec<[f64; 2]>> {
        // a curve under a lens: in short pieces, broken where the camera does not see
        let mut runs = vec![Vec::new()];
        for k in 0..=200 {
            let t = from + (to - from) * f64::from(k) / 200.0;
            match camera.pixel_of(point(t)) {
                Some(pixel) => {
                    if let Some(run) = runs.last_mut() {
                        run.push(pixel.into());
                    }
                }
                None => runs.push(Vec::new()),
            }
        }
        runs
    };
    for k in multiples(view.near, view.far, step) {
        let x = step * k;
        for run in along(view.left, view.right, &|y| GroundPoint::new(x, y)) {
            panel.line(&run, GRID, 1.0);
        }
        // at the grid line nearest to the middle that is in the picture
        let mut places: Vec<f64> = multiples(view.right, view.left, step)
            .map(|k| step * k)
            .collect();
        places.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
        let at = places
            .into_iter()
            .find_map(|y| seen(camera, GroundPoint::new(x, y), size));
        if let Some(at) = at {
            panel.label(at.into(), GRID, metres(x));
        }
    }
    for k in multiples(view.right, view.left, step) {
        let y = step * k;
        for run in along(view.near, view.far, &|x| GroundPoint::new(x, y)) {
            panel.line(&run, GRID, if k == 0.0 { 2.0 } else { 1.0 });
        }
    }
}

impl View {
    fn of_pairs(pairs: &[Pair]) -> Self {
        let bounds = |of: fn(&Pair) -> f64| {
            let values = || pairs.iter().map(of);
            let (low, high) = (
                values().fold(f64::INFINITY, f64::min),
                values().fold(f64::NEG_INFINITY, f64::max),
            );
            let margin = 0.15 * (high - low);
            (low - margin, high + margin)
        };
        let ((near, far), (right, left)) = (bounds(|p| p.floor.x), bounds(|p| p.floor.y));
        let about = (far - near).max(left - right) / 11.0;
        let power = 10f64.powf(about.log10().floor());
        let steps = [1.0, 2.0, 5.0, 10.0].map(|m| m * power);
        let step = steps.into_iter().find(|s| *s >= about).unwrap_or(about);
        Self {
            near,
            far,
            left,
            right,
            step,
        }
    }
}

/// A length without the digits that rounding adds.
fn metres(length: f64) -> String {
    format!("{} m", (length * 1000.0).round() / 1000.0)
}

fn multiples(from: f64, to: f64, step: f64) -> impl Iterator<Item = f64> {
    let first = (from / step).ceil() as i64;
    let last = (to / step).floor() as i64;
    (first..=last).map(|k| k as f64)
}

/// The floor from above, of about this height [px], and how much its ellipses are enlarged.
fn floor_panel(
    found: &Calibration,
    pairs: &[Pair],
    size: [u32; 2],
    view: &View,
    height: f64,
) -> (Panel, f64) {
    let camera = &found.camera;
    let side =
        ((view.far - view.near) / height).max((view.left - view.right) / (WIDEST_FLOOR * height));
    let floor =
        |column: f64, row: f64| GroundPoint::new(view.far - side * row, view.left - side * column);
    let place = |p: GroundPoint| [(view.left - p.y) / side, (view.far - p.x) / side];
    let pixels = |length: f64| ((length / side).ceil() as u32).clamp(1, 4096);
    let bands = bands(camera, pairs);
    let shaded = RgbImage::from_fn(
        pixels(view.left - view.right),
        pixels(view.far - view.near),
        |c, r| {
            Rgb(shade(
                camera,
                floor(f64::from(c), f64::from(r)),
                size,
                &bands,
            ))
        },
    );
    let mut panel = Panel::new(shaded, 1);
    for k in multiples(view.near, view.far, view.step) {
        let x = view.step * k;
        let ends = [
            GroundPoint::new(x, view.left),
            GroundPoint::new(x, view.right),
        ]
        .map(place);
        panel.line(&ends, FAINT, 1.0);
        panel.label(ends[0], Color::INK, metres(x));
    }
    for k in multiples(view.right, view.left, view.step) {
        let y = view.step * k;
        let ends = [
            GroundPoint::new(view.near, y),
            GroundPoint::new(view.far, y),
        ]
        .map(place);
        panel.line(&ends, FAINT, 1.0);
        panel.label([ends[0][0], ends[0][1] - 10.0], Color::INK, metres(y));
    }
    let magnified = draw_ellipses(&mut panel, camera, view, size, place);
    for (pair, error) in pairs.iter().zip(&found.errors) {
        let color = if error.fits { FITS } else { Color::FAULT };
        panel.dot(place(pair.floor), color, 3.0);
        let off = GroundPoint::new(
            pair.floor.x + magnified * error.floor[0],
            pair.floor.y + magnified * error.floor[1],
        );
        if off.is_finite() {
            panel.line(&[place(pair.floor), place(off)], color, 2.0);
        }
    }
    legend(&mut panel, &bands);
    (panel, magnified)
}

/// Upper ends of the bands of a pixel's footprint [m], the last one open: the finest is that of the nearest
/// pair or below it.
fn bands(camera: &FloorCamera, pairs: &[Pair]) -> [f64; BANDS.len()] {
    let footprints = pairs.iter().filter_map(|p| camera.footprint(p.pixel));
    let finest = footprints.fold(f64::INFINITY, f64::min).clamp(1e-6, 1e3);
    let power = 10f64.powf(finest.log10().floor());
    let ladder = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0].map(|m| m * power);
    let first = ladder.iter().position(|l| *l >= finest).unwrap_or(0).min(3);
    std::array::from_fn(|k| {
        if k + 1 < BANDS.len() {
            ladder[first + k]
        } else {
            f64::INFINITY
        }
    })
}

/// The pixel that sees a floor point, where it is within the picture.
fn seen(camera: &FloorCamera, point: GroundPoint, [width, height]: [u32; 2]) -> Option<PixelPoint> {
    let pixel = camera.pixel_of(point)?;
    let inside = pixel.u >= -0.5
        && pixel.v >= -0.5
        && pixel.u <= f64::from(width) - 0.5
        && pixel.v <= f64::from(height) - 0.5;
    inside.then_some(pixel)
}

fn shade(camera: &FloorCamera, point: GroundPoint, size: [u32; 2], bands: &[f64]) -> [u8; 3] {
    let footprint = seen(camera, point, size).and_then(|pixel| camera.footprint(pixel));
    let band = footprint.and_then(|footprint| bands.iter().position(|end| footprint <= *end));
    band.map_or([255, 255, 255], |band| BANDS[band])
}

/// Ellipses where grid lines cross, enlarged by a round factor so that they are seen and do not overlap.
fn draw_ellipses(
    panel: &mut Panel,
    camera: &FloorCamera,
    view: &View,
    size: [u32; 2],
    place: impl Fn(GroundPoint) -> [f64; 2],
) -> f64 {
    let step = view.step;
    let variance = camera.pixel_sigma_px.powi(2);
    let mut estimates = Vec::new();
    for k in multiples(view.near, view.far, step) {
        for l in multiples(view.right, view.left, step) {
            let point = GroundPoint::new(step * k, step * l);
            let estimate = seen(camera, point, size)
                .and_then(|pixel| camera.floor_estimate(pixel, [[variance, 0.0], [0.0, variance]]));
            estimates.extend(estimate);
        }
    }
    let mut sizes: Vec<f64> = estimates
        .iter()
        .map(|e| e.covariance[0][0].max(e.covariance[1][1]).sqrt())
        .collect();
    sizes.sort_by(f64::total_cmp);
    let middle = sizes
        .get(sizes.len() / 2)
        .copied()
        .unwrap_or(step)
        .max(1e-9);
    let about = 0.12 * step / middle;
    let power = 10f64.powf(about.log10().floor());
    let magnified = [5.0, 2.0, 1.0]
        .map(|m| m * power)
        .into_iter()
        .find(|m| *m <= about)
        .unwrap_or(1.0)
        .max(1.0);
    let [origin, ahead] = [GroundPoint::new(0.0, 0.0), GroundPoint::new(1.0, 0.0)].map(&place);
    let per_metre = origin[1] - ahead[1];
    for e in estimates {
        let [[xx, xy], [_, yy]] = e.covariance;
        // of the picture u is -y and v is -x
        let in_picture = [[yy, xy], [xy, xx]].map(|row| row.map(|c| c * per_metre * per_metre));
        panel.ellipse(place(e.point), in_picture, magnified, Color::INK);
    }
    magnified
}

fn legend(panel: &mut Panel, bands: &[f64]) {
    let left = panel.size()[0] - 84.0;
    let size = |end: f64| {
        let centimetres = (100_000.0 * end).round() / 1000.0;
        if end >= 1.0 {
            format!("{end} m")
        } else {
            format!("{centimetres} cm")
        }
    };
    for (k, (&end, [r, g, b])) in bands.iter().zip(BANDS).enumerate() {
        let v = 14.0 + 20.0 * k as f64;
        panel.line(&[[left, v], [left + 14.0, v]], Color(80, 80, 80), 15.0);
        panel.line(&[[left, v], [left + 14.0, v]], Color(r, g, b), 13.0);
        let words = if end.is_finite() {
            size(end)
        } else {
            format!("> {}", size(bands[k - 1]))
        };
        panel.label([left + 22.0, v], Color::INK, words);
    }
}
