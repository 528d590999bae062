"""Two cameras that go over a painted sea floor with a stone, without a renderer."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from underwater_spectral.datasets.axes import looking_at
from underwater_spectral.datasets.camera import PinholeCamera
from underwater_spectral.datasets.card import DataCard
from underwater_spectral.datasets.depth_maps import write_depth_png
from underwater_spectral.datasets.instance_maps import write_instance_map
from underwater_spectral.datasets.layer_file import FrameLayers, LayerImage, write_layers
from underwater_spectral.datasets.set_files import Development, RenderedView, SetFiles, Shape
from underwater_spectral.datasets.view import DataSetView, SeenInstance
from underwater_spectral.uw_spectral.spectra.spectral_image import write_png, write_rgb_exr

OPTICS = PinholeCamera(64, 48, 60.0, 60.0, 31.3, 24.6)
BASELINE = 0.12
FLOOR, STONE = -6.0, -4.5  # m: heights of the floor, and of a square that floats above it
EDGE = 0.6
TIMES = (0.0, 0.1, 0.2, 0.3, 0.4)
TO_REC709 = np.array([[2.0, -0.3, 0.1], [-0.2, 1.6, -0.2], [0.05, -0.4, 2.4]])
RATIO = 0.3  # of light that the water leaves, in the pictures here
AIR = 2.0  # of light in air
SETTINGS = {"water": "jerlov:IB", "sun_zenith": 30.0, "surface": "flat"}


def left_poses() -> list[np.ndarray]:
    """A way that goes forth, turns and rolls."""
    return [
        looking_at((0.15 * n - 0.3, -2.0 + 0.1 * n, -2.0 + 0.05 * n), (0.1 * n, 0.3, -5.0), 3.0 * n)
        for n in range(len(TIMES))
    ]


def paint(points: np.ndarray) -> np.ndarray:
    """Colours of places, smooth enough to be interpolated."""
    x, y, z = np.moveaxis(points, -1, 0)
    return 0.5 + 0.3 * np.stack([np.sin(4 * x + z), np.cos(3 * y), np.sin(2 * x + 3 * y)], axis=-1)


def cast(camera: PinholeCamera, pose: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Planar depth, whether the stone is seen, and the places that are seen."""
    rays = camera.rays() * (1, -1, -1) @ pose[:3, :3].T
    eye = pose[:3, 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        ways = [(height - eye[2]) / rays[..., 2] for height in (STONE, FLOOR)]
    near = eye + ways[0][..., None] * rays
    stone = (np.abs(near[..., :2]) < EDGE).all(axis=-1) & (ways[0] > 0)
    distance = np.where(stone, ways[0], np.where(ways[1] > 0, ways[1], np.inf))
    distance[:2] = np.inf  # open water
    points = eye + np.where(np.isfinite(distance), distance, 0.0)[..., None] * rays
    return distance * camera.rays()[..., 2], stone & np.isfinite(distance), points


def way_files(folder: Path, waters: tuple[str, ...] = ("jerlov:IB",)) -> SetFiles:
    """Write the views of both cameras, with their layers."""
    views, rendered = [], {}
    for kind in ("images", "depth", "ids", "jobs"):
        (folder / kind).mkdir()
    for number, pose in enumerate(left_poses()):
        for water in waters:
            for camera, offset in (("left", 0.0), ("right", BASELINE)):
                there = pose.copy()
                there[:3, 3] += pose[:3, 0] * offset
                view, files = _view(folder, number, water, camera, there)
                views.append(view)
                rendered[view.name] = files
    card = DataCard("Way", "CC0-1.0", version="2.1", description="Two cameras over a floor.")
    return SetFiles(folder, views, card, 10, 3, rendered, _shapes)


def _shapes(models) -> dict[int, Shape]:
    corners = EDGE * np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], float)
    return {model: Shape(corners, np.array([(0, 1, 2), (0, 2, 3)])) for model in models}


def _view(
    folder: Path, number: int, water: str, camera: str, pose: np.ndarray
) -> tuple[DataSetView, RenderedView]:
    name = f"{camera}{number}{water[-3:].strip(':')}"
    depth, stone, points = cast(OPTICS, pose)
    wet = np.where(np.isfinite(depth)[..., None], paint(points), 0.05)
    # In air the picture is as bright as in water, exposed by itself.
    channels = np.linalg.solve(TO_REC709, wet[..., None])[..., 0]
    light = AIR if water == "air" else 1.0
    paths = {kind: folder / kind / f"{name}.png" for kind in ("images", "depth", "ids")}
    write_png(paths["images"], wet)
    write_depth_png(paths["depth"], depth)
    write_instance_map(paths["ids"], np.where(stone, 5, 0))
    linear = folder / "jobs" / f"{name}.exr"
    write_rgb_exr(linear, wet)
    layers = folder / "jobs" / f"{name}_layers.exr"
    one, three, four = ("",), ("X", "Y", "Z"), ("X", "Y", "Z", "W")
    normals = np.broadcast_to((0.0, 0.0, 1.0), (*depth.shape, 3))
    motion = np.arange(depth.size * 4, dtype=float).reshape(*depth.shape, 4)
    content = {
        "range": LayerImage((depth / OPTICS.rays()[..., 2])[..., None], one, whole=True),
        "planar_depth": LayerImage(depth[..., None], one, whole=True),
        "normal": LayerImage(normals, three, whole=True),
        "motion": LayerImage(motion, four, whole=True),
        "I": LayerImage(light * channels, ("R", "G", "B"), whole=True),
        "J": LayerImage(channels / RATIO, ("R", "G", "B"), whole=True),
    }
    write_layers(layers, FrameLayers(content))
    at = np.eye(4)
    at[2, 3] = STONE

    def development() -> Development:
        return Development(TO_REC709 / light, 1 / light)

    known = {
        "water": water, "camera": camera, "pose": number, "pose_set": "way", "lowered_m": 0.0,
        "group": f"{water[-3:].strip(':')}-sun", "repeat": 0, "time_s": TIMES[number],
        "rig": {"name": "sun"},
        "settings": SETTINGS if water != "air" else {"water": "air", "sun_zenith": 30.0},
    }  # fmt: skip
    view = DataSetView(
        name, paths["images"], OPTICS, pose, ("train", "val", "test", "train", "test")[number],
        depth=paths["depth"], instance_map=paths["ids"],
        instances=(SeenInstance(5, "stone", at, 2, paths["ids"]),), metadata=known,
    )  # fmt: skip
    return view, RenderedView(linear, layers, linear, linear, development)
