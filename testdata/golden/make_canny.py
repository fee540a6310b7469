#!/usr/bin/env python3
"""Edges that cv2.Canny (aperture 3) finds in made-up pictures and in the frames: canny.txt and canny/*.png.

Made with opencv-contrib-python-headless 5.0.0.93 (Apache-2.0), NumPy 2.4; the same file came out with
Intel IPP switched on and off, and of opencv-python-headless 4.12.0.88 (see `python3 make_canny.py --check`).

A line of canny.txt is `picture seed width height norm low high count hash`: the name of a kind of made-up
picture (see `picture`) or of a file in frames/, the thresholds, and how many edge pixels there are with the
wrapping sum of mix(row * width + column) over them."""

import pathlib
import sys

import cv2
import numpy as np

HERE = pathlib.Path(__file__).parent
FRAMES = HERE.parent / "frames"
U64 = np.uint64
SIDES = [1, 2, 3, 5, 17, 31, 32, 33, 63, 64, 65, 66, 96, 127, 128, 129, 200]
KINDS = ["noise", "faint", "binary", "blocks", "ramp", "waves", "dots", "flat", "disk"]
CASES = 2000
# frames whose whole picture of edges is kept: name, low, high, norm
WHOLE = [("dbow2-2.png", 100, 200, "L1"), ("rtabmap-20.png", 60, 180, "L2"), ("vgg-000.png", 50, 150, "L1")]


def mix(value):
    """splitmix64's finalizer."""
    with np.errstate(over="ignore"):
        value = (np.asarray(value, U64) + U64(0x9E3779B97F4A7C15)).astype(U64)
        value = (value ^ (value >> U64(30))) * U64(0xBF58476D1CE4E5B9)
        value = (value ^ (value >> U64(27))) * U64(0x94D049BB133111EB)
        return value ^ (value >> U64(31))


def picture(kind, seed, width, height):
    """Whole-number arithmetic only, so that any language makes the same."""
    v, u = np.mgrid[0:height, 0:width].astype(np.int64)
    random = mix(np.int64(seed) * 1_000_003 + v * width + u)
    byte = (random & U64(255)).astype(np.int64)
    low = seed % 7
    if kind == "noise":
        out = byte
    elif kind == "faint":
        out = 100 + byte % (2 + seed % 14)
    elif kind == "binary":
        out = byte % 2 * 255
    elif kind == "blocks":
        side = 3 + seed % 9
        out = (mix(seed * 7919 + v // side * 1009 + u // side) & U64(255)).astype(np.int64)
    elif kind == "ramp":
        out = (u * (1 + seed % 5) + v * (seed % 11) + byte % (1 + low)) & 255
    elif kind == "waves":
        phase = (u * (3 + seed % 29) + v * (seed % 31)) // 8 % 128
        out = np.minimum(phase, 127 - phase) * 3 + byte % (1 + low)
    elif kind == "dots":
        out = np.where(byte % 17 == 0, ((random >> U64(8)) & U64(255)).astype(np.int64), 0)
    elif kind == "flat":
        out = np.full((height, width), seed % 256)
    else:
        radius = 1 + seed % (1 + max(width, height) // 2)
        inside = (u - width // 2) ** 2 + (v - height // 2) ** 2 < radius * radius
        out = np.where(inside, 200, 60) + byte % (1 + low)
    return out.astype(np.uint8)


def thresholds(kind, r):
    """A pair of whole eighths, or of finer binary fractions for the kinds of little contrast."""
    style = r % 8
    a, b = (r >> 8) % 2400, (r >> 24) % 2400
    if kind in ("faint", "waves", "flat"):
        return a / 64, b / 32
    if style == 0:
        return a - 1200.0, b - 1200.0
    if style == 1:
        return a / 8, b / 8
    if style == 2:
        return float(a), float(a)
    if style == 3:
        return float(a % 100), float(b % 400)
    if style == 4:
        return 0.0, float(b)
    if style == 5:
        return a / 8 + 0.5, 40_000.0 + b
    if style == 6:
        return float(b % 300 + a % 100), float(b % 300)
    return float(a % 600), float(b)


def line(name, seed, gray, low, high, norm):
    edges = cv2.Canny(gray, low, high, L2gradient=norm == "L2")
    assert set(np.unique(edges)) <= {0, 255}
    at = np.flatnonzero(edges).astype(U64)
    with np.errstate(over="ignore"):
        total = int(np.sum(mix(at), dtype=U64))
    height, width = gray.shape
    return f"{name} {seed} {width} {height} {norm} {low} {high} {len(at)} {total:016x}"


def lines():
    for case in range(CASES):
        r = int(mix(case))
        kind = KINDS[case % len(KINDS)]
        width, height = SIDES[(r >> 4) % len(SIDES)], SIDES[(r >> 12) % len(SIDES)]
        low, high = thresholds(kind, int(mix(r)))
        norm = "L2" if r % 2 else "L1"
        yield line(kind, case, picture(kind, case, width, height), low, high, norm)
    for path in sorted(FRAMES.glob("*.png")):
        gray = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        assert gray.ndim == 2 and gray.dtype == np.uint8, path
        for norm in ("L1", "L2"):
            for low, high in [(50.0, 150.0), (100.0, 200.0), (0.0, 0.0), (20.5, 33.25), (300.0, 80.0)]:
                yield line(path.name, 0, gray, low, high, norm)


def main():
    text = "\n".join(lines()) + "\n"
    if "--check" in sys.argv:
        sys.exit(text != (HERE / "canny.txt").read_text())
    (HERE / "canny.txt").write_text(text)
    (HERE / "canny").mkdir(exist_ok=True)
    for name, low, high, norm in WHOLE:
        gray = cv2.imread(str(FRAMES / name), cv2.IMREAD_UNCHANGED)
        edges = cv2.Canny(gray, low, high, L2gradient=norm == "L2")
        out = HERE / "canny" / f"{pathlib.Path(name).stem}-{norm}-{low}-{high}.png"
        cv2.imwrite(str(out), edges, [cv2.IMWRITE_PNG_BILEVEL, 1, cv2.IMWRITE_PNG_COMPRESSION, 9])


if __name__ == "__main__":
    main()
