"""Times peers and ours in alternation and compares their outputs; called by `run`."""

import argparse
import ctypes
import glob
import json
import math
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time

import cv2
import networkx
import numpy as np
import scipy
import skimage
import skimage.measure
import skimage.morphology
import sknw
from importlib.metadata import version

cv2.setNumThreads(1)

# Robot of the map_to_graph row, in cells of the map: 0.25 m at 0.05 m a cell.
RADIUS_CELLS = 5
FREE_FROM = 250
# Works on camera frames rather than the map, and the frames' rows and columns.
FRAME_WORKS = ("canny", "hough", "segments")
FRAME_SHAPE = (480, 640)


class Worker:
    """Our side: a process that holds the map and does one piece of work a line."""

    def __init__(self, program, folder):
        self.process = subprocess.Popen(
            [program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self.folder = folder

    def ask(self, line):
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        answer = self.process.stdout.readline().split()
        if not answer or answer[0] != "ok":
            raise RuntimeError(f"{line}: {answer}")
        return answer[1:]

    def times_ms(self, work, count=1):
        """Times of that many calls in a row."""
        return [float(ms) for ms in self.ask(f"time {work} {count}")]

    def output(self, work, dtype, shape):
        path = os.path.join(self.folder, work)
        self.ask(f"dump {work} {path}")
        data = np.fromfile(path, dtype)
        os.remove(path)
        return data.reshape(shape)


def timed(work):
    start = time.perf_counter()
    result = work()
    return (time.perf_counter() - start) * 1e3, result


class Row:
    """One peer at one piece of work. `work` does it once; `agrees` compares its result with ours."""

    def __init__(self, work, peer, peer_version, do, agrees, note=""):
        self.work, self.peer, self.peer_version = work, peer, peer_version
        self.do, self.agrees, self.note = do, agrees, note


def same_partition(ours, theirs):
    """Whether two label images part the foreground alike (labels may be named differently)."""
    if not np.array_equal(ours == 0, theirs == 0):
        return False
    pairs = np.unique(np.stack([ours.ravel(), theirs.ravel().astype(ours.dtype)]), axis=1)
    return len(np.unique(pairs[0])) == len(np.unique(pairs[1])) == pairs.shape[1]


def close(ours, theirs):
    """Within 5 %."""
    return abs(ours - theirs) <= 0.05 * max(ours, theirs)


def topology(image):
    """Components (8) and holes (4-connected background that does not reach the outside)."""
    image = np.pad(image > 0, 1)
    return (
        skimage.measure.label(image, connectivity=2).max(),
        skimage.measure.label(~image, connectivity=1).max() - 1,
    )


class Leptonica:
    """The library that tesserocr's wheel carries, called directly: 1-bit images, 32 pixels a word."""

    def __init__(self, bits):
        import tesserocr

        libs = os.path.join(os.path.dirname(os.path.dirname(tesserocr.__file__)), "tesserocr.libs")
        (path,) = glob.glob(os.path.join(libs, "libleptonica*")) or glob.glob(
            os.path.join(os.path.dirname(tesserocr.__file__), "**", "libleptonica*"), recursive=True
        )
        lib = self.lib = ctypes.CDLL(path)
        pointer, integer = ctypes.c_void_p, ctypes.c_int
        lib.getLeptonicaVersion.restype = ctypes.c_char_p
        self.version = lib.getLeptonicaVersion().decode().split("-")[-1]
        for name, arguments in {
            "pixCreate": [integer] * 3,
            "pixErodeBrick": [pointer, pointer, integer, integer],
            "pixDilateBrick": [pointer, pointer, integer, integer],
            "pixOpenBrick": [pointer, pointer, integer, integer],
        }.items():
            getattr(lib, name).argtypes = arguments
            getattr(lib, name).restype = pointer
        lib.pixGetData.argtypes, lib.pixGetData.restype = [pointer], pointer
        lib.pixGetWpl.argtypes, lib.pixGetWpl.restype = [pointer], integer
        self.height, self.width = bits.shape
        self.source, self.out = self.image(), self.image()
        words = np.packbits(bits > 0, axis=1).reshape(self.height, -1, 4)[:, :, ::-1]
        self.view(self.source)[:] = np.ascontiguousarray(words).reshape(self.height, -1)

    def image(self):
        return self.lib.pixCreate(self.width, self.height, 1)

    def view(self, pix):
        count = self.lib.pixGetWpl(pix) * 4 * self.height
        data = (ctypes.c_uint8 * count).from_address(self.lib.pixGetData(pix))
        return np.frombuffer(data, np.uint8).reshape(self.height, -1)

    def brick(self, name, side):
        getattr(self.lib, name)(self.out, self.source, side, side)
        return self.out

    def bits(self, pix):
        words = self.view(pix).reshape(self.height, -1, 4)[:, :, ::-1].reshape(self.height, -1)
        return np.unpackbits(words, axis=1)[:, : self.width] * np.uint8(255)


def opencv_rows(gray, bits, seed):
    square = lambda n: np.ones((n, n), np.uint8)
    y, x = np.mgrid[-7:8, -7:8]
    disk = (x * x + y * y <= 49).astype(np.uint8)
    out = np.empty_like(bits)
    equal = lambda ours, theirs: np.array_equal(ours, theirs)
    cv = lambda work, do, agrees=equal, note="": Row(work, "OpenCV", cv2.__version__, do, agrees, note)

    def flood():
        picture = bits.copy()
        start = time.perf_counter()
        cv2.floodFill(picture, None, seed, 128, flags=8)
        flood.ms = (time.perf_counter() - start) * 1e3
        return np.where(picture == 128, 255, 0).astype(np.uint8)

    def graph():
        free = cv2.threshold(gray, FREE_FROM - 1, 255, cv2.THRESH_BINARY)[1]
        free = cv2.copyMakeBorder(free, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=0)
        clearance = cv2.distanceTransform(free, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        skeleton = skimage.morphology.skeletonize(clearance >= RADIUS_CELLS + 0.5)
        network = sknw.build_sknw(skeleton.astype(np.uint16), multi=True)
        for _, _, arc in network.edges(data=True):
            points = arc["pts"]
            arc["clearance"] = clearance[points[:, 0], points[:, 1]].min() if len(points) else 0.0
        return network

    distance = lambda: cv2.distanceTransform(bits, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return [
        cv("erode_3x3", lambda: cv2.erode(bits, square(3), dst=out)),
        cv("dilate_3x3", lambda: cv2.dilate(bits, square(3), dst=out)),
        cv("open_3x3", lambda: cv2.morphologyEx(bits, cv2.MORPH_OPEN, square(3), dst=out)),
        cv("open_15x15", lambda: cv2.morphologyEx(bits, cv2.MORPH_OPEN, square(15), dst=out)),
        cv("open_disk7", lambda: cv2.morphologyEx(bits, cv2.MORPH_OPEN, disk, dst=out)),
        cv(
            "threshold_pack",
            lambda: cv2.threshold(gray, FREE_FROM - 1, 255, cv2.THRESH_BINARY, dst=out)[1],
        ),
        cv("seed_fill", flood),
        cv(
            "components",
            lambda: cv2.connectedComponents(bits, connectivity=8, ltype=cv2.CV_32S)[1],
            same_partition,
            "ours: label of every run; label image not written",
        ),
        cv(
            "components_image",
            lambda: cv2.connectedComponents(bits, connectivity=8, ltype=cv2.CV_32S)[1],
            same_partition,
            "ours writes the 32-bit label image too",
        ),
        cv(
            "distance",
            distance,
            # OpenCV's result is a 32-bit float: squared distances are exact up to its rounding.
            lambda ours, theirs: np.array_equal(ours, np.rint(theirs.astype(np.float64) ** 2)),
        ),
        cv(
            "thin_zs",
            lambda: cv2.ximgproc.thinning(bits, thinningType=cv2.ximgproc.THINNING_ZHANGSUEN),
        ),
        Row(
            "map_to_graph",
            "OpenCV + scikit-image + sknw",
            f"{cv2.__version__} + {skimage.__version__} + {version('sknw')}",
            graph,
            None,
            "",
        ),
    ]


def canny_rows(frame, corridor):
    out = np.empty_like(frame)

    def row(work, image, l2):
        do = lambda: cv2.Canny(image, 50, 150, edges=out, L2gradient=l2)
        return Row(work, "OpenCV", cv2.__version__, do, np.array_equal, "")

    return [
        row("canny", frame, False),
        row("canny_l2", frame, True),
        row("canny_corridor", corridor, False),
    ]


def normal_forms(segments):
    """rho at the picture's middle and theta of rows (u1, v1, u2, v2)."""
    u1, v1, u2, v2 = np.asarray(segments, float).reshape(-1, 4).T
    theta = np.arctan2(u2 - u1, v1 - v2) % np.pi
    return np.stack([(u1 - 320) * np.cos(theta) + (v1 - 240) * np.sin(theta), theta], 1)


def hough_rows(frame, corridor):
    edges = cv2.Canny(frame, 50, 150)
    fast = cv2.ximgproc.createFastLineDetector()
    drawing = cv2.ximgproc.createEdgeDrawing()
    lsd = cv2.createLineSegmentDetector()

    def edge_drawing(image):
        drawing.detectEdges(image)
        return drawing.detectLines()

    def strongest(ours, theirs):
        """The five strongest lines of OpenCV are among ours, to a bin or two."""
        theirs = theirs.reshape(-1, 2)[:5]
        near = lambda l: (abs(ours[:, 0] - l[0]) < 4.5) & (abs(ours[:, 1] - l[1]) < 0.06)
        return all(near(line).any() for line in theirs)

    def longest(ours, theirs):
        """Our ten longest segments lie on lines of the peer, whose own choice of contrasts is wider."""
        order = np.argsort(-np.hypot(*(ours[:, :2] - ours[:, 2:]).T))
        theirs = normal_forms(theirs)
        near = lambda l: (abs(theirs[:, 0] - l[0]) < 4) & (abs(theirs[:, 1] - l[1]) < 0.05)
        return sum(near(line).any() for line in normal_forms(ours[order[:10]])) >= 8

    angle = np.pi / 180
    cv = lambda work, peer, do, agrees: Row(work, peer, cv2.__version__, do, agrees, "")
    lines = lambda: cv2.HoughLines(edges, 1, angle, 100)
    rows = [
        cv("hough_standard", "OpenCV HoughLines", lines, strongest),
        cv("hough_modified", "OpenCV HoughLines", lines, lambda ours, _: len(ours) > 5),
        cv(
            "hough_modified",
            "OpenCV HoughLinesP",
            lambda: cv2.HoughLinesP(edges, 1, angle, 50, minLineLength=30, maxLineGap=5),
            lambda ours, _: len(ours) > 5,
        ),
    ]
    for work, image in [("segments", frame), ("segments_corridor", corridor)]:
        rows += [
            cv(work, "OpenCV EdgeDrawing", lambda image=image: edge_drawing(image), longest),
            cv(work, "OpenCV FastLineDetector", lambda image=image: fast.detect(image), longest),
            cv(work, "OpenCV LSD", lambda image=image: lsd.detect(image)[0], longest),
        ]
    return rows


def skimage_rows(bits):
    binary = bits > 0
    return [
        Row(
            "thin_homotopic",
            "scikit-image skeletonize",
            skimage.__version__,
            lambda: skimage.morphology.skeletonize(binary),
            lambda ours, theirs: topology(ours) == topology(theirs) == topology(binary),
            "agree: components and holes of both equal the map's",
        ),
    ]


def leptonica_rows(bits):
    peer = Leptonica(bits)

    def row(work, name, side):
        # Leptonica erodes from the picture's edge, OpenCV and ours do not: the margin is left out.
        inner = np.s_[side:-side, side:-side]
        agrees = lambda ours, theirs: np.array_equal(ours[inner], peer.bits(theirs)[inner])
        note = f"agree: without the outer {side} pixels, where the border rules differ"
        return Row(work, "Leptonica", peer.version, lambda: peer.brick(name, side), agrees, note)

    return [
        row("erode_3x3", "pixErodeBrick", 3),
        row("dilate_3x3", "pixDilateBrick", 3),
        row("open_3x3", "pixOpenBrick", 3),
        row("open_15x15", "pixOpenBrick", 15),
    ]


# Works whose peer is Rust and runs inside the worker: work id, our name, the peer's, label.
IN_WORKER = [
    ("erode_3x3", "imageproc", "imageproc_erode_3x3"),
    ("open_3x3", "imageproc", "imageproc_open_3x3"),
    ("components", "imageproc", "imageproc_components"),
    ("distance", "imageproc", "imageproc_distance"),
    ("canny_l2", "imageproc", "imageproc_canny"),
    ("hough_standard", "imageproc", "imageproc_hough"),
    ("sonar_update", "plain loop (exp, atan2)", "plain_sonar_update"),
]


def agreement(row, worker, theirs, shape):
    """Compares outputs once, outside the timing."""
    if row.work == "map_to_graph":
        # The two count a cell's clearance differently (to the obstacle's edge, to its centre) and prune
        # differently: compared are the connected parts and the independent cycles.
        _, _, parts, cycles, length = worker.ask("graph_figures")
        their_parts = networkx.number_connected_components(theirs)
        their_cycles = theirs.number_of_edges() - theirs.number_of_nodes() + their_parts
        their_length = sum(arc["weight"] for _, _, arc in theirs.edges(data=True))
        row.note = (
            f"parts {parts} / {their_parts}, cycles {cycles} / {their_cycles}, "
            f"length {float(length):.0f} / {their_length:.0f} cells"
        )
        return close(int(parts), their_parts) and close(int(cycles), their_cycles)
    dtype = np.uint32 if row.work in ("components", "components_image", "distance") else np.uint8
    if row.work.startswith("hough"):
        dtype, shape = np.float64, (-1, 3)
    elif row.work.startswith("segments"):
        dtype, shape = np.float64, (-1, 4)
    ours = worker.output(row.work, dtype, shape)
    return bool(row.agrees(ours, theirs))


def in_turns(first_ms, rounds, peer_times, our_times):
    """Medians of blocks of calls in turn, the same number on both sides. A block of short work is some
    calls long, so that either side finds its own data in the caches, not the other's."""
    block = 7 if first_ms < 20 else 3 if first_ms < 500 else 1
    rounds = max(3, min(rounds, int(20_000 / max(first_ms * block, 1))))
    peer_ms, our_ms = [], []
    for _ in range(rounds):
        peer_ms += peer_times(block)
        our_ms += our_times(block)
    return our_ms, peer_ms


def measure(row, worker, rounds, shape):
    def peer_once():
        ms, result = timed(row.do)
        return getattr(row.do, "ms", ms), result

    first_ms, theirs = peer_once()
    agree = agreement(row, worker, theirs, shape)
    del theirs
    worker.times_ms(row.work)
    our_ms, peer_ms = in_turns(
        first_ms,
        rounds,
        lambda count: [peer_once()[0] for _ in range(count)],
        lambda count: worker.times_ms(row.work, count),
    )
    return finished(row.work, row.peer, row.peer_version, our_ms, peer_ms, agree, row.note, shape)


def measure_in_worker(work, peer, name, worker, rounds, shape):
    agree = worker.ask(f"agree {work} {name}")[0] == "true"
    peer_version = worker.ask(f"version {name}")[0]
    worker.times_ms(work)
    (first_ms,) = worker.times_ms(name)
    our_ms, peer_ms = in_turns(
        first_ms,
        rounds,
        lambda count: worker.times_ms(name, count),
        lambda count: worker.times_ms(work, count),
    )
    return finished(work, peer, peer_version, our_ms, peer_ms, agree, "", shape)


def measure_alone(worker, rounds, shape):
    """From frame to pose, which no peer does: compared is the pose with where the frame was taken."""
    off, turned, status = worker.ask("pose_error")
    off_cm, turned_deg = 100 * float(off), math.degrees(float(turned))
    agree = status == "ok" and off_cm < 3 and turned_deg < 0.5
    note = f"no peer; status {status}, {off_cm:.2f} cm and {turned_deg:.3f} degrees off the truth"
    worker.times_ms("frame_to_pose", 7)
    our_ms = [ms for _ in range(rounds) for ms in worker.times_ms("frame_to_pose", 7)]
    return finished("frame_to_pose", "none", "", our_ms, None, agree, note, shape)


def finished(work, peer, peer_version, ours_ms, peer_ms, agree, note, shape):
    """A row; without times of a peer it has neither those nor a ratio."""
    ours = statistics.median(ours_ms)
    theirs = statistics.median(peer_ms) if peer_ms else None
    row = {
        "work": work,
        "size": f"{shape[1]}x{shape[0]}",
        "ours_ms": ours,
        "peer": peer,
        "peer_version": peer_version,
        "peer_ms": theirs,
        "ratio": theirs / ours if peer_ms else None,
        "agree": agree,
        "rounds": len(ours_ms),
        "note": note,
    }
    their_column = f"{theirs:>11.3f} {row['ratio']:>8.1f}x" if peer_ms else f"{'-':>11} {'-':>9}"
    print(
        f"{work:<17} {peer:<29} {ours:>10.3f} {their_column}  "
        f"{'agree' if agree else 'DIFFER':<7} {note}",
        flush=True,
    )
    return row


def main():
    parser = argparse.ArgumentParser(prog="run")
    parser.add_argument("worker")
    parser.add_argument("--json")
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--only", help="work ids, comma-separated")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        worker = Worker(options.worker, folder)
        width, height = (int(v) for v in worker.ask("size"))
        shape = (height, width)
        gray = worker.output("map", np.uint8, shape)
        bits = np.where(gray >= FREE_FROM, 255, 0).astype(np.uint8)
        seed = tuple(int(v) for v in worker.ask("seed"))
        wanted = set(options.only.split(",")) if options.only else None
        chosen = lambda work: wanted is None or work in wanted
        print(
            f"{'work':<17} {'peer':<29} {'ours [ms]':>10} {'peer [ms]':>11} {'ratio':>9}", flush=True
        )
        rows = []
        frame, corridor = (
            worker.output(name, np.uint8, FRAME_SHAPE) for name in ("frame", "frame_corridor")
        )
        shape_of = lambda work: FRAME_SHAPE if work.startswith(FRAME_WORKS) else shape
        peers = (
            opencv_rows(gray, bits, seed)
            + skimage_rows(bits)
            + leptonica_rows(bits)
            + canny_rows(frame, corridor)
            + hough_rows(frame, corridor)
        )
        for row in peers:
            if chosen(row.work):
                rows.append(measure(row, worker, options.rounds, shape_of(row.work)))
        for work, peer, name in IN_WORKER:
            if chosen(work):
                rows.append(
                    measure_in_worker(work, peer, name, worker, options.rounds, shape_of(work))
                )
        if chosen("frame_to_pose"):
            rows.append(measure_alone(worker, options.rounds, FRAME_SHAPE))
    if options.json:
        machine = {
            "processor": platform.processor() or cpu_name(),
            "system": platform.platform(),
            "python": platform.python_version(),
        }
        with open(options.json, "w") as file:
            json.dump({"machine": machine, "rows": rows}, file, indent=1)
            file.write("\n")
    if not all(row["agree"] for row in rows):
        sys.exit("some outputs differ: see the rows above")


def cpu_name():
    with open("/proc/cpuinfo") as file:
        return next((l.split(":")[1].strip() for l in file if l.startswith("model name")), "?")


if __name__ == "__main__":
    main()
