//! Lines, dots and ellipses over one or more pictures beside each other: camera frames and floor plans.

use std::fmt::Write as _;

use base64::{Engine as _, engine::general_purpose::STANDARD};
use image::{ExtendedColorType, RgbImage};

use super::canvas::Canvas;
use super::raster::encode;
use super::scene::Color;
use super::svg::{escape, hex, number};

/// Space between panels [page px].
const GAP_PX: f64 = 24.0;
/// Height of a line of caption [page px].
const LINE_PX: f64 = 20.0;

/// Enlarged frames have about this many pixels on their longer side.
pub const OVERLAY_SIDE_PX: u32 = 1400;

/// A picture enlarged by a factor, and what is drawn over it.
#[derive(Debug, Clone)]
pub struct Panel {
    picture: RgbImage,
    zoom: f64,
    strokes: Vec<(Vec<[f64; 2]>, Color, f64)>,
    labels: Vec<([f64; 2], Color, String)>,
}

impl Panel {
    /// A picture, enlarged by a whole factor so that its longer side has about this many pixels.
    #[must_use]
    pub fn new(picture: RgbImage, long_side_px: u32) -> Self {
        let longer = picture.width().max(picture.height()).max(1);
        Self {
            zoom: (f64::from(long_side_px) / f64::from(longer))
                .round()
                .clamp(1.0, 16.0),
            picture,
            strokes: vec![],
            labels: vec![],
        }
    }

    /// Adds a line through points of the picture (pixel centres at integers), of a width on the page [px].
    pub fn line(&mut self, points: &[[f64; 2]], color: Color, width_px: f64) {
        self.strokes.push((points.to_vec(), color, width_px));
    }

    /// Adds a dot of a radius on the page [px].
    pub fn dot(&mut self, at: [f64; 2], color: Color, radius_px: f64) {
        self.strokes.push((vec![at, at], color, 2.0 * radius_px));
    }

    /// Adds the ellipse that holds 95 % of a normal distribution with this covariance, enlarged.
    pub fn ellipse(
        &mut self,
        at: [f64; 2],
        covariance: [[f64; 2]; 2],
        enlarged: f64,
        color: Color,
    ) {
        let [[a, b], [_, d]] = covariance;
        // a root of the covariance: lower triangular
        let l = a.max(0.0).sqrt();
        let m = if l > 0.0 { b / l } else { 0.0 };
        let n = (d - m * m).max(0.0).sqrt();
        let size = 5.991_f64.sqrt() * enlarged;
        let point = |k: u32| {
            let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 48.0).sin_cos();
            [at[0] + size * l * cos, at[1] + size * (m * cos + n * sin)]
        };
        let points: Vec<[f64; 2]> = (0..=48).map(point).collect();
        self.line(&points, color, 1.5);
    }

    /// Adds words to the right of a place.
    pub fn label(&mut self, at: [f64; 2], color: Color, text: impl Into<String>) {
        self.labels.push((at, color, text.into()));
    }

    /// Width and height on the page [px].
    #[must_use]
    pub fn size(&self) -> [f64; 2] {
        let (width, height) = self.picture.dimensions();
        [f64::from(width) * self.zoom, f64::from(height) * self.zoom]
    }

    /// From the picture's pixels to the page's.
    fn place(&self, left: f64, [u, v]: [f64; 2]) -> (f64, f64) {
        (left + (u + 0.5) * self.zoom, (v + 0.5) * self.zoom)
    }

    /// The part of a line within the picture and a little around it: piece by piece.
    fn pieces<'a>(&'a self, points: &'a [[f64; 2]]) -> impl Iterator<Item = [[f64; 2]; 2]> + 'a {
        let (width, height) = self.picture.dimensions();
        let bounds = [f64::from(width) - 0.5, f64::from(height) - 0.5];
        points
            .windows(2)
            .filter_map(move |pair| clipped(pair[0], pair[1], bounds))
    }
}

/// The part of a segment with coordinates from -0.5 to these bounds.
fn clipped(a: [f64; 2], b: [f64; 2], bounds: [f64; 2]) -> Option<[[f64; 2]; 2]> {
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for k in 0..2 {
        let step = b[k] - a[k];
        for (sign, limit) in [(-1.0, 0.5), (1.0, bounds[k])] {
            let (gain, room) = (sign * step, limit - sign * a[k]);
            if gain > 0.0 {
                to = to.min(room / gain);
            } else if gain < 0.0 {
                from = from.max(room / gain);
            } else if room < 0.0 {
                return None;
            }
        }
    }
    let at = |t: f64| [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
    (from <= to).then(|| [at(from), at(to)])
}

/// Panels beside each other with lines of text below (SVG only).
#[derive(Debug, Clone, Default)]
pub struct Overlay {
    panels: Vec<Panel>,
    caption: Vec<(Color, String)>,
}

impl Overlay {
    /// One panel alone or several from left to right.
    #[must_use]
    pub fn new(panels: Vec<Panel>) -> Self {
        Self {
            panels,
            caption: vec![],
        }
    }

    /// Adds a line of text below.
    pub fn note(&mut self, color: Color, text: impl Into<String>) {
        self.caption.push((color, text.into()));
    }

    /// Width and height of the panels together [page px].
    fn size(&self) -> [f64; 2] {
        let sizes = self.panels.iter().map(Panel::size);
        let [width, height] = sizes.fold([-GAP_PX, 0.0], |[width, height], [w, h]| {
            [width + GAP_PX + w, f64::max(height, h)]
        });
        [width.max(1.0), height.max(1.0)]
    }

    /// The panels with their left edges [page px].
    fn placed(&self) -> impl Iterator<Item = (f64, &Panel)> {
        let mut left = 0.0;
        self.panels.iter().map(move |panel| {
            let at = left;
            left += panel.size()[0] + GAP_PX;
            (at, panel)
        })
    }

    pub(super) fn to_png(&self) -> anyhow::Result<Vec<u8>> {
        let [width, height] = self.size().map(|s| s as usize);
        let mut canvas = Canvas {
            width,
            height,
            rgb: vec![255; 3 * width * height],
        };
        for (left, panel) in self.placed() {
            let [w, h] = panel.size().map(|s| s as usize);
            for row in 0..h {
                for column in 0..w {
                    let (u, v) = (column as f64 / panel.zoom, row as f64 / panel.zoom);
                    let pixel = panel.picture.get_pixel(u as u32, v as u32).0;
                    let at = 3 * (row * width + left as usize + column);
                    canvas.rgb[at..at + 3].copy_from_slice(&pixel);
                }
            }
            for (points, color, width_px) in &panel.strokes {
                for [a, b] in panel.pieces(points) {
                    canvas.line(
                        panel.place(left, a),
                        panel.place(left, b),
                        width_px / 2.0,
                        *color,
                    );
                }
            }
            for (at, color, text) in &panel.labels {
                let (x, y) = panel.place(left, *at);
                canvas.text((x + 4.0, y - 5.0), text, *color);
            }
        }
        encode(
            width as u32,
            height as u32,
            &canvas.rgb,
            ExtendedColorType::Rgb8,
        )
    }

    pub(super) fn to_svg(&self) -> anyhow::Result<String> {
        let [width, height] = self.size();
        let whole = height + (self.caption.len() as f64 + 0.5) * LINE_PX;
        let mut svg = String::new();
        writeln!(
            svg,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{whole:.0}\" viewBox=\"0 0 {width:.2} {whole:.2}\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"white\"/>"
        )?;
        for (left, panel) in self.placed() {
            let [w, h] = panel.size();
            let png = super::rgb_png(&panel.picture)?;
            writeln!(
                svg,
                "<image x=\"{left}\" y=\"0\" width=\"{w}\" height=\"{h}\" preserveAspectRatio=\"none\" style=\"image-rendering:pixelated\" href=\"data:image/png;base64,{}\"/>\n\
                 <g fill=\"none\" stroke-linejoin=\"round\" stroke-linecap=\"round\">",
                STANDARD.encode(&png)
            )?;
            for (points, color, width_px) in &panel.strokes {
                svg_path(&mut svg, panel, left, points, *color, *width_px)?;
            }
            svg.push_str("</g>\n");
            for (at, color, text) in &panel.labels {
                let (x, y) = panel.place(left, *at);
                svg_text(&mut svg, x + 4.0, y + 4.0, 12, *color, text)?;
            }
        }
        for (line, (color, text)) in (1..).zip(&self.caption) {
            svg_text(
                &mut svg,
                8.0,
                height + f64::from(line) * LINE_PX,
                14,
                *color,
                text,
            )?;
        }
        svg.push_str("</svg>\n");
        Ok(svg)
    }
}

/// A line as one path: pieces that follow each other are joined.
fn svg_path(
    svg: &mut String,
    panel: &Panel,
    left: f64,
    points: &[[f64; 2]],
    color: Color,
    width_px: f64,
) -> std::fmt::Result {
    svg.push_str("<path d=\"");
    let mut end = None;
    for [a, b] in panel.pieces(points) {
        let ((x0, y0), (x1, y1)) = (panel.place(left, a), panel.place(left, b));
        if end != Some(a) {
            write!(svg, "M{} {}", number(x0), number(y0))?;
        }
        write!(svg, "L{} {}", number(x1), number(y1))?;
        end = Some(b);
    }
    writeln!(
        svg,
        "\" stroke=\"{}\" stroke-width=\"{width_px}\"/>",
        hex(color)
    )
}

fn svg_text(
    svg: &mut String,
    x: f64,
    y: f64,
    size: u32,
    color: Color,
    text: &str,
) -> std::fmt::Result {
    writeln!(
        svg,
        "<text x=\"{x:.1}\" y=\"{y:.1}\" font-family=\"sans-serif\" font-size=\"{size}\" fill=\"{}\">{}</text>",
        hex(color),
        escape(text)
    )
}
