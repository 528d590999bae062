"""A scene that needs no renderer: known points and boxes before two cameras."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from underwater_spectral.datasets.axes import looking_at
from underwater_spectral.datasets.camera import PinholeCamera
from underwater_spectral.datasets.depth_maps import planar_depth, write_depth_png
from underwater_spectral.datasets.instance_maps import write_instance_map
from underwater_spectral.datasets.view import DataSetView, SeenInstance
from underwater_spectral.uw_spectral.spectra.spectral_image import write_codes, write_png

POINTS = np.random.default_rng(3).uniform((-1, -1, -5), (1, 1, -3), (40, 3))
"""Known points of the world, m, all before the cameras."""

PLAIN = PinholeCamera.from_field_of_view(64, 48, 70.0)
ACROSS = PinholeCamera(80, 60, 70.0, 71.0, 41.3, 28.2)
BENT = PinholeCamera(80, 60, 70.0, 71.0, 41.3, 28.2, (-0.12, 0.03, 0.002, -0.001, 0.0))
BENT_MORE = PinholeCamera(80, 60, 70.0, 71.0, 41.3, 28.2, (-0.12, 0.03, 0.002, -0.001, 0.01))
CAMERAS = (PLAIN, BENT, BENT_MORE)


def poses() -> list[np.ndarray]:
    """Cameras around the points, one level, one from above, one that is rolled."""
    eyes = [(0.0, -6.0, -4.0), (4.0, -4.0, -1.0), (-5.0, 1.0, -6.0)]
    return [
        looking_at(eye, (0.0, 0.0, -4.0), roll)
        for eye, roll in zip(eyes, (0, 0, 25.0), strict=True)
    ]


def views(folder: Path, cameras: Sequence[PinholeCamera] = CAMERAS) -> list[DataSetView]:
    """Write pictures, depths and instances of three views, and return these."""
    found = []
    splits = ("train", "val", "test")
    for number, (camera, pose) in enumerate(zip(cameras, poses(), strict=True)):
        size = (camera.height, camera.width)
        y, x = np.mgrid[: size[0], : size[1]]
        image, depth = folder / f"view_{number}.png", folder / f"depth_{number}.png"
        write_png(image, np.full((*size, 3), 0.1 + 0.2 * number))
        distances = np.where(x < 5, np.inf, 4.0 + 0.01 * x + 0.02 * y)
        write_depth_png(depth, planar_depth(distances, camera))
        ids, whole = np.zeros(size, int), np.zeros(size, np.uint8)
        whole[10:30, 8:40] = 255
        ids[10:30, 8:40] = 7  # the left half of it is behind the next
        ids[5:40, 0:24] = 12
        write_instance_map(folder / f"ids_{number}.png", ids)
        write_codes(folder / f"whole_7_{number}.png", whole)
        write_codes(folder / f"whole_12_{number}.png", (ids == 12).astype(np.uint8))
        coral = looking_at((0.3, 0.2, -4.5), (1.0, 2.0, -3.0), 10.0)
        instances = (
            SeenInstance(7, "coral", coral, 3, folder / f"whole_7_{number}.png"),
            SeenInstance(12, "rock", np.eye(4), 1, folder / f"whole_12_{number}.png"),
        )
        found.append(
            DataSetView(
                f"{number}",
                image,
                camera,
                pose,
                splits[number],
                depth=depth,
                instance_map=folder / f"ids_{number}.png",
                instances=instances,
                metadata={"water": "jerlov:IB"},
            )
        )
    return found
