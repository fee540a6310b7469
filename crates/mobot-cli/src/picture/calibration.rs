//! A calibration at a glance: pairs and a metric grid in the camera's picture; beside it the floor from
//! above with what a pixel covers, the error ellipses and the residuals.

use image::{Rgb, RgbImage};
use monocal::{BirdseyeParams, Calibration, FloorCamera, GroundPoint, Pair, PixelPoint};

use super::overlay::{Overlay, Panel};
use super::scene::Color;

/// The longer side of the camera's picture on the page, and of the floor [px].
const LONG_SIDE_PX: u32 = 960;
/// The floor is shown where a pixel covers at most this [m].
const COARSEST: f64 = 0.2;
const FITS: Color = Color(0, 120, 70);
const PREDICTED: Color = Color(230, 120, 0);
const GRID: Color = Color(40, 110, 220);
const FAINT: Color = Color(150, 150, 150);

/// Footprint of a pixel [m] and the colour up to it.
const BANDS: [(f64, [u8; 3], &str); 6] = [
    (0.0025, [240, 249, 232], "0.25 cm"),
    (0.005, [204, 235, 197], "0.5 cm"),
    (0.01, [168, 221, 181], "1 cm"),
    (0.02, [123, 204, 196], "2 cm"),
    (0.05, [112, 180, 212], "5 cm"),
    (f64::INFINITY, [170, 170, 190], "more"),
];

/// Draws a calibration over a frame of the camera, or over white.
#[must_use]
pub fn calibration(found: &Calibration, pairs: &[Pair], frame: Option<RgbImage>) -> Overlay {
    let camera = &found.camera;
    let picture = frame.unwrap_or_else(|| blank(camera, pairs));
    let size = [picture.width(), picture.height()];
    let mut panels = vec![camera_panel(found, pairs, picture)];
    let (mut magnified, mut spacing) = (1.0, 0.5);
    if let Some((panel, m, s)) = floor_panel(found, pairs, size) {
        panels.push(panel);
        (magnified, spacing) = (m, s);
    }
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

fn camera_panel(found: &Calibration, pairs: &[Pair], picture: RgbImage) -> Panel {
    let camera = &found.camera;
    let size = [picture.width(), picture.height()];
    let mut panel = Panel::new(picture, LONG_SIDE_PX);
    if let Some(view) = BirdseyeParams::of_view(camera, size, COARSEST, 1000) {
        draw_grid(&mut panel, camera, &view);
    }
    for (pair, error) in pairs.iter().zip(&found.errors) {
        let color = if error.fits { FITS } else { Color::FAULT };
        if let Some(seen) = camera.pixel_of(pair.floor) {
            panel.line(&[pair.pixel.into(), seen.into()], PREDICTED, 2.0);
            panel.dot(seen.into(), PREDICTED, 2.0);
        }
        cross(&mut panel, pair.pixel.into(), color, size);
    }
    panel
}

fn cross(panel: &mut Panel, [u, v]: [f64; 2], color: Color, size: [u32; 2]) {
    let arm = f64::from(size[0].max(size[1])) / 120.0;
    panel.line(&[[u - arm, v - arm], [u + arm, v + arm]], color, 2.0);
    panel.line(&[[u - arm, v + arm], [u + arm, v - arm]], color, 2.0);
}

/// Lines of equal x and y on the floor, as the camera sees them.
fn draw_grid(panel: &mut Panel, camera: &FloorCamera, view: &BirdseyeParams) {
    let step = spacing(view);
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
        if let Some(at) = camera.pixel_of(GroundPoint::new(x, 0.0)) {
            panel.label(at.into(), GRID, format!("{x} m"));
        }
    }
    for k in multiples(view.right, view.left, step) {
        let y = step * k;
        for run in along(view.near, view.far, &|x| GroundPoint::new(x, y)) {
            panel.line(&run, GRID, if k == 0.0 { 2.0 } else { 1.0 });
        }
    }
}

/// A round distance that divides the view into about eight.
fn spacing(view: &BirdseyeParams) -> f64 {
    let about = (view.far - view.near).max(view.left - view.right) / 8.0;
    let power = 10f64.powf(about.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|m| m * power);
    steps.into_iter().find(|s| *s >= about).unwrap_or(about)
}

fn multiples(from: f64, to: f64, step: f64) -> impl Iterator<Item = f64> {
    let first = (from / step).ceil() as i64;
    let last = (to / step).floor() as i64;
    (first..=last).map(|k| k as f64)
}

/// The floor from above, with how much its ellipses are enlarged and how far its grid lines are apart [m].
fn floor_panel(found: &Calibration, pairs: &[Pair], size: [u32; 2]) -> Option<(Panel, f64, f64)> {
    let camera = &found.camera;
    let mut view = BirdseyeParams::of_view(camera, size, COARSEST, LONG_SIDE_PX)?;
    include(&mut view, pairs);
    let step = spacing(&view);
    let side = (view.far - view.near).max(view.left - view.right) / f64::from(LONG_SIDE_PX);
    let floor =
        |column: f64, row: f64| GroundPoint::new(view.far - side * row, view.left - side * column);
    let place = |p: GroundPoint| [(view.left - p.y) / side, (view.far - p.x) / side];
    let pixels = |length: f64| ((length / side).ceil() as u32).clamp(1, LONG_SIDE_PX);
    let shaded = RgbImage::from_fn(
        pixels(view.left - view.right),
        pixels(view.far - view.near),
        |c, r| Rgb(shade(camera, floor(f64::from(c), f64::from(r)), size)),
    );
    let mut panel = Panel::new(shaded, LONG_SIDE_PX);
    for k in multiples(view.near, view.far, step) {
        let x = step * k;
        let ends = [
            GroundPoint::new(x, view.left),
            GroundPoint::new(x, view.right),
        ]
        .map(place);
        panel.line(&ends, FAINT, 1.0);
        panel.label(
            place(GroundPoint::new(x, view.left)),
            Color::INK,
            format!("{x} m"),
        );
    }
    for k in multiples(view.right, view.left, step) {
        let y = step * k;
        panel.line(
            &[
                GroundPoint::new(view.near, y),
                GroundPoint::new(view.far, y),
            ]
            .map(place),
            FAINT,
            1.0,
        );
        panel.label(
            place(GroundPoint::new(
                view.near + 0.03 * (view.far - view.near),
                y,
            )),
            Color::INK,
            format!("{y} m"),
        );
    }
    let magnified = draw_ellipses(&mut panel, camera, &view, step, size, place);
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
    legend(&mut panel);
    Some((panel, magnified, step))
}

/// Widens a view to show the floor points of all pairs, if they are near enough to be of use.
fn include(view: &mut BirdseyeParams, pairs: &[Pair]) {
    let extent = (view.far - view.near).max(view.left - view.right);
    let margin = 0.03 * extent;
    let bounds = [
        view.near - extent,
        view.far + extent,
        view.right - extent,
        view.left + extent,
    ];
    for GroundPoint { x, y } in pairs.iter().map(|p| p.floor) {
        if x > bounds[0] && x < bounds[1] && y > bounds[2] && y < bounds[3] {
            view.near = view.near.min(x - margin);
            view.far = view.far.max(x + margin);
            view.right = view.right.min(y - margin);
            view.left = view.left.max(y + margin);
        }
    }
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

fn shade(camera: &FloorCamera, point: GroundPoint, size: [u32; 2]) -> [u8; 3] {
    let footprint = seen(camera, point, size).and_then(|pixel| camera.footprint(pixel));
    footprint
        .and_then(|footprint| BANDS.iter().find(|band| footprint <= band.0))
        .map_or([255, 255, 255], |band| band.1)
}

/// Ellipses where grid lines cross, enlarged by a round factor so that they are seen and do not overlap.
fn draw_ellipses(
    panel: &mut Panel,
    camera: &FloorCamera,
    view: &BirdseyeParams,
    step: f64,
    size: [u32; 2],
    place: impl Fn(GroundPoint) -> [f64; 2],
) -> f64 {
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

fn legend(panel: &mut Panel) {
    for (k, (_, color, words)) in (0..).zip(BANDS) {
        let (u, v) = (14.0, 14.0 + 20.0 * f64::from(k));
        let [r, g, b] = color;
        panel.line(&[[u, v], [u + 14.0, v]], Color(80, 80, 80), 15.0);
        panel.line(&[[u, v], [u + 14.0, v]], Color(r, g, b), 13.0);
        panel.label([u + 22.0, v], Color::INK, words);
    }
}
