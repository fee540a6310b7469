"""Writes what OpenCV says of lenses and homographies, and real pixel-to-floor pairs.

Run from this folder with opencv-python and NumPy (written with OpenCV 5.0.0, NumPy 2.4.6), with the folder of
the original pictures as argument: opencv-chessboard and udacity-camera-cal from OpenCV's samples and
CarND-Advanced-Lane-Lines, vgg-corridor from the VGG multiple view examples with floor points extracted,
surround-view-floor-cloth from surround-view-system-introduction.

lens.csv: model, camera matrix, coefficients (padded with zeros to 8), undistorted pixel, pixel. The undistorted
  pixels are given; the pixels are OpenCV's projectPoints and fisheye.distortPoints, undistortPoints agrees.
homography.csv: groups of one line `pairs,n`, n lines u,v,x,y with noise, then two lines of nine numbers: the
  refined findHomography from floor to pixels and from pixels to floor, both over their last entry.
../calibration/chessboard.csv, udacity.csv: picture, u, v, x, y of chessboard corners (findChessboardCorners,
  cornerSubPix), squares of 25 mm and of unit size; turned so that the board is seen from its front.
../calibration/chessboard.yaml, udacity.yaml: camera_info as ROS writes it, with OpenCV's published calibration
  of these pictures and one by calibrateCamera.
flatness.csv: table, RMS error of a coordinate [px] of findHomography, one line a picture, lens undone.
../calibration/vgg-corridor.csv: view, u, v, x, y of points on the corridor's floor, and u_true, v_true by the
  published camera matrices; scene units, axes in the floor, seen from above.
../calibration/floor-cloth.csv, floor-cloth.yaml: pixels of the fisheye picture, floor points [m] of its
  published ground projection, and its published lens as camera_info; ../frames/floor-cloth.jpg: the picture.
"""

import pathlib
import sys

import cv2
import numpy as np

HERE = pathlib.Path(__file__).parent
OUT = HERE.parent / "calibration"
PICTURES = pathlib.Path(sys.argv[1])


def line(*values):
    return ",".join(v if isinstance(v, str) else repr(float(v)) for v in values) + "\n"


def lenses(rng):
    rows = ["model,fx,fy,cx,cy," + ",".join(f"k{i}" for i in range(8)) + ",u,v,du,dv\n"]
    models = [
        ("plumb_bob", (535.9, 535.9, 342.3, 235.6), [-0.266, -0.0386, 0.00178, -0.000281, 0.238], 0.7),
        ("plumb_bob", (450, 455, 239.5, 109.5), [0.1, 0.02, -0.001, 0.002, 0.0], 0.8),
        ("plumb_bob", (1158.8, 1153.9, 669.6, 388.8), [-0.256, 0.045, -0.0005, -0.00011, -0.06], 0.6),
        ("rational_polynomial", (610, 612, 320, 240), [0.5, -0.3, 0.0005, -0.0003, 0.02, 0.8, -0.2, 0.01], 0.8),
        ("rational_polynomial", (504.1, 504.2, 322.0, 336.4), [5.37, 3.36, 8.0e-6, -6.8e-5, 0.15, 5.70, 5.05, 0.86], 1.2),
        ("equidistant", (302.45, 331.2, 496.64, 320.75), [-0.0437, 0.0217, -0.0264, 0.00841], 2.0),
        ("equidistant", (285.7, 286.8, 420.3, 396.7), [-0.0089, 0.0432, -0.0415, 0.0078], 3.0),
    ]
    for model, (fx, fy, cx, cy), k, reach in models:
        matrix = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])
        angle = rng.uniform(0, 2 * np.pi, 60)
        radius = reach * np.sqrt(rng.uniform(0, 1, 60))
        ideal = np.c_[radius * np.cos(angle), radius * np.sin(angle)]
        ideal[0] = 0
        if model == "equidistant":
            seen = cv2.fisheye.distortPoints(ideal[None], matrix, np.array(k))[0]
            back = cv2.fisheye.undistortPoints(seen[None], matrix, np.array(k), criteria=(3, 100, 1e-12))[0]
        else:
            solid = np.c_[ideal, np.ones(len(ideal))]
            seen = cv2.projectPoints(solid, np.zeros(3), np.zeros(3), matrix, np.array(k))[0][:, 0]
            stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 1000, 1e-13)
            back = cv2.undistortPoints(seen[:, None], matrix, np.array(k), criteria=stop)[:, 0]
        assert np.abs(back - ideal).max() < 1e-6, (model, np.abs(back - ideal).max())
        for p, q in zip(ideal, seen):
            padded = list(k) + [0] * (8 - len(k))
            rows.append(line(model, fx, fy, cx, cy, *padded, fx * p[0] + cx, fy * p[1] + cy, *q))
    (HERE / "lens.csv").write_text("".join(rows))


def homographies(rng):
    text = ""
    for k in range(24):
        count = [4, 5, 8, 26][k % 4]
        height, tilt, focal = rng.uniform(0.3, 2), rng.uniform(0.2, 0.9), rng.uniform(300, 900)
        yaw = rng.uniform(-0.5, 0.5)
        forward = np.array([np.cos(yaw) * np.cos(tilt), np.sin(yaw) * np.cos(tilt), -np.sin(tilt)])
        right = np.array([np.sin(yaw), -np.cos(yaw), 0])
        down = np.cross(forward, right)
        camera = np.array([[focal, 0, 320], [0, focal, 240], [0, 0, 1]]) @ np.array([right, down, forward])
        while True:
            floor = np.c_[rng.uniform(0.5 * height, 5 * height, count), rng.uniform(-2 * height, 2 * height, count)]
            solid = np.c_[floor, -height * np.ones(count)] @ camera.T
            if (solid[:, 2] > 0.2 * height).all():
                break
        pixels = solid[:, :2] / solid[:, 2:] + rng.normal(0, 0.5, (count, 2))
        to_pixels = cv2.findHomography(floor, pixels, 0)[0]
        to_floor = cv2.findHomography(pixels, floor, 0)[0]
        text += f"pairs,{count}\n" + "".join(line(*p, *f) for p, f in zip(pixels, floor))
        text += line(*to_pixels.ravel()) + line(*to_floor.ravel())
    (HERE / "homography.csv").write_text(text)


def corners(name, size, pattern):
    rows, objects, pictures = [], [], []
    for path in sorted(PICTURES.glob(pattern)):
        gray = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        found, points = cv2.findChessboardCorners(gray, (9, 6))
        if not found:
            continue
        points = cv2.cornerSubPix(gray, points, (5, 5), (-1, -1), (3, 100, 1e-4)).reshape(-1, 2)
        board = np.array([[x * size, y * size] for y in range(6) for x in range(9)])
        # seen from the front, x right and y down turn as u and v do: x and y change places for floor axes
        objects.append(np.c_[board, np.zeros(54)].astype(np.float32))
        pictures.append(points.astype(np.float32))
        pixels = points.astype(float)
        area = np.linalg.det(np.array([pixels[8] - pixels[0], pixels[45] - pixels[0]]))
        floor = board[:, ::-1] if area > 0 else board
        rows += [line(path.name, *p, *f) for p, f in zip(pixels, floor)]
    (OUT / f"{name}.csv").write_text("picture,u,v,x,y\n" + "".join(rows))
    return objects, pictures, gray.shape[::-1]


def camera_info(name, size, matrix, model, k):
    data = ", ".join(repr(float(v)) for v in np.asarray(matrix).ravel())
    coefficients = ", ".join(repr(float(v)) for v in np.asarray(k).ravel())
    (OUT / f"{name}.yaml").write_text(
        f"image_width: {size[0]}\nimage_height: {size[1]}\ncamera_name: {name}\n"
        f"camera_matrix:\n  rows: 3\n  cols: 3\n  data: [{data}]\n"
        f"distortion_model: {model}\n"
        f"distortion_coefficients:\n  rows: 1\n  cols: {np.size(k)}\n  data: [{coefficients}]\n"
        "rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
        "projection_matrix:\n  rows: 3\n  cols: 4\n"
        f"  data: [{', '.join(repr(float(v)) for v in np.c_[np.asarray(matrix).reshape(3, 3), np.zeros(3)].ravel())}]\n"
    )


def flatness(name, objects, pictures, matrix, k):
    """RMS error of a coordinate of cv2.findHomography from the board to undistorted pixels."""
    stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 1000, 1e-13)
    rows = ""
    for board, pixels in zip(objects, pictures):
        ideal = cv2.undistortPoints(pixels.astype(float), matrix, k, P=matrix, criteria=stop).reshape(-1, 2)
        board = board[:, :2].astype(float)
        fit = cv2.findHomography(board, ideal, 0)[0]
        seen = np.c_[board, np.ones(len(board))] @ fit.T
        rows += line(name, np.sqrt(np.mean((seen[:, :2] / seen[:, 2:] - ideal) ** 2)))
    return rows


def chessboards():
    objects, pictures, _ = corners("chessboard", 0.025, "opencv-chessboard/left*.jpg")
    file = cv2.FileStorage(str(PICTURES / "opencv-chessboard/left_intrinsics.yml"), cv2.FILE_STORAGE_READ)
    matrix, k = file.getNode("camera_matrix").mat(), file.getNode("distortion_coefficients").mat()
    camera_info("chessboard", (640, 480), matrix, "plumb_bob", k)
    rows = flatness("chessboard", objects, pictures, matrix, k)
    objects, pictures, _ = corners("udacity", 1.0, "udacity-camera-cal/*.jpg")
    _, matrix, k, _, _ = cv2.calibrateCamera(objects, pictures, (1280, 720), None, None)
    camera_info("udacity", (1280, 720), matrix, "plumb_bob", k)
    (HERE / "flatness.csv").write_text(rows + flatness("udacity", objects, pictures, matrix, k))


def corridor():
    folder = PICTURES / "vgg-corridor/derived"
    plane = np.loadtxt(folder / "floor-plane.txt")
    normal, offset = plane[:3] / np.linalg.norm(plane[:3]), plane[3] / np.linalg.norm(plane[:3])
    rows = "view,u,v,x,y,u_true,v_true\n"
    cameras = {view: np.loadtxt(folder / f"{view}.P.txt") for view in ("bt.000", "bt.002")}
    first = cameras["bt.000"]
    center = -np.linalg.solve(first[:, :3], first[:, 3])
    if normal @ center + offset < 0:
        normal, offset = -normal, -offset
    ahead = np.linalg.det(first[:, :3]) * first[2, :3]
    x = ahead - (ahead @ normal) * normal
    x /= np.linalg.norm(x)
    y = np.cross(normal, x)
    foot = center - (normal @ center + offset) * normal
    # the scene's handedness is not that of its pictures: x is where the points are, y goes by the pictures
    points = np.genfromtxt(folder / "bt.000.points.csv", delimiter=",", names=True)
    points = points[points["on_floor"] == 1]
    if np.median(np.c_[points["X"], points["Y"], points["Z"]] @ x - foot @ x) < 0:
        x, y = -x, -y
    if handed(first, foot, x, y) > 0:
        y = -y
    for view, camera in cameras.items():
        for record in np.genfromtxt(folder / f"{view}.points.csv", delimiter=",", names=True):
            if record["on_floor"] != 1:
                continue
            point = np.array([record["X"], record["Y"], record["Z"]])
            a, b = (point - foot) @ x, (point - foot) @ y
            on_floor = foot + a * x + b * y
            seen = camera @ np.append(on_floor, 1)
            rows += line(view, record["u"], record["v"], a, b, *(seen[:2] / seen[2]))
    (OUT / "vgg-corridor.csv").write_text(rows)


def handed(camera, foot, x, y):
    """Sign of the determinant of the picture of two floor axes far ahead; the scene may be mirrored."""
    def at(a, b):
        seen = camera @ np.append(foot + a * x + b * y, 1)
        return seen[:2] / seen[2]
    return np.linalg.det(np.array([at(11, 0) - at(10, 0), at(10, 1) - at(10, 0)]))


def cloth():
    file = cv2.FileStorage(str(PICTURES / "surround-view-floor-cloth/front.yaml"), cv2.FILE_STORAGE_READ)
    matrix, k = file.getNode("camera_matrix").mat(), file.getNode("dist_coeffs").mat()
    project = file.getNode("project_matrix").mat()
    scale, shift = file.getNode("scale_xy").mat().ravel(), file.getNode("shift_xy").mat().ravel()
    zoomed = matrix.copy()
    zoomed[0, 0] *= scale[0]
    zoomed[1, 1] *= scale[1]
    zoomed[:2, 2] += shift
    camera_info("floor-cloth", (960, 640), matrix, "equidistant", k)
    # a centimetre a pixel; of the projected picture x is to the right and y towards the camera
    rows = "u,v,x,y\n"
    for v in range(330, 620, 40):
        for u in range(150, 850, 80):
            ray = cv2.fisheye.undistortPoints(np.array([[[u, v]]], float), matrix, k)[0, 0]
            if np.hypot(*ray) > np.tan(np.radians(80)):
                continue
            ideal = zoomed @ np.array([*ray, 1])
            ground = project @ ideal
            gx, gy = ground[:2] / ground[2]
            # the floor is where the published matrix has a negative third component
            if ground[2] < -0.1 and 0 <= gx < 1200 and 0 <= gy < 600:
                rows += line(u, v, (600 - gy) / 100, (600 - gx) / 100)
    (OUT / "floor-cloth.csv").write_text(rows)
    picture = cv2.imread(str(PICTURES / "surround-view-floor-cloth/front.png"))
    cv2.imwrite(str(HERE.parent / "frames/floor-cloth.jpg"), picture, [cv2.IMWRITE_JPEG_QUALITY, 85])


def main():
    OUT.mkdir(exist_ok=True)
    rng = np.random.default_rng(1999)
    lenses(rng)
    homographies(rng)
    chessboards()
    corridor()
    cloth()


if __name__ == "__main__":
    main()
