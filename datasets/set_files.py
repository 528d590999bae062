"""A set whose views are written, for the formats that describe it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.spectra.spectral_image import read_exr
from .axes import Array
from .card import DataCard
from .depth_maps import PLANAR
from .files import make_folder, plain_names
from .layer_file import FrameLayers, read_layers
from .view import DataSetView


@dataclass(frozen=True, eq=False)
class Development:
    """How the sensor's channels became a picture.

    ``to_rec709``, shape (3, 3), leads from the channels to the picture, white balance and exposure
    included; ``white`` is the luminance in the picture of white in the surface light, which tells
    exposures apart.
    """

    to_rec709: Array
    white: float


@dataclass(frozen=True)
class RenderedView:
    """What was rendered of a view: scene-linear picture, its layers, and JSON of its truth.

    ``record`` is JSON, written last; None if the view is not rendered as its job now has it.
    ``development`` returns how it was developed.
    """

    picture: Path
    layers: Path
    record: Path | None
    truth: Path
    development: Callable[[], Development]


@dataclass(frozen=True, eq=False)
class Shape:
    """The surface of an object in its own axes, m: vertices (v, 3) and triangles (t, 3) of them."""

    vertices: NDArray[np.floating]
    triangles: NDArray[np.integer]


Shapes = Callable[[Collection[int]], Mapping[int, Shape]]
"""Returns the shapes of models, by their numbers; those of objects without a mesh are missing."""


@dataclass(frozen=True)
class SetFiles:
    """A set whose views are written, for the files that describe them.

    ``points`` are the known points of each view, where a format has these; ``rendered`` is by the
    names of views; ``shapes`` are those of the models; ``report_note`` receives what a format could
    not hold, a line each. Cameras and pose sets are named in the order of the specification: names
    in paths follow from it, whatever is rendered.
    """

    folder: Path
    views: Sequence[DataSetView]
    card: DataCard
    points: int = 0
    seed: int = 0
    rendered: Mapping[str, RenderedView] = field(default_factory=dict)
    shapes: Shapes = lambda _: {}
    report_note: Callable[[str], None] = lambda _: None
    cameras: tuple[str, ...] = ()
    pose_sets: tuple[str, ...] = ()

    @cached_property
    def camera_names(self) -> dict[str, str]:
        """The names of cameras in paths."""
        return plain_names((*self.cameras, *map(camera_of_view, self.views)))

    @cached_property
    def pose_set_names(self) -> dict[str, str]:
        """The names of sets of poses in paths."""
        named = (str(view.metadata.get("pose_set")) for view in self.views)
        return plain_names((*self.pose_sets, *named))

    def of_split(self, split: str) -> list[DataSetView]:
        """Return the views of a split."""
        return [view for view in self.views if view.split == split]

    @cached_property
    def scenes(self) -> dict[str, list[DataSetView]]:
        """Views of one water, light and rig, which show one scene."""
        found: dict[str, list[DataSetView]] = {}
        for view in self.views:
            found.setdefault(str(view.metadata["group"]), []).append(view)
        return found

    def scene_folder(self, name: str) -> Path:
        """Return the folder of one of the scenes, made if it is not there."""
        return make_folder(self.folder / "scenes" / name)

    def layers(self, view: DataSetView) -> FrameLayers:
        """Return the layers of a view."""
        return read_layers(self.rendered[view.name].layers)

    def planar_depth(self, view: DataSetView) -> NDArray[np.float32]:
        """Return the planar depth of a view, m; infinite where nothing is seen."""
        return self.layers(view)[PLANAR]


def camera_of_view(view: DataSetView) -> str:
    """Return the name of the camera of a view."""
    return str(view.metadata.get("camera", "camera"))


def shown_pixels(view: DataSetView) -> NDArray[np.uint8]:
    """Return the 8-bit codes of a view's picture, shape (height, width, 3)."""
    pixels = read_exr(view.image)[0]  # any picture, as fractions
    return np.round(pixels[..., :3] * 255).astype(np.uint8)
