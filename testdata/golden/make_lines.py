#!/usr/bin/env python3
"""Straight edges with known truth, and where OpenCV's detectors place them: lines.png and lines.csv; the
strongest lines of cv2.HoughLines in the frames: hough.csv.

Made with opencv-contrib-python-headless 5.0.0.93 (Apache-2.0), NumPy 2.4, SciPy 1.17.

lines.png is a mosaic of TILES tiles of WIDTH x HEIGHT, each with one straight edge: exact pixel coverage,
Gaussian blur, Gaussian noise. A line of lines.csv, in the coordinates of its tile:
contrast, rho and theta of the truth, of the strongest line of cv2.HoughLines (1 px, 1 degree) in cv2.Canny's
edges (thresholds 0.8 and 1.6 times the contrast), and of the longest segment of cv2's LSD.
A line of hough.csv: frame, theta [degrees], rho [px], votes of cv2.HoughLines in cv2.Canny(50, 150)."""

import pathlib

import cv2
import numpy as np
from scipy.special import ndtr

HERE = pathlib.Path(__file__).parent
WIDTH, HEIGHT, ACROSS, DOWN = 128, 96, 10, 8
FRAMES = ["dbow2-1.png", "dbow2-2.png", "rtabmap-12.png", "vgg-000.png", "york-urban.png"]
random = np.random.default_rng(19990912)


def twice_integrated(x, blur):
    """The normal distribution function of deviation `blur`, integrated twice."""
    z = x / blur
    density = np.exp(-0.5 * z * z) / np.sqrt(2 * np.pi)
    return 0.5 * ((z * z + 1) * ndtr(z) + z * density) * blur * blur


def tile(rho, theta, dark, contrast, blur, noise):
    v, u = np.mgrid[0:HEIGHT, 0:WIDTH].astype(float)
    d = u * np.cos(theta) + v * np.sin(theta) - rho
    # the pixel's square seen along the edge is the convolution of two boxes
    a, b = max(abs(np.cos(theta)), 1e-3), max(abs(np.sin(theta)), 1e-3)
    f = lambda x: twice_integrated(x, blur)
    part = (f(d + (a + b) / 2) - f(d + (a - b) / 2) - f(d - (a - b) / 2) + f(d - (a + b) / 2)) / (a * b)
    picture = dark + contrast * part + random.normal(0, noise, d.shape)
    return np.clip(np.rint(picture), 0, 255).astype(np.uint8)


def normal_form(ends):
    (u1, v1, u2, v2) = (float(x) for x in ends)
    theta = np.arctan2(u2 - u1, v1 - v2) % np.pi
    return u1 * np.cos(theta) + v1 * np.sin(theta), theta


def lines():
    mosaic = np.zeros((DOWN * HEIGHT, ACROSS * WIDTH), np.uint8)
    rows = ["contrast,rho,theta,hough_rho,hough_theta,lsd_rho,lsd_theta"]
    for row in range(DOWN):
        for column in range(ACROSS):
            theta = random.uniform(0, np.pi)
            u, v = WIDTH * random.uniform(0.3, 0.7), HEIGHT * random.uniform(0.3, 0.7)
            rho = u * np.cos(theta) + v * np.sin(theta)
            contrast = random.choice([-1, 1]) * random.uniform(30, 100)
            dark = 70 if contrast > 0 else 190
            picture = tile(rho, theta, dark, contrast, random.uniform(0.5, 1.2), random.uniform(1, 4))
            edges = cv2.Canny(picture, 0.8 * abs(contrast), 1.6 * abs(contrast))
            hough = cv2.HoughLines(edges, 1, np.pi / 180, 20).reshape(-1, 2)[0]
            found = cv2.createLineSegmentDetector().detect(picture)[0].reshape(-1, 4)
            lsd = normal_form(max(found, key=lambda s: np.hypot(s[0] - s[2], s[1] - s[3])))
            numbers = [contrast, rho, theta, *hough, *lsd]
            rows.append(",".join(f"{float(x):.9g}" for x in numbers))
            mosaic[row * HEIGHT :, column * WIDTH :][:HEIGHT, :WIDTH] = picture
    cv2.imwrite(str(HERE / "lines.png"), mosaic, [cv2.IMWRITE_PNG_COMPRESSION, 9])
    (HERE / "lines.csv").write_text("\n".join(rows) + "\n")


def hough():
    rows = ["frame,theta_deg,rho,votes"]
    for name in FRAMES:
        frame = cv2.imread(str(HERE.parent / "frames" / name), cv2.IMREAD_GRAYSCALE)
        found = cv2.HoughLinesWithAccumulator(cv2.Canny(frame, 50, 150), 1, np.pi / 180, 60)
        for rho, theta, votes in found.reshape(-1, 3)[:50]:
            rows.append(f"{name},{round(np.degrees(float(theta)))},{round(float(rho))},{int(votes)}")
    (HERE / "hough.csv").write_text("\n".join(rows) + "\n")


lines()
hough()
