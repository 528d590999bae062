"""Each format of a set is read by the software, or by the words of the specification, it is for."""

from __future__ import annotations

import csv
import dataclasses
import json
from collections.abc import Callable
from dataclasses import replace
from decimal import Decimal
from pathlib import Path

import cv2
import h5py
import numpy as np
import OpenImageIO as oiio
import pytest
import trimesh
import yaml
from evo.core.metrics import APE, PoseRelation
from evo.core.trajectory import PoseTrajectory3D
from evo.tools import file_interface
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader
from underwater_spectral.datasets import formats
from underwater_spectral.datasets.axes import looking_at, turned
from underwater_spectral.datasets.bop import diameter
from underwater_spectral.datasets.card import write_card
from underwater_spectral.datasets.files import plain_names
from underwater_spectral.datasets.formats import FORMATS
from underwater_spectral.datasets.instance_maps import visible_masks
from underwater_spectral.datasets.optical_flow import flow_between, flow_mask, optical_flow
from underwater_spectral.datasets.rosbag import ros_name, write_camera_infos
from underwater_spectral.datasets.sequences import write_tum_sequences
from underwater_spectral.datasets.set_files import SetFiles
from underwater_spectral.datasets.trajectories import trajectories
from underwater_spectral.datasets.yolo import outline
from underwater_spectral.tests.datasets.stereo_way import (
    AIR,
    BASELINE,
    OPTICS,
    RATIO,
    TIMES,
    TO_REC709,
    cast,
    left_poses,
    paint,
    way_files,
)
from underwater_spectral.uw_spectral.errors import InputError

WAY = "way-IB-sun"
CLOSE = 1e-6


@pytest.fixture(scope="module")
def files(tmp_path_factory) -> SetFiles:
    made = way_files(tmp_path_factory.mktemp("way"), ("jerlov:IB", "air"))
    for name, each in FORMATS.items():
        if name not in ("nerfstudio", "colmap", "bop", "coco"):
            each.write(made)
    return made


def of_camera(files: SetFiles, camera: str, water: str = "jerlov:IB") -> list:
    return [
        view
        for view in files.views
        if (view.metadata["camera"], view.metadata["water"]) == (camera, water)
    ]


def rows_of(path) -> list[list[str]]:
    with path.open() as file:
        return list(csv.reader(file))[1:]


def table(path) -> list[dict[str, str]]:
    with path.open() as file:
        return list(csv.DictReader(file))


def pixel(points: np.ndarray, K: np.ndarray) -> np.ndarray:
    """Where OpenCV puts points of a camera's own axes; the first pixel's centre is 0."""
    return cv2.projectPoints(points, np.zeros(3), np.zeros(3), K, None)[0][:, 0]


# --- Trajectories -----------------------------------------------------------------------------


def same_way(found: PoseTrajectory3D, wanted: list[np.ndarray]) -> bool:
    """Whether evo finds no error between what it read and the poses, Blender's axes."""
    truth = PoseTrajectory3D(
        poses_se3=[turned(pose) for pose in wanted], timestamps=np.array(TIMES)
    )
    errors = []
    for relation in (PoseRelation.translation_part, PoseRelation.rotation_part):
        metric = APE(relation)
        metric.process_data((truth, found))
        errors.append(max(metric.error))
    return max(errors) < CLOSE and np.abs(found.timestamps - TIMES).max() < CLOSE


def test_tum_is_read_by_evo_and_its_lists_name_pictures(files):
    for camera in ("left", "right"):
        folder = files.folder / "tum" / WAY / camera
        views = of_camera(files, camera)
        found = file_interface.read_tum_trajectory_file(folder / "groundtruth.txt")
        assert same_way(found, [view.camera_to_world for view in views])
        for kind in ("rgb", "depth"):
            rows = [
                line.split()
                for line in (folder / f"{kind}.txt").read_text().splitlines()
                if not line.startswith("#")
            ]
            assert [float(time) for time, _ in rows] == pytest.approx(TIMES)
            for (_, name), view in zip(rows, views, strict=True):
                pixels = cv2.imread(str(folder / name), cv2.IMREAD_UNCHANGED)
                if kind == "rgb":
                    assert np.array_equal(pixels, cv2.imread(str(view.image)))
                    continue
                true = cast(OPTICS, view.camera_to_world)[0]
                true = np.where(true > 65535 / 5000, 0.0, true)
                assert pixels / 5000 == pytest.approx(true, abs=1.01e-4)


def test_euroc_is_read_by_evo_and_its_cameras_stand_where_they_did(files):
    root = files.folder / "euroc" / WAY / "mav0"
    found = file_interface.read_euroc_csv_trajectory(
        root / "state_groundtruth_estimate0" / "data.csv"
    )
    assert same_way(found, [view.camera_to_world for view in of_camera(files, "left")])
    for number, camera in enumerate(("left", "right")):
        sensor = yaml.safe_load((root / f"cam{number}" / "sensor.yaml").read_text())
        T_BS = np.array(sensor["T_BS"]["data"]).reshape(4, 4)
        for body, view in zip(found.poses_se3, of_camera(files, camera), strict=True):
            assert turned(body @ T_BS) == pytest.approx(view.camera_to_world, abs=CLOSE)
        assert sensor["resolution"] == [OPTICS.width, OPTICS.height]
        assert sensor["rate_hz"] == pytest.approx(10.0)
        fu, fv, cu, cv = sensor["intrinsics"]
        point = np.array([[0.3, -0.2, 2.0]])
        K = np.array([[fu, 0, cu], [0, fv, cv], [0, 0, 1]])
        assert pixel(point, K) == pytest.approx(OPTICS.project(point) - 0.5, abs=CLOSE)
        rows = rows_of(root / f"cam{number}" / "data.csv")
        for (stamp, name), view in zip(rows, of_camera(files, camera), strict=True):
            assert int(stamp) == round(view.metadata["time_s"] * 1e9)
            picture = cv2.imread(str(root / f"cam{number}" / "data" / name))
            assert np.array_equal(picture, cv2.imread(str(view.image)))


def test_kitti_is_read_by_evo_and_its_stereo_triangulates(files):
    root = files.folder / "kitti"
    names = dict(rows_of(root / "sequences.csv"))
    number = next(number for number, name in names.items() if name == WAY)
    found = file_interface.read_kitti_poses_file(root / "poses" / f"{number}.txt")
    left, right = (of_camera(files, camera) for camera in ("left", "right"))
    first = turned(left[0].camera_to_world)
    for pose, view in zip(found.poses_se3, left, strict=True):
        assert turned(first @ pose) == pytest.approx(view.camera_to_world, abs=CLOSE)
    rows = (root / "sequences" / number / "calib.txt").read_text().splitlines()
    P = {
        name: np.array(values.split(), float).reshape(3, 4)
        for name, values in (row.split(":") for row in rows)
    }
    point = np.array([[0.1, 0.4, -5.0]])
    seen = [
        (views[2].project(point) - 0.5).T.copy() for views in (left, right)
    ]  # the first pixel's centre is 0
    at = cv2.triangulatePoints(P["P2"], P["P3"], *seen)
    in_world = turned(left[2].camera_to_world) @ (at / at[3])
    assert in_world[:3, 0] == pytest.approx(point[0], abs=CLOSE)
    times = np.loadtxt(root / "sequences" / number / "times.txt")
    assert times == pytest.approx(TIMES)
    for camera, views in ((2, left), (3, right)):
        for place, view in enumerate(views):
            path = root / "sequences" / number / f"image_{camera}" / f"{place:06d}.png"
            assert np.array_equal(cv2.imread(str(path)), cv2.imread(str(view.image)))


def _tartanair_world(row: np.ndarray, local: np.ndarray) -> np.ndarray:
    """Points in north, east, down of points of the camera: ahead, right, down."""
    x, y, z, w = row[3:] / np.linalg.norm(row[3:])
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    return local @ turn.T + row[:3]


def test_tartanair_fits_by_the_words_of_its_specification(files):
    """There is no light reader of its own: numpy, and axes as *tartanair_tools* has them."""
    root = files.folder / "tartanair" / WAY / "Easy" / "P000"
    K = OPTICS.K_opencv
    u, v = np.meshgrid(np.arange(OPTICS.width), np.arange(OPTICS.height))
    for side in ("left", "right"):
        rows = np.loadtxt(root / f"pose_{side}.txt")
        for number, view in enumerate(of_camera(files, side)):
            depth = np.load(root / f"depth_{side}" / f"{number:06d}_{side}_depth.npy")
            true, _, points = cast(OPTICS, view.camera_to_world)
            assert depth.dtype == np.float32
            assert depth == pytest.approx(true, rel=1e-6)
            finite = np.isfinite(true)
            ahead = true[finite]
            right, down = ((w[finite] - K[i, 2]) / K[i, i] * ahead for i, w in enumerate((u, v)))
            found = _tartanair_world(rows[number], np.stack([ahead, right, down], axis=-1))
            east, north, up = points[finite].T
            assert found == pytest.approx(np.stack([north, east, -up], axis=-1), abs=1e-6)
            picture = cv2.imread(str(root / f"image_{side}" / f"{number:06d}_{side}.png"))
            assert np.array_equal(picture, cv2.imread(str(view.image)))
            seg = np.load(root / f"seg_{side}" / f"{number:06d}_{side}_seg.npy")
            assert np.array_equal(seg == 5, visible_masks(view)[5])
    flows = sorted(path.name for path in (root / "flow").iterdir())
    assert flows[:2] == ["000000_000001_flow.npy", "000000_000001_mask.npy"]
    assert len(flows) == 2 * (len(TIMES) - 1)
    flow = np.load(root / "flow" / flows[0])
    assert (flow.shape, flow.dtype) == ((48, 64, 2), np.float32)


# --- Flow -------------------------------------------------------------------------------------


def test_opencv_reads_flow_and_the_next_picture_shows_the_same(files):
    rows = table(files.folder / "flow" / "flow.csv")
    assert len(rows) == 2 * 2 * 2 * (len(TIMES) - 1)
    views = {view.name: view for view in files.views}
    for row in rows:
        view, following = views[row["view"]], views[row["next"]]
        back = row["flow"] == f"{view.name}_back.flo"
        assert following.metadata["pose"] == view.metadata["pose"] + (-1 if back else 1)
        flow = cv2.readOpticalFlow(str(files.folder / "flow" / row["flow"]))
        depth, _, points = cast(OPTICS, view.camera_to_world)
        assert (np.abs(flow) > 1e9).all(axis=-1).sum() == np.isinf(depth).sum()
        next_depth, _, next_points = cast(OPTICS, following.camera_to_world)
        mask = flow_mask(view, depth, following, next_depth)
        assert set(np.unique(mask)) <= {0, 1, 100}
        y, x = np.nonzero(mask == 0)
        to = np.stack([x, y], axis=-1) + flow[y, x]
        # The place that the next picture shows there, by OpenCV's own interpolation.
        apart, apart_if_longer = (
            np.linalg.norm(_interpolated(next_points, at) - points[y, x], axis=-1)
            for at in (to, to + 0.1 * flow[y, x])
        )
        assert np.median(apart) < 1e-3
        assert np.quantile(apart, 0.9) < 5e-3
        assert np.median(apart_if_longer) > 1e-2


def test_what_moves_has_the_motion_that_was_rendered(files):
    """Of frames in turn; where it tells the same as the poses these are exact."""
    one, two = (
        replace(view, metadata={**view.metadata, "frame": frame})
        for frame, view in enumerate(of_camera(files, "left")[:2], start=3)
    )
    depth = cast(OPTICS, one.camera_to_world)[0]
    exact = optical_flow(one, files.planar_depth(one), two)
    motion = files.layers(one)["motion"]  # numbers, of which none is what the poses tell
    seen = np.isfinite(depth) & (motion[..., 0] > 200)
    there = flow_between(files, one, two)
    np.testing.assert_array_equal(there[seen], (motion[..., 2:] * (-1, 1))[seen])
    np.testing.assert_array_equal(np.isnan(there), np.isnan(exact))
    motion = files.layers(two)["motion"]
    seen = np.isfinite(cast(OPTICS, two.camera_to_world)[0]) & (motion[..., 0] > 200)
    back = flow_between(files, two, one)
    np.testing.assert_array_equal(back[seen], (motion[..., :2] * (1, -1))[seen])
    later = replace(two, metadata={**two.metadata, "frame": 9})
    np.testing.assert_array_equal(flow_between(files, one, later), exact)


def _interpolated(image: np.ndarray, at: np.ndarray) -> np.ndarray:
    x, y = at.astype(np.float32).T
    return cv2.remap(image.astype(np.float32), x[None], y[None], cv2.INTER_LINEAR)[0]


def test_what_the_stone_hides_in_the_next_picture_is_marked(files):
    left = of_camera(files, "left")
    view, following = left[0], left[-1]
    depth, stone, points = cast(OPTICS, view.camera_to_world)
    next_depth = cast(OPTICS, following.camera_to_world)[0]
    mask = flow_mask(view, depth, following, next_depth)
    # By rays of our own: what is on the way from the other camera to each place.
    eye = following.camera_to_world[:3, 3]
    fraction = (-4.5 - eye[2]) / (points[..., 2] - eye[2])
    crossed = eye + fraction[..., None] * (points - eye)
    behind = (np.abs(crossed[..., :2]) < 0.6).all(axis=-1) & ~stone & (points[..., 2] < -5)
    inside = mask != 100
    assert (behind & inside).sum() > 20
    assert (mask == 1)[behind & inside].mean() > 0.85
    assert (mask == 1)[~behind & inside].mean() < 0.03
    assert np.isnan(optical_flow(view, depth, following)[:2]).all()


# --- Cameras of ROS ---------------------------------------------------------------------------


def test_camera_info_has_all_keys_and_projects(files):
    names = {
        "image_width", "image_height", "camera_name", "camera_matrix", "distortion_model",
        "distortion_coefficients", "rectification_matrix", "projection_matrix",
    }  # fmt: skip
    left, right = of_camera(files, "left")[1], of_camera(files, "right")[1]
    point = np.array([[0.2, 0.1, -5.0, 1.0]]).T
    in_left = left.world_to_opencv @ point
    for view in (left, right):
        path = files.folder / "camera_info" / f"{view.metadata['camera']}.yaml"
        info = yaml.safe_load(path.read_text())
        assert set(info) == names
        matrices = {}
        for name, (rows, cols) in (
            ("camera_matrix", (3, 3)), ("distortion_coefficients", (1, 5)),
            ("rectification_matrix", (3, 3)), ("projection_matrix", (3, 4)),
        ):  # fmt: skip
            assert (info[name]["rows"], info[name]["cols"]) == (rows, cols)
            matrices[name] = np.array(info[name]["data"]).reshape(rows, cols)
        assert (info["image_width"], info["image_height"]) == (64, 48)
        assert info["distortion_model"] == "plumb_bob"
        # As image_geometry's StereoCameraModel: both project from the left camera's axes.
        x, y, w = matrices["projection_matrix"] @ in_left
        at = np.concatenate([x / w, y / w])
        assert at + 0.5 == pytest.approx(view.project(point[:3].T)[0], abs=CLOSE)
        assert np.array_equal(matrices["rectification_matrix"], np.eye(3))
    assert matrices["projection_matrix"][0, 3] == pytest.approx(-OPTICS.fx * BASELINE)


def test_bags_are_read_by_rosbags_and_evo(files):
    bag = files.folder / "rosbag2" / WAY
    counts, transforms = {}, []
    with AnyReader([bag]) as reader:
        for connection, stamp, data in reader.messages():
            counts[connection.topic] = counts.get(connection.topic, 0) + 1
            message = reader.deserialize(data, connection.msgtype)
            number = round(stamp / 1e8)
            if connection.topic == "/tf":
                (moved,) = message.transforms
                assert moved.header.frame_id == "world"
                if moved.child_frame_id == "right_optical":
                    t, q = moved.transform.translation, moved.transform.rotation
                    transforms.append(((t.x, t.y, t.z), (q.w, q.x, q.y, q.z), stamp / 1e9))
            if not connection.topic.startswith("/left"):
                continue
            view = of_camera(files, "left")[number]
            head = message.header
            assert head.stamp.sec * 10**9 + head.stamp.nanosec == stamp
            assert head.frame_id == "left_optical"
            if connection.topic.endswith("camera_info"):
                assert message.k.reshape(3, 3) == pytest.approx(OPTICS.K_opencv)
                assert (message.width, message.height) == (64, 48)
                continue
            kind = {"rgb8": np.uint8, "32FC1": np.float32}[message.encoding]
            pixels = message.data.view(kind).reshape(message.height, message.width, -1)
            assert message.step == message.data.size // message.height
            if message.encoding == "rgb8":
                assert np.array_equal(pixels[..., ::-1], cv2.imread(str(view.image)))
            else:
                assert pixels[..., 0] == pytest.approx(
                    cast(OPTICS, view.camera_to_world)[0], rel=1e-6
                )
    with Reader(bag) as reader:
        odometry = file_interface.read_bag_trajectory(reader, "/odometry")
    assert same_way(odometry, left_poses())
    assert same_way(
        PoseTrajectory3D(*map(np.array, zip(*transforms, strict=True))),
        [view.camera_to_world for view in of_camera(files, "right")],
    )
    topics = {f"/{c}/{t}" for c in ("left", "right")
              for t in ("image_raw", "depth/image_raw", "camera_info")}  # fmt: skip
    assert counts == dict.fromkeys(topics, 5) | {"/odometry": 5, "/tf": 10}


# --- Instances --------------------------------------------------------------------------------


def even_odd(polygon: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Pixels whose centres are inside a polygon, by crossings of a ray to the right."""
    y, x = np.mgrid[: shape[0], : shape[1]] + 0.5
    inside = np.zeros(shape, bool)
    for (x0, y0), (x1, y1) in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        if y0 != y1:
            crosses = (y0 > y) != (y1 > y)
            inside ^= crosses & (x < x0 + (y - y0) / (y1 - y0) * (x1 - x0))
    return inside


@pytest.mark.parametrize("seed", range(20))
def test_outlines_enclose_the_mask_exactly(seed):
    """Parts, holes, and pixels that touch by a corner."""
    random = np.random.default_rng(seed)
    mask = random.random(random.integers(1, 14, 2)) < random.choice([0.2, 0.5, 0.9])
    if seed % 2:
        mask = np.kron(mask, np.ones((2, 3), bool))
    if mask.any():
        assert np.array_equal(even_odd(outline(mask), mask.shape), mask)
    else:
        assert not outline(mask).size


@pytest.mark.parametrize("kind", ["yolo", "yolo_segments"])
def test_yolo_is_read_by_supervision(files, kind):
    import supervision

    root, found = files.folder / kind, 0
    data = yaml.safe_load((root / "data.yaml").read_text())
    assert data["names"] == {0: "stone"}
    for split in ("train", "val", "test"):
        assert data[split] == f"images/{split}"
        images = root / data[split]
        read = supervision.DetectionDataset.from_yolo(
            str(images), str(images).replace("images", "labels"), str(root / "data.yaml"),
            force_masks=kind == "yolo_segments",
        )  # fmt: skip
        assert read.classes == ["stone"]
        of_split = {view.name: view for view in files.of_split(split)}
        assert len(read) == len(of_split)
        for path, picture, seen in read:
            view = of_split[path.rsplit("/", 1)[1].removesuffix(".png")]
            assert np.array_equal(picture, cv2.imread(str(view.image)))
            mask = visible_masks(view)[5]
            y, x = np.nonzero(mask)
            box = [x.min(), y.min(), x.max() + 1, y.max() + 1]
            # supervision rounds the corners of polygons to whole pixels.
            close = 0.01 if kind == "yolo" else 1.01
            assert seen.xyxy[0] == pytest.approx(box, abs=close)
            if kind == "yolo_segments":
                both = (seen.mask[0] & mask).sum() / (seen.mask[0] | mask).sum()
                assert both > 0.85  # it draws the outline as wide as a pixel
                words = (root / "labels" / split / f"{view.name}.txt").read_text().split()
                corners = np.array(words[1:], float).reshape(-1, 2) * (64, 48)
                assert np.array_equal(even_odd(np.round(corners, 4), mask.shape), mask)
            found += 1
    assert found == len(files.views)


def test_bop_has_models_cameras_and_targets(tmp_path):
    files = way_files(tmp_path)
    FORMATS["bop"].write(files)
    root = tmp_path / "bop"
    for name in ("models", "models_eval"):
        mesh = trimesh.load(root / name / "obj_000002.ply", process=False)
        assert mesh.extents == pytest.approx([1200, 1200, 0])
        assert mesh.area == pytest.approx(1.2**2 * 1e6)
        infos = json.loads((root / name / "models_info.json").read_text())
        assert set(infos) == {"2"}
        assert infos["2"]["diameter"] == pytest.approx(1200 * 2**0.5)
        assert infos["2"]["min_x"] == pytest.approx(-600)
        assert infos["2"]["size_z"] == 0
    camera = json.loads((root / "camera.json").read_text())
    assert camera == json.loads((root / "camera_left.json").read_text())
    assert (camera["fx"], camera["cx"]) == (OPTICS.fx, OPTICS.cx - 0.5)
    assert (camera["width"], camera["height"], camera["depth_scale"]) == (64, 48, 1.0)
    targets = json.loads((root / "test_targets_bop19.json").read_text())
    assert len(targets) == len(files.of_split("test"))
    assert set(targets[0]) == {"im_id", "inst_count", "obj_id", "scene_id"}
    # The mesh, put where the truth says, covers what the mask shows.
    scene = root / "train" / "000000"
    truths = json.loads((scene / "scene_gt.json").read_text())
    cameras = json.loads((scene / "scene_camera.json").read_text())
    for key, (truth,) in truths.items():
        K = np.array(cameras[key]["cam_K"]).reshape(3, 3)
        turn = cv2.Rodrigues(np.array(truth["cam_R_m2c"]).reshape(3, 3))[0]
        at = cv2.projectPoints(mesh.vertices, turn, np.array(truth["cam_t_m2c"]), K, None)[0]
        path = scene / "mask_visib" / f"{int(key):06d}_000000.png"
        mask = cv2.imread(str(path), cv2.IMREAD_UNCHANGED) > 0
        assert np.array_equal(even_odd(at[:, 0] + 0.5, mask.shape)[2:], mask[2:])


def test_diameters_of_many_vertices_are_close():
    random = np.random.default_rng(4)
    cloud = random.normal(size=(6000, 3)) * (3.0, 1.0, 1.0)
    apart = max(np.linalg.norm(cloud - point, axis=1).max() for point in cloud)
    assert diameter(cloud) == pytest.approx(apart, rel=1e-3)


# --- Restoration, compositing, tables ---------------------------------------------------------


def _linear(path) -> np.ndarray:
    codes = cv2.imread(str(path))[..., ::-1] / 255.0
    return np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)


CODE = 2.4 / 1.055 / 255
"""A code of sRGB at white; each of two pictures is half of it off at most."""


def _paint(view) -> np.ndarray:
    depth, _, points = cast(OPTICS, view.camera_to_world)
    return np.where(np.isfinite(depth)[..., None], paint(points), 0.05)


@pytest.mark.parametrize(("kind", "ratio"), [("pairs", 1 / RATIO), ("pairs_air", AIR)])
def test_pairs_have_one_exposure(files, kind, ratio):
    folder = files.folder / kind
    rows = table(folder / "pairs.csv")
    assert [row["name"] for row in rows] == [
        view.name for view in files.views if view.metadata["water"] != "air"
    ]
    for row in rows:
        raw, reference = (_linear(folder / x / f"{row['name']}.png") for x in ("raw", "reference"))
        view = next(v for v in files.views if v.name == row["name"])
        lit = np.isfinite(cast(OPTICS, view.camera_to_world)[0])
        whole = (reference < 0.98) & (raw > 0.05) & lit[..., None]
        assert whole.mean() > 0.3
        assert np.median(reference[whole] / raw[whole]) == pytest.approx(ratio, rel=0.02)
        brightest = files.layers(view)["J"] @ TO_REC709.T if kind == "pairs" else AIR * _paint(view)
        gain = float(row["gain"])
        assert gain < 1
        assert 0.001 < (brightest * gain > 1).mean() < 0.006
        own = _linear(view.image)
        assert raw == pytest.approx(own * gain, abs=CODE)
        assert (row["reference_view"] == view.name) == (kind == "pairs")


def test_pairs_that_are_half_rendered_wait(files, tmp_path):
    some = [v for v in files.views if v.metadata["water"] != "air" or v.metadata["pose"] == 1]
    FORMATS["pairs_air"].write(dataclasses.replace(files, folder=tmp_path, views=some))
    names = [row["name"] for row in table(tmp_path / "pairs_air" / "pairs.csv")]
    assert names == [v.name for v in some if v.metadata["pose"] == 1][:2]
    apart = [v for v in some if v.metadata["water"] == "air" or v.metadata["pose"] == 2]
    with pytest.raises(InputError, match="no view in water has one of the same pose and light"):
        FORMATS["pairs_air"].write(dataclasses.replace(files, folder=tmp_path, views=apart))


def test_exr_has_the_names_and_values_of_blender(files):
    view = of_camera(files, "left")[0]
    image = oiio.ImageBuf(str(files.folder / "exr" / f"{view.name}.exr"))
    names = list(image.spec().channelnames)
    assert set(names) == {
        *(f"ViewLayer.Combined.{c}" for c in "RGBA"), "ViewLayer.Depth.Z",
        *(f"ViewLayer.Normal.{c}" for c in "XYZ"), *(f"ViewLayer.Vector.{c}" for c in "XYZW"),
    }  # fmt: skip
    pixels = image.get_pixels(oiio.FLOAT)
    depth = pixels[..., names.index("ViewLayer.Depth.Z")]
    true = cast(OPTICS, view.camera_to_world)[0]
    assert depth == pytest.approx(np.where(np.isinf(true), 1e10, true), rel=1e-6)
    assert (pixels[..., names.index("ViewLayer.Normal.Z")] == 1).all()
    vectors = [pixels[..., names.index(f"ViewLayer.Vector.{c}")] for c in "XYZW"]
    assert np.array_equal(np.stack(vectors, axis=-1), files.layers(view)["motion"])


def test_hdf5_is_read_by_h5py(files):
    for number, view in enumerate(files.views):
        with h5py.File(files.folder / "hdf5" / f"{number}.hdf5") as file:
            assert np.array_equal(file["colors"][()][..., ::-1], cv2.imread(str(view.image)))
            true = cast(OPTICS, view.camera_to_world)[0]
            assert file["depth"][()] == pytest.approx(np.where(np.isinf(true), 0, true), rel=1e-6)
            assert np.array_equal(file["instance_segmaps"][()] == 5, visible_masks(view)[5])
            objects = json.loads(file["instance_attribute_maps"][()])
            assert objects == [{"idx": 5, "name": "stone", "category_id": 1}]
            camera = json.loads(file["camera"][()])
            assert np.array_equal(camera["cam2world_matrix"], view.camera_to_world)


@pytest.mark.filterwarnings("ignore:ConjunctiveGraph:DeprecationWarning")  # of its own
def test_croissant_is_read_by_mlcroissant(files):
    import mlcroissant

    found = mlcroissant.Dataset(jsonld=files.folder / "croissant.json")
    assert not found.metadata.ctx.issues.errors
    # What a set does not know of itself: how it is cited, and when it will be published.
    recommended = {text.split('"')[1] for text in found.metadata.ctx.issues.warnings}
    assert recommended == {
        "http://mlcommons.org/croissant/citeAs",
        "https://schema.org/datePublished",
    }
    assert found.metadata.name == "Way"
    records = list(found.records("views"))
    assert len(records) == len(files.views)
    for record, view in zip(records, files.views, strict=True):
        values = {
            key.removeprefix("views/"): value.decode() if isinstance(value, bytes) else value
            for key, value in record.items()
        }
        assert (values["name"], values["split"]) == (view.name, view.split)
        assert (files.folder / values["image"]).samefile(view.image)
        assert (values["fx"], values["width"]) == (OPTICS.fx, 64)
        pose = np.array(json.loads(values["camera_to_world"])).reshape(4, 4)
        assert np.array_equal(pose, view.camera_to_world)


# --- The table of formats ---------------------------------------------------------------------


def test_a_card_counts_cameras_that_are_alike(files, tmp_path):
    write_card(tmp_path / "README.md", files.card, files.views)
    text = (tmp_path / "README.md").read_text()
    assert "Cameras: 2" in text
    assert "- left: 64 × 48 pixels" in text
    assert "- right: 64 × 48 pixels" in text


def test_a_package_that_is_missing_is_named(monkeypatch):
    monkeypatch.setattr(formats.importlib.util, "find_spec", lambda _: None)
    with pytest.raises(InputError, match=r"'hdf5' .* h5py, .*pip install h5py"):
        FORMATS["hdf5"].require("hdf5")
    FORMATS["tum"].require("tum")


def _one_side(files: SetFiles, change: Callable) -> SetFiles:
    return dataclasses.replace(files, views=[change(view) for view in files.views])


def test_cameras_that_are_no_pair_are_refused(files):
    def turn(view):
        if view.metadata["camera"] == "left":
            return view
        pose = looking_at(view.camera_to_world[:3, 3], (0, 1, -5))
        return dataclasses.replace(view, camera_to_world=pose)

    for name in ("kitti", "tartanair"):
        with pytest.raises(InputError, match=r"2 cameras \(left, right\); it has one, or two"):
            FORMATS[name].write(_one_side(files, turn))


def test_views_that_are_not_rendered_break_no_way(files):
    some = [view for view in files.views if view.metadata["pose"] != 2]
    (way, _) = trajectories(dataclasses.replace(files, views=some), "tum")
    assert way.poses == (0, 1, 3, 4)
    assert list(way.steps) == [(0, 1), (2, 3)]
    assert way.times == (0, 100_000_000, 300_000_000, 400_000_000)
    old = dict(files.views[0].metadata)
    del old["time_s"]
    with pytest.raises(InputError, match="has no time, as planned by an earlier version"):
        without = [dataclasses.replace(files.views[0], metadata=old)]
        trajectories(dataclasses.replace(files, views=without), "tum")


@pytest.mark.parametrize("names", [("左", "右"), ("Left", "left"), ("a-b", "a_b"), ("con", "é")])
def test_cameras_whose_names_are_alike_in_files_have_files_of_their_own(files, tmp_path, names):
    """Two of a rig ended in one file and one topic."""
    other = dict(zip(("left", "right"), names, strict=True))
    views = [
        dataclasses.replace(v, metadata={**v.metadata, "camera": other[v.metadata["camera"]]})
        for v in files.views
    ]
    renamed = dataclasses.replace(files, views=views, folder=tmp_path, cameras=names)
    write_camera_infos(renamed)
    found = [path.name.lower() for path in (tmp_path / "camera_info").iterdir()]
    assert len(set(found)) == 2
    assert not any(name.startswith((".", "con.")) for name in found)
    write_tum_sequences(renamed)
    for way in (tmp_path / "tum").iterdir():
        assert len({path.name.lower() for path in way.iterdir()}) == 2
    topics = plain_names(names, ros_name)
    assert len(set(topics.values())) == 2
    # The same for what is rendered first.
    alone = [view for view in views if view.metadata["camera"] == names[1]]
    part = dataclasses.replace(renamed, views=alone)
    assert part.camera_names[names[1]] == renamed.camera_names[names[1]]


def test_formats_have_times_to_the_nanosecond(files, tmp_path):
    start, step = 1403636579763555585, 50_000_001
    times = [start + step * number for number in range(5)]
    views = [
        dataclasses.replace(
            view, metadata={**view.metadata, "time_ns": times[view.metadata["pose"]]}
        )
        for view in files.views
    ]
    timed = dataclasses.replace(files, views=views, folder=tmp_path)
    for name in ("tum", "euroc", "kitti", "rosbag2"):
        FORMATS[name].write(timed)

    def stamps(path: Path, separator: str, scale: int = 1) -> list[int]:
        lines = path.read_text().splitlines()
        words = [line.split(separator) for line in lines if not line.startswith("#")]
        assert all(
            word[1].rpartition("/")[2].startswith(word[0])
            for word in words
            if word[1].endswith("png")
        )
        return [int(Decimal(word[0]) * scale) for word in words]

    mav0, tum = tmp_path / "euroc" / WAY / "mav0", tmp_path / "tum" / WAY / "left"
    assert stamps(mav0 / "cam1" / "data.csv", ",") == times
    assert stamps(mav0 / "state_groundtruth_estimate0" / "data.csv", ",") == times
    for name in ("rgb.txt", "depth.txt", "groundtruth.txt"):
        assert stamps(tum / name, " ", 10**9) == times
    since = np.loadtxt(next((tmp_path / "kitti" / "sequences").glob("*/times.txt")))
    assert [round(float(x) * 1e9) for x in since] == [time - start for time in times]
    with AnyReader([tmp_path / "rosbag2" / WAY]) as reader:
        odometry = [x for x in reader.connections if x.topic == "/odometry"]
        found = list(reader.messages(connections=odometry))
        assert [stamp for _, stamp, _ in found] == times
        heads = [reader.deserialize(raw, x.msgtype).header.stamp for x, _, raw in found]
        assert [head.sec * 10**9 + head.nanosec for head in heads] == times


def test_ways_of_several_depths_and_repeats_have_names_of_their_own(files):
    views = [
        dataclasses.replace(
            view,
            name=f"{view.name}_{depth}_{repeat}",
            metadata={**view.metadata, "lowered_m": depth, "repeat": repeat},
        )
        for view in of_camera(files, "left")
        for depth in (1.0, 2.5)
        for repeat in (0, 1)
    ]
    ways = trajectories(dataclasses.replace(files, views=views), "tum")
    assert [way.name.removeprefix(WAY) for way in ways] == [
        "-1m", "-1m-repeat1", "-2.5m", "-2.5m-repeat1",
    ]  # fmt: skip
    assert all(way.poses == (0, 1, 2, 3, 4) for way in ways)
