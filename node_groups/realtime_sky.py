"""A sky that is a picture: an image of all directions, as Blender has them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import override

import bpy
import numpy as np

from ..uw_spectral.mathematics import NUMPY, Mathematics, Operand
from ..uw_spectral.transfer.sky import PICTURE, Sky
from ..uw_spectral.transfer.sky_picture import SkyPicture
from .data_blocks import write_pixels
from .node_mathematics import Graph
from .realtime_values import SKY_LEVELS
from .realtime_water import PixelWater
from .shape import Shape, TermShape
from .texture_atlas import number_image, take_as_given

PART = "uw_sky"
_SHOWN = "uw_sky_shown"


class SkyShape(TermShape):
    """The sky is a picture."""

    skies = 3
    channels = SKY_LEVELS

    @override
    def parts(self, shape: Shape) -> dict[str, bpy.types.ID]:
        return {PART: new_image()}

    @override
    def sky(self, water: PixelWater) -> Sky:
        return DrawnSky(graph=water.graph, image=water.sources.parts[PART])


def new_image() -> bpy.types.Image:
    """Make the image, whose size comes with what is written."""
    return number_image("UW Sky", 4, 4)


def write(image: bpy.types.Image, picture: SkyPicture, *, fresh: bool = False) -> None:
    """Put a picture into the image, or a fresh one, unless it shows that already."""
    key = str(hash(picture))
    if image.get(_SHOWN) == key:
        return
    rows, columns = picture.radiance.shape[:2]
    pixels = np.ones((rows, columns, 4), np.float32)
    pixels[..., :3] = picture.radiance[::-1]
    write_pixels(image, pixels, fresh=fresh)[_SHOWN] = key


@dataclass(frozen=True, eq=False)
class DrawnSky(Sky):
    """The look-up of the picture in a node tree: radiance in red, green and blue."""

    graph: Graph | None = None
    image: bpy.types.ID | None = None
    kind: str = PICTURE

    @override
    def radiance(self, v: Sequence[Operand], m: Mathematics = NUMPY) -> Operand:
        assert self.graph is not None, "it is looked up in a tree"
        node = self.graph.inner_node("ShaderNodeTexEnvironment", image=self.image)
        take_as_given(node)
        self.graph.assign(self.graph.vector(*v), node.inputs["Vector"])
        return self.graph.term(node.outputs["Color"])
