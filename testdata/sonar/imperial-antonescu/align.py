#!/usr/bin/env python3
"""Turns the three rotating-sonar files of this folder into sonar logs in the arena's frame.

Known: the arena's walls, the waypoint of every file, one reading [cm] a line, about one degree of motor turn a
line, 255 = no echo. Unknown: the sense of the turn and the heading of the first line. Both are estimated here
by ray casting: the expected reading is the shortest distance to a wall within +-BEAM/2 of the axis; the cost of a
heading is the mean absolute error, cut at CUT so that lost echoes (the sensor then repeats its last value) weigh
no more than that. First one sense and one heading for all three files, since it is one robot with one motor, then
every file's heading within +-WINDOW degrees of it, which also takes up the sensor's lag.

No reading is dropped or corrected: held and wrong values stay in the logs.

Writes dense.csv (360 shots a stop), sparse.csv (every 18th line: 20 shots a stop, 18 degrees apart) and arena.csv
(wall segments [m]) beside this script. Needs numpy only.   Run: python3 align.py
"""
import pathlib

import numpy as np

HERE = pathlib.Path(__file__).parent
# wall segments x0, y0, x1, y1 [cm]
ARENA = np.array([[0, 0, 0, 168], [0, 168, 84, 168], [84, 126, 84, 210], [84, 210, 168, 210],
                  [168, 210, 168, 84], [168, 84, 210, 84], [210, 84, 210, 0], [210, 0, 0, 0]], float)
STOPS = {"loc_00": (84, 30), "loc_01": (180, 30), "loc_02": (126, 54)}
BEAM = 30  # full width [deg]
CUT = 8.0  # [cm]
WINDOW = 10  # [deg]
NO_ECHO = 255
SECONDS_A_LINE = 0.05  # nominal: the files carry no time


def cast(x, y, degrees):
    """Distance to the nearest wall along every direction [cm]."""
    a = np.deg2rad(degrees)
    dx, dy = np.cos(a), np.sin(a)
    nearest = np.full(a.shape, np.inf)
    for x0, y0, x1, y1 in ARENA:
        ex, ey = x1 - x0, y1 - y0
        with np.errstate(divide="ignore", invalid="ignore"):
            den = dx * ey - dy * ex
            t = ((x0 - x) * ey - (y0 - y) * ex) / den
            u = ((x0 - x) * dy - (y0 - y) * dx) / den
        hit = (t > 0) & (u >= 0) & (u <= 1)
        nearest = np.where(hit & (t < nearest), t, nearest)
    return nearest


def errors(name, readings):
    """Absolute errors, one row a heading 0..359, for each sense of turn."""
    ranges = cast(*STOPS[name], np.arange(360.0))
    beam = range(-BEAM // 2, BEAM // 2 + 1)
    expected = np.min([np.roll(ranges, k) for k in beam], axis=0)
    lines = np.arange(len(readings))
    return {sense: np.array([np.abs(expected[(h + sense * lines) % 360] - readings) for h in range(360)])
            for sense in (1, -1)}


def main():
    readings = {n: np.loadtxt(HERE / f"{n}.dat") for n in STOPS}
    tables = {n: errors(n, r) for n, r in readings.items()}
    cost = {n: {s: np.minimum(t[s], CUT).mean(axis=1) for s in t} for n, t in tables.items()}
    joint = {s: sum(cost[n][s] for n in STOPS) for s in (1, -1)}
    sense = min(joint, key=lambda s: joint[s].min())
    shared = int(joint[sense].argmin())
    print(f"sense {sense:+d}, shared heading {shared} deg, mean cut error {joint[sense].min() / 3:.2f} cm "
          f"(other sense {joint[-sense].min() / 3:.2f} cm)")
    dense, sparse = ["stamp,x,y,theta,bearing,kind,range"], ["stamp,x,y,theta,bearing,kind,range"]
    stamp = 0.0
    for name, (x, y) in STOPS.items():
        window = [(shared + d) % 360 for d in range(-WINDOW, WINDOW + 1)]
        heading = min(window, key=lambda h: cost[name][sense][h])
        error = tables[name][sense][heading]
        print(f"{name}: heading {heading} deg, median error {np.median(error):.1f} cm, "
              f"within 5 cm {np.mean(error <= 5):.0%}")
        for i, z in enumerate(readings[name]):
            kind = "no_echo" if z >= NO_ECHO else "echo"
            row = (f"{stamp:.2f},{x / 100},{y / 100},{np.deg2rad(heading):.6f},"
                   f"{np.deg2rad(sense * i):.6f},{kind},{z / 100:.2f}")
            dense.append(row)
            if i % 18 == 0:
                sparse.append(row)
            stamp += SECONDS_A_LINE
    (HERE / "dense.csv").write_text("\n".join(dense) + "\n")
    (HERE / "sparse.csv").write_text("\n".join(sparse) + "\n")
    walls = "\n".join(",".join(str(v / 100) for v in w) for w in ARENA)
    (HERE / "arena.csv").write_text(f"x0,y0,x1,y1\n{walls}\n")


if __name__ == "__main__":
    main()
