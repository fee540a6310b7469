#![doc = include_str!("../README.md")]

mod bit_image;
mod components;
pub mod distance;
mod element;
mod fill;
mod gray;
mod grow;
mod ops;
mod pipeline;
pub mod reference;
mod thin;

pub use bit_image::BitImage;
