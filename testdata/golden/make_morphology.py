#!/usr/bin/env python3
"""Writes morphology.pbms: inputs, and what OpenCV, scikit-image and SciPy make of them.

Made with OpenCV 5.0, scikit-image 0.26, SciPy and NumPy. Run in this directory; reads ../maps.
The file is a row of records: a line of text, then a binary PBM (P4, here 1 = foreground).
The line names the input and the work, as tests/it/golden.rs of the crate morpho reads it:
    input NAME
    NAME erode|dilate BORDER ELEMENT          OpenCV, BORDER = neutral, 0 or 1
    NAME open|close ELEMENT                   OpenCV (elements that equal their reflection), neutral border
    NAME fill X Y 4|8                         OpenCV floodFill
    NAME holes 4|8                            SciPy binary_fill_holes; 4|8 = connectivity of the foreground
    NAME grow K all|majority|any              scikit-image block_reduce
    NAME reconstruct 4|8                      scikit-image reconstruction, marker = opening by square-5
and, followed by an empty image,
    NAME components 4|8 AREA,X,Y,W,H ..       OpenCV connectedComponentsWithStats, in the order of first pixels
    NAME euler 4|8 N                          scikit-image euler_number
ELEMENT = rect-W-H, disk-R or mask-AX-AY-ROW-ROW.. with rows of 0 and 1.
"""
import cv2
import numpy as np
from scipy import ndimage
from skimage import measure, morphology

out = open("morphology.pbms", "wb")


def record(line, image=np.zeros((0, 0), bool)):
    image = np.asarray(image, bool)
    h, w = image.shape
    out.write(f"{line}\nP4\n{w} {h}\n".encode() + np.packbits(image, axis=1).tobytes())


def element(name):
    kind, *rest = name.split("-")
    if kind == "rect":
        w, h = map(int, rest)
        return np.ones((h, w), np.uint8), (-1, -1)
    if kind == "disk":
        return morphology.disk(int(rest[0])).astype(np.uint8), (-1, -1)
    mask = np.array([[int(c) for c in row] for row in rest[2:]], np.uint8)
    return mask, (int(rest[0]), int(rest[1]))


SYMMETRIC = ["rect-3-3", "rect-15-15", "rect-5-1", "disk-1", "disk-4", "disk-7"]
ALL = SYMMETRIC + ["rect-2-2", "rect-4-3", "rect-70-6", "mask-0-2-110-010-001", "mask-2-0-10111-00000-01010"]
EIGHT, FOUR = np.ones((3, 3), int), ndimage.generate_binary_structure(2, 1)


def works(name, image):
    record(f"input {name}", image)
    u8 = image.astype(np.uint8) * 255
    for e in ALL:
        kernel, anchor = element(e)
        for border, value in [("neutral", None), ("0", 0), ("1", 255)]:
            how = {} if value is None else {"borderType": cv2.BORDER_CONSTANT, "borderValue": value}
            record(f"{name} erode {border} {e}", cv2.erode(u8, kernel, anchor=anchor, **how) > 0)
            record(f"{name} dilate {border} {e}", cv2.dilate(u8, kernel, anchor=anchor, **how) > 0)
    for e in SYMMETRIC:
        kernel, _ = element(e)
        record(f"{name} open {e}", cv2.morphologyEx(u8, cv2.MORPH_OPEN, kernel) > 0)
        record(f"{name} close {e}", cv2.morphologyEx(u8, cv2.MORPH_CLOSE, kernel) > 0)
    n, labels, stats, _ = cv2.connectedComponentsWithStats(u8, connectivity=8)
    seeds = []
    if n > 1:
        y, x = np.argwhere(labels == 1 + stats[1:, 4].argmax())[0]
        seeds = [(int(x), int(y))]
        y, x = np.argwhere(image)[-1]
        seeds.append((int(x), int(y)))
    for x, y in seeds:
        for c in (4, 8):
            filled = u8.copy()
            cv2.floodFill(filled, None, (x, y), 128, flags=c)
            record(f"{name} fill {x} {y} {c}", filled == 128)
    marker = cv2.morphologyEx(u8, cv2.MORPH_OPEN, np.ones((5, 5), np.uint8)) > 0
    for c, structure, dual in [(4, FOUR, EIGHT), (8, EIGHT, FOUR)]:
        record(f"{name} holes {c}", ndimage.binary_fill_holes(image, structure=dual))
        rebuilt = morphology.reconstruction(marker & image, image, footprint=structure) > 0
        record(f"{name} reconstruct {c}", rebuilt)
        n, labels, stats, _ = cv2.connectedComponentsWithStats(u8, connectivity=c)
        first = sorted(range(1, n), key=lambda i: int(np.flatnonzero(labels == i)[0]))
        parts = [",".join(str(int(stats[i][k])) for k in (4, 0, 1, 2, 3)) for i in first]
        record(f"{name} components {c} " + " ".join(parts))
        record(f"{name} euler {c} {measure.euler_number(image, connectivity=1 if c == 4 else 2)}")
    for k in (2, 3, 5):
        count = measure.block_reduce(image.astype(int), (k, k), np.sum)
        record(f"{name} grow {k} all", count == k * k)
        record(f"{name} grow {k} majority", 2 * count > k * k)
        record(f"{name} grow {k} any", count > 0)


def crop(path, x, y, w, h, free):
    return cv2.imread(f"../maps/{path}", cv2.IMREAD_GRAYSCALE)[y : y + h, x : x + w] >= free


rng = np.random.default_rng(1999)
works("willow", crop("turtlebot_apps/willow-2010-02-18-0.10.pgm", 200, 260, 129, 80, 250))
works("intel", crop("utexas_gdc/intel.pgm", 180, 200, 128, 70, 250))
works("specks", rng.random((41, 65)) < 0.6)
works("blobs", ndimage.gaussian_filter(rng.random((50, 127)), 2.0) > 0.5)
works("column", rng.random((40, 1)) < 0.7)
works("full", np.ones((9, 64), bool))
