"""Water that differs with depth: homogeneous layers, made from samples at depths."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, unknown_name
from ..spectra.spectral_table import checked_spectral_table
from ..spectra.spectrum import Table, read_table, read_text, table_text
from .bio_optics import AMOUNTS, PROPERTIES, Constituents
from .optical_properties import Water

DEPTH = "depth_m"
"""Column that makes a table a profile."""

Array = NDArray[np.float64]
T = TypeVar("T")
U = TypeVar("U")

MOST_LAYERS = 16
"""Layers that solver and renderer take; more are finer than their light can tell apart."""


@dataclass(frozen=True)
class DepthProfile(Generic[T]):
    """Something for each layer of the water, from the surface down.

    Raises
    ------
    InputError
        If the depths do not increase from 0, or there are more than :data:`MOST_LAYERS`.
    """

    #: Depth in m at which each layer begins, the first at 0. The last one has no lower end, but for
    #: the floor.
    tops: tuple[float, ...]
    layers: tuple[T, ...]  #: What each of them holds, such as a :class:`.Water`.

    def __post_init__(self) -> None:
        increase = all(upper < lower for upper, lower in itertools.pairwise(self.tops))
        if len(self.tops) != len(self.layers) or self.tops[:1] != (0.0,) or not increase:
            raise InputError(
                f"profile: {len(self.layers)} layers begin at {self.tops} m; give one depth each, "
                "increasing from 0"
            )
        if len(self.layers) > MOST_LAYERS:
            raise InputError(
                f"profile: {len(self.layers)} layers; at most {MOST_LAYERS} can be computed, so "
                "average neighbouring depths"
            )

    @classmethod
    def of_samples(cls, depths: Sequence[float], samples: Sequence[T]) -> DepthProfile[T]:
        """Layers around samples: they meet half-way between two neighbouring depths.

        The first reaches up to the surface, and the last has no lower end.

        Raises
        ------
        InputError
            If the depths are not as said.
        """
        if len(depths) < 2:
            raise InputError(
                f"a profile needs two depths, and there is {len(depths)}; leave {DEPTH} out for "
                "water that is the same everywhere"
            )
        if not depths[0] >= 0:
            raise InputError(f"depth {depths[0]:g} m lies above the surface; depths are 0 or more")
        for upper, lower in itertools.pairwise(depths):
            if not upper < lower:
                raise InputError(
                    f"depth {lower:g} m follows {upper:g} m; depths must increase, each given once"
                )
        middles = ((upper + lower) / 2 for upper, lower in itertools.pairwise(depths))
        return cls((0.0, *map(float, middles)), tuple(samples))

    def at(self, y: float) -> T:
        """What lies at a depth in m; where two layers meet, the upper one."""
        return self.layers[max(sum(top < y for top in self.tops) - 1, 0)]

    def map(self, function: Callable[[T], U]) -> DepthProfile[U]:
        """Return the layers with something else in them, made from what they hold."""
        return DepthProfile(self.tops, tuple(map(function, self.layers)))


WaterProfile = DepthProfile[Water] | DepthProfile[Constituents]
"""What a table over depth holds."""


def read_profile(path: str | Path) -> WaterProfile:
    """Read a profile from a CSV table with the column ``depth_m``.

    Either ``depth_m,wavelength_nm,a,b`` in m, nm and 1/m: the rows of a depth stand together, and
    the wavelengths may differ between depths. Or ``depth_m`` with some of
    ``chlorophyll,cdom,minerals,detritus`` in the units of :class:`.Constituents`, a row for each
    depth; what is left out is 0. The comment may state what holds at all depths, as
    ``# cdom-slope: 0.018``, by the keys of :func:`.parse_constituents`. Depths increase; see
    :meth:`DepthProfile.of_samples` for the layers that they make.

    Raises
    ------
    InputError
        If the table is not as said; the message names the file and the place in it.
    """
    if "wavelength_nm" in table_text(read_text(path), str(path)).names:
        return _measured(Path(path))
    return _of_constituents(read_table(path, (DEPTH,)))


def _measured(path: Path) -> DepthProfile[Water]:
    table = read_table(path, (DEPTH, "wavelength_nm", "a", "b"), ("Kd",))
    depth = table.columns[DEPTH]
    starts = [0, *(np.flatnonzero(np.diff(depth)) + 1), len(depth)]
    rows = [slice(*ends) for ends in itertools.pairwise(starts)]

    def water(part: slice) -> Water:
        columns = {name: values[part] for name, values in table.columns.items() if name != DEPTH}
        at = f"at {depth[part.start]:g} m"
        here = checked_spectral_table(Table(path, table.header, columns), f"{path}, {at}")
        return Water.from_table(here, f"{path.name} {at}")

    return _layers(path, [float(depth[part.start]) for part in rows], rows).map(water)


def _of_constituents(table: Table) -> DepthProfile[Constituents]:
    path, columns = table.path, dict(table.columns)
    depths = columns.pop(DEPTH).tolist()
    stated = {name: table.stated(key) for key, name in PROPERTIES.items()}
    everywhere = {name: value for name, value in stated.items() if value is not None}
    for name in columns:
        if name not in AMOUNTS:
            raise InputError(f"{path}: {unknown_name('constituent', name, AMOUNTS)}")
    if not columns:
        raise InputError(
            f"{path} has {DEPTH} alone; add wavelength_nm, a and b, or some of {', '.join(AMOUNTS)}"
        )

    def constituents(at: int) -> Constituents:
        try:
            amounts = {name: float(values[at]) for name, values in columns.items()}
            return Constituents(**amounts, **everywhere)
        except InputError as error:
            raise InputError(f"{path}, at {depths[at]:g} m: {error}") from error

    return _layers(path, depths, range(len(depths))).map(constituents)


def _layers(path: Path, depths: Sequence[float], samples: Sequence[T]) -> DepthProfile[T]:
    try:
        return DepthProfile.of_samples(depths, samples)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
