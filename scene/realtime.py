"""Real-time water for EEVEE: put into a scene, given its values, taken out again.

Values change without rebuilding anything; only another :class:`Shape` (number
of bands, kind of phase function, surface, aureole, shafts) builds new nodes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ..node_groups import (
    realtime_background,
    realtime_inelastic,
    realtime_shadows,
    realtime_surface,
    realtime_values,
    realtime_volume,
    realtime_waves,
)
from ..node_groups.node_mathematics import remove_group
from ..node_groups.realtime_values import Numbers, Shape
from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.reflectance import emission_basis, uplift_basis
from ..uw_spectral.surface.wave_patterns import WavePatterns
from ..uw_spectral.transfer.closed_form import ClosedForm, solve_closed_form
from ..uw_spectral.transfer.inelastic_light import InelasticLight, reduced
from ..uw_spectral.transfer.light_cone import LightCone, light_cone
from ..uw_spectral.transfer.water_column import WaterColumn
from ..uw_spectral.water.phase import BandPhase, HenyeyGreenstein
from . import band_colors, realtime_materials, water_body
from .water_body import WaterExtent

_STATE = "uw_realtime"
_WORLD = "uw_original_world"
_LAMPS = "uw_hidden_lamps"
_FLOOR = "UW Floor"
_GROUPS = (
    realtime_surface.NAME,
    realtime_surface.TRIPLE_NAME,
    realtime_background.NAME,
    realtime_background.TRIPLE_NAME,
    realtime_volume.TRIPLE_NAME,
    realtime_values.NAME,
)
# Shafts end where the clearest band keeps 2 % of its light, or soon after the scene does.
_SHAFT_OPTICAL_DEPTH = 4.0
_LONGEST_SHAFT = 200.0
MOST_BANDS = 16
"""Bands of one shader. More fit into its 64 KB of numbers, but take minutes to compile."""
# Share by which the volume may dim what is behind it; below, the rounding of its
# transmittance costs more light than that (8 to 14 % at 0.003, 4 to 6 % at 0.02).
_SHAFT_OPACITY = 0.02
# Finest detail of the sun's shadow in m: Blender's millimetre costs several times as much,
# and the sun's disc blurs a shadow by 7 mm per metre, waves by far more.
_SHADOW, _WAVY_SHADOW = 0.01, 0.03


@dataclass(frozen=True)
class ShaftRange:
    """Reach of the froxel volume in m, and the factor that makes it thin."""

    end: float
    scale: float


@dataclass(frozen=True, eq=False)
class RealtimeWater:
    """The water of a frame, ready for the node groups; see :func:`realtime_water`."""

    shape: Shape
    numbers: Numbers
    reflectances: dict[str, NDArray[np.float64]]
    column: WaterColumn
    shafts: ShaftRange | None
    cone: LightCone | None = None
    waves: WavePatterns | None = None

    def of_bands(self, indices: Sequence[int], count: int) -> RealtimeWater:
        """Return the water of some of the bands, and what the sensor sees of these.

        Parameters
        ----------
        indices : sequence of int
            The bands.
        count : int
            Bands of the shape that is returned; the last one is repeated, unseen.
        """
        chosen = [*indices, *[indices[-1]] * (count - len(indices))]
        bands = {name: values[chosen] for name, values in self.numbers.bands.items()}
        seen = np.arange(count) < len(indices)
        bands |= {name: bands[name] * seen for name in realtime_values.SENSOR}
        return replace(
            self,
            shape=replace(self.shape, bands=count),
            numbers=Numbers(bands, self.numbers.single),
            reflectances={name: values[chosen] for name, values in self.reflectances.items()},
        )

    def of_sign(self, sign: float) -> RealtimeWater:
        """Return the water with the sensor's weights of one sign, 1 or -1, as positive ones."""
        bands = dict(self.numbers.bands)
        bands |= {name: np.maximum(sign * bands[name], 0.0) for name in realtime_values.SENSOR}
        return replace(self, numbers=Numbers(bands, self.numbers.single))

    def of_triple(self, indices: Sequence[int], gains: Sequence[float]) -> RealtimeWater:
        """Return the water of one band pass: three bands, seen as red, green and blue.

        Parameters
        ----------
        indices : sequence of int
            The one to three bands of the pass.
        gains : sequence of float
            Factor of each channel that brings its radiance near 1.
        """
        water = self.of_bands(indices, 3)
        sensor = dict(zip(realtime_values.SENSOR, np.eye(3) * np.resize(gains, 3), strict=True))
        numbers = Numbers({**water.numbers.bands, **sensor}, water.numbers.single)
        return replace(water, numbers=numbers)


def realtime_water(
    column: WaterColumn,
    phase: BandPhase,
    camera_depth: float,
    weights: NDArray[np.float64],
    *,
    aureole: bool = True,
    shafts: bool = False,
    diffuse_shadows: bool = False,
    reflectances: dict[str, NDArray[np.float64]] | None = None,
    inelastic: InelasticLight | None = None,
) -> RealtimeWater:
    """Compute everything that the node groups need for a frame.

    Parameters
    ----------
    column : WaterColumn
        The water, its light and its floor.
    phase : BandPhase
        Its phase function.
    camera_depth : float
        Depth of the camera, m.
    weights : array, shape (3, n)
        Linear RGB per unit radiance of each band.
    aureole : bool
        Whether sunlight spreads by scattering many times at small angles.
    shafts : bool
        Whether single scattering is drawn by the froxel volume, with shadows.
    diffuse_shadows : bool
        Whether things keep light from above other than the direct sun away.
    reflectances : dict of str to array, shape (n,), optional
        Measured reflectance by material name.
    inelastic : InelasticLight, optional
        Light of changed wavelength in the same bands; it is reduced to a few exponentials.
    """
    n = len(column.bands)
    water = solve_closed_form(column.light_field(phase), phase, camera_depth, column.sun_direction)
    lobes = len(water.aureole.weights) if aureole else 0
    shape = Shape(
        n, tuple(phase.components), lobes, column.reflects, shafts, diffuse_shadows=diffuse_shadows
    )
    light = {}
    if inelastic is not None:
        few = reduced(inelastic)
        light = realtime_inelastic.of_light(few)
        shape = replace(shape, inelastic=tuple(term.rising for term in few.terms))
    numbers = realtime_values.of_water(water, shape)
    reach = _shaft_range(column, water, camera_depth, weights) if shafts else None
    cone = None
    if diffuse_shadows:
        cone = light_cone(water.field, camera_depth, column.sun_direction)
    bands = {
        **numbers.bands,
        **light,
        realtime_values.SKY: column.sky_radiance,
        **dict(zip(realtime_values.REFLECTANCE, uplift_basis(column.bands).T, strict=True)),
        **dict(zip(realtime_values.EMISSION, emission_basis(column.bands).T, strict=True)),
        **dict(zip(realtime_values.SENSOR, np.asarray(weights), strict=True)),
    }
    single = {
        **numbers.single,
        realtime_values.CAMERA_DEPTH: camera_depth,
        realtime_values.INDEX: column.refractive_index,
        realtime_values.SHAFT_END: reach.end if reach else 0.0,
        realtime_values.SHAFT_SCALE: reach.scale if reach else 0.0,
    }
    known = dict(reflectances or {})
    if math.isfinite(column.floor_depth):
        known[_FLOOR] = column.floor_reflectance
    return RealtimeWater(shape, Numbers(bands, single), known, column, reach, cone)


def add_realtime(scene: bpy.types.Scene, water: RealtimeWater, extent: WaterExtent) -> list[str]:
    """Put real-time water into a scene.

    Replaces the world, hides the scene's own lamps, adds sun, floor and the
    volume of the shafts, and sends every material through the surface group.

    Parameters
    ----------
    scene : Scene
        The scene; its z = 0 is the mean water surface.
    water : RealtimeWater
        The water of the current frame.
    extent : WaterExtent
        Size of the water.

    Returns
    -------
    list of str
        What could not be treated, one line each.

    Raises
    ------
    InputError
        If the scene has water already, or the water has too many bands.
    """
    if water_body.has_water(scene) or has_realtime(scene):
        raise InputError(f"scene {scene.name!r} has water already; remove it first")
    if water.shape.bands > MOST_BANDS:
        raise InputError(
            f"one shader carries up to {MOST_BANDS} bands, and this water has {water.shape.bands}; "
            "take fewer, or some of them at a time (RealtimeWater.of_bands)"
        )
    notes = []
    materials = band_colors.materials(scene)
    lamps = {o.name: o for o in scene.objects if o.type == "LIGHT" and o.is_editable}
    shown = {name: o for name, o in lamps.items() if not o.hide_render}
    if any(o.data.type != "SUN" for o in shown.values()):
        notes.append("lamps other than the sun do not light the real-time water; they are hidden")
    collection = bpy.data.collections.new(water_body.COLLECTION)
    collection[_STATE] = True
    for index, item in enumerate(lamps.values()):
        collection[f"{_LAMPS}_{index}"] = item
        item[_LAMPS] = [item.hide_render, item.hide_viewport]
        item.hide_render = item.hide_viewport = True
    if scene.world is not None:
        collection[_WORLD] = scene.world
    scene.collection.children.link(collection)
    if water.waves is not None:
        realtime_waves.write_patterns(water.waves)
    values = realtime_values.build(water.shape)
    realtime_values.write(values, water.numbers)
    group = realtime_surface.build(values, water.shape)
    scene.world = realtime_background.build_world(realtime_background.build(values, water.shape))
    if math.isfinite(water.column.floor_depth):
        materials.append(_floor_material())
        collection.objects.link(water_body.floor_plane(extent, materials[-1]))
    if water.shafts is not None:
        box = water_body.box("UW Shafts", extent, 0.0)
        box.data.materials.append(realtime_volume.build(values, water.shape))
        collection.objects.link(box)
    notes += realtime_materials.insert(materials, group, water.reflectances, water.shape)
    lamp = bpy.data.lights.new("UW Sun", "SUN")
    lamp.energy = 1.0
    lamp.shadow_maximum_resolution = _SHADOW if water.waves is None else _WAVY_SHADOW
    above = realtime_shadows.lamps() if water.cone is not None else []
    for data in (lamp, *above):
        item = bpy.data.objects.new(data.name, data)
        item[water_body.IS_SUN] = data is lamp
        collection.objects.link(item)
    set_values(scene, water)
    return notes


def set_values(scene: bpy.types.Scene, water: RealtimeWater) -> None:
    """Give the water in a scene other values; nothing is rebuilt.

    Raises
    ------
    InputError
        If the scene has no real-time water, or water of another shape.
    """
    tree = bpy.data.node_groups.get(realtime_values.NAME)
    if not has_realtime(scene) or tree is None:
        raise InputError(f"scene {scene.name!r} has no real-time water; add it first")
    if tree[realtime_values.SHAPE] != repr(water.shape):
        raise InputError(
            "this water needs other nodes; remove the real-time water and add it again"
        )
    realtime_values.write(tree, water.numbers)
    if water.waves is not None:
        realtime_waves.write_patterns(water.waves)
    realtime_materials.write_reflectances(water.reflectances, water.shape)
    realtime_materials.refresh()
    collection = _collection(scene)
    water_body.place_in(collection, water.column)
    for item in collection.objects:
        if item.get(water_body.IS_SUN):
            item.data.angle = water_body.SUN_DIAMETER_IN_AIR / water.column.refractive_index
            item.data.volume_factor = 1.0 / water.shafts.scale if water.shafts is not None else 0.0
        elif item.type == "LIGHT" and water.cone is not None:
            water_body.turn(item, water.cone.direction)
            item.data.angle = 2.0 * water.cone.half_angle


def remove_realtime(scene: bpy.types.Scene) -> None:
    """Take the water out; the scene is as it was before :func:`add_realtime`."""
    collection = _collection(scene)
    if collection is None:
        return
    realtime_materials.remove()
    for key in [k for k in collection.keys() if k.startswith(f"{_LAMPS}_")]:  # noqa: SIM118
        item = collection[key]
        item.hide_render, item.hide_viewport = (bool(x) for x in item[_LAMPS])
        del item[_LAMPS]
    world = scene.world
    scene.world = collection.get(_WORLD)
    bpy.data.worlds.remove(world)
    for item in list(collection.objects):
        water_body.delete(item)
    bpy.data.collections.remove(collection)
    for name in _GROUPS:
        group = bpy.data.node_groups.get(name)
        if group is not None:
            remove_group(group)
    realtime_waves.remove_images()


def has_realtime(scene: bpy.types.Scene) -> bool:
    """Whether :func:`add_realtime` has put water into the scene."""
    return _collection(scene) is not None


def _collection(scene: bpy.types.Scene) -> bpy.types.Collection | None:
    return next((c for c in scene.collection.children if _STATE in c), None)


def _floor_material() -> bpy.types.Material:
    material = bpy.data.materials.new(_FLOOR)
    tree = material.node_tree
    tree.nodes.clear()
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (0.5, 0.5, 0.5, 1.0)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    return material


def _shaft_range(
    column: WaterColumn, water: ClosedForm, camera_depth: float, weights: NDArray[np.float64]
) -> ShaftRange:
    """Reach of the froxels, and a scale that keeps their volume thin away from the sun."""
    clearest = float(column.attenuation.min())
    end = min(_SHAFT_OPTICAL_DEPTH / max(clearest, 1e-6), _LONGEST_SHAFT)
    angles = np.radians(np.linspace(5.0, 175.0, 35))
    sun = np.asarray(column.sun_direction, dtype=np.float64)
    across = np.cross(sun, [1.0, 0.0, 0.0] if abs(sun[0]) < 0.9 else [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    w = -np.cos(angles)[:, None] * sun + np.sin(angles)[:, None] * across
    light = water.single_scattering(camera_depth, tuple(w.T[..., None]), end)
    seen = np.maximum(light @ weights.T, 0.0).max(axis=1)
    phase = HenyeyGreenstein(realtime_volume.ANISOTROPY)
    opacity = float((seen / phase(np.cos(angles))).max())
    return ShaftRange(end, _SHAFT_OPACITY / max(opacity, 1e-12))
