//! Integration tests.
mod distance;
mod thin;
mod ops;
mod random;
