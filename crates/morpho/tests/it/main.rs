//! Integration tests.
mod distance;
mod thin;
