"""Foreign witnesses for the simulated world: where a camera sees a point (OpenCV), whether a pixel shows
floor, and how far a ray or a cone reaches in plan (Shapely).

Reads ../worlds/*.toml and builds its own model of them. Writes sim_pixels.csv, sim_floor.csv and
sim_ranges.csv beside this file.
Run with opencv-python, Shapely and NumPy (written with OpenCV 5.0.0, Shapely 2.2.0, NumPy 2.4.6).
"""

import math
import pathlib
import tomllib

import cv2
import numpy as np
from shapely import LineString, Point, Polygon, affinity, unary_union

HERE = pathlib.Path(__file__).parent
WORLDS = ["office", "sketch", "hall"]
rng = np.random.default_rng(20)


# ---- the camera, with OpenCV ------------------------------------------------------------------------
def rotation(axis, angle):
    vector = np.zeros(3)
    vector[axis] = angle
    return cv2.Rodrigues(vector)[0]


def map_from_camera(pose, mount, tilt, yaw, roll):
    """Rotation and position of the optical frame (right, down, forward) in the map."""
    optical = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    base = rotation(2, pose[2])
    turn = base @ rotation(2, yaw) @ rotation(1, tilt) @ optical @ rotation(2, roll)
    return turn, np.array([pose[0], pose[1], 0.0]) + base @ np.array(mount)


def project(kind, k, d, turn, position, points):
    world_to_camera = turn.T
    rvec = cv2.Rodrigues(world_to_camera)[0]
    tvec = -world_to_camera @ position
    points = np.asarray(points, dtype=float).reshape(-1, 1, 3)
    if kind == "fisheye":
        return cv2.fisheye.projectPoints(points, rvec, tvec, k, np.array(d[:4]))[0].reshape(-1, 2)
    return cv2.projectPoints(points, rvec, tvec, k, np.array(d))[0].reshape(-1, 2)


def pixels():
    rows = ["kind,fx,fy,cx,cy,d0,d1,d2,d3,d4,height,x,y,yaw,tilt,roll,base_x,base_y,theta,px,py,pz,u,v"]
    for kind in ["none", "plumb_bob", "fisheye"]:
        done = 0
        while done < 120:
            fx, fy = rng.uniform(200, 700, 2)
            cx, cy = rng.uniform(150, 400, 2)
            d = np.zeros(5)
            if kind == "plumb_bob":
                d = np.array([rng.uniform(-0.3, 0.1), rng.uniform(-0.02, 0.05), *rng.uniform(-0.003, 0.003, 2), rng.uniform(-0.005, 0.005)])
            if kind == "fisheye":
                d = np.array([*rng.uniform(-0.03, 0.03, 2), *rng.uniform(-0.004, 0.004, 2), 0.0])
            pose = [*rng.uniform(-20, 20, 2), rng.uniform(-3, 3)]
            mount = [*rng.uniform(-0.3, 0.3, 2), rng.uniform(0.2, 1.6)]
            yaw, tilt, roll = rng.uniform(-0.5, 0.5), rng.uniform(-0.2, 1.2), rng.uniform(-0.1, 0.1)
            turn, position = map_from_camera(pose, mount, tilt, yaw, roll)
            # a point in front of the camera: up to 38 degrees off the axis, with a fisheye up to 75
            off, around = rng.uniform(0, math.radians(75 if kind == "fisheye" else 38)), rng.uniform(0, math.tau)
            ray = np.array([math.sin(off) * math.cos(around), math.sin(off) * math.sin(around), math.cos(off)])
            point = position + turn @ (ray * rng.uniform(0.5, 8))
            k = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])
            u, v = project(kind, k, d, turn, position, [point])[0]
            numbers = [fx, fy, cx, cy, *d, mount[2], mount[0], mount[1], yaw, tilt, roll, *pose, *point, u, v]
            rows.append(kind + "," + ",".join(f"{n:.12g}" for n in numbers))
            done += 1
    (HERE / "sim_pixels.csv").write_text("\n".join(rows) + "\n")


# ---- the world, with Shapely ------------------------------------------------------------------------
def solids(world):
    """Every upright prism as (footprint, bottom, top), people apart."""
    out = []
    ceiling = world.get("ceiling", 2.6)
    for wall in world["walls"]:
        (ax, ay), (bx, by) = wall["from"], wall["to"]
        thick, top = wall.get("thickness", 0.12), wall.get("height", 0) or ceiling
        length, angle = math.hypot(bx - ax, by - ay), math.atan2(by - ay, bx - ax)

        def place(polygon):
            turned = affinity.rotate(polygon, angle, origin=(0, 0), use_radians=True)
            return affinity.translate(turned, ax, ay)

        def piece(a, b):
            return place(Polygon([(a, -thick / 2), (b, -thick / 2), (b, thick / 2), (a, thick / 2)]))

        begin = -thick / 2
        for door in sorted(wall.get("doors", []), key=lambda d: d["at"]):
            near, far = door["at"], door["at"] + door.get("width", 0.9)
            high = door.get("height", 2.05)
            out.append((piece(begin, near), 0.0, top))
            out.append((piece(near, far), high, top))
            begin = far
            hinge = door.get("hinge", "near")
            if hinge == "none":
                continue
            sign = 1 if door.get("swing", "left") == "left" else -1
            # shut: flush with the face it opens to, 4 cm thick
            leaf = Polygon([(near, sign * thick / 2), (far, sign * thick / 2), (far, sign * (thick / 2 - 0.04)), (near, sign * (thick / 2 - 0.04))])
            pivot = (near if hinge == "near" else far, sign * thick / 2)
            turn = sign * (1 if hinge == "near" else -1) * door.get("open_deg", 0)
            out.append((place(affinity.rotate(leaf, turn, origin=pivot)), 0.0, high))
        out.append((piece(begin, length + thick / 2), 0.0, top))
    for box in world.get("boxes", []):
        (x, y), (w, h) = box["at"], box.get("size", [0.5, 0.5])
        shape = Polygon([(x - w / 2, y - h / 2), (x + w / 2, y - h / 2), (x + w / 2, y + h / 2), (x - w / 2, y + h / 2)])
        shape = affinity.rotate(shape, box.get("yaw_deg", 0), origin=(x, y))
        out.append((shape, box.get("bottom", 0.0), box.get("height", 0.75)))
    for disc in world.get("cylinders", []):
        circle = Point(disc["at"]).buffer(disc.get("radius", 0.2), quad_segs=2000)
        out.append((circle, 0.0, disc.get("height", 0.75)))
    return out


def free_place(things, room):
    """A random place of the plan with room around it, indoors."""
    everything = unary_union([shape for shape, bottom, _ in things if bottom < 1.2])
    x0, y0, x1, y1 = everything.bounds
    while True:
        p = Point(rng.uniform(x0, x1), rng.uniform(y0, y1))
        if everything.distance(p) > room:
            return p.x, p.y


def shows_floor(things, camera, point):
    """Whether nothing stands between the camera and a point on the floor."""
    eye, floor = np.array(camera), np.array([*point, 0.0])
    line = LineString([eye[:2], floor[:2]])
    for shape, bottom, top in things:
        inside = line.intersection(shape)
        if inside.is_empty:
            continue
        ways = [Point(c).distance(Point(eye[:2])) for g in getattr(inside, "geoms", [inside]) for c in g.coords]
        heights = [eye[2] * (1 - w / line.length) for w in ways]
        if min(heights) < top and max(heights) > bottom:
            return False
    return True


def floor():
    rows = ["world,camera,x,y,theta,u,v,floor"]
    cameras = {
        "paper": (480, 220, 450.0, math.radians(24)),
        "vga": (640, 480, 560.0, math.radians(28)),
    }
    for name in WORLDS:
        things = solids(tomllib.loads((HERE / f"../worlds/{name}.toml").read_text()))
        for _ in range(12):
            x, y = free_place(things, 0.3)
            theta = rng.uniform(-math.pi, math.pi)
            for camera, (w, h, f, tilt) in cameras.items():
                turn, eye = map_from_camera([x, y, theta], [0, 0, 1.0], tilt, 0, 0)
                kept = 0
                for _ in range(400):
                    u, v = int(rng.integers(0, w)), int(rng.integers(0, h))
                    answers = set()
                    # only pixels whose neighbourhood is all alike
                    for du, dv in [(0, 0), (-1.5, -1.5), (1.5, -1.5), (-1.5, 1.5), (1.5, 1.5)]:
                        ray = turn @ np.array([(u + du - (w - 1) / 2) / f, (v + dv - (h - 1) / 2) / f, 1])
                        at = eye + ray * (eye[2] / -ray[2])
                        answers.add(shows_floor(things, eye, at[:2]))
                    if len(answers) == 1 and kept < 25:
                        rows.append(f"{name},{camera},{x:.9g},{y:.9g},{theta:.9g},{u},{v},{int(answers.pop())}")
                        kept += 1
    (HERE / "sim_floor.csv").write_text("\n".join(rows) + "\n")


def ranges():
    rows = ["world,x,y,theta,height,half_angle,range"]
    for name in WORLDS:
        things = solids(tomllib.loads((HERE / f"../worlds/{name}.toml").read_text()))
        for _ in range(150):
            height = float(rng.choice([0.1, 0.3, 0.7, 1.0, 2.2]))
            outline = unary_union([s for s, bottom, top in things if bottom <= height <= top]).boundary
            x, y = free_place(things, 0.05)
            theta = rng.uniform(-math.pi, math.pi)
            end = (x + 60 * math.cos(theta), y + 60 * math.sin(theta))
            hit = LineString([(x, y), end]).intersection(outline)
            rows.append(f"{name},{x:.12g},{y:.12g},{theta:.12g},{height},0,{Point(x, y).distance(hit):.12g}")
            half = rng.uniform(0.05, 0.4)
            fan = [(x + 60 * math.cos(theta + a) / math.cos(half), y + 60 * math.sin(theta + a) / math.cos(half)) for a in (-half, 0, half)]
            near = Point(x, y).distance(outline.intersection(Polygon([(x, y), *fan])))
            rows.append(f"{name},{x:.12g},{y:.12g},{theta:.12g},{height},{half:.12g},{near:.12g}")
    (HERE / "sim_ranges.csv").write_text("\n".join(rows) + "\n")


pixels()
floor()
ranges()
