"""The lamps of a scene as lights in the water, spectrally."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ..node_groups.node_mathematics import MARK
from ..uw_spectral.errors import InputError
from ..uw_spectral.lamps.emission import (
    SPHERE,
    WATTS,
    intensity_of_colour,
    parse_emission,
    radiant_intensity,
)
from ..uw_spectral.lamps.ies import read_ies
from ..uw_spectral.lamps.lamp import Lamp
from ..uw_spectral.lamps.profile import (
    IsotropicProfile,
    Profile,
    SpotProfile,
    TableProfile,
    profile_from_csv,
    rov_lamp,
)
from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.spectra.illuminant import RELATIVE, full_sun
from . import cameras, scene_water
from .stored_lamps import ROV, stored_lamp

KINDS = ("POINT", "SPOT", "AREA")
"""Types of Blender's lights that light the water; the sun is the water's own."""
_POINTS = 24
"""Of a measured profile."""
_LAMBERT = TableProfile(np.array([0.0, 1.0]), np.array([0.0, 1.0]))
_RAYS = (12, 8)
_LAYERS, _STEP = 4, 1e-3  # of the water's own things that a ray passes; m behind each
_FORM = ("shadow_soft_size", "spot_size", "spot_blend", "shape", "size", "size_y")
_DOWN = Vector((0.0, 0.0, -1.0))


@dataclass(frozen=True, eq=False)
class SceneLamps:
    """Lamps of a scene that light its water, and the objects they come from."""

    objects: tuple[bpy.types.Object, ...] = ()
    lamps: tuple[Lamp, ...] = ()
    notes: tuple[str, ...] = ()

    def of_bands(self, indices: Sequence[int]) -> SceneLamps:
        """Return the lamps in some of the bands."""
        chosen = list(indices)
        lamps = tuple(replace(lamp, intensity=lamp.intensity[chosen]) for lamp in self.lamps)
        return replace(self, lamps=lamps)


def objects_of(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Return the lamps that light the water of a scene, by name."""
    return [item for item in _shown(scene) if not why_dark(item)]


def left_out(scene: bpy.types.Scene) -> dict[bpy.types.Object, str]:
    """Return the lamps of a scene that do not light its water, and why."""
    return {item: why_dark(item) for item in _shown(scene) if why_dark(item)}


def why_dark(item: bpy.types.Object) -> str:
    """Say why a lamp does not light the water, empty if it does.

    One that moves counts everywhere: nodes for it are needed in all frames.
    """
    if not stored_lamp(item.data).in_water:
        return "it belongs to the air; let it light the water with its switch"
    if item.matrix_world.translation.z > 0.0 and not _moves(item):
        return "it is above the water; lower it, or leave it to the sun"
    return ""


def _shown(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    found = [
        item
        for item in scene.objects
        if item.type == "LIGHT"
        and item.data.type in KINDS
        and MARK not in item
        and not scene_water.is_hidden(item)
    ]
    return sorted(found, key=lambda item: item.name_full)


def _moves(item: bpy.types.Object | None) -> bool:
    while item is not None:
        if item.animation_data is not None or item.constraints:
            return True
        item = item.parent
    return False


def lamps_of(scene: bpy.types.Scene, bands: Bands, unit: str) -> SceneLamps:
    """Return the lamps of a scene's current frame.

    Parameters
    ----------
    scene : Scene
        Its z = 0 is the water surface; lamps above it do not shine.
    bands : Bands
    unit : str
        Of the irradiance that the scene is lit with.

    Raises
    ------
    InputError
        If a spectrum, a power or a profile cannot be used; it names the lamp.
    """
    objects, lamps = objects_of(scene), []
    notes = [f"lamp {item.name!r} is left out: {why}" for item, why in left_out(scene).items()]
    for item in objects:
        try:
            lamp = _lamp(item, bands, unit)
        except InputError as error:
            raise InputError(f"lamp {item.name!r}: {error}") from error
        if item.matrix_world.translation.z > 0:
            notes.append(
                f"lamp {item.name!r} is above the water and does not light it; lower it, or leave "
                "it to the sun"
            )
            lamp = replace(lamp, intensity=np.zeros(len(bands)))
        lamps.append(lamp)
    return SceneLamps(tuple(objects), tuple(lamps), tuple(notes))


def seen_places(scene: bpy.types.Scene, camera: bpy.types.Object) -> list[tuple[float, ...]]:
    """Return places on the things that a camera sees, by a few rays."""
    depsgraph, found = bpy.context.evaluated_depsgraph_get(), []
    for origin, direction in cameras.camera_rays(scene, camera, *_RAYS):
        start = origin
        for _ in range(_LAYERS):
            hit, place, _, _, item, _ = scene.ray_cast(depsgraph, start, direction)
            if not hit:
                break
            if MARK not in item:
                found.append(tuple(place))
                break
            start = place + direction * _STEP
    return found


def state(scene: bpy.types.Scene) -> tuple[object, ...]:
    """Return all that the light of a scene's lamps depends on, to be compared."""
    found = []
    for item in objects_of(scene):
        light = item.data
        numbers = (
            light.energy, light.exposure, *light.color, light.use_temperature, light.temperature,
            item.visible_camera, *(x for row in item.matrix_world for x in row),
        )  # fmt: skip
        form = [getattr(light, name, 0.0) for name in _FORM]
        found.append((item.name_full, light.type, stored_lamp(light), *numbers, *form))
    return tuple(found)


def _lamp(item: bpy.types.Object, bands: Bands, unit: str) -> Lamp:
    light, chosen = item.data, stored_lamp(item.data)
    profile = _profile(light, chosen.profile)
    power = light.energy * 2.0**light.exposure
    colour = np.array(light.color)
    if light.use_temperature:
        colour = colour * np.array(light.temperature_color)
    if chosen.spectrum:
        spread = profile.solid_angle if chosen.unit != WATTS or chosen.profile else SPHERE
        if light.type == "AREA":
            spread = profile.solid_angle
        shape = parse_emission(_absolute(chosen.spectrum))
        intensity = radiant_intensity(shape, power, bands, chosen.unit, spread)
        if unit == RELATIVE:
            intensity = intensity / full_sun()
    else:
        # Blender's area light shines four times as strong along its axis as a point.
        gain = SPHERE / profile.solid_angle if light.type == "AREA" and not chosen.profile else 1.0
        intensity = gain * intensity_of_colour(colour, power, bands)
    place = item.matrix_world
    axis = (place.to_3x3() @ _DOWN).normalized()
    radius, seen = _radius(light, place), float(item.visible_camera)
    return Lamp(tuple(place.translation), tuple(axis), intensity, profile, radius, seen)


def _absolute(text: str) -> str:
    """Resolve a file's path that is relative to the .blend."""
    scheme, _, path = text.partition(":")
    return f"file:{bpy.path.abspath(path)}" if scheme == "file" else text


def _profile(light: bpy.types.Light, chosen: str) -> Profile:
    if chosen == ROV:
        return rov_lamp()
    if chosen:
        path = bpy.path.abspath(chosen)
        if Path(path).suffix.lower() == ".ies":
            return read_ies(path).profile(_POINTS)
        return profile_from_csv(path, _POINTS)
    if light.type == "SPOT":
        return SpotProfile(min(light.spot_size, math.pi), light.spot_blend)
    if light.type == "AREA":
        return _LAMBERT
    return IsotropicProfile()


def _radius(light: bpy.types.Light, place: Matrix) -> float:
    if light.type != "AREA":
        return float(light.shadow_soft_size)
    across, along = (abs(x) for x in place.to_scale()[:2])
    width, height = light.size * across, light.size * along
    if light.shape in ("RECTANGLE", "ELLIPSE"):
        height = light.size_y * along
    area = width * height
    if light.shape in ("DISK", "ELLIPSE"):
        area *= math.pi / 4.0
    return math.sqrt(area / math.pi)
