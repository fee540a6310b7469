#!/usr/bin/env python3
"""Converts the RoboND corridor log to the CSV that `mobot map` reads.

measurement.txt: `timestamp r0 .. r7`, mm, 5110 = no echo. poses.txt: `timestamp x y theta`, mm and 0.1 degree.
The eight sensors sit at the robot's centre (axes from the course's code). Usage: convert.py [FOLDER]
"""
import math
import pathlib
import sys

BEARINGS_DEG = [-90, -37.5, -22.5, -7.5, 7.5, 22.5, 37.5, 90]
NO_ECHO_MM = 5110
LISTENED_M = 5.0  # z_max of the course
TOO_CLOSE_MM = 170  # z_min of the course

folder = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path(__file__).parent / "udacity-robond"
ranges = [line.split() for line in (folder / "measurement.txt").read_text().splitlines() if line.strip()]
poses = [line.split() for line in (folder / "poses.txt").read_text().splitlines() if line.strip()]
assert [r[0] for r in ranges] == [p[0] for p in poses], "the two files differ in their stamps"
with open(folder / "log.csv", "w", newline="\n") as out:
    out.write("stamp,x,y,theta,bearing,kind,range\n")
    for row, (stamp, x, y, theta) in zip(ranges, poses):
        pose = f"{int(stamp) / 1000:.3f},{float(x) / 1000:.4f},{float(y) / 1000:.4f},{math.radians(float(theta) / 10):.6f}"
        for bearing, value in zip(BEARINGS_DEG, map(int, row[1:])):
            if value >= NO_ECHO_MM:
                kind, distance = "no_echo", LISTENED_M
            elif value < TOO_CLOSE_MM:
                kind, distance = "too_close", value / 1000
            else:
                kind, distance = "echo", value / 1000
            out.write(f"{pose},{math.radians(bearing):.6f},{kind},{distance:g}\n")
