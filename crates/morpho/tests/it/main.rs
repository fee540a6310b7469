//! Integration tests.
mod distance;
mod ops;
mod random;
mod thin;
mod fill;
