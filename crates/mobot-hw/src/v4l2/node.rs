//! The camera's node in the file system: requests to the kernel, and the buffers that it shares with us. All unsafe
//! code of the workspace is in this file.

use std::ffi::{c_int, c_void};
use std::os::fd::OwnedFd;
use std::path::Path;
use std::ptr::null_mut;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags};
use rustix::io::{Errno, Result};
use rustix::ioctl::{Opcode, Updater, ioctl, opcode};
use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};

use super::layout::{
    Buffer, Capability, ControlQuery, ControlValue, Format, FormatDescription, RequestBuffers,
    STREAMED, StreamParm,
};

const GROUP: u8 = b'V';

/// An open node.
#[derive(Debug)]
pub(super) struct Node(OwnedFd);

/// A safe method for a request: its code is made from the type that it carries.
macro_rules! requests {
    ($($seen:vis $name:ident($value:ty) = $direction:ident $number:literal;)*) => {
        impl Node {
            $(
                $seen fn $name(&self, value: &mut $value) -> Result<()> {
                    const CODE: Opcode = opcode::$direction::<$value>(GROUP, $number);
                    // SAFETY: `CODE` carries the size of the value, and the kernel touches no byte beyond it. The
                    // value is made of integers, for which all bytes are good. None of these requests lets the
                    // kernel follow a pointer in the value: where one could, `layout` fixes the kind of the value.
                    unsafe { ioctl(&self.0, Updater::<CODE, $value>::new(value)) }
                }
            )*

            #[cfg(test)]
            const CODES: &[(&str, Opcode)] = &[
                $((stringify!($name), opcode::$direction::<$value>(GROUP, $number)),)*
            ];
        }
    };
}

// those that move buffers are for this file alone
requests! {
    pub(super) capability(Capability) = read 0;
    pub(super) describe_format(FormatDescription) = read_write 2;
    pub(super) read_format(Format) = read_write 4;
    pub(super) set_format(Format) = read_write 5;
    request_buffers(RequestBuffers) = read_write 8;
    query_buffer(Buffer) = read_write 9;
    queue_buffer(Buffer) = read_write 15;
    dequeue_buffer(Buffer) = read_write 17;
    stream_on(c_int) = write 18;
    stream_off(c_int) = write 19;
    pub(super) read_parm(StreamParm) = read_write 21;
    pub(super) set_parm(StreamParm) = read_write 22;
    pub(super) read_control(ControlValue) = read_write 27;
    pub(super) set_control(ControlValue) = read_write 28;
    pub(super) query_control(ControlQuery) = read_write 36;
}

impl Node {
    pub(super) fn open(path: &Path) -> Result<Self> {
        let flags = OFlags::RDWR | OFlags::NONBLOCK | OFlags::CLOEXEC;
        rustix::fs::open(path, flags, Mode::empty()).map(Self)
    }

    /// Returns when there may be a frame or a fault, or after `wait`.
    pub(super) fn wait(&self, wait: Duration) -> Result<()> {
        let wait = Timespec::try_from(wait).map_err(|_| Errno::INVAL)?;
        match poll(&mut [PollFd::new(&self.0, PollFlags::IN)], Some(&wait)) {
            Ok(_) | Err(Errno::INTR) => Ok(()),
            Err(error) => Err(error),
        }
    }
}

/// Memory of the driver's, to read.
#[derive(Debug)]
struct Mapping {
    start: *mut c_void,
    length: usize,
}

// SAFETY: memory is mapped for the whole process, not for a thread.
unsafe impl Send for Mapping {}

impl Mapping {
    fn new(node: &Node, buffer: &Buffer) -> Result<Self> {
        let length = buffer.length as usize;
        // SAFETY: the kernel chooses the place, so nothing else is there.
        let start = unsafe {
            mmap(
                null_mut(),
                length,
                ProtFlags::READ,
                MapFlags::SHARED,
                &node.0,
                u64::from(buffer.offset),
            )
        }?;
        Ok(Self { start, length })
    }
}

impl Drop for Mapping {
    fn drop(&mut self) {
        // SAFETY: this is what `mmap` gave, and slices of it borrow `self`.
        let unmapped = unsafe { munmap(self.start, self.length) };
        debug_assert_eq!(unmapped, Ok(()));
    }
}

/// Buffers that the driver fills in turn.
#[derive(Debug)]
pub(super) struct Ring {
    // before the node: unmapped before it is closed
    mappings: Vec<Mapping>,
    node: Node,
    /// Counts up whenever the driver takes all buffers back.
    generation: u64,
}

/// A filled buffer, ours until it is queued again.
#[derive(Debug)]
pub(super) struct Filled {
    buffer: Buffer,
    generation: u64,
}

impl Filled {
    pub(super) fn buffer(&self) -> &Buffer {
        &self.buffer
    }
}

impl Ring {
    /// Asks for so many buffers, of which there may be more or fewer, and starts the stream.
    pub(super) fn start(node: Node, count: u32) -> Result<Self> {
        let mut request = RequestBuffers::mapped(count);
        node.request_buffers(&mut request)?;
        let mut ring = Self {
            mappings: Vec::new(),
            node,
            generation: 0,
        };
        for index in 0..request.count {
            let mut buffer = Buffer::mapped(index);
            ring.node.query_buffer(&mut buffer)?;
            ring.mappings.push(Mapping::new(&ring.node, &buffer)?);
        }
        ring.begin()?;
        Ok(ring)
    }

    pub(super) fn node(&self) -> &Node {
        &self.node
    }

    /// Stops the stream, which gives all buffers back to us, and starts it again.
    pub(super) fn restart(&mut self) -> Result<()> {
        self.generation += 1;
        self.node.stream_off(&mut (STREAMED as c_int))?;
        self.begin()
    }

    fn begin(&self) -> Result<()> {
        for index in 0..self.mappings.len() {
            self.node.queue_buffer(&mut Buffer::mapped(index as u32))?;
        }
        self.node.stream_on(&mut (STREAMED as c_int))
    }

    /// `None` where the driver has filled no other yet.
    pub(super) fn dequeue(&mut self) -> Result<Option<Filled>> {
        let mut buffer = Buffer::mapped(0);
        match self.node.dequeue_buffer(&mut buffer) {
            Ok(()) => Ok(Some(Filled {
                buffer,
                generation: self.generation,
            })),
            Err(Errno::AGAIN | Errno::INTR) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Lets the driver fill it again.
    pub(super) fn requeue(&mut self, filled: Filled) -> Result<()> {
        if filled.generation != self.generation {
            return Ok(()); // queued by the restart
        }
        self.node
            .queue_buffer(&mut Buffer::mapped(filled.buffer.index))
    }

    /// What the driver has filled it with; nothing if the driver has taken it back.
    pub(super) fn bytes<'a>(&'a self, filled: &'a Filled) -> &'a [u8] {
        let mapping = self.mappings.get(filled.buffer.index as usize);
        let Some(mapping) = mapping.filter(|_| filled.generation == self.generation) else {
            return &[];
        };
        let length = mapping.length.min(filled.buffer.bytes_used as usize);
        // SAFETY: the bytes are mapped as long as `self` lives, and within `length`. The driver does not write to a
        // buffer between giving it out and getting it back: `requeue` takes `filled`, `restart` takes `self`
        // mutably and makes a new generation, so neither happens while the slice lives. There is one ring a camera,
        // and `filled` never leaves it.
        unsafe { std::slice::from_raw_parts(mapping.start.cast(), length) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(target_arch = "x86_64")]
    fn requests_are_the_kernels() {
        let table = include_str!("../../../../testdata/golden/videodev2.csv");
        let theirs: Vec<&str> = table
            .lines()
            .filter(|line| line.starts_with("VIDIOC"))
            .collect();
        let names = [
            "QUERYCAP",
            "ENUM_FMT",
            "G_FMT",
            "S_FMT",
            "REQBUFS",
            "QUERYBUF",
            "QBUF",
            "DQBUF",
            "STREAMON",
            "STREAMOFF",
            "G_PARM",
            "S_PARM",
            "G_CTRL",
            "S_CTRL",
            "QUERYCTRL",
        ];
        assert_eq!(Node::CODES.len(), names.len());
        for ((name, (ours, code)), line) in names.iter().zip(Node::CODES).zip(&theirs) {
            assert_eq!(format!("VIDIOC_{name},{code}"), **line, "{ours}");
        }
    }

    #[test]
    fn what_is_no_camera_refuses() {
        let node = Node::open(Path::new("/dev/null")).expect("a device");
        let refused = node.capability(&mut Capability::default());
        assert_eq!(refused, Err(Errno::NOTTY));
        let mut request = RequestBuffers::mapped(4);
        assert!(node.request_buffers(&mut request).is_err());
        assert!(Ring::start(node, 4).is_err());
    }
}
