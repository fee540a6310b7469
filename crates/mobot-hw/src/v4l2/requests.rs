//! What is asked of a camera before and beside its stream: a node's requests, or those of a camera made up for tests.

use rustix::io::Result;

use super::layout::{ControlQuery, ControlValue, Format, FormatDescription, StreamParm};
use super::node::Node;

/// Each changes the value to what holds afterwards.
pub(super) trait Requests {
    fn describe_format(&self, value: &mut FormatDescription) -> Result<()>;
    fn read_format(&self, value: &mut Format) -> Result<()>;
    fn set_format(&self, value: &mut Format) -> Result<()>;
    fn read_parm(&self, value: &mut StreamParm) -> Result<()>;
    fn set_parm(&self, value: &mut StreamParm) -> Result<()>;
    fn query_control(&self, value: &mut ControlQuery) -> Result<()>;
    fn read_control(&self, value: &mut ControlValue) -> Result<()>;
    fn set_control(&self, value: &mut ControlValue) -> Result<()>;
}

impl Requests for Node {
    fn describe_format(&self, value: &mut FormatDescription) -> Result<()> {
        self.describe_format(value)
    }

    fn read_format(&self, value: &mut Format) -> Result<()> {
        self.read_format(value)
    }

    fn set_format(&self, value: &mut Format) -> Result<()> {
        self.set_format(value)
    }

    fn read_parm(&self, value: &mut StreamParm) -> Result<()> {
        self.read_parm(value)
    }

    fn set_parm(&self, value: &mut StreamParm) -> Result<()> {
        self.set_parm(value)
    }

    fn query_control(&self, value: &mut ControlQuery) -> Result<()> {
        self.query_control(value)
    }

    fn read_control(&self, value: &mut ControlValue) -> Result<()> {
        self.read_control(value)
    }

    fn set_control(&self, value: &mut ControlValue) -> Result<()> {
        self.set_control(value)
    }
}

#[cfg(test)]
#[path = "webcam_tests.rs"]
mod tests;
