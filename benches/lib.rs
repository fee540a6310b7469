//! Shared inputs of the benchmarks: real maps at three sizes.
