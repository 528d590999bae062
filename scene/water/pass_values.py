"""Sets the values of a render pass on a view layer, where the node trees read them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups import attributes
from ...settings.render_plan import RenderPlan
from ...uw_spectral.spectra.reflectance import emission_basis, uplift_basis
from ...uw_spectral.transfer.above_water import light_in_air
from ...uw_spectral.transfer.water_column import WaterColumn
from .. import contents
from ..materials import band_colors
from .cycles_phase import CyclesPhase, cycles_phases


@dataclass(frozen=True, eq=False)
class PassValues:
    """Every quantity that differs by band, over all n bands."""

    values: dict[str, NDArray[np.float64]]  #: By names of view-layer properties, (n,).

    @classmethod
    def of_column(cls, column: WaterColumn, phases: Sequence[CyclesPhase]) -> PassValues:
        """Return the values of the water itself; the phase of each layer from the surface down."""
        in_air = light_in_air(column)
        values = {
            attributes.SUN_IRRADIANCE: column.sun_irradiance / column.sun_cosine,
            attributes.SUN_IN_AIR: in_air.sun,
            attributes.SKY_RADIANCE: in_air.level * gain_in_water(column),
            attributes.FLOOR_REFLECTANCE: column.floor_reflectance,
        }
        layers = zip((column, *column.below), phases, strict=True)
        for layer, (water, phase) in enumerate(layers):
            values |= phase.values(layer, water.absorption, water.scattering)
        return cls(values)

    @classmethod
    def of_plan(cls, plan: RenderPlan, scene: bpy.types.Scene) -> PassValues:
        """Return the values of the water itself, and of the materials of a scene."""
        values: dict[str, NDArray[np.float64]] = {
            **dict(zip(attributes.REFLECTANCE_BASIS, uplift_basis(plan.bands).T, strict=True)),
            **dict(zip(attributes.EMISSION_BASIS, emission_basis(plan.bands).T, strict=True)),
        }
        for material, reflectance in band_colors.measured_reflectances(scene):
            name = band_colors.measured_attribute(material)
            if name is not None:
                values[name] = reflectance.at(plan.bands.centres)
        return cls.of_column(plan.column, cycles_phases(plan)).with_values(values)

    def with_values(self, values: Mapping[str, NDArray[np.float64]]) -> PassValues:
        """Return these values and more."""
        return PassValues({**self.values, **values})

    def dark(self) -> PassValues:
        """Return these values with no light from anything."""
        values = self.values.items()
        return PassValues({k: 0.0 * v if attributes.is_light(k) else v for k, v in values})

    def apply(self, layer: bpy.types.ViewLayer, indices: tuple[int, ...]) -> None:
        """Give a view layer the values of the pass that carries these bands.

        A pass with fewer than three bands repeats its last one.
        """
        filled = list(indices) + [indices[-1]] * (3 - len(indices))
        for name, values in self.values.items():
            layer[name] = [float(value) for value in values[filled]]

    def refresh(self, scene: bpy.types.Scene) -> None:
        """Tell Blender that materials, lamps and the world read new values.

        Without it a render that keeps its data uses stale ones.
        """
        scene.world.update_tag()
        for item in scene.objects:
            if item.type == "LIGHT":
                item.data.update_tag()
        for material in contents.materials(scene):
            material.update_tag()


def gain_in_water(column: WaterColumn) -> float:
    """Return what radiance gains on its way into the denser medium, n²; Cycles leaves that out."""
    return column.refractive_index**2 if column.reflects else 1.0


def clear(layer: bpy.types.ViewLayer) -> None:
    """Delete every value that :class:`PassValues` has set."""
    for name in [key for key in layer.keys() if key.startswith(attributes.PREFIX)]:  # noqa: SIM118
        del layer[name]
