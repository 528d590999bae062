"""Clouds in the water as node groups look them up: images of their numbers, and of grids."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.clouds.cloud_numbers import ESCAPES, ESCAPING, CloudNumbers
from ..uw_spectral.mathematics import Operand
from ..uw_spectral.table import Table
from ..uw_spectral.water.phase import PhaseFunction
from . import cloud_grids
from .data_blocks import write_pixels
from .image_table import ImageTable
from .loops import summed
from .node_mathematics import NODES, Graph, NodeValue
from .texture_atlas import closest, number_image

NAME, PART = "UW Clouds", "uw_clouds"
GRIDS, GRID_LAMPS = "uw_cloud_grids", "uw_cloud_lamps"
"""Parts of clouds with grids, and of what is between these and lamps."""
# Texels of a cloud: single numbers, three to each, and how many the other fields take.
_SINGLE = ("reference", "asymmetry", "ceiling", "peak", "kind")
_OF_PLACE = {"middle": 1, "rows": 3}
_TRIPLES = {
    field.name: _OF_PLACE.get(field.name, 1)
    for field in fields(CloudNumbers)
    if field.name not in (*_SINGLE, "escapes", "grid")
}
_FIRST = -(-len(_SINGLE) // 3)  # texels of single numbers
_ESCAPES = _FIRST + sum(_TRIPLES.values())
_WIDTH = _ESCAPES + ESCAPES.count


def new_image(count: int) -> bpy.types.Image:
    """Make the image of the numbers of so many clouds."""
    return number_image(NAME, _WIDTH, count, half=False)


def write_clouds(image: bpy.types.Image, clouds: Sequence[CloudNumbers]) -> None:
    """Put the numbers of clouds into an image of their size."""
    out = np.zeros((len(clouds), _WIDTH, 4), np.float32)
    out[..., 3] = 1.0
    for row, cloud in zip(out, clouds, strict=True):
        row[:_ESCAPES, :3] = _texels(cloud)
        if cloud.escapes is not None:
            assert isinstance(cloud.escapes, Table)
            row[_ESCAPES:, :3] = cloud.escapes.values
    write_pixels(image, out)


def write_grids(image: bpy.types.Image, clouds: Sequence[CloudNumbers]) -> None:
    """Put the numbers of clouds with grids, and these, into an image of their number."""
    cloud_grids.write(image, [(_texels(cloud), cloud.grid) for cloud in clouds])


def write_lamps(image: bpy.types.Image, clouds: Sequence[CloudNumbers]) -> None:
    """Put what is between grids and lamps into an image of their numbers."""
    cloud_grids.write_lamps(image, [cloud.grid for cloud in clouds])


def _texels(cloud: CloudNumbers) -> NDArray[np.float64]:
    """Return what all clouds have, three numbers each."""
    single = [getattr(cloud, name) for name in _SINGLE] + [0.0] * (3 * _FIRST - len(_SINGLE))
    values = [np.ravel(getattr(cloud, name)) for name in _TRIPLES]
    return np.reshape(np.concatenate([single, *values]), (-1, 3))


def _read(graph: Graph, image: bpy.types.Image, row: NodeValue | float) -> CloudNumbers:
    """Look up what all clouds have in a row of an image."""
    texels = [closest(graph, image, float(i), row) for i in range(_ESCAPES)]
    first = _FIRST
    single = [x for place in texels[:first] for x in graph.components(place)]
    parts: dict[str, Operand] = dict(zip(_SINGLE, single, strict=False))
    for name, size in _TRIPLES.items():
        found = texels[first : first + size]
        first += size
        parts[name] = found[0]
        if name in _OF_PLACE:
            parts[name] = [x for place in found for x in graph.components(place)]
    return CloudNumbers(**parts)


@dataclass(frozen=True, eq=False)
class CloudTable:
    """Clouds in an image of :func:`new_image`, in a node tree; a :class:`.Group`.

    One is read where it is needed; several are looped over, so that what is compiled does not grow
    with their number.
    """

    graph: Graph
    image: bpy.types.Image

    @property
    def count(self) -> int:
        """Number of clouds."""
        return int(self.image.size[1])

    def total(self, terms: Callable[[CloudNumbers], Sequence[Operand]]) -> Sequence[Operand]:
        """Add up terms of each."""
        if self.count == 1:
            return terms(self._cloud(0.0))
        return summed(self.graph, self.count, lambda index: terms(self._cloud(index)))

    def product(self, factor: Callable[[CloudNumbers], Operand]) -> Operand:
        """Multiply channels of each, which are positive."""
        if self.count == 1:
            return factor(self._cloud(0.0))

        def logarithms(index: NodeValue) -> Sequence[NodeValue]:
            return [NODES.log(x) for x in self.graph.components(factor(self._cloud(index)))]

        return NODES.exp(self.graph.vector(*summed(self.graph, self.count, logarithms)))

    @property
    def alone(self) -> bool:
        """Whether there is one only."""
        return self.count == 1

    @property
    def grids(self) -> Sequence[CloudNumbers]:
        """None of them."""
        return ()

    def _cloud(self, index: NodeValue | float) -> CloudNumbers:
        found = _read(self.graph, self.image, index)
        escapes = ImageTable(self.graph, self.image, ESCAPING, float(_ESCAPES), index, margin=0)
        return replace(found, escapes=escapes)


def grids_in(
    graph: Graph, image: bpy.types.Image, of_lamps: bpy.types.Image | None = None, lamps: int = 0
) -> list[CloudNumbers]:
    """Return the clouds with grids in an image, in a node tree; arguments of :func:`.grid`."""
    found = []
    for index in range(cloud_grids.count(image)):
        numbers = _read(graph, image, cloud_grids.row(index))
        box = cloud_grids.grid(graph, image, index, of_lamps, lamps)
        found.append(replace(numbers, grid=box))
    return found


def kinds(phases: Sequence[PhaseFunction]) -> list[PhaseFunction]:
    """Return the phase functions of clouds, each once; its place is the kind of a cloud."""
    found: list[PhaseFunction] = []
    for phase in phases:
        found += [] if phase in found else [phase]
    return found
