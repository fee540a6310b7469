#!/usr/bin/env python3
"""Gray PNG files of frames whose originals are JPEG, so that every decoder gives the same pixels.

  make_frames.py FOLDER    FOLDER holds the originals under the names below

Pillow 13.0 decodes and converts (ITU-R 601 luma)."""

import pathlib
import sys

from PIL import Image

HERE = pathlib.Path(__file__).parent
FRAMES = {
    "rtabmap-corridor/8.jpg": "rtabmap-08.png",
    "rtabmap-corridor/12.jpg": "rtabmap-12.png",
    "rtabmap-corridor/19.jpg": "rtabmap-19.png",
    "rtabmap-corridor/20.jpg": "rtabmap-20.png",
    "rtabmap-corridor/34.jpg": "rtabmap-34.png",
    "york-urban/P1020829.jpg": "york-urban.png",
    "opencv-chessboard/left01.jpg": "opencv-left01.png",
    "opencv-lines/building.jpg": "opencv-building.png",
}

for source, name in FRAMES.items():
    Image.open(pathlib.Path(sys.argv[1]) / source).convert("L").save(HERE / name, optimize=True)
