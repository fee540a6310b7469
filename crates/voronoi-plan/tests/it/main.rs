//! Integration tests.

mod check;
mod clearance;
mod completeness;
#[cfg(feature = "geojson")]
mod geojson;
mod graph;
mod hostile;
mod paper;
mod plan;
#[cfg(feature = "geojson")]
mod planted;
mod prune;
mod random;
mod straight;

/// Whether the long forms of the tests were asked for.
fn long() -> bool {
    std::env::var_os("MOBOT_LONG").is_some()
}
