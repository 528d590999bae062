"""Lamps in the water as a term of a pixel."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import override

import bpy

from ..uw_spectral.mathematics import Operand
from ..uw_spectral.transfer.pixel_parts import COLOURS, ChannelPixel
from ..uw_spectral.water.phase import PhaseFunction
from . import lamp_visibility, realtime_lamps, surface_inputs
from .lamp_images import LampImages, LampRows, images_in, new_images
from .node_mathematics import NODES, NodeValue
from .pixel_term import Pixel, TermPixel
from .realtime_lamps import CloudsOf
from .realtime_values import FLOOR_DEPTH
from .realtime_water import in_group
from .shape import Shape, TermShape


@dataclass(frozen=True)
class LampShape(TermShape):
    """Lamps shine in the water."""

    singles = lamp_visibility.NUMBERS
    large = True

    count: int = 0
    virtual: int = 0  #: How many of them stand for what lit objects throw back.
    components: tuple[PhaseFunction, ...] = ()  #: Of the phase function of their water.
    from_air: bool = False  #: Some may shine into it from above.
    facets: int = (
        0  #: How many of :data:`.realtime_lamps.FACETS` their light may meet on an object.
    )
    excites: bool = False  #: Their light excites fluorophores.
    floating: bool = False  #: There is something in the water that floats in it.
    inelastic: int = 0  #: How many of them excite light of changed wavelength in the water.

    @override
    def parts(self, shape: Shape) -> dict[str, bpy.types.ID]:
        # What stands for objects has one profile.
        return new_images(
            self.count,
            self.count - self.virtual + bool(self.virtual),
            LampRows.of_parts(
                len(self.components),
                shape.measured,
                exciting=self.excites,
                in_clouds=self.floating,
                inelastic=self.inelastic,
            ),
            self.virtual,
            from_air=self.from_air,
        ).parts

    @property
    @override
    def inputs(self) -> Mapping[str, str]:
        facets = realtime_lamps.FACETS[: self.facets]
        return {name: kind for one in facets for name, kind in one.items()}

    @override
    def in_pixel(self, pixel: Pixel) -> TermPixel:
        return _LampPixel(self, pixel)


class _LampPixel(TermPixel):
    """Light of lamps on an object, and in the water before it or up to the boundary."""

    def __init__(self, lamps: LampShape, pixel: Pixel) -> None:
        self._lamps, self._pixel = lamps, pixel
        images, shape, sources = images_in(pixel.sources.parts), pixel.shape, pixel.sources
        assert images is not None, "lamps shine in the water"
        floating = (term.matter(shape, sources) for term in shape.terms)
        clouds = next((found for found in floating if found is not None), None)
        self._found = {}
        if pixel.given is not None:
            self._found = self._on_object(pixel.given, images, clouds)
        path = realtime_lamps.build_path(
            images, lamps.components, ahead=pixel.given is None, rays=sources.rays, clouds=clouds
        )
        # Open water is lit down to the floor.
        inputs = {FLOOR_DEPTH: pixel.water.values[FLOOR_DEPTH]} if pixel.given is None else {}
        self._found |= in_group(pixel.graph, path, inputs)
        names = realtime_lamps
        self.added = self._found.get(names.SEEN, self._found.get(names.UNSCATTERED, 0.0))
        self.irradiance = self._found.get(names.IRRADIANCE, 0.0)
        self.exciting = self._found.get(names.EXCITING, 0.0)

    def _on_object(
        self, given: Mapping[str, NodeValue], images: LampImages, clouds: CloudsOf | None
    ) -> dict[str, NodeValue]:
        pixel, names, shape = self._pixel, realtime_lamps, self._pixel.shape
        outputs = [names.UNSCATTERED, names.FORWARD] if shape.layers else [names.SEEN]
        outputs += [names.THERE] if "J" in shape.layers else []
        outputs += [names.IRRADIANCE] if "E" in shape.layers else []
        outputs += [names.EXCITING] if surface_inputs.FLUORESCENCE in given else []
        normal, numbers = given[surface_inputs.NORMAL], pixel.water.values.outputs
        inputs: dict[str, Operand] = {
            names.NORMAL: normal,
            names.COLOR: given[surface_inputs.COLOR],
            names.VISIBILITY: lamp_visibility.visibility(pixel.graph, numbers, images, normal),
        }
        if shape.measured:
            # There measured reflectances count from 1, here columns go on after three colours.
            column = given[surface_inputs.COLUMN]
            inputs[names.MEASURED] = NODES.maximum(column - (len(COLOURS) - 1.0), 0.0)
        inputs |= {name: given[name] for name in self._lamps.inputs}
        patch = names.build_patch(images, outputs, pixel.sources.rays, self._lamps.facets, clouds)
        return in_group(pixel.graph, patch, inputs)

    @override
    def lit(self, pixel: ChannelPixel) -> ChannelPixel:
        found, given = self._found, self._pixel.given
        if given is None:
            return replace(pixel, lamps=found[realtime_lamps.LIGHT])
        return replace(
            pixel,
            direct=pixel.direct + self.added,
            forward_scattered=pixel.forward_scattered + found.get(realtime_lamps.FORWARD, 0.0),
            L_end=pixel.L_end + found.get(realtime_lamps.THERE, 0.0),
            lamps=found[realtime_lamps.LIGHT] * given[surface_inputs.COVERAGE],
        )
