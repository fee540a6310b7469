#![doc = include_str!("../README.md")]

mod aligned;
mod bit_image;
mod components;
pub mod distance;
mod element;
mod fill;
mod gray;
mod grow;
mod lanes;
mod ledger;
mod levels;
mod ops;
mod pack;
mod pipeline;
mod rectangle;
pub mod reference;
mod square;
pub mod thin;
mod vertical;
mod window;

pub use bit_image::{BitImage, Pixel};
pub use components::{Bounds, Component, Components, euler, holes};
pub use element::{Element, ElementError};
pub use fill::{
    Connectivity, FillWorkspace, fill_holes, reconstruct, reconstruct_into, seed_fill,
    seed_fill_into,
};
pub use gray::{threshold, threshold_into, to_gray};
#[cfg(feature = "image")]
pub use gray::{threshold_image, to_gray_image};
pub use grow::{GrowRule, grow};
pub use ledger::{Change, Difference, Joined, Kinship, Region, Split};
pub use ops::{
    Border, Workspace, close, close_into, dilate, dilate_into, erode, erode_into, open, open_into,
};
pub use pipeline::{
    CleanError, Cleaned, Cleaner, CleanerParams, Entry, Ledger, Stage, Stages, Thinning,
};
