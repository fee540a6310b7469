//! Scenes as SVG: the map as an embedded picture, lines and marks as vectors that keep their width at
//! any zoom.

use std::fmt::Write as _;

use base64::{Engine as _, engine::general_purpose::STANDARD};

use super::scene::{Color, Scene};

/// The longer side of the map on the page [px].
const PAGE_PX: f64 = 1200.0;
/// Height of a line of caption [px].
const LINE_PX: f64 = 20.0;

/// The scene as an SVG document.
pub(crate) fn render(scene: &Scene) -> anyhow::Result<String> {
    let [left, top, width, height] = scene.view;
    let png = super::gray_png(width, height, &scene.gray)?;
    let scale = PAGE_PX / f64::from(width.max(height));
    let (page_w, page_h) = (f64::from(width) * scale, f64::from(height) * scale);
    let caption_h = (scene.caption.len() as f64 + 1.5) * LINE_PX;
    let mut svg = String::new();
    write!(
        svg,
        r#"<svg xmlns="http://www.w3.org/2000/svg" width="{page_w:.0}" height="{:.0}" viewBox="0 0 {page_w:.2} {:.2}">
<rect width="100%" height="100%" fill="white"/>
<g class="map" transform="scale({scale:.6}) translate({} {})" fill="none" stroke-linejoin="round" stroke-linecap="round">
<image x="{left}" y="{top}" width="{width}" height="{height}" preserveAspectRatio="none" style="image-rendering:pixelated" href="data:image/png;base64,{}"/>
"#,
        page_h + caption_h,
        page_h + caption_h,
        -f64::from(left),
        -f64::from(top),
        STANDARD.encode(&png),
    )?;
    for stroke in &scene.strokes {
        svg.push_str("<polyline ");
        if !stroke.layer.is_empty() {
            write!(svg, "class=\"{}\" ", stroke.layer)?;
        }
        svg.push_str("vector-effect=\"non-scaling-stroke\" points=\"");
        for p in &stroke.points {
            write!(svg, "{},{} ", number(p.col), number(p.row))?;
        }
        writeln!(
            svg,
            "\" stroke=\"{}\" stroke-width=\"{}\"/>",
            hex(stroke.color),
            stroke.width_px
        )?;
    }
    for mark in &scene.marks {
        writeln!(
            svg,
            "<circle cx=\"{}\" cy=\"{}\" r=\"{:.4}\" fill=\"{}\"/>",
            number(mark.at.col),
            number(mark.at.row),
            mark.radius_px / scale,
            hex(mark.color)
        )?;
    }
    svg.push_str("</g>\n");
    scale_bar(&mut svg, scene, scale, page_h)?;
    for (line, (color, text)) in (2..).zip(&scene.caption) {
        writeln!(
            svg,
            "<text x=\"8\" y=\"{:.1}\" font-family=\"sans-serif\" font-size=\"14\" fill=\"{}\">{}</text>",
            page_h + f64::from(line) * LINE_PX,
            hex(*color),
            escape(text)
        )?;
    }
    svg.push_str("</svg>\n");
    Ok(svg)
}

/// A bar of a round length in metres.
fn scale_bar(svg: &mut String, scene: &Scene, scale: f64, page_h: f64) -> std::fmt::Result {
    let metres_per_px = scene.resolution() / scale;
    let about = 150.0 * metres_per_px;
    let power = 10f64.powf(about.log10().floor());
    let length = [5.0, 2.0, 1.0]
        .into_iter()
        .map(|m| m * power)
        .find(|l| *l <= about);
    let length = length.unwrap_or(power);
    let px = length / metres_per_px;
    let y = page_h + 0.75 * LINE_PX;
    writeln!(
        svg,
        "<path d=\"M8 {y:.1}h{px:.1}m0 -5v10M8 {:.1}v10\" stroke=\"#1e1e1e\" fill=\"none\"/>\
         <text x=\"{:.1}\" y=\"{:.1}\" font-family=\"sans-serif\" font-size=\"14\">{length} m</text>",
        y - 5.0,
        px + 16.0,
        y + 5.0
    )
}

pub(super) fn hex(color: Color) -> String {
    format!("#{:02x}{:02x}{:02x}", color.0, color.1, color.2)
}

/// A coordinate with at most three decimals: a thousandth of a cell.
pub(super) fn number(value: f64) -> f64 {
    (value * 1000.0).round() / 1000.0
}

/// Text that cannot leave its element: file names may hold anything.
pub(crate) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            c if c.is_control() => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_cannot_leave_its_element() {
        assert_eq!(escape("<a>&\u{1b}[0m"), "&lt;a&gt;&amp;\u{fffd}[0m");
    }
}
