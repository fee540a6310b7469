#!/usr/bin/env python3
"""Sizes, places and request codes of the kernel's video interface, as a C compiler finds them: videodev2.csv.

Made with gcc 12.2 and linux/videodev2.h of linux-libc-dev 6.1 (GPL-2.0 WITH Linux-syscall-note OR BSD-3-Clause),
x86-64: numbers alone are kept."""

import pathlib
import subprocess
import tempfile

HERE = pathlib.Path(__file__).parent
LAYOUT = """v4l2_capability v4l2_capability.device_caps v4l2_fmtdesc v4l2_fmtdesc.pixelformat v4l2_format
v4l2_format.fmt.pix.width v4l2_format.fmt.pix.bytesperline v4l2_pix_format v4l2_streamparm
v4l2_streamparm.parm.capture.timeperframe v4l2_requestbuffers v4l2_requestbuffers.memory v4l2_buffer
v4l2_buffer.timestamp v4l2_buffer.sequence v4l2_buffer.m v4l2_buffer.length v4l2_queryctrl v4l2_queryctrl.minimum
v4l2_queryctrl.flags v4l2_control""".split()
CODES = """VIDIOC_QUERYCAP VIDIOC_ENUM_FMT VIDIOC_G_FMT VIDIOC_S_FMT VIDIOC_REQBUFS VIDIOC_QUERYBUF VIDIOC_QBUF VIDIOC_DQBUF
VIDIOC_STREAMON VIDIOC_STREAMOFF VIDIOC_G_PARM VIDIOC_S_PARM VIDIOC_G_CTRL VIDIOC_S_CTRL VIDIOC_QUERYCTRL""".split()

lines = []
for name in LAYOUT:
    struct, _, field = name.partition(".")
    value = f"__builtin_offsetof(struct {struct}, {field})" if field else f"sizeof(struct {struct})"
    lines.append(f'printf("{name},%zu\\n", {value});')
for name in CODES:
    lines.append(f'printf("{name},%lu\\n", (unsigned long){name});')
source = "#include <linux/videodev2.h>\n#include <stdio.h>\nint main(void) {\n" + "\n".join(lines) + "\n}\n"
with tempfile.TemporaryDirectory() as folder:
    program = pathlib.Path(folder) / "layout"
    subprocess.run(["cc", "-x", "c", "-", "-o", program], input=source.encode(), check=True)
    table = subprocess.run([program], capture_output=True, check=True).stdout.decode()
(HERE / "videodev2.csv").write_text("name,value\n" + table)
