//! The `mobot` command.

fn main() {}
