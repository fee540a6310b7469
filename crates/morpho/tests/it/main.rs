//! Integration tests.
mod distance;
