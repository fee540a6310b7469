//! A noisy picture of two rooms through the cleaning chain, each stage printed with its ledger page.

use std::io::Write;

use morpho::{BitImage, CleanError, Cleaner, CleanerParams, Stage};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let cleaned = clean()?;
    let mut out = std::io::stdout().lock();
    for (entry, stage) in cleaned.ledger.entries.iter().zip(Stage::ALL) {
        writeln!(
            out,
            "\n{}: {} free in {} parts with {} holes; -{} +{}",
            stage.name(),
            entry.free_cells,
            entry.free_components,
            entry.holes,
            entry.removed.pixels,
            entry.added.pixels
        )?;
        for region in &entry.components.vanished {
            writeln!(
                out,
                "  a part of {} vanished at ({}, {})",
                region.area, region.first.x, region.first.y
            )?;
        }
        for split in &entry.components.split {
            writeln!(
                out,
                "  the part at ({}, {}) split into {}",
                split.from.first.x,
                split.from.first.y,
                split.into.len()
            )?;
        }
        writeln!(out, "{:?}", cleaned.stages.get(stage))?;
    }
    Ok(())
}

/// Two rooms and a door, a blob outside, and one pixel in thirty wrong.
fn clean() -> Result<morpho::Cleaned, CleanError> {
    let mut noise = 1_u32;
    let free = BitImage::from_fn(96, 36, |x, y| {
        noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let rooms = (3..33).contains(&y) && ((3..42).contains(&x) || (48..78).contains(&x));
        let door = (12..21).contains(&y) && (42..48).contains(&x);
        let blob = (24..30).contains(&y) && (84..92).contains(&x);
        (rooms || door || blob) != (noise >> 16).is_multiple_of(30)
    });
    Cleaner::new(CleanerParams {
        closing_side: 5,
        ..CleanerParams::default()
    })
    .clean(free)
}
