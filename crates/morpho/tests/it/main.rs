//! Integration tests.
mod distance;
mod fill;
mod golden;
mod ops;
mod pipeline;
mod random;
mod thin;
