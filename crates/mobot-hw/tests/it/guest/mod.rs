//! On a machine with the kernel's virtual camera and a virtual USB serial port: `.ci/vm/run` makes one and runs
//! these there, one at a time.

#[cfg(feature = "serial")]
mod usb_serial;
mod video;
