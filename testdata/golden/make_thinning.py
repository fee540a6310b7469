"""Writes what OpenCV's ximgproc.thinning makes of hostile little images and of real maps.

Run from this folder with opencv-contrib-python and NumPy; the first line of thinning_maps.txt names
the versions that wrote the files. Free (foreground) in a map is grey >= 250.

thinning.bin: images one after another: width, height (a byte each), then three bit planes (the image,
Zhang-Suen, Guo-Hall), row-major, first pixel in the lowest bit, each plane padded to whole bytes.
thinning_maps.txt: a map a line: path, width, height, then for Zhang-Suen and Guo-Hall the count of
pixels left and the FNV-1a hash (64 bits) of the result's bytes (0 or 1, row-major).
"""

import pathlib

import cv2
import numpy as np

MAPS = [
    "aws/small-house/map.pgm",
    "cob_environments/ipa-apartment/map.pgm",
    "nav2/depot.pgm",
    "turtlebot_apps/willow-2010-02-18-0.10.pgm",
    "utexas_gdc/intel.pgm",
]
KINDS = [cv2.ximgproc.THINNING_ZHANGSUEN, cv2.ximgproc.THINNING_GUOHALL]


def thinned(image):
    return [(cv2.ximgproc.thinning(image * 255, thinningType=k) > 0).astype(np.uint8) for k in KINDS]


def fnv(data):
    value = 0xCBF29CE484222325
    for byte in data:
        value = ((value ^ byte) * 0x100000001B3) & 0xFFFFFFFFFFFFFFFF
    return value


def little_images(rng):
    sides = [1, 2, 3, 4, 5, 6, 7, 9, 16, 17, 33]
    for width in sides:
        for height in sides:
            for density in (0.5, 0.8, 0.95):
                yield (rng.random((height, width)) < density).astype(np.uint8)
    for width, height in [(63, 20), (64, 20), (65, 20), (129, 18), (70, 40)] * 4:
        blobs = cv2.GaussianBlur(rng.random((height, width)), (0, 0), 2)
        yield (blobs > np.quantile(blobs, 0.4)).astype(np.uint8)


def main():
    here = pathlib.Path(__file__).parent
    with open(here / "thinning.bin", "wb") as file:
        for image in little_images(np.random.default_rng(1999)):
            height, width = image.shape
            file.write(bytes([width, height]))
            for plane in [image, *thinned(image)]:
                file.write(np.packbits(plane.ravel(), bitorder="little").tobytes())
    with open(here / "thinning_maps.txt", "w") as file:
        file.write(f"# opencv-contrib {cv2.__version__}, numpy {np.__version__}\n")
        for name in MAPS:
            grey = cv2.imread(str(here.parent / "maps" / name), cv2.IMREAD_UNCHANGED)
            free = (grey >= 250).astype(np.uint8)
            results = " ".join(f"{r.sum()} {fnv(r.tobytes()):016x}" for r in thinned(free))
            file.write(f"{name} {free.shape[1]} {free.shape[0]} {results}\n")


if __name__ == "__main__":
    main()
