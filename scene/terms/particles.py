"""Particles in the water of a scene: what its settings ask for, brought in, moved on."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, override

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups import particles as geometry
from ...node_groups.node_mathematics import MARK
from ...settings.scene_settings import SceneSettings
from ...uw_spectral.transfer.water_column import WaterColumn
from ...uw_spectral.water.particles import (
    BUBBLES,
    KINDS,
    SNOW,
    ParticleCloud,
    number_of_scattering,
    particle_cloud,
    particle_scattering,
    scattering_fraction,
)
from .. import marks
from ..materials import band_colors
from ..water import new_materials, scene_water
from ..water.frame_water import RealtimeWater
from ..water.term import SceneFrame, Term

_REACH, _LONGEST = 4.0, 30.0  # optical depth in the clearest band, and m, beyond which none is seen
_MILLI = 1e-3

Wet = Callable[[bpy.types.Material], object]
"""Brings a material into the water of an engine."""


@dataclass(frozen=True)
class ParticleTerm(Term):
    """The particles of a frame."""

    clouds: tuple[ParticleCloud, ...] = ()  #: One a kind, those without particles left out.
    drift: tuple[float, float, float] = (0.0, 0.0, 0.0)  #: Velocity of the water, m/s.
    deepest: float = math.inf  #: Depth of the floor, m.
    seed: int = 0

    @classmethod
    @override
    def read(cls, frame: SceneFrame) -> ParticleTerm:
        return particles_of(frame.plan.settings, frame.plan.column)

    @classmethod
    @override
    def bring_to_cycles(cls, frame: SceneFrame) -> Mapping[str, NDArray[np.float64]]:
        wanted = cls.read(frame)
        bring(frame.scene, wanted, lambda material: band_colors.insert([material]))
        return {}

    @property
    @override
    def is_near(self) -> bool:
        return bool(self.clouds)

    @override
    def fits(self, scene: bpy.types.Scene) -> bool:
        return {cloud.kind.name for cloud in self.clouds} <= set(_objects(scene))

    @override
    def write(self, scene: bpy.types.Scene, water: RealtimeWater) -> None:
        bring(scene, self, lambda material: new_materials.wet(scene, material))


def snow_of_water(settings: SceneSettings, column: WaterColumn) -> float:
    """Particles larger than 0.1 mm per litre that the scattering of the upper water speaks for."""
    b_p = particle_scattering(column.bands.centres, column.scattering)
    return number_of_scattering(b_p, settings.particle_slope)


def particles_of(settings: SceneSettings, column: WaterColumn) -> ParticleTerm:
    """Return the particles that settings ask for in a water."""
    numbers = {name: getattr(settings, name) for name in KINDS}
    if settings.snow_of_water:
        numbers[SNOW] += settings.snow_of_water * snow_of_water(settings, column)
    reach = min(_REACH / max(float(column.attenuation.min()), 1e-6), _LONGEST)
    clouds = tuple(
        particle_cloud(
            KINDS[name],
            number,
            slope=settings.particle_slope,
            angle=_MILLI * settings.particle_angle,
            reach=reach,
        )
        for name, number in numbers.items()
        if number
    )
    heading = math.radians(settings.drift_direction)
    x, y = (settings.drift_speed * part for part in (math.cos(heading), math.sin(heading)))
    return ParticleTerm(clouds, (x, y, 0.0), column.floor_depth, settings.particle_seed)


def record(settings: SceneSettings, column: WaterColumn) -> dict[str, Any]:
    """Return what a picture's record says of its particles; nothing without any."""
    found = particles_of(settings, column)
    if not found.clouds:
        return {}
    b_p = particle_scattering(column.bands.centres, column.scattering)
    return {
        "particles": {
            "particle_scattering_550_per_m": b_p,
            "share_of_scattering_above_0.1_mm": scattering_fraction(settings.particle_slope),
            "snow_of_water_per_litre": snow_of_water(settings, column),
            "kinds": {
                cloud.kind.name: {
                    "above_0.1_mm_per_litre": cloud.per_litre,
                    "slope": cloud.slope,
                    "smallest_angle_mrad": cloud.angle / _MILLI,
                    "diameters_m": [cloud.kind.smallest, cloud.kind.largest],
                    "particles_around_camera": cloud.count,
                }
                for cloud in found.clouds
            },
        }
    }


def bring(scene: bpy.types.Scene, wanted: ParticleTerm, wet: Wet) -> None:
    """Give the water of a scene its particles; kinds that it lacks are added.

    ``wet`` brings a new material into the water.
    """
    there = _objects(scene)
    for cloud in wanted.clouds:
        name = cloud.kind.name
        if name not in there:
            there[name] = _add(scene, cloud, wet)
        geometry.write(_made_by(there[name]), cloud, wanted.drift, wanted.deepest, wanted.seed)
    for name in set(there) - {cloud.kind.name for cloud in wanted.clouds}:
        geometry.empty(_made_by(there[name]))


def _objects(scene: bpy.types.Scene) -> dict[str, bpy.types.Object]:
    known = (item for item in marks.objects(scene) if marks.PARTICLES in item)
    return {item[marks.PARTICLES]: item for item in known if _made_by(item) is not None}


def _made_by(item: bpy.types.Object) -> bpy.types.NodeTree | None:
    """Return the geometry nodes of particles, if the user has left them."""
    groups = (m.node_group for m in item.modifiers if m.type == "NODES")
    return next((group for group in groups if group is not None and MARK in group), None)


def _add(scene: bpy.types.Scene, cloud: ParticleCloud, wet: Wet) -> bpy.types.Object:
    name = f"UW {cloud.kind.name.capitalize()}"
    material = _material(scene, wet, bubbles=cloud.kind.name == BUBBLES)
    item = bpy.data.objects.new(name, bpy.data.meshes.new(name))
    item[marks.PARTICLES] = cloud.kind.name
    dress(item, geometry.build(name, cloud, material), material)
    scene_water.link(scene, item)
    return item


def dress(item: bpy.types.Object, tree: bpy.types.NodeTree, material: bpy.types.Material) -> None:
    """Let a mesh show particles of one material, by a tree of :mod:`.node_groups.particles`."""
    item.data.materials.append(material)
    item.modifiers.new(tree.name, "NODES").node_group = tree
    # Only the camera sees them: what they keep from each other and from objects is in the water's
    # own scattering already.
    item.visible_shadow = item.visible_diffuse = item.visible_glossy = False
    item.visible_transmission = item.visible_volume_scatter = False


def _material(scene: bpy.types.Scene, wet: Wet, *, bubbles: bool) -> bpy.types.Material:
    for name, item in _objects(scene).items():
        if (name == BUBBLES) == bubbles:
            return item.data.materials[0]
    made = geometry.bubble_material() if bubbles else geometry.grain_material()
    wet(made)
    return made
