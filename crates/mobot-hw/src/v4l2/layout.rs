//! What the kernel's requests carry, as `linux/videodev2.h` lays it out; the tests hold sizes and places against that
//! header. Fields that would make the kernel follow a pointer are private and constant: single-planar capture into
//! mapped memory, nothing else.

use std::ffi::c_ulong;

const CAPTURE: u32 = 1;
const MAPPED: u32 = 1;

pub(super) type Name = [u8; 32];

/// `v4l2_capability`.
#[repr(C)]
#[derive(Debug, Default)]
pub(super) struct Capability {
    pub(super) driver: [u8; 16],
    pub(super) card: Name,
    pub(super) bus: Name,
    pub(super) version: u32,
    pub(super) capabilities: u32,
    pub(super) device_caps: u32,
    reserved: [u32; 3],
}

/// `v4l2_fmtdesc`.
#[repr(C)]
#[derive(Debug)]
pub(super) struct FormatDescription {
    pub(super) index: u32,
    kind: u32,
    flags: u32,
    description: Name,
    pub(super) fourcc: [u8; 4],
    mbus_code: u32,
    reserved: [u32; 3],
}

/// `v4l2_pix_format`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PixFormat {
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) fourcc: [u8; 4],
    pub(super) field: u32,
    pub(super) bytes_per_line: u32,
    pub(super) size_image: u32,
    pub(super) colorspace: u32,
    pub(super) private: u32,
    pub(super) flags: u32,
    pub(super) encoding: u32,
    pub(super) quantization: u32,
    pub(super) transfer: u32,
}

/// `v4l2_format`, of capture.
#[repr(C)]
#[derive(Debug)]
pub(super) struct Format {
    kind: u32,
    align: [c_ulong; 0],
    pub(super) pix: PixFormat,
    rest: [u8; 200 - size_of::<PixFormat>()],
}

/// `v4l2_streamparm`, of capture.
#[repr(C)]
#[derive(Debug)]
pub(super) struct StreamParm {
    kind: u32,
    pub(super) capability: u32,
    mode: u32,
    /// Time per frame [s], as a fraction.
    pub(super) numerator: u32,
    pub(super) denominator: u32,
    rest: [u8; 200 - 16],
}

/// `v4l2_requestbuffers`.
#[repr(C)]
#[derive(Debug)]
pub(super) struct RequestBuffers {
    pub(super) count: u32,
    kind: u32,
    memory: u32,
    capabilities: u32,
    flags: u32,
}

/// `v4l2_buffer`.
#[repr(C)]
#[derive(Debug)]
pub(super) struct Buffer {
    pub(super) index: u32,
    kind: u32,
    pub(super) bytes_used: u32,
    pub(super) flags: u32,
    field: u32,
    pub(super) stamp_s: c_ulong,
    pub(super) stamp_us: c_ulong,
    timecode: [u32; 4],
    pub(super) sequence: u32,
    memory: u32,
    pub(super) offset: u32,
    union_rest: [u8; size_of::<c_ulong>() - 4],
    pub(super) length: u32,
    reserved: [u32; 2],
}

/// `v4l2_queryctrl`.
#[repr(C)]
#[derive(Debug, Default)]
pub(super) struct ControlQuery {
    pub(super) id: u32,
    pub(super) kind: u32,
    pub(super) name: Name,
    pub(super) minimum: i32,
    pub(super) maximum: i32,
    pub(super) step: i32,
    pub(super) default: i32,
    pub(super) flags: u32,
    pub(super) reserved: [u32; 2],
}

/// `v4l2_control`.
#[repr(C)]
#[derive(Debug)]
pub(super) struct ControlValue {
    pub(super) id: u32,
    pub(super) value: i32,
}

impl FormatDescription {
    pub(super) fn at(index: u32) -> Self {
        Self {
            index,
            kind: CAPTURE,
            flags: 0,
            description: [0; 32],
            fourcc: [0; 4],
            mbus_code: 0,
            reserved: [0; 3],
        }
    }
}

impl Format {
    pub(super) fn of(pix: PixFormat) -> Self {
        Self {
            kind: CAPTURE,
            align: [],
            pix,
            rest: [0; 200 - size_of::<PixFormat>()],
        }
    }
}

impl StreamParm {
    pub(super) fn time_per_frame(numerator: u32, denominator: u32) -> Self {
        Self {
            kind: CAPTURE,
            capability: 0,
            mode: 0,
            numerator,
            denominator,
            rest: [0; 184],
        }
    }
}

impl RequestBuffers {
    pub(super) fn mapped(count: u32) -> Self {
        Self {
            count,
            kind: CAPTURE,
            memory: MAPPED,
            capabilities: 0,
            flags: 0,
        }
    }
}

impl Buffer {
    pub(super) fn mapped(index: u32) -> Self {
        Self {
            index,
            kind: CAPTURE,
            bytes_used: 0,
            flags: 0,
            field: 0,
            stamp_s: 0,
            stamp_us: 0,
            timecode: [0; 4],
            sequence: 0,
            memory: MAPPED,
            offset: 0,
            union_rest: [0; size_of::<c_ulong>() - 4],
            length: 0,
            reserved: [0; 2],
        }
    }
}

/// The kind of buffers that streaming is switched on and off for.
pub(super) const STREAMED: u32 = CAPTURE;

#[cfg(test)]
mod tests {
    use std::mem::offset_of;

    use super::*;

    /// Sizes and places that a C compiler found in the kernel's header, for machines of 64 bits.
    #[test]
    #[cfg(target_pointer_width = "64")]
    fn structures_are_the_kernels() {
        let ours = [
            ("v4l2_capability", size_of::<Capability>()),
            (
                "v4l2_capability.device_caps",
                offset_of!(Capability, device_caps),
            ),
            ("v4l2_fmtdesc", size_of::<FormatDescription>()),
            (
                "v4l2_fmtdesc.pixelformat",
                offset_of!(FormatDescription, fourcc),
            ),
            ("v4l2_format", size_of::<Format>()),
            ("v4l2_format.fmt.pix.width", offset_of!(Format, pix)),
            (
                "v4l2_format.fmt.pix.bytesperline",
                offset_of!(Format, pix) + offset_of!(PixFormat, bytes_per_line),
            ),
            ("v4l2_pix_format", size_of::<PixFormat>()),
            ("v4l2_streamparm", size_of::<StreamParm>()),
            (
                "v4l2_streamparm.parm.capture.timeperframe",
                offset_of!(StreamParm, numerator),
            ),
            ("v4l2_requestbuffers", size_of::<RequestBuffers>()),
            (
                "v4l2_requestbuffers.memory",
                offset_of!(RequestBuffers, memory),
            ),
            ("v4l2_buffer", size_of::<Buffer>()),
            ("v4l2_buffer.timestamp", offset_of!(Buffer, stamp_s)),
            ("v4l2_buffer.sequence", offset_of!(Buffer, sequence)),
            ("v4l2_buffer.m", offset_of!(Buffer, offset)),
            ("v4l2_buffer.length", offset_of!(Buffer, length)),
            ("v4l2_queryctrl", size_of::<ControlQuery>()),
            ("v4l2_queryctrl.minimum", offset_of!(ControlQuery, minimum)),
            ("v4l2_queryctrl.flags", offset_of!(ControlQuery, flags)),
            ("v4l2_control", size_of::<ControlValue>()),
        ];
        let theirs = include_str!("../../../../testdata/golden/videodev2.csv");
        let theirs: Vec<_> = theirs.lines().skip(1).collect();
        let ours: Vec<_> = ours.iter().map(|(n, s)| format!("{n},{s}")).collect();
        assert_eq!(theirs[..ours.len()], ours);
    }
}
