"""Writes OpenCV's exact distance transform of little images, checked against SciPy's.

Run from this folder with opencv-python, SciPy and NumPy (written with OpenCV 5.0.0, SciPy 1.17.1).

distance.bin: images one after another: width, height (16 bits each), the image's bits (row-major, first
pixel in the lowest bit, padded to whole bytes), then the squared distance of each pixel (32 bits), all
little-endian. Only background inside the image counts; each image has some.
"""

import pathlib

import cv2
import numpy as np
from scipy.ndimage import distance_transform_edt


def images(rng):
    for width, height in [(1, 1), (1, 9), (9, 1), (5, 7), (16, 16), (33, 20), (64, 10), (65, 12), (129, 6)]:
        for density in (0.5, 0.9, 0.99):
            yield rng.random((height, width)) < density
    for width, height in [(300, 3), (40, 40), (3, 200)]:
        image = np.ones((height, width), bool)
        image[rng.integers(height), rng.integers(width)] = False
        yield image


def main():
    here = pathlib.Path(__file__).parent
    with open(here / "distance.bin", "wb") as file:
        for image in images(np.random.default_rng(1999)):
            if image.all():
                image[0, 0] = False
            height, width = image.shape
            distance = cv2.distanceTransform(image.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
            squared = np.rint(distance.astype(np.float64) ** 2).astype("<u4")
            assert (squared == np.rint(distance_transform_edt(image) ** 2)).all()
            file.write(np.array([width, height], "<u2").tobytes())
            file.write(np.packbits(image.ravel(), bitorder="little").tobytes())
            file.write(squared.tobytes())


if __name__ == "__main__":
    main()
