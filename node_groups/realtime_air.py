"""Cameras in the air, and objects there, as node groups draw them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import override

import bpy

from ..uw_spectral.mathematics import Operand, dot
from ..uw_spectral.surface.caustics import SUN_RADIUS
from ..uw_spectral.transfer.above_water import (
    LightInAir,
    facing_mirrored,
    glitter_from_above,
    turned_sun,
)
from ..uw_spectral.transfer.foam_light import foam_from_above
from ..uw_spectral.transfer.radiance_field import surface_normal
from . import realtime_refraction, surface_inputs
from . import realtime_values as numbers
from .node_mathematics import NODES, NodeValue
from .pixel_term import Pixel, TermPixel
from .realtime_rays import straight_direction
from .realtime_refraction import DRY, LEAVING, MIRRORED_SKY, REFLECTANCE
from .realtime_waves import (
    FOAM,
    FOAM_IN_SKY,
    FOAM_IN_SUN,
    SLOPE,
    FoamShape,
    WaveShape,
    images_in,
    ripples,
)
from .shape import Sources, TermShape


class AirShape(TermShape):
    """The camera may be above the water."""

    channels = numbers.OF_AIR
    singles = (
        *(numbers.IN_AIR, numbers.RAY_INDEX, *numbers.CAMERA, *numbers.DRAWN_SUN),
        *(numbers.MIRRORED_FRACTION, numbers.MIRRORED_SUN),
    )

    @override
    def rays(self, sources: Sources) -> bpy.types.ShaderNodeTree:
        return realtime_refraction.build(sources.values, images_in(sources.parts))

    @override
    def in_pixel(self, pixel: Pixel) -> TermPixel:
        return _AirPixel(pixel)


class DrySide(TermPixel):
    """Light of objects in the air."""

    def __init__(self, pixel: Pixel) -> None:
        self.pixel, self._values = pixel, pixel.water.values

    @override
    def sun_in_air(self) -> list[Operand]:
        sun = self._values.of(*numbers.SUN_IN_AIR)
        turned = self.turned(sun) * self._values[numbers.SUN_GAIN]
        return [self._values[name] * turned for name in numbers.SUN_ABOVE]

    @override
    def in_air(self, lit: Sequence[Operand], glow: Sequence[Operand]) -> Operand:
        values, given = self._values, self.pixel.given
        assert given is not None, "open water is no object in the air"
        split = self.pixel.graph.components
        sun, normal = values.of(*numbers.SUN_IN_AIR), split(given[surface_inputs.NORMAL])
        turned, facing = self.turned(sun), facing_mirrored(normal, sun, NODES)
        base = split(given[surface_inputs.COLOR])
        total: Operand = 0.0
        for k in range(3):
            light = LightInAir(
                values[numbers.SUN_ABOVE[k]],
                values[numbers.SKY_ABOVE[k]],
                values[numbers.MIRRORED_FRACTION],
                sun_mirrored=values[numbers.MIRRORED_SUN],
                leaving=values[numbers.WATER_ABOVE[k]],
            )
            total = light.reflected(lit[k], base[k], turned, normal[2], facing) + total
        for k, radiance in enumerate(glow):
            total = radiance * values[numbers.GLOW_ABOVE[k]] + total
        return total


class _AirPixel(DrySide):
    """What a ray loses at the surface, and the light that this mirrors."""

    def __init__(self, pixel: Pixel) -> None:
        super().__init__(pixel)
        self.dry, self.leaving = self._of_ray(DRY), self._of_ray(LEAVING)

    @override
    def turned(self, sun: Sequence[NodeValue]) -> Operand:
        given = self.pixel.given
        assert given is not None, "open water has no normal"
        normal = self.pixel.graph.components(given[surface_inputs.NORMAL])
        drawn = self._values.of(*numbers.DRAWN_SUN)
        return turned_sun(-dot(normal, sun), -dot(normal, drawn), NODES)

    @override
    def seen(self, pixel: Operand, coverage: Operand) -> Operand:
        return self.leaving * pixel + coverage * self._mirrored()

    def _of_ray(self, name: str) -> NodeValue:
        """Return what is known of a ray that may be bent."""
        graph, rays = self.pixel.graph, self.pixel.sources.rays
        assert rays is not None, "a camera in the air has rays that are bent"
        return graph.term(graph.shared(rays)[name])

    def _mirrored(self) -> Operand:
        """Radiance of the sky that the surface mirrors, or of the sky itself."""
        water, values, shape = self.pixel.water, self._values, self.pixel.shape
        v = self.pixel.graph.components(self._of_ray(MIRRORED_SKY))
        R = self._of_ray(REFLECTANCE)
        seen = water.skylight(R * water.sky.radiance(v, NODES))
        if WaveShape not in shape:
            return seen
        waves = ripples(values, self._of_ray(SLOPE))
        view = straight_direction(self.pixel.graph)
        glitter = glitter_from_above(1.0, view, waves, values[numbers.INDEX], SUN_RADIUS**2, NODES)
        glitter = NODES.less(0.0, self.leaving) * glitter * values[numbers.SUN_LEVEL]
        if FoamShape not in shape:
            return seen + glitter
        sun, sky = values.of(FOAM_IN_SUN, FOAM_IN_SKY)
        normal, foam = surface_normal(*waves.slopes, NODES), self._of_ray(FOAM)
        matte = foam_from_above(sun, sky, normal, values.of(*numbers.SUN_IN_AIR), NODES)
        return seen + (1.0 - foam) * glitter + foam * matte
