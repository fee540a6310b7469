//! A roadmap over a small map, drawn in the terminal.
#![expect(clippy::print_stdout, reason = "an example speaks to the terminal")]

use morpho::BitImage;
use occgrid::{MapFrame, Pose2};
use voronoi_plan::{FreeSpace, GraphParams, NodeKind, VoronoiGraph};

const MAP: [&str; 17] = [
    "############################################",
    "#............#.............................#",
    "#............#.............................#",
    "#............#.............................#",
    "#..........................................#",
    "#..........................................#",
    "#..........................#########.......#",
    "#............#.............#########.......#",
    "#............#.............#########.......#",
    "######...#####.............#########.......#",
    "######...#####.............................#",
    "######...#####.............................#",
    "#............#.............................#",
    "#............#.............................#",
    "#............###########...#################",
    "#............###########...................#",
    "############################################",
];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (width, height) = (MAP[0].len(), MAP.len());
    let cells = BitImage::from_fn(width, height, |x, y| MAP[y].as_bytes()[x] == b'.');
    let frame = MapFrame::new(width as u32, height as u32, 0.25, Pose2::default())?;
    let params = GraphParams {
        radius: 0.35,
        ..GraphParams::default()
    };
    let graph = VoronoiGraph::build(&FreeSpace::new(frame, cells), &params)?;

    let mut picture: Vec<Vec<u8>> = MAP.iter().map(|row| row.replace('.', " ").into()).collect();
    let mut put = |point, letter| {
        if let Some(cell) = frame.cell_at(point) {
            picture[cell.row as usize][cell.col as usize] = letter;
        }
    };
    for arc in &graph.arcs {
        arc.polyline.iter().for_each(|&point| put(point, b'.'));
    }
    for node in &graph.nodes {
        put(
            node.point,
            if node.kind == NodeKind::End {
                b'e'
            } else {
                b'o'
            },
        );
    }
    for row in picture {
        println!("{}", String::from_utf8(row)?);
    }
    println!(
        "{} nodes, {} arcs, {} cycles, {:.2} m in all; no arc nearer than {:.3} m to a wall",
        graph.nodes.len(),
        graph.arcs.len(),
        graph.cycles(),
        graph.total_length(),
        graph.min_clearance().unwrap_or(f64::INFINITY),
    );
    Ok(())
}
