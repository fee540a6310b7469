//! Integration tests.

mod check;
#[cfg(feature = "geojson")]
mod geojson;
mod clearance;
mod graph;
mod hostile;
mod paper;
mod random;

/// Whether the long forms of the tests were asked for.
fn long() -> bool {
    std::env::var_os("MOBOT_LONG").is_some()
}
