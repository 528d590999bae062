"""The water of a pixel in a node tree: its tables, its numbers, and what shades it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import bpy

from ..uw_spectral.mathematics import Operand
from ..uw_spectral.occlusion.occlusion_table import along_ray
from ..uw_spectral.surface.caustics import SUN_RADIUS
from ..uw_spectral.transfer.above_water import glitter_from_above
from ..uw_spectral.transfer.channel_pixel import ChannelWater
from ..uw_spectral.transfer.foam_light import FoamAhead, foam_from_above
from ..uw_spectral.transfer.pixel_parts import (
    UNOCCLUDED,
    Around,
    ChannelPixel,
    OcclusionFactor,
    OcclusionOnPath,
    ReflectedRadiance,
    ReflectionPicture,
    RefractedRadiance,
    RefractionPicture,
)
from ..uw_spectral.transfer.radiance_field import Ripples, surface_normal
from ..uw_spectral.transfer.sky import UNIFORM, Sky
from ..uw_spectral.transfer.sun_beam import half_angle2
from . import (
    realtime_adjacency,
    realtime_fluorescence,
    realtime_occlusion,
    realtime_reflected_view,
    realtime_refracted_view,
)
from .node_mathematics import NODES, Graph, NodeValue
from .realtime_fluorescence import EXCITING
from .realtime_occlusion import ON_PATH, REACH, Occlusion, OcclusionShape
from .realtime_rays import straight_direction
from .realtime_refraction import LEAVING, MIRRORED_SKY, REFLECTANCE, AirShape
from .realtime_tables import PART, ImageTables, exciting_sizes, sizes_of
from .realtime_values import FASTEST, INDEX, SKY_LEVEL, SUN, SUN_IN_AIR, SUN_LEVEL, Values
from .realtime_waves import (
    FOAM,
    FOAM_BELOW,
    FOAM_IN_SKY,
    FOAM_IN_SUN,
    GLITTER,
    GLITTER_WIDTH,
    SLOPE,
    FoamShape,
    WaveShape,
)
from .shape import Shape, Sources

SEEN = "Seen"


class PixelWater:
    """The water of a pixel.

    Parameters
    ----------
    graph : Graph
        The tree.
    """

    def __init__(self, graph: Graph, shape: Shape, sources: Sources) -> None:
        self.graph, self.shape, self._sources = graph, shape, sources
        self.values = Values(graph, sources.values, shape)
        scales = self.values.depth_scale, self.values.lengths
        self._tables = ImageTables(graph, sources.parts[PART], sizes_of(shape), *scales)

    @property
    def sun(self) -> tuple[NodeValue, ...]:
        """Direction the sunlight travels to."""
        return self.values.of(*SUN)

    def along(self, w: Sequence[NodeValue]) -> ChannelWater:
        """Return the water along a ray."""
        s2 = half_angle2(w, self.sun, NODES)
        parts = [part.per_steradian(s2, NODES) for part in self.shape.components]
        return ChannelWater(
            self._tables, self.values.numbers, self.sun, parts, self.shape.layered,
            self.values[FASTEST], NODES,
        )  # fmt: skip

    def exciting(self, w: Sequence[NodeValue]) -> ChannelWater:
        """Return the same of the light that excites fluorophores, each a channel."""
        image, values = self._sources.parts[realtime_fluorescence.PART], self.values
        sizes = exciting_sizes(self.shape)
        tables = ImageTables(self.graph, image, sizes, values.depth_scale, values.lengths)
        return replace(self.along(w), tables=tables, numbers=values.light(EXCITING))

    @property
    def sky(self) -> Sky:
        """The sky, of level 1."""
        if self.shape.sky == UNIFORM:
            return Sky(1.0)
        return Sky(1.0, self.shape.sky, self.values.of(*SUN_IN_AIR))

    @property
    def index(self) -> NodeValue | None:
        """Index of the water against air, if it has a surface."""
        return self.values[INDEX] if self.shape.flat else None

    def ripples(self, slope: NodeValue | None) -> Ripples | None:
        """Return the moving surface where a ray meets it; None without waves."""
        if slope is None:
            return None
        slopes = self.graph.components(slope)[:2]
        width, strength = self.values.of(GLITTER_WIDTH, GLITTER)
        return Ripples(slopes, width, strength, self.values.of(*SUN_IN_AIR))

    def foam(self, fraction: NodeValue | None) -> FoamAhead | None:
        """Return the foam where a ray meets the surface from below; None without foam."""
        return None if fraction is None else FoamAhead(fraction, self.values[FOAM_BELOW])

    def occlusion(self) -> Occlusion | None:
        """Return the look-ups of the occlusion, if there is any."""
        image = self._sources.parts.get(realtime_occlusion.PART)
        return None if image is None else Occlusion(self.graph, self.values.outputs, image)

    def around(self, point: Sequence[NodeValue]) -> Around | None:
        """Look up what objects about a point in view do to light that is scattered forward."""
        image = self._sources.parts.get(realtime_adjacency.PART)
        if image is None:
            return None
        return realtime_adjacency.around(self.graph, self.values.outputs, image, point)

    def picture(self, place: Sequence[NodeValue]) -> ReflectionPicture | None:
        """Return the look-up of objects that the surface mirrors at a place, if there is any."""
        image = self._sources.parts.get(realtime_reflected_view.PART)
        if image is None:
            return None

        def seen(down: Sequence[Operand]) -> ReflectedRadiance:
            values, waves = self.values.outputs, WaveShape in self.shape
            return realtime_reflected_view.seen_in(
                self.graph, values, image, place, down, waves=waves
            )

        return seen

    def window(
        self, place: Sequence[NodeValue], w: Sequence[NodeValue]
    ) -> RefractionPicture | None:
        """Return the look-up of objects in the air, for a ray that leaves the water at a place."""
        image, index = self._sources.parts.get(realtime_refracted_view.PART), self.index
        if image is None or index is None:
            return None

        def seen(up: Sequence[Operand]) -> RefractedRadiance:
            values, waves = self.values.outputs, WaveShape in self.shape
            return realtime_refracted_view.seen_in(
                self.graph, values, image, place, w, up, index=index, waves=waves
            )

        return seen

    def path_occlusion(
        self,
        found: dict[str, NodeValue],
        rates: tuple[Operand, Operand],
        P: NodeValue,
    ) -> OcclusionOnPath:
        """What objects leave of the light of a path.

        ``rates`` are those of :meth:`.ChannelWater.falling_off`.
        """
        if OcclusionShape not in self.shape:
            return UNOCCLUDED
        steps = [self.graph.components(found[name]) for name in ON_PATH]
        often, single = rates
        reach = P, self.values[REACH], NODES
        sunlit = [step[2] for step in steps]
        mean, fraction = (along_ray([step[i] for step in steps], often, *reach) for i in range(2))
        return OcclusionOnPath(
            OcclusionFactor(mean, fraction),
            along_ray(sunlit, single, *reach),
        )

    def seen(self, pixel: Operand, coverage: Operand = 1.0) -> Operand:
        """Return what is seen of the light of a pixel in the water, the sky mirrored besides."""
        if AirShape not in self.shape:
            return pixel
        return self.ray(LEAVING) * pixel + coverage * self._mirrored_from_above()

    def ray(self, name: str) -> NodeValue:
        """Return what is known of a ray that may be bent."""
        assert self._sources.rays is not None, "a camera in the air has rays that are bent"
        return self.graph.term(self.graph.shared(self._sources.rays)[name])

    def _mirrored_from_above(self) -> Operand:
        """Radiance of the sky that the surface mirrors, or of the sky itself."""
        v = self.graph.components(self.ray(MIRRORED_SKY))
        R = self.ray(REFLECTANCE)
        seen = (R * self.sky.radiance(v, NODES)) * self.values[SKY_LEVEL]
        if WaveShape not in self.shape:
            return seen
        ripples = self.ripples(self.ray(SLOPE))
        assert ripples is not None
        view = straight_direction(self.graph)
        glitter = glitter_from_above(1.0, view, ripples, self.values[INDEX], SUN_RADIUS**2, NODES)
        glitter = NODES.less(0.0, self.ray(LEAVING)) * glitter * self.values[SUN_LEVEL]
        if FoamShape not in self.shape:
            return seen + glitter
        sun, sky = self.values.of(FOAM_IN_SUN, FOAM_IN_SKY)
        normal, foam = surface_normal(*ripples.slopes, NODES), self.ray(FOAM)
        matte = foam_from_above(sun, sky, normal, self.values.of(*SUN_IN_AIR), NODES)
        return seen + (1.0 - foam) * glitter + foam * matte


def in_group(
    graph: Graph, tree: bpy.types.ShaderNodeTree, inputs: Mapping[str, Operand]
) -> dict[str, NodeValue]:
    """Put a group into a tree; return its outputs."""
    node = graph.node("ShaderNodeGroup", node_tree=tree)
    for name, value in inputs.items():
        graph.assign(value, node.inputs[name])
    return {socket.name: graph.term(socket) for socket in node.outputs}


def pixel_layers(pixel: ChannelPixel) -> dict[str, Operand]:
    """Return the layers of a pixel, by the names of :data:`.layers.LAYERS`."""
    return {
        "I": pixel.total,
        "J": pixel.L_end,
        "D": pixel.direct,
        "B_single": pixel.single_scattering,
        "B_water": pixel.path,
        "F": pixel.forward_scattered,
        "B_lamps": pixel.lamps,
    }
