#!/usr/bin/env python3
"""An independent reader of map_server maps (Pillow, PyYAML, numpy), and the golden values made with it.

  nav2_reader.py synthetic DIR         writes small synthetic maps
  nav2_reader.py golden DIR > FILE     one line a map, mode and rule: size, counts, cells, sha256
  nav2_reader.py read MAP.yaml OUT     writes the int8 grid, row 0 = top of the picture

Rules: ros-navigation/navigation2 a3a97043e, nav2_map_server/src/map_io.cpp, whose pictures pass through
GraphicsMagick (16 bits inside: luma floor(0.299 R + 0.587 G + 0.114 B + 0.5), eight bits by v // 257;
checked against libgraphicsmagick 1.3.40); and ros-planning/navigation, map_server/src/image_loader.cpp.
Values above 100 of ROS 1's raw mode are written as unknown. Made with Pillow 13.0, PyYAML 6.0.3, numpy 2.4.6.
"""
import hashlib
import pathlib
import sys

import numpy as np
import yaml
from PIL import Image

Image.MAX_IMAGE_PIXELS = None


def levels(path):
    """Grey or RGB levels in 16 bits, shape (rows, cols, 1 or 3), and alpha in 16 bits or None."""
    picture = Image.open(path)
    if picture.mode in ("I", "I;16", "I;16B"):
        return np.asarray(picture).astype(np.int64)[..., None], None
    if picture.mode in ("1", "P"):
        picture = picture.convert("RGBA" if "transparency" in picture.info else "RGB" if picture.mode == "P" else "L")
    pixels = np.asarray(picture).astype(np.int64) * 257
    if picture.mode == "L":
        return pixels[..., None], None
    if picture.mode in ("LA", "RGBA"):
        return pixels[..., :-1], pixels[..., -1]
    assert picture.mode == "RGB", picture.mode
    return pixels, None


def read(path, mode=None, rule="nav2"):
    path = pathlib.Path(path)
    keys = yaml.safe_load(path.read_text())
    mode = mode or str(keys.get("mode", "trinary")).lower()
    negate = bool(keys["negate"])
    free, occupied = float(keys["free_thresh"]), float(keys["occupied_thresh"])
    colour, alpha = levels(path.parent / keys["image"])
    if rule == "nav2":
        if colour.shape[2] == 3:
            grey = np.floor(colour @ np.array([0.299, 0.587, 0.114]) + 0.5).astype(np.int64)
        else:
            grey = colour[..., 0]
        grey = grey // 257
        if mode == "raw":
            return np.where(grey <= 100, grey, -1).astype(np.int8)
        dark = grey.astype(np.float32) / np.float32(255)
        if not negate:
            dark = np.float32(1) - dark
        out = np.full(grey.shape, -1, np.int8)
        out[dark >= np.float32(occupied)] = 100
        out[dark <= np.float32(free)] = 0
        if mode == "scale":
            between = (dark > np.float32(free)) & (dark < np.float32(occupied))
            scaled = (dark - np.float32(free)) / np.float32(occupied - free) * np.float32(100)
            out[between] = np.floor(scaled[between] + np.float32(0.5)).astype(np.int8)
        if alpha is not None:
            out[alpha // 257 < 255] = -1
        return out
    channels = [colour[..., i] // 257 for i in range(colour.shape[2])]
    if alpha is not None and mode == "trinary":
        channels.append(alpha // 257)
    mean = sum(channels) / float(len(channels))
    if negate:
        mean = 255 - mean
    if mode == "raw":
        value = np.trunc(mean).astype(np.int64)
        return np.where(value <= 100, value, -1).astype(np.int8)
    dark = (255 - mean) / 255.0
    out = np.full(mean.shape, -1, np.int8)
    if mode == "scale":
        ratio = (dark - free) / (occupied - free)
        spread = np.trunc(1 + 98 * ratio)
        opaque = np.ones(mean.shape, bool) if alpha is None else alpha // 257 >= 1
        between = (dark >= free) & (dark <= occupied) & opaque
        out[between] = spread[between].astype(np.int8)
    out[dark < free] = 0
    out[dark > occupied] = 100
    return out


def golden(folder):
    for path in sorted(pathlib.Path(folder).rglob("*.yaml")):
        if "image" not in (yaml.safe_load(path.read_text()) or {}):
            continue
        for mode in ("trinary", "scale", "raw"):
            for rule in ("nav2", "ros1"):
                grid = read(path, mode, rule)
                rows, cols = grid.shape
                at = [(rows // 3, cols // 4), (rows // 2, cols // 2), (rows - 1, 0), (0, cols - 1)]
                cells = ";".join(f"{r}:{c}:{grid[r, c]}" for r, c in at)
                counts = [(grid == -1).sum(), (grid == 0).sum(), ((grid > 0) & (grid < 100)).sum(), (grid == 100).sum()]
                name = path.relative_to(folder).as_posix()
                digest = hashlib.sha256(grid.tobytes()).hexdigest()
                print(name, mode, rule, cols, rows, *counts, cells, digest)


def synthetic(folder):
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(20090411)
    ramp = np.arange(256, dtype=np.uint8).reshape(16, 16)

    def describe(name, image, negate=0, occupied=0.65, free=0.196, yaw=0.0, mode="trinary"):
        (folder / f"{name}.yaml").write_text(
            f"image: {image}\nmode: {mode}\nresolution: 0.05\norigin: [-1.0, 2.5, {yaw}]\n"
            f"negate: {negate}\noccupied_thresh: {occupied}\nfree_thresh: {free}\n"
        )

    def p5(name, samples, maximum):
        rows, cols = samples.shape
        kind = ">u2" if maximum > 255 else np.uint8
        head = f"P5\n# every level\n{cols} {rows}\n{maximum}\n".encode()
        (folder / name).write_bytes(head + samples.astype(kind).tobytes())

    p5("ramp.pgm", ramp, 255)
    describe("ramp", "ramp.pgm", yaw=0.7)
    describe("ramp_negate", "ramp.pgm", negate="true", yaw=-2.0)
    # thresholds that greys meet exactly: 51/255, 153/255, and 0 and 1
    describe("ramp_on_threshold", "ramp.pgm", occupied=0.6, free=0.2)
    describe("ramp_wide", "ramp.pgm", occupied=1.0, free=0.0, mode="scale")
    describe("ramp_narrow", "ramp.pgm", occupied=0.5, free=0.499)
    p5("wide.pgm", np.arange(0, 65536, 7)[:9216].reshape(72, 128), 65535)
    describe("wide", "wide.pgm")
    describe("wide_negate", "wide.pgm", negate=1, occupied=0.7, free=0.3, mode="scale")
    plain = "\n".join(" ".join(str(v) for v in row) for row in ramp)
    (folder / "plain.pgm").write_text(f"P2 # plain\n16\t16 # size\n\n255\n{plain}\n")
    describe("plain", "plain.pgm")
    plain = " ".join(str(v) for v in range(0, 65536, 257))
    (folder / "plain_wide.pgm").write_text(f"P2\n16 16\n65535\n{plain}\n")
    describe("plain_wide", "plain_wide.pgm", mode="raw")
    for mode, channels in (("LA", 2), ("RGB", 3), ("RGBA", 4)):
        pixels = rng.integers(0, 256, (65, 63, channels), dtype=np.uint8)
        if channels in (2, 4):
            # opaque, transparent, and between
            pixels[..., -1] = rng.choice([255, 255, 255, 254, 1, 0], (65, 63))
        Image.fromarray(pixels, mode).save(folder / f"{mode.lower()}.png")
        describe(mode.lower(), f"{mode.lower()}.png")
    Image.fromarray(rng.integers(0, 256, (9, 7, 3), dtype=np.uint8)).save(folder / "colour.bmp")
    describe("colour_bmp", "colour.bmp", mode="scale", occupied=0.9, free=0.1)
    Image.fromarray(np.arange(0, 65536, 16, dtype=np.uint16).reshape(64, 64)).save(folder / "grey16.png")
    describe("grey16", "grey16.png")
    bits = Image.fromarray(rng.integers(0, 2, (33, 31), dtype=np.uint8) * 255).convert("1")
    bits.save(folder / "bits.png")
    describe("bits", "bits.png")
    indexed = Image.fromarray(rng.integers(0, 256, (24, 40, 3), dtype=np.uint8)).quantize(16)
    indexed.save(folder / "indexed.png")
    describe("indexed", "indexed.png")


if __name__ == "__main__":
    if sys.argv[1] == "synthetic":
        synthetic(sys.argv[2])
    elif sys.argv[1] == "golden":
        golden(sys.argv[2])
    elif sys.argv[1] == "read":
        pathlib.Path(sys.argv[3]).write_bytes(read(sys.argv[2]).tobytes())
    else:
        sys.exit(__doc__)
