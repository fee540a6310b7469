//! Integration tests.

mod grid;
