"""A data set on disk as samples of arrays, as training loops take them."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.errors import InputError
from ..uw_spectral.housing.description import NONE
from ..uw_spectral.spectra.spectral_image import read_exr
from .axes import Array, world_to_opencv
from .camera import PinholeCamera
from .depth_maps import read_depth_png
from .index import NAME, IndexedView, read_index
from .layer_file import camera_of, read_layers
from .pairs import is_same
from .picture_codes import read_codes, read_rgb
from .view import AIR, SPLITS, Split

Sample = dict[str, NDArray[Any] | str]
_LAYER, _AIR = "layer:", "air"


@dataclass(frozen=True)
class LoadedSet(Sequence[Sample]):
    """Samples of a data set that was rendered here: dictionaries of numpy arrays.

    What PyTorch calls a map-style data set: ``torch.utils.data.DataLoader(LoadedSet(folder))``.
    Raises InputError if there is no data set, a field is unknown, or no view is of the split and
    waters.

    Examples
    --------
    >>> train = LoadedSet(Path("reef"), ("image", "air"), "train")  # doctest: +SKIP
    >>> train[0]["image"].shape  # doctest: +SKIP
    (3, 480, 640)
    """

    folder: Path
    #: ``image``: sRGB of 0 to 1, (3, h, w); ``air``: the same of the view of that pose and light
    #: in air; ``linear``: scene-linear Rec.709, (3, h, w); ``depth``: planar, m, infinite where
    #: nothing is, (h, w); ``instances``: numbers of objects, (h, w); ``K`` (3, 3): pixels, the
    #: first one's centre at (0, 0); ``world_to_camera`` (4, 4): OpenCV's axes; ``layer:J`` and
    #: on: layers by channel, (k, h, w).
    fields: tuple[str, ...] = ("image", "depth", "K")
    split: Split | None = None  #: All by default.
    waters: tuple[str, ...] = ()  #: Of these alone, ``air`` among them; all in water by default.
    views: tuple[IndexedView, ...] = dataclasses.field(init=False, repr=False)
    partners: Mapping[str, str] = dataclasses.field(init=False, repr=False)

    def __post_init__(self) -> None:
        if self.split is not None and self.split not in SPLITS:
            raise InputError(f"there is no split {self.split!r}, but {', '.join(SPLITS)}")
        unknown = [x for x in self.fields if x not in _FIELDS and not x.startswith(_LAYER)]
        if unknown:
            raise InputError(
                f"there is no field {unknown[0]!r}, but {', '.join(_FIELDS)}, layer:NAME"
            )
        index = read_index(self.folder / NAME)
        every = index.views.values()
        views = [view for view in every if self._is_wanted(view)]
        partners: dict[str, str] = {}
        if _AIR in self.fields:
            dry = [view for view in every if _water(view) == AIR]
            for view in views:
                found = next((x.name for x in dry if is_same(view.record, x.record)), None)
                if found is not None:
                    partners[view.name] = found
            views = [view for view in views if view.name in partners]
        if not views:
            waters = ", ".join(sorted({_water(view) for view in every}))
            raise InputError(
                f"{self.folder} has no view of split {self.split or 'any'} in "
                f"{', '.join(self.waters) or 'water'}{' with one in air' * (_AIR in self.fields)};"
                f" its waters are {waters}"
            )
        object.__setattr__(self, "views", tuple(views))
        object.__setattr__(self, "partners", partners)

    def _is_wanted(self, view: IndexedView) -> bool:
        there = _water(view) in self.waters if self.waters else _water(view) != AIR
        return there and self.split in (None, view.split)

    def __len__(self) -> int:
        return len(self.views)

    @overload
    def __getitem__(self, number: int) -> Sample: ...
    @overload
    def __getitem__(self, number: slice) -> Sequence[Sample]: ...
    def __getitem__(self, number: int | slice) -> Sample | Sequence[Sample]:
        if isinstance(number, slice):
            return [self[k] for k in range(*number.indices(len(self)))]
        view = self.views[number]
        sample: Sample = {"name": view.name, "water": _water(view)}
        for field in self.fields:
            read = _layer if field.startswith(_LAYER) else _FIELDS[field]
            sample[field] = read(self, view, field)
        return sample

    def path(self, kind: str, name: str, *suffixes: str) -> Path:
        """Return a file of a view, the first that is there."""
        paths = [self.folder / kind / f"{name}.{suffix}" for suffix in suffixes]
        found = next(filter(Path.is_file, paths), None)
        if found is None:
            raise InputError(
                f"there is no {paths[0]}; let [output] of the set have it, and export again"
            )
        return found


def _water(view: IndexedView) -> str:
    return str(view.record["settings"]["water"])


def _image(of: LoadedSet, view: IndexedView, field: str) -> NDArray[np.float32]:
    name = of.partners[view.name] if field == _AIR else view.name
    codes = read_rgb(of.path("images", name, "png", "jpg"))
    return _channels_first(codes / np.float32(np.iinfo(codes.dtype).max))


def _layer(of: LoadedSet, view: IndexedView, field: str) -> NDArray[np.float32]:
    path, wanted = of.path("layers", view.name, "exr"), field.removeprefix(_LAYER)
    layers = read_layers(path).layers
    if wanted not in layers:
        raise InputError(f"{path} has no layer {wanted!r}, but {', '.join(layers)}")
    return _channels_first(layers[wanted].values)


def _pinhole(of: LoadedSet, view: IndexedView) -> tuple[PinholeCamera, Array]:
    """The camera in the water, and its pose."""
    port = view.record["camera"].get("port")
    if not port or port[0][1] == NONE:
        return view.camera, view.camera_to_world
    return camera_of(read_layers(of.path("layers", view.name, "exr")).header)


def _channels_first(pixels: NDArray[Any]) -> NDArray[np.float32]:
    return np.ascontiguousarray(np.moveaxis(pixels, -1, 0), dtype=np.float32)


_FIELDS: Mapping[str, Callable[[LoadedSet, IndexedView, str], NDArray[Any]]] = {
    "image": _image,
    _AIR: _image,
    "linear": lambda of, view, _: _channels_first(
        read_exr(of.path("linear", view.name, "exr"))[0][..., :3]
    ),
    "depth": lambda of, view, _: read_depth_png(of.path("depth", view.name, "png")).astype(
        np.float32
    ),
    "instances": lambda of, view, _: read_codes(of.path("instances", view.name, "png")).astype(
        np.int64
    ),
    "K": lambda of, view, _: _pinhole(of, view)[0].K_opencv,
    "world_to_camera": lambda of, view, _: world_to_opencv(_pinhole(of, view)[1]),
}
