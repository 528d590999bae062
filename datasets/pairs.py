"""Pairs for restoration: a picture through the water, and the same without it, exposed alike."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.spectral_image import write_png
from .axes import Array
from .files import make_folder, write_text
from .set_files import SetFiles
from .view import AIR, DataSetView

IMAGE, UNATTENUATED = "I", "J"
"""Layers that the two pictures of a pair are made of."""
_BRIGHT = 0.995  # fraction of the channels of both that stay below white
_SAME = ("pose_set", "pose", "camera", "lowered_m", "rig", "repeat")


def write_pairs(files: SetFiles) -> None:
    """Write pairs of the scene, and of it as it is lit there, without water before the camera."""
    wet = [view for view in files.views if view.metadata["water"] != AIR]
    _write(files, "pairs", {view.name: view for view in wet}, UNATTENUATED)


def write_air_pairs(files: SetFiles) -> None:
    """Write pairs of the scene in water, and in air."""
    wet, dry = (
        [view for view in files.views if (view.metadata["water"] == AIR) is in_air]
        for in_air in (False, True)
    )
    partners: dict[str, DataSetView] = {}
    for view in wet:
        found = next((other for other in dry if is_same(view.metadata, other.metadata)), None)
        if found is not None:  # else it is not rendered yet
            partners[view.name] = found
    if wet and dry and not partners:
        raise InputError(
            "pairs_air: no view in water has one of the same pose and light in air; render the "
            "rest of the set"
        )
    _write(files, "pairs_air", partners, IMAGE)


def is_same(view: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Whether a view in air is of the same camera and light; the water's settings are not its."""
    dry: Mapping[str, Any] = other["settings"]
    return all(view.get(name) == other.get(name) for name in _SAME) and all(
        view["settings"].get(name) == value for name, value in dry.items() if name != "water"
    )


def _write(files: SetFiles, kind: str, partners: Mapping[str, DataSetView], layer: str) -> None:
    folder = files.folder / kind
    raw, reference = make_folder(folder / "raw"), make_folder(folder / "reference")
    rows = ["name,split,water,reference_view,gain"]
    for view in files.views:
        other = partners.get(view.name)
        if other is None:
            continue
        wet, dry = (files.rendered[x.name].development() for x in (view, other))
        pictures = [
            _developed(files, view, IMAGE, wet.to_rec709),
            _developed(files, other, layer, dry.to_rec709 * (wet.white / dry.white)),
        ]
        gain = common_gain(*pictures)
        for path, rgb in zip((raw, reference), pictures, strict=True):
            write_png(path / f"{view.name}.png", rgb * gain)
        water = str(view.metadata["water"])
        rows.append(f"{view.name},{view.split},{water},{other.name},{gain!r}")
    write_text(folder / "pairs.csv", "\n".join(rows) + "\n")


def _developed(files: SetFiles, view: DataSetView, name: str, matrix: Array) -> Array:
    channels = files.layers(view)[name].astype(np.float64)
    return np.nan_to_num(channels @ matrix.T, posinf=0.0, neginf=0.0)


def common_gain(one: Array, two: Array) -> float:
    """Return what both pictures are multiplied by so that neither is burnt out; 1 if none is.

    Examples
    --------
    >>> common_gain(np.full((2, 2, 3), 0.5), np.full((2, 2, 3), 4.0))
    0.25
    """
    bright = max(float(np.quantile(picture, _BRIGHT)) for picture in (one, two))
    return 1.0 / bright if bright > 1.0 else 1.0
