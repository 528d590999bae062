"""Manifests of jobs that nobody renders, for the tests."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

from underwater_spectral.jobs import manifest as manifests
from underwater_spectral.settings.scene_settings import SceneSettings


def small_manifest(
    out: Path, frames: int = 1, cameras: tuple[str, ...] = ("Camera",), passes: int = 1, **changes
) -> manifests.Manifest:
    """A job of so many frames, cameras and passes; ``changes`` are fields of it."""
    numbers = tuple(range(1, frames + 1))
    values = {
        "scene": None,
        "out": out,
        "scene_sha256": "unsaved",
        "versions": {"Blender": "5.2.3 LTS"},
        "output": manifests.Output(
            "cycles", "bands", "cpu", (8, 8, 100), 0, False, None, (50.0, 60.0), ()
        ),
        "settings": asdict(SceneSettings()),
        "changes": {},
        "frames": numbers,
        "cameras": manifests.folders(cameras),
        "passes": tuple(manifests.Pass((n,), 0, 0, 2) for n in range(passes)),
        "bands_nm": tuple(400.0 + n for n in range(passes)),
        "widths_nm": (1.0,) * passes,
        "developments": (manifests.Development("none", ((1.0,) * passes,) * 3),),
        "views": tuple(
            manifests.View(frame, camera, 5.0 + frame / 3, 0, (0.1, frame / 7, -5.0, 0.0, 1.0, 0.0))
            for camera in cameras
            for frame in numbers
        ),
        "files": (),
    }
    return manifests.Manifest(**{**values, **changes})
