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

const STEPS: [&str; 10] = [
    "1. Print at true size (no fitting to the page). The bar above must measure 100 mm.",
    "2. Stand the robot still, camera fixed. Stretch a string straight ahead from below its centre: that is x.",
    "3. Lay the mark, centre on the spot, at a place of the plan; x ahead, y to the left, in metres, to 5 mm.",
    "    Far away it is only a few rows of the picture high: beyond 3 m lay four whole sheets, two dark and two",
    "    light, as the four fields, and use the point where they meet.",
    "4. Take a picture. Read the pixel of the mark's centre, where the four fields meet, to half a pixel",
    "    (u to the right, v down, the centre of the top left pixel is 0, 0).",
    "5. Write a line u,v,x,y to a file whose first line is u,v,x,y. Do so for 20 places and more, 8 at least,",
    "    spread over all of the floor that you will use, its far corners most of all.",
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
        "<path d=\"M55 132h100M55 130v4M155 130v4M105 131v2\" stroke=\"black\" stroke-width=\"0.3\" fill=\"none\"/>\n\
         <text x=\"105\" y=\"138\" font-size=\"4\" text-anchor=\"middle\">100 mm</text>\n\
         <text x=\"12\" y=\"148\" font-size=\"5\" font-weight=\"bold\">Floor mark for mobot calibrate</text>\n",
    );
    for (line, step) in (0..).zip(STEPS) {
        let y = 156.0 + 5.2 * f64::from(line);
        writeln!(
            svg,
            "<text x=\"12\" y=\"{y:.1}\" font-size=\"3.4\" xml:space=\"preserve\">{step}</text>"
        )?;
    }
    plan(&mut svg)?;
    svg.push_str("</svg>\n");
    Ok(svg)
}

/// A disc of four fields, 100 mm wide, with ticks on the lines through its centre.
fn mark(svg: &mut String) -> std::fmt::Result {
    writeln!(
        svg,
        "<g transform=\"translate(105 66)\">\n\
         <circle r=\"50\" fill=\"white\" stroke=\"black\" stroke-width=\"1\"/>\n\
         <path d=\"M0 0L0 -50A50 50 0 0 1 50 0ZM0 0L0 50A50 50 0 0 1 -50 0Z\" fill=\"black\"/>\n\
         <path d=\"M0 -60V-52M0 52V60M-60 0H-52M52 0H60\" stroke=\"black\" stroke-width=\"0.5\"/>\n</g>"
    )
}

/// The suggested places, seen from above, the robot at the bottom.
fn plan(svg: &mut String) -> std::fmt::Result {
    // 10 mm a metre
    let at = |x: f64, y: f64| (140.0 - 10.0 * y, 284.0 - 10.0 * x);
    writeln!(
        svg,
        "<text x=\"12\" y=\"216\" font-size=\"4\" font-weight=\"bold\">Places to lay it</text>"
    )?;
    let (left, base) = at(0.0, 0.0);
    writeln!(
        svg,
        "<path d=\"M{left} {base}V218\" stroke=\"gray\" stroke-width=\"0.2\" stroke-dasharray=\"1 1\"/>\n\
         <rect x=\"{}\" y=\"{base}\" width=\"6\" height=\"5\" fill=\"none\" stroke=\"black\" stroke-width=\"0.4\"/>\n\
         <text x=\"12\" y=\"{}\" font-size=\"3.4\">robot: x 0, y 0</text>",
        left - 3.0,
        base + 3.5
    )?;
    for (x, ys) in ROWS {
        let (_, row) = at(x, 0.0);
        let places = ys.map(|y| y.to_string()).join(", ");
        writeln!(
            svg,
            "<text x=\"12\" y=\"{:.1}\" font-size=\"3.4\">x {x} m: y {places} m</text>",
            row + 1.2
        )?;
        for y in ys {
            let (px, py) = at(x, y);
            writeln!(
                svg,
                "<path d=\"M{} {py}h3M{px} {}v3\" stroke=\"black\" stroke-width=\"0.4\"/>",
                px - 1.5,
                py - 1.5
            )?;
        }
    }
    Ok(())
}
