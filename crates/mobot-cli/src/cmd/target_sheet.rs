//! A sheet to print for calibrating: a mark for the floor, where to lay it, and what to do.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::{Context as _, bail};

use crate::output::write_whole;
use crate::picture::{Format, format_of};

/// Where the instructions suggest to lay the mark, x forward and y to the left of the robot [m].
const ROWS: [(f64, [f64; 4]); 5] = [
    (1.5, [0.6, 0.2, -0.2, -0.6]),
    (2.0, [0.8, 0.3, -0.3, -0.8]),
    (3.0, [1.2, 0.4, -0.4, -1.2]),
    (4.5, [1.6, 0.5, -0.5, -1.6]),
    (6.0, [1.6, 0.5, -0.5, -1.6]),
];

const STEPS: [&str; 8] = [
    "1. Print at true size (no fitting to the page). The bar above must measure 100 mm.",
    "2. Stand the robot still, camera fixed. Stretch a string straight ahead from below its centre: that is x.",
    "3. Lay the mark, centre on the spot, at a place of the plan; x ahead, y to the left, in metres, to 5 mm.",
    "4. Take a picture. Read the pixel of the mark's centre, where the four fields meet, to half a pixel",
    "    (u to the right, v down, the centre of the top left pixel is 0, 0).",
    "5. Write a line u,v,x,y to a file whose first line is u,v,x,y. Do so for 20 places and more;",
    "    8 at least. Spread them over all of the floor that you will use, its far corners most of all.",
    "6. mobot calibrate PAIRS.csv -o CAMERA.json --image PICTURE.png --picture CHECK.svg",
];

/// Writes the sheet.
pub(super) fn write(path: &Path) -> anyhow::Result<()> {
    if format_of(path)? != Format::Svg {
        bail!("{}: expected a sheet name ending in .svg", path.display());
    }
    write_whole(path, sheet()?.as_bytes()).with_context(|| format!("{}", path.display()))
}

/// A4, in millimetres.
fn sheet() -> Result<String, std::fmt::Error> {
    let mut svg = String::from(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"210mm\" height=\"297mm\" viewBox=\"0 0 210 297\" font-family=\"sans-serif\">\n\
         <rect width=\"210\" height=\"297\" fill=\"white\"/>\n",
    );
    mark(&mut svg)?;
    svg.push_str(
        "<path d=\"M55 153h100M55 151v4M155 151v4M105 152v2\" stroke=\"black\" stroke-width=\"0.3\" fill=\"none\"/>\n\
         <text x=\"105\" y=\"160\" font-size=\"4\" text-anchor=\"middle\">100 mm</text>\n\
         <text x=\"12\" y=\"170\" font-size=\"5\" font-weight=\"bold\">Floor mark for mobot calibrate</text>\n",
    );
    for (line, step) in (0..).zip(STEPS) {
        let y = 178.0 + 5.2 * f64::from(line);
        writeln!(
            svg,
            "<text x=\"12\" y=\"{y:.1}\" font-size=\"3.4\" xml:space=\"preserve\">{step}</text>"
        )?;
    }
    plan(&mut svg)?;
    svg.push_str("</svg>\n");
    Ok(svg)
}

/// A disc of four fields, 120 mm wide, with ticks on the lines through its centre.
fn mark(svg: &mut String) -> std::fmt::Result {
    writeln!(
        svg,
        "<g transform=\"translate(105 78)\">\n\
         <circle r=\"60\" fill=\"white\" stroke=\"black\" stroke-width=\"1\"/>\n\
         <path d=\"M0 0L0 -60A60 60 0 0 1 60 0ZM0 0L0 60A60 60 0 0 1 -60 0Z\" fill=\"black\"/>\n\
         <path d=\"M0 -70V-62M0 62V70M-70 0H-62M62 0H70\" stroke=\"black\" stroke-width=\"0.5\"/>\n</g>"
    )
}

/// The suggested places, seen from above, the robot at the bottom.
fn plan(svg: &mut String) -> std::fmt::Result {
    // 10 mm a metre
    let at = |x: f64, y: f64| (105.0 - 22.0 * y, 286.0 - 9.5 * x);
    writeln!(
        svg,
        "<text x=\"12\" y=\"227\" font-size=\"4\" font-weight=\"bold\">Places to lay it (x ahead, y to the left, m)</text>"
    )?;
    let (left, base) = at(0.0, 0.0);
    writeln!(
        svg,
        "<path d=\"M{left} {base}V226\" stroke=\"gray\" stroke-width=\"0.2\" stroke-dasharray=\"1 1\"/>\n\
         <rect x=\"{}\" y=\"{base}\" width=\"10\" height=\"6\" fill=\"none\" stroke=\"black\" stroke-width=\"0.4\"/>\n\
         <text x=\"{}\" y=\"{}\" font-size=\"3\">robot, x = 0, y = 0</text>",
        left - 5.0,
        left + 7.0,
        base + 4.0
    )?;
    for (x, ys) in ROWS {
        for y in ys {
            let (px, py) = at(x, y);
            writeln!(
                svg,
                "<path d=\"M{} {py}h3M{px} {}v3\" stroke=\"black\" stroke-width=\"0.4\"/>\n\
                 <text x=\"{}\" y=\"{}\" font-size=\"2.6\">{x}, {y}</text>",
                px - 1.5,
                py - 1.5,
                px + 2.0,
                py - 0.8
            )?;
        }
    }
    Ok(())
}
