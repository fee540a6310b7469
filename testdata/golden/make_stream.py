#!/usr/bin/env python3
"""Motion JPEG as other programs write it, and what libjpeg makes of it: stream.mjpeg, stream_luma.png, rgb_grey.csv.

Made with PyAV 18.1 (FFmpeg's libavcodec 62.28), Pillow 13.0 (libjpeg-turbo), OpenCV 5.0.0, NumPy 2.4.

stream.mjpeg: whole frames of WIDTH x HEIGHT, with bytes between some of them: three of FFmpeg's encoder; of
Pillow's: 4:2:0, 4:2:2, 4:4:4, grey, progressive, with restart markers, with a thumbnail in its Exif header; one of
OpenCV's without its Huffman tables, and one with an AVI1 header besides, as cameras send them.
stream_luma.png: the luma of each by libjpeg-turbo, one below the other; of the frames without tables before those
were taken out. rgb_grey.csv: red, green, blue, and the grey of cv2.cvtColor."""

import io
import pathlib
from fractions import Fraction

import av
import cv2
import numpy as np
from PIL import Image

HERE = pathlib.Path(__file__).parent
WIDTH, HEIGHT = 80, 56
random = np.random.default_rng(1999)


def picture(n):
    v, u = np.mgrid[0:HEIGHT, 0:WIDTH].astype(float)
    red = 128 + 100 * np.sin((u + 7 * n) / 9)
    green = 4 * v + n
    blue = np.where((u - 40) ** 2 + (v - 28) ** 2 < (10 + n) ** 2, 230, 40)
    rgb = np.stack([red, green, blue], axis=-1) + random.normal(0, 3, (HEIGHT, WIDTH, 3))
    return np.clip(np.rint(rgb), 0, 255).astype(np.uint8)


def of_ffmpeg(count):
    coder = av.CodecContext.create("mjpeg", "w")
    coder.width, coder.height, coder.pix_fmt = WIDTH, HEIGHT, "yuvj420p"
    coder.time_base = Fraction(1, 30)
    packets = []
    for n in range(count):
        frame = av.VideoFrame.from_ndarray(picture(n), format="rgb24").reformat(format="yuvj420p")
        frame.pts = n
        packets += coder.encode(frame)
    packets += coder.encode(None)
    return [bytes(p) for p in packets]


def of_pillow(n, mode="RGB", **options):
    out = io.BytesIO()
    Image.fromarray(picture(n)).convert(mode).save(out, "JPEG", quality=85, **options)
    return out.getvalue()


def segments(jpeg):
    """(start, end, marker) of each segment before the scan."""
    at = 2
    while True:
        end = at + 2 + int.from_bytes(jpeg[at + 2 : at + 4], "big")
        yield at, end, jpeg[at + 1]
        if jpeg[at + 1] == 0xDA:
            return
        at = end


def without_tables(jpeg):
    drop = [(a, b) for a, b, marker in segments(jpeg) if marker == 0xC4]
    for a, b in reversed(drop):
        jpeg = jpeg[:a] + jpeg[b:]
    return jpeg


def luma(jpeg):
    grey = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_GRAYSCALE)
    assert grey.shape == (HEIGHT, WIDTH)
    return grey


def main():
    thumbnail = of_pillow(20)
    exif = b"Exif\0\0" + thumbnail
    whole = of_ffmpeg(3) + [
        of_pillow(3, subsampling="4:2:0"),
        of_pillow(4, subsampling="4:2:2"),
        of_pillow(5, subsampling="4:4:4"),
        of_pillow(6, mode="L"),
        of_pillow(7, progressive=True),
        of_pillow(8, restart_marker_blocks=2),
        of_pillow(9, exif=exif),
    ]
    plain = [cv2.imencode(".jpg", picture(n))[1].tobytes() for n in (10, 11)]
    bare = [without_tables(jpeg) for jpeg in plain]
    bare[1] = bare[1][:2] + b"\xff\xe0\x00\x10AVI1" + bytes(10) + bare[1][2:]
    between = [b"", b"\0" * 7, b"--boundary\r\nContent-Type: image/jpeg\r\n\r\n", b"\xff\xd8", b"\xff"]
    stream = b""
    for n, jpeg in enumerate(whole + bare):
        stream += between[n % len(between)] + jpeg
    (HERE / "stream.mjpeg").write_bytes(stream)
    cv2.imwrite(str(HERE / "stream_luma.png"), np.vstack([luma(jpeg) for jpeg in whole + plain]))

    rgb = random.integers(0, 256, (1, 500, 3), dtype=np.uint8)
    grey = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)
    rows = np.hstack([rgb[0], grey[0][:, None]]) if grey.ndim == 2 else None
    np.savetxt(HERE / "rgb_grey.csv", rows, "%d", ",")


main()
