"""The moving surface as node groups read it: images, and where to look them up.

The images are ordinary data-blocks, so a file opens without the extension: one holds the relative
sunlight at four depths, one per channel, the other the slopes of the surface along x and y. Where
the surface has heights, these are in the third channel, and one more image holds the same of the
long waves. Where waves leave foam, two more hold how much either crowd the water together.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import override

import bpy

from ..uw_spectral.mathematics import Operand
from ..uw_spectral.surface.wave_patterns import (
    LAYERS,
    WavePatterns,
    layer_position,
    pattern_at,
    sunlight_factor,
    under_waves,
)
from ..uw_spectral.surface.whitecaps import Foam
from ..uw_spectral.transfer.foam_light import FoamAhead
from ..uw_spectral.transfer.pixel_parts import SurfaceAbove
from ..uw_spectral.transfer.radiance_field import Ripples
from .data_blocks import write_pixels
from .node_mathematics import NODES, Graph, NodeValue
from .pixel_term import Pixel, TermPixel
from .realtime_rays import eye_place, place_here
from .realtime_values import SUN, SUN_IN_AIR, Values
from .shape import Shape, TermShape
from .texture_atlas import number_image, take_as_given, texel

type Numbers = Callable[[str], NodeValue]
"""Looks a number of UW Values up by its name."""
SLOPE, FOAM = "Slope", "Foam"
WAVES_PER_METRE, WAVES_HALF_CELL = "waves per metre", "waves half cell"
WAVES_FAR_PER_METRE, WAVES_FAR_HALF_CELL = "long waves per metre", "long waves half cell"
WAVES_HIGHEST = "waves highest"
WAVES_LOG_DEPTH, WAVES_PER_LOG = "waves log depth", "waves per log"
GLITTER, GLITTER_WIDTH = "glitter", "glitter width"
CAUSTIC_STRENGTH, LEAST_PATTERN = "caustic strength", "least caustic pattern"
FOAM_FIRST, FOAM_PER_CROWDING = "foam first", "foam per crowding"
FOAM_IN_SUN, FOAM_IN_SKY, FOAM_BELOW = "foam in sun", "foam in sky", "foam below"
_NAMES = {
    "uw_caustics": "UW Caustics",
    "uw_slopes": "UW Slopes",
    "uw_long_waves": "UW Long Waves",
    "uw_crowding": "UW Crowding",
    "uw_long_crowding": "UW Long Crowding",
}
_PARTS = tuple(_NAMES)
FAR_PART = _PARTS[2]
"""Image of the long waves of a surface with heights."""
_FLATTEST = 1e-3  # vertical component of a view ray that still finds a place on the surface
_CALM = 4  # pixels
# m from the eye. Beside a face seen edge-on a place may lie anywhere; the anisotropic filter of a
# software rasteriser then sums all texels between the two.
_FARTHEST, _FARTHEST_PER_HEIGHT = 100.0, 4.0


class WaveShape(TermShape):
    """The surface moves and throws caustics."""

    caustics = True
    singles = (
        *(WAVES_PER_METRE, WAVES_HALF_CELL, WAVES_LOG_DEPTH, WAVES_PER_LOG),
        *(GLITTER, GLITTER_WIDTH, CAUSTIC_STRENGTH, LEAST_PATTERN),
    )

    @override
    def parts(self, shape: Shape) -> dict[str, bpy.types.ID]:
        return {part: new_image(part) for part in _PARTS[:2]}

    @override
    def in_pixel(self, pixel: Pixel) -> TermPixel:
        return _WavePixel(pixel)


class FoamShape(TermShape):
    """Waves with heights leave foam."""

    channels = FOAM_BELOW, FOAM_IN_SUN, FOAM_IN_SKY
    singles = FOAM_FIRST, FOAM_PER_CROWDING

    @override
    def parts(self, shape: Shape) -> dict[str, bpy.types.ID]:
        return {part: new_image(part) for part in _PARTS[3:]}


@dataclass(frozen=True)
class WaveImages:
    """The images of a moving surface; that of long waves if it has heights.

    Those of the crowding of short and of long waves if they leave foam.
    """

    caustics: bpy.types.Image
    slopes: bpy.types.Image
    far: bpy.types.Image | None = None
    crowding: bpy.types.Image | None = None
    far_crowding: bpy.types.Image | None = None

    @property
    def parts(self) -> dict[str, bpy.types.ID]:
        """Those that there are, by the names of :func:`images_in`."""
        found = zip(_PARTS, vars(self).values(), strict=True)
        return {name: image for name, image in found if image is not None}


def images_in(parts: Mapping[str, bpy.types.ID]) -> WaveImages | None:
    """Return the images of a water, if its surface moves."""
    found = [parts.get(name) for name in _PARTS]
    return WaveImages(*found) if found[0] is not None else None


def new_images(*, raised: bool = False, foam: bool = False) -> WaveImages:
    """Make the images of a surface without waves, which may get heights and foam."""
    wanted = zip(_PARTS, (True, True, raised, foam, foam), strict=True)
    return WaveImages(*(new_image(part) if is_wanted else None for part, is_wanted in wanted))


def new_image(part: str) -> bpy.types.Image:
    """Make one of them."""
    return number_image(_NAMES[part], _CALM, _CALM)


def write_patterns(images: WaveImages, waves: WavePatterns, *, fresh: bool = False) -> None:
    """Put the waves of a moment into images, see :func:`.write_pixels`.

    With ``fresh`` all are replaced: Cycles keeps what it has read of one while its data are
    persistent.
    """
    write_pixels(images.caustics, waves.caustics_image(), fresh=fresh)
    write_pixels(images.slopes, waves.slopes_image(), fresh=fresh)
    if images.far is not None and waves.raised is not None:
        write_pixels(images.far, waves.raised.far.image(), fresh=fresh)
    if images.crowding is not None and images.far_crowding is not None and waves.raised is not None:
        write_pixels(images.crowding, waves.raised.near.crowding_image(), fresh=fresh)
        write_pixels(images.far_crowding, waves.raised.far.crowding_image(), fresh=fresh)


def numbers(waves: WavePatterns, strength: float) -> dict[str, float]:
    """Return what the nodes need to look up the images of waves, by name."""
    depths, raised = waves.layers.depths, waves.raised
    far = {}
    if raised is not None:
        far = {
            WAVES_FAR_PER_METRE: 1 / raised.far.tile,
            WAVES_FAR_HALF_CELL: 0.5 / len(raised.far.elevation),
            WAVES_HIGHEST: raised.highest,
        }
        if raised.foam is not None:
            far |= {FOAM_FIRST: raised.foam.first, FOAM_PER_CROWDING: raised.foam.per_crowding}
    return far | {
        WAVES_PER_METRE: 1 / waves.layers.tile,
        WAVES_HALF_CELL: 0.5 / len(waves.slope_x),
        WAVES_LOG_DEPTH: math.log(depths[0]),
        WAVES_PER_LOG: (LAYERS - 1) / math.log(depths[-1] / depths[0]),
        CAUSTIC_STRENGTH: strength,
    }


def sample(
    graph: Graph, image: bpy.types.Image, x: NodeValue, y: NodeValue, scale: tuple[NodeValue, ...]
) -> tuple[NodeValue, NodeValue]:
    """Colour and alpha of a tiled image of some scale at a place on the surface."""
    texture = graph.node("ShaderNodeTexImage", image=image, interpolation="Linear")
    texture.extension = "REPEAT"
    take_as_given(texture)
    per_metre, half_cell = scale
    where = graph.vector(x * per_metre + half_cell, y * per_metre + half_cell, 0.0)
    graph.assign(where, texture.inputs["Vector"])
    return graph.term(texture.outputs["Color"]), graph.term(texture.outputs["Alpha"])


def layers_at(
    graph: Graph, caustics: bpy.types.Image, x: NodeValue, y: NodeValue, number: Numbers
) -> tuple[NodeValue, NodeValue, NodeValue, NodeValue]:
    """Relative sunlight at the depths of the four layers."""
    scale = number(WAVES_PER_METRE), number(WAVES_HALF_CELL)
    colour, alpha = sample(graph, caustics, x, y, scale)
    return (*graph.components(colour), alpha)


def caustics_here(
    graph: Graph, values: bpy.types.ShaderNodeTree, caustics: bpy.types.Image
) -> NodeValue:
    """Relative sunlight at the shaded point."""
    number = numbers_of(graph, values)
    px, py, pz = place_here(graph)
    depth = NODES.maximum(-pz, 0.0)
    x, y = under_waves(px, py, depth, [number(name) for name in SUN])
    *eye, height = eye_place(graph)
    reach = _FARTHEST + _FARTHEST_PER_HEIGHT * NODES.maximum(height, -height)
    x, y = (
        NODES.clamp(at, here - reach, here + reach) for at, here in zip((x, y), eye, strict=True)
    )
    layers = layers_at(graph, caustics, x, y, number)
    position = layer_position(depth, number(WAVES_LOG_DEPTH), number(WAVES_PER_LOG), NODES)
    return pattern_at(depth, position, layers, NODES)


@dataclass(frozen=True, eq=False)
class WaveTables:
    """Look-ups of the images of a moving surface in a node tree, at places x and y on it."""

    graph: Graph
    images: WaveImages
    number: Numbers

    def slopes(self, x: NodeValue, y: NodeValue) -> NodeValue:
        """Slopes of the surface along x and y, and its height where it has any."""
        return self._added(self.images.slopes, self.images.far, x, y, filtered=True)

    def raised(self, x: NodeValue, y: NodeValue) -> NodeValue:
        """Return the same, unfiltered where there are heights: places jump between pixels.

        There a software rasteriser filters for ever.
        """
        far = self.images.far
        return self._added(self.images.slopes, far, x, y, filtered=far is None)

    def level(self, x: NodeValue, y: NodeValue) -> NodeValue | float:
        """Height of the surface over its mean; 0 where it has none."""
        return 0.0 if self.images.far is None else self.graph.components(self.raised(x, y))[2]

    def foam(self, x: NodeValue, y: NodeValue, *, filtered: bool = False) -> NodeValue | None:
        """Fraction of fresh foam; None where waves leave none.

        Filtered where places never jump between pixels, see :meth:`raised`.
        """
        near, far = self.images.crowding, self.images.far_crowding
        if near is None or far is None:
            return None
        total = self.graph.components(self._added(near, far, x, y, filtered=filtered))[0]
        foam = Foam(self.number(FOAM_FIRST), self.number(FOAM_PER_CROWDING))
        return foam.fraction(total, NODES)

    def _added(
        self,
        near: bpy.types.Image,
        far: bpy.types.Image | None,
        x: NodeValue,
        y: NodeValue,
        *,
        filtered: bool,
    ) -> NodeValue:
        """Sum of the images of short and of long waves."""

        def found(image: bpy.types.Image, *names: str) -> NodeValue:
            per_metre, half_cell = scale = tuple(map(self.number, names))
            if filtered:
                return sample(self.graph, image, x, y, scale)[0]
            size = 0.5 / half_cell

            def texels(along: NodeValue) -> NodeValue:
                turns = along * per_metre + half_cell
                return (turns - NODES.floor(turns)) * size - 0.5

            return texel(self.graph, image, texels(x), texels(y), size, size, tiled=True)

        short = found(near, WAVES_PER_METRE, WAVES_HALF_CELL)
        if far is None:
            return short
        return short + found(far, WAVES_FAR_PER_METRE, WAVES_FAR_HALF_CELL)


def numbers_of(graph: Graph, values: bpy.types.ShaderNodeTree) -> Numbers:
    """Return what looks a number of UW Values up by its name."""
    outputs = graph.shared(values)
    return lambda name: graph.term(outputs[name])


def ripples(values: Values, slope: NodeValue) -> Ripples:
    """Return the moving surface of a slope where a ray meets it."""
    slopes = values.graph.components(slope)[:2]
    width, strength = values.of(GLITTER_WIDTH, GLITTER)
    return Ripples(slopes, width, strength, values.of(*SUN_IN_AIR))


class _WavePixel(TermPixel):
    """Caustics on an object; slopes and foam of the surface where a ray of open water meets it."""

    def __init__(self, pixel: Pixel) -> None:
        self._values = pixel.water.values
        images = images_in(pixel.sources.parts)
        assert images is not None, "the surface moves"
        graph, values = pixel.graph, pixel.sources.values
        if pixel.given is not None:
            pattern = caustics_here(graph, values, images.caustics)
            self.pattern = NODES.maximum(pattern, self._values[LEAST_PATTERN])
            return
        number, (x, y, z), w = numbers_of(graph, values), pixel.eye, pixel.w
        reach = NODES.maximum(-z, 0.0) / NODES.maximum(w[2], _FLATTEST)
        place = x + w[0] * reach, y + w[1] * reach
        tables = WaveTables(graph, images, number)
        self._slope, self._foam = tables.raised(*place), tables.foam(*place)

    @property
    @override
    def caustics(self) -> Operand:
        return sunlight_factor(self.pattern, self._values[CAUSTIC_STRENGTH], NODES)

    @override
    def above(self, surface: SurfaceAbove) -> SurfaceAbove:
        foam = None if self._foam is None else FoamAhead(self._foam, self._values[FOAM_BELOW])
        return replace(surface, ripples=ripples(self._values, self._slope), foam=foam)
