"""The formats of data sets: what each writes, in which axes, and what it needs of the views."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.spectra.spectral_image import read_exr
from .axes import Array
from .bop import write_bop
from .card import DataCard
from .coco import write_coco
from .colmap import write_colmap
from .depth_maps import read_depth_png
from .files import make_folder
from .nerfstudio import write_nerfstudio
from .sparse_points import sparse_points
from .view import SPLITS, DataSetView

_OPENCV = "COLMAP and BOP: world or model to camera, the camera looks along +z, y is down."


@dataclass(frozen=True)
class SetFiles:
    """A set whose views are written, for the files that describe them.

    Attributes
    ----------
    folder : Path
    views : sequence of DataSetView
    card : DataCard
    points : int
        Known points of each view, where a format has these.
    seed : int
    """

    folder: Path
    views: Sequence[DataSetView]
    card: DataCard
    points: int
    seed: int

    def of_split(self, split: str) -> list[DataSetView]:
        """Return the views of a split."""
        return [view for view in self.views if view.split == split]


@dataclass(frozen=True)
class Format:
    """A format of data sets.

    Attributes
    ----------
    write : callable
        Writes its files into a set.
    convention : str
        Of its poses, for the card; empty where it has none.
    silhouettes : bool
        Whether it tells how much of an object is hidden.
    """

    write: Callable[[SetFiles], None]
    convention: str = ""
    silhouettes: bool = False


def _nerfstudio(files: SetFiles) -> None:
    """Write the whole set, and each scene of it."""
    write_nerfstudio(files.folder / "transforms.json", files.views)
    for name, views in _groups(files.views).items():
        write_nerfstudio(_scene(files, name) / "transforms.json", views)


def _colmap(files: SetFiles) -> None:
    """Write each scene."""
    for name, views in _groups(files.views).items():
        points = sparse_points(views, _depth, _picture, files.points, files.seed)
        write_colmap(_scene(files, name) / "sparse" / "0", views, points, files.folder / "images")


def _bop(files: SetFiles) -> None:
    """Write a scene for each split and water."""
    for split in SPLITS:
        for number, views in enumerate(_groups(files.of_split(split)).values()):
            write_bop(files.folder / "bop" / split / f"{number:06d}", views)


def _coco(files: SetFiles) -> None:
    """Write a file for each split."""
    for split in SPLITS:
        views = files.of_split(split)
        if views:
            write_coco(files.folder / f"coco_{split}.json", views, files.card)


FORMATS = {
    "nerfstudio": Format(
        _nerfstudio,
        "`transforms.json` (nerfstudio): camera to world, the camera looks along -z, y is up.",
    ),
    "colmap": Format(_colmap, _OPENCV),
    "bop": Format(_bop, _OPENCV, silhouettes=True),
    "coco": Format(_coco),
}
"""By the names that a specification gives them; a set without ``formats`` has all."""


def conventions() -> tuple[str, ...]:
    """Return the conventions of all formats, each once."""
    return tuple(dict.fromkeys(each.convention for each in FORMATS.values() if each.convention))


def _groups(views: Iterable[DataSetView]) -> dict[str, list[DataSetView]]:
    """Views of one water, light and rig, which show one scene."""
    found: dict[str, list[DataSetView]] = {}
    for view in views:
        found.setdefault(str(view.metadata["group"]), []).append(view)
    return found


def _scene(files: SetFiles, name: str) -> Path:
    return make_folder(files.folder / "scenes" / name)


def _depth(view: DataSetView) -> Array:
    assert view.depth is not None
    return read_depth_png(view.depth)


def _picture(view: DataSetView) -> NDArray[np.uint8]:
    """An 8-bit picture."""
    pixels = read_exr(view.image)[0]  # any picture, as shares
    return np.round(pixels * 255).astype(np.uint8)
