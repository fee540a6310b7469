#!/usr/bin/env python3
"""A third opinion on route graphs: the clearance of every edge, by brute force, in numpy.

Reads a map as Nav2's map_server reads it (Pillow, PyYAML) and a route graph (json), shares no code with
the Rust side, and needs no search structure: the distance of a segment to *every* cell square that is not
free and could matter. Distance of a segment and a square that do not meet = least distance between a
vertex of one and the other; they meet where no axis (x, y, the segment's normal) separates them.

    verify_graph.py GRAPH.geojson MAP.yaml [--radius R] [--unknown-free] [--csv]

prints, for every edge, id, true clearance [m] and what it claims, worst first; exit status 1 where an edge
is under the radius or claims more than the truth (1e-9 m of rounding allowed).

tb3_route_clearance.csv, which the tests compare with, was made by
    verify_graph.py ../maps/nav2/route/turtlebot3_graph.geojson ../maps/nav2/route/tb3_sandbox.yaml --csv
(numpy 2, Pillow, PyYAML).
"""
import argparse
import json
import math
import os
import sys

import numpy as np
import yaml
from PIL import Image


def read_map(path):
    """(not-free mask with row 0 = top, unknown mask, resolution, origin) by Nav2's rules, trinary and scale."""
    with open(path, encoding="utf-8") as handle:
        meta = yaml.safe_load(handle)
    Image.MAX_IMAGE_PIXELS = None
    image = Image.open(os.path.join(os.path.dirname(path), meta["image"]))
    grey, alpha = np.asarray(image), None
    if image.mode == "P":
        image = image.convert("RGBA" if "transparency" in image.info else "RGB")
        grey = np.asarray(image)
    if grey.ndim == 3:
        colours = grey.shape[2]
        if colours in (2, 4):
            alpha = grey[..., -1]
        grey = grey[..., 0] if colours == 2 else grey[..., :3].mean(axis=2)
    if image.mode == "1":
        grey = grey.astype(np.float64) * 255.0
    grey = grey.astype(np.float64)
    if image.mode.startswith("I"):
        grey = grey / 257.0
    negate = bool(int(meta.get("negate", 0)))
    p = grey / 255.0 if negate else (255.0 - grey) / 255.0
    occupied = p >= float(meta["occupied_thresh"])
    free = ~occupied & (p <= float(meta["free_thresh"]))
    if alpha is not None:
        free &= alpha == 255
        occupied &= alpha == 255
    if meta.get("mode", "trinary") == "raw":
        raise SystemExit("raw maps are not read here")
    return ~free, ~free & ~occupied, float(meta["resolution"]), [float(v) for v in meta["origin"]]


def read_graph(path):
    """(id, polyline in the map frame, claim) of every edge: drawn line joined to its nodes."""
    with open(path, encoding="utf-8") as handle:
        features = json.load(handle)["features"]
    nodes = {f["properties"]["id"]: f["geometry"]["coordinates"][:2]
             for f in features if f["geometry"]["type"] == "Point"}
    edges = []
    for feature in features:
        if feature["geometry"]["type"] not in ("LineString", "MultiLineString"):
            continue
        properties = feature["properties"]
        drawn = feature["geometry"].get("coordinates") or []
        if drawn and isinstance(drawn[0][0], list):
            drawn = [p for part in drawn for p in part]
        line = [nodes[properties["startid"]], *(p[:2] for p in drawn), nodes[properties["endid"]]]
        edges.append((properties["id"], np.array(line, dtype=float), properties.get("clearance")))
    return edges


def to_cells(points, height, resolution, origin):
    """Map frame to grid coordinates [cells]: column to the right, row down from the top."""
    x0, y0, yaw = origin
    c, s = math.cos(yaw), math.sin(yaw)
    dx, dy = points[:, 0] - x0, points[:, 1] - y0
    return np.stack([(c * dx + s * dy) / resolution, height - (c * dy - s * dx) / resolution], axis=1)


def segment_to_squares(a, b, col, row):
    """Distances [cells] of one segment to unit squares with the given top left corners."""
    d = b - a
    n = float(d @ d)

    def point_to_squares(p):
        dx = np.maximum(np.maximum(col - p[0], p[0] - (col + 1)), 0)
        dy = np.maximum(np.maximum(row - p[1], p[1] - (row + 1)), 0)
        return np.hypot(dx, dy)

    best = np.minimum(point_to_squares(a), point_to_squares(b))
    sides = []
    for i in (0, 1):
        for j in (0, 1):
            px, py = col + i - a[0], row + j - a[1]
            t = np.clip((px * d[0] + py * d[1]) / n, 0, 1) if n > 0 else 0.0
            best = np.minimum(best, np.hypot(px - t * d[0], py - t * d[1]))
            sides.append(d[0] * py - d[1] * px)
    sides = np.array(sides)
    low, high = np.minimum(a, b), np.maximum(a, b)
    meet = ((col + 1 >= low[0]) & (col <= high[0]) & (row + 1 >= low[1]) & (row <= high[1])
            & (sides.min(axis=0) <= 0) & (sides.max(axis=0) >= 0))
    best[meet] = 0
    return best


def clearance(line, blocked):
    """Clearance [cells] of a polyline in grid coordinates."""
    height, width = blocked.shape
    margin = np.minimum(np.minimum(line[:, 0], width - line[:, 0]), np.minimum(line[:, 1], height - line[:, 1]))
    least = max(float(margin.min()), 0.0)
    for a, b in zip(line[:-1], line[1:]):
        low, high = np.minimum(a, b), np.maximum(a, b)
        reach = 2.0
        while least > 0:
            # the cells of a window; what is outside it is at least `reach` away
            reach = min(reach, least)
            c0, r0 = (max(int(math.floor(v - reach)) - 1, 0) for v in low)
            c1, r1 = (int(math.ceil(v + reach)) + 1 for v in high)
            rows, cols = np.nonzero(blocked[r0:r1, c0:c1])
            here = math.inf
            if len(rows):
                here = float(segment_to_squares(a, b, (cols + c0).astype(float), (rows + r0).astype(float)).min())
            least = min(least, max(here, 0.0)) if here <= reach or reach >= least else least
            if here <= reach or reach >= least:
                break
            reach *= 2
    return least


def verify(graph_path, map_path, unknown_free=False):
    """[(clearance [m], id, claim)] worst first."""
    not_free, unknown, resolution, origin = read_map(map_path)
    blocked = not_free & ~unknown if unknown_free else not_free
    found, known = [], {}
    for identifier, line, claim in read_graph(graph_path):
        cells = to_cells(line, blocked.shape[0], resolution, origin)
        key = min(cells.tobytes(), cells[::-1].tobytes())
        if key not in known:
            known[key] = clearance(cells, blocked) * resolution
        found.append((known[key], identifier, claim))
    return sorted(found, key=lambda item: (item[0], item[1]))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("graph")
    parser.add_argument("map")
    parser.add_argument("--radius", type=float, default=0.0)
    parser.add_argument("--unknown-free", action="store_true")
    parser.add_argument("--csv", action="store_true")
    arguments = parser.parse_args()
    edges = verify(arguments.graph, arguments.map, arguments.unknown_free)
    short = [e for e in edges if e[0] < arguments.radius - 1e-9 or e[0] <= 1e-9]
    boasts = [e for e in edges if e[2] is not None and e[2] > e[0] + 1e-9]
    gaps = sorted(e[0] - e[2] for e in edges if e[2] is not None)
    if arguments.csv:
        print("id,clearance")
        for distance, identifier, _ in sorted(edges, key=lambda e: e[1]):
            print(f"{identifier},{distance!r}")
    else:
        for distance, identifier, claim in short[:20]:
            print(f"edge {identifier}: clearance {distance:.6f} m, claims {claim}")
        for distance, identifier, claim in boasts[:20]:
            print(f"edge {identifier}: claims {claim}, truth {distance}")
        print(f"{len(edges)} edges, {len(short)} under {arguments.radius} m, {len(boasts)} claims above the truth, "
              f"least {edges[0][0] if edges else None} m" + (
                  f"; truth - claim: median {gaps[len(gaps) // 2]:.3g}, 99 % {gaps[int(0.99 * (len(gaps) - 1))]:.3g}, "
                  f"most {gaps[-1]:.3g} m" if gaps else ""))
    return 1 if short or boasts else 0


if __name__ == "__main__":
    sys.exit(main())
