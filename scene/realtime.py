"""Real-time water for EEVEE: put into a scene, given its values, taken out again.

Values change without rebuilding anything; only another :class:`Shape` (number
of bands, kind of phase function, surface, sky, aureole, shafts) builds new nodes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import bpy
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..node_groups import (
    realtime_background,
    realtime_inelastic,
    realtime_lamps,
    realtime_refraction,
    realtime_shade,
    realtime_shadows,
    realtime_surface,
    realtime_tables,
    realtime_values,
    realtime_volume,
    realtime_waves,
)
from ..node_groups.realtime_tables import Layout
from ..node_groups.realtime_triples import TableImages
from ..node_groups.realtime_values import Numbers, Shape
from ..uw_spectral.errors import InputError
from ..uw_spectral.lamps.grouping import grouped
from ..uw_spectral.lamps.multiple_scattering import LampWater, lamp_water
from ..uw_spectral.shade.shade_table import ShadeTable
from ..uw_spectral.spectra.reflectance import emission_basis, uplift_basis
from ..uw_spectral.surface.wave_patterns import WavePatterns
from ..uw_spectral.transfer.above_water import flattened_sun, light_in_air
from ..uw_spectral.transfer.closed_form import solve_closed_form
from ..uw_spectral.transfer.inelastic_light import InelasticLight, reduced
from ..uw_spectral.transfer.light_cone import LightCone, light_cone
from ..uw_spectral.transfer.radiance_table import RadianceTable, tabulate
from ..uw_spectral.transfer.solved_field import SolvedField
from ..uw_spectral.transfer.sun_beam import SunBeam, sun_beam
from ..uw_spectral.transfer.water_column import WaterColumn
from ..uw_spectral.water.phase import BandPhase, HenyeyGreenstein
from . import apparent_places, bare_surfaces, contents, particles, realtime_materials, scene_water
from .lamps import SceneLamps
from .particles import SceneParticles
from .water_body import WaterExtent, box

# Key of the added floor's reflectance; no material has an empty name.
_FLOOR = ""
_VALUES = "uw_values"
_OWNER = "uw_owner"
_TABLE = "uw_table"
_SHADE = "uw_shade"
_LAMPS = "uw_lamps"
_APPARENT = "uw_apparent"
_PLAIN = "uw_plain"
# Shafts end where the clearest band keeps 2 % of its light, or soon after the scene does.
_SHAFT_OPTICAL_DEPTH = 4.0
_LONGEST_SHAFT = 200.0
MOST_BANDS = 64
"""Bands of one shader, looked up in turn."""
MOST_CLOSED_FORM_BANDS = 16
"""Of the closed form. More fit into a shader's 64 KB of numbers, but take minutes to compile."""
# Share by which the volume may dim what is behind it; below, the rounding of its
# transmittance costs more light than that (8 to 14 % at 0.003, 4 to 6 % at 0.02).
_SHAFT_OPACITY = 0.02
# Finest detail of the sun's shadow in m: Blender's millimetre costs several times as much,
# and the sun's disc blurs a shadow by 7 mm per metre, waves by far more.
_SHADOW, _WAVY_SHADOW = 0.01, 0.03
# Intensity of the lamps that cast shadows: what they add to the sun's light on a thing is this
# share of what the lamps themselves do. Fainter ones drown in the rounding of single precision.
_FAINT_SHARE, _FAINTEST, _BRIGHTEST = 1e-3, 2e-5, 2e-3


@dataclass(frozen=True)
class ShaftRange:
    """Reach of the froxel volume in m, and the factor that makes it thin."""

    end: float
    scale: float


@dataclass(frozen=True)
class ViewFromAir:
    """A camera of which some frames may be above the water.

    Parameters
    ----------
    camera : three floats
        Where it is, m.
    in_air : bool
        Whether its rays begin in the air.
    towards : three floats
        Unit vector to where it looks.
    """

    camera: Sequence[float]
    in_air: bool
    towards: Sequence[float]

    def numbers(self, column: WaterColumn) -> dict[str, float]:
        """Return what the node groups know of it."""
        index = column.refractive_index if column.reflects else 1.0
        sun = column.sun_direction.tolist()
        if self.in_air:
            sun = flattened_sun(sun, self.towards, index).tolist()
        return {
            realtime_values.IN_AIR: float(self.in_air),
            realtime_values.RAY_INDEX: index,
            **dict(zip(realtime_values.CAMERA, self.camera, strict=True)),
            **dict(zip(realtime_values.DRAWN_SUN, sun, strict=True)),
        }


@dataclass(frozen=True, eq=False)
class RealtimeWater:
    """The water of a frame, ready for the node groups; see :func:`realtime_water`."""

    shape: Shape
    numbers: Numbers
    reflectances: dict[str, NDArray[np.float64]]
    column: WaterColumn
    shafts: ShaftRange | None
    cone: LightCone | None = None
    table: RadianceTable | None = None
    waves: WavePatterns | None = None
    shade: ShadeTable | None = None
    lamps: SceneLamps = field(default_factory=SceneLamps)
    around_lamps: LampWater | None = None
    above: ViewFromAir | None = None
    particles: SceneParticles = field(default_factory=SceneParticles)

    def seen_from(self, *, in_air: bool) -> RealtimeWater:
        """Return the water for rays that all begin in the air, or all in the water."""
        assert self.above is not None, "the camera may be in the air"
        now = replace(self.above, in_air=in_air)
        numbers = Numbers(self.numbers.bands, {**self.numbers.single, **now.numbers(self.column)})
        return replace(self, numbers=numbers, above=now)

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
        sensors = (*realtime_values.SENSOR, *realtime_values.LAYERS_SENSOR)
        bands |= {name: bands[name] * seen for name in sensors if name in bands}
        return replace(
            self,
            shape=replace(self.shape, bands=count),
            numbers=Numbers(bands, self.numbers.single),
            reflectances={name: values[chosen] for name, values in self.reflectances.items()},
            table=None if self.table is None else self.table.of_bands(chosen),
            shade=None if self.shade is None else self.shade.of_bands(chosen),
            lamps=self.lamps.of_bands(chosen),
            around_lamps=None if self.around_lamps is None else self.around_lamps.of_bands(chosen),
        )

    @property
    def seen(self) -> NDArray[np.float64]:
        """What the picture sees per unit radiance of each band, shape (3, n)."""
        return np.array([self.numbers.bands[name] for name in realtime_values.SENSOR])

    def of_sign(self, sign: float) -> RealtimeWater:
        """Return the water with the sensor's weights of one sign, 1 or -1, as positive ones."""
        bands = dict(self.numbers.bands)
        bands |= {name: np.maximum(sign * bands[name], 0.0) for name in realtime_values.SENSOR}
        return replace(self, numbers=Numbers(bands, self.numbers.single))

    def of_triple(self, indices: Sequence[int], gains: ArrayLike) -> RealtimeWater:
        """Return the water of one band pass: three bands, seen as red, green and blue.

        Parameters
        ----------
        indices : sequence of int
            The one to three bands of the pass.
        gains : array_like, shape (3,) or fewer
            Factor of each channel that brings its radiance near 1.
        """
        water = self.of_bands(indices, 3)
        seen = np.eye(3) * np.resize(gains, 3)
        sensor = dict(zip(realtime_values.SENSOR, seen, strict=True))
        if water.shape.layers:
            sensor |= zip(realtime_values.LAYERS_SENSOR, seen, strict=True)
        numbers = Numbers({**water.numbers.bands, **sensor}, water.numbers.single)
        return replace(water, numbers=numbers)

    def with_layers(self, layers: Sequence[str], seen: ArrayLike) -> RealtimeWater:
        """Return the water that writes layers beside its picture.

        Parameters
        ----------
        layers : sequence of str
            Of :mod:`.realtime_layers`.
        seen : array_like, shape (3, n)
            What their sensor sees per unit radiance of each band.
        """
        rows = zip(realtime_values.LAYERS_SENSOR, np.asarray(seen, np.float64), strict=True)
        numbers = Numbers({**self.numbers.bands, **dict(rows)}, self.numbers.single)
        return replace(self, shape=replace(self.shape, layers=tuple(layers)), numbers=numbers)


def realtime_water(
    column: WaterColumn,
    phase: BandPhase,
    camera_depth: float,
    weights: NDArray[np.float64],
    *,
    solved: SolvedField | None = None,
    shafts: bool = False,
    diffuse_shadows: bool = False,
    reflectances: dict[str, NDArray[np.float64]] | None = None,
    inelastic: InelasticLight | None = None,
    shade: ShadeTable | None = None,
    lamps: SceneLamps | None = None,
    above: ViewFromAir | None = None,
    mirrors: bool = False,
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
    solved : SolvedField, optional
        Of the column and the phase function, to be looked up; the closed form without.
    shafts : bool
        Whether single scattering is drawn by the froxel volume, with shadows.
    diffuse_shadows : bool
        Whether things keep light from above other than the direct sun away, in the closed form.
    reflectances : dict of str to array, shape (n,), optional
        Measured reflectance by material name.
    inelastic : InelasticLight, optional
        Light of changed wavelength in the same bands, for the closed form; it is reduced to a
        few exponentials. A solved field holds its own.
    shade : ShadeTable, optional
        What things keep away and throw back, of a solved field.
    lamps : SceneLamps, optional
        In the water.
    above : ViewFromAir, optional
        Of a camera that may be above the water; shafts are not drawn then.
    mirrors : bool
        Whether things mirror the water, which takes a solved field of a single layer.
    """
    lamps = lamps or SceneLamps()
    shafts = shafts and above is None
    if solved is None:
        column.require_one_layer("the closed form (--field) knows")
    if shafts:
        column.require_one_layer("shafts of light know")
    field = column.mixed_above(camera_depth).light_field(phase)
    beam = sun_beam(field, phase, column.sun_direction.tolist())
    shape = Shape(
        len(column.bands), tuple(phase.components), 0, column.reflects, shafts,
        # Lamps need the colours that tell those of the light from above apart.
        diffuse_shadows=diffuse_shadows and solved is None and not lamps.lamps, sky=column.sky,
        shade=shade is not None, lamps=len(lamps.all), above=above is not None,
    )  # fmt: skip
    light, table = {}, None
    if solved is None:
        water = solve_closed_form(field, phase, camera_depth, column.sun_direction)
        shape = replace(shape, lobes=len(water.aureole.weights))
        if inelastic is not None:
            few = reduced(inelastic)
            light = realtime_inelastic.of_light(few)
            shape = replace(shape, inelastic=tuple(term.rising for term in few.terms))
        numbers = realtime_values.of_water(water, shape)
    else:
        table = tabulate(solved)
        scale = table.depth_scale
        shape = replace(shape, solved=True, zones=len(scale.zones), slices=scale.slices)
        shape = replace(shape, mirrors=mirrors and not solved.layered)
        if solved.layered:
            shape = replace(shape, layered=True, components=solved.components)
        solved_beam = replace(beam, cp=solved.extinction)
        numbers = realtime_values.of_table(solved_beam, table, solved.floor_radiance)
    reach = _shaft_range(column, beam, camera_depth, weights) if shafts else None
    cone = light_cone(field, camera_depth, column.sun_direction) if shape.diffuse_shadows else None
    bands = {
        **numbers.bands,
        **light,
        realtime_values.SKY: column.skylight.level,
        **dict(zip(realtime_values.REFLECTANCE, uplift_basis(column.bands).T, strict=True)),
        **dict(zip(realtime_values.EMISSION, emission_basis(column.bands).T, strict=True)),
        **dict(zip(realtime_values.SENSOR, np.asarray(weights), strict=True)),
    }
    single = {
        **numbers.single,
        realtime_values.CAMERA_DEPTH: camera_depth,
        realtime_values.INDEX: column.refractive_index,
        **dict(zip(realtime_values.SUN_IN_AIR, column.skylight.sun, strict=True)),
        realtime_values.SHAFT_END: reach.end if reach else 0.0,
        realtime_values.SHAFT_SCALE: reach.scale if reach else 0.0,
    }
    if shade is not None:
        bands[realtime_shade.SPECTRUM] = shade.spectrum
        single |= realtime_shade.numbers(shade.box)
    around_lamps = None
    if above is not None:
        in_air = light_in_air(column)
        bands |= {realtime_values.SUN_ABOVE: in_air.sun, realtime_values.SKY_ABOVE: in_air.sky}
        single |= above.numbers(column) | {realtime_values.MIRRORED_SHARE: float(in_air.mirrored)}
    if lamps.lamps:
        around_lamps = _around_lamps(column, phase, camera_depth)
        bands |= realtime_lamps.of_water(around_lamps)
        single |= _of_lamps(lamps, column, phase, camera_depth, around_lamps.reach)
    known = dict(reflectances or {})
    if math.isfinite(column.floor_depth):
        known[_FLOOR] = column.floor_reflectance
    return RealtimeWater(
        shape, Numbers(bands, single), known, column, reach, cone, table, shade=shade, lamps=lamps,
        around_lamps=around_lamps, above=above,
    )  # fmt: skip


def _around_lamps(column: WaterColumn, phase: BandPhase, depth: float) -> LampWater:
    """Return the water of a depth as the light of lamps meets it."""
    here = column.layer_at(depth, phase)
    alike = here.phase.components == phase.components
    return lamp_water(here.absorption, here.scattering, here.phase if alike else phase)


def _of_lamps(
    lamps: SceneLamps, column: WaterColumn, phase: BandPhase, depth: float, reach: float
) -> dict[str, float]:
    """Return the numbers of lamps in water of a depth that are the same in every band."""
    sun = float(np.mean(column.Ed(depth, phase)))
    brightest = max(float(np.mean(lamp.intensity)) for lamp in lamps.lamps)
    sunlit = bool(np.any(column.sun_irradiance > 0))
    code = min(max(_FAINT_SHARE * brightest / sun, _FAINTEST), _BRIGHTEST) if sun > 0 else 1.0
    return dict(zip(realtime_lamps.NUMBERS, (reach, float(sunlit), code), strict=True))


def add_realtime(scene: bpy.types.Scene, water: RealtimeWater, extent: WaterExtent) -> list[str]:
    """Put real-time water into a scene.

    Replaces the world, hides the scene's own lamps, adds sun, floor and the
    volume of the shafts, and sends every material through the surface group.
    :func:`.scene_water.remove` takes it out.

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
        If the scene has water already or is linked from another file, or the water has too
        many bands.
    """
    most = MOST_BANDS if water.shape.solved else MOST_CLOSED_FORM_BANDS
    if water.shape.bands > most:
        raise InputError(
            f"one shader carries up to {most} bands, and this water has {water.shape.bands}; "
            "take fewer, or some of them at a time (RealtimeWater.of_bands)"
        )
    scene_water.prepare(scene)
    plain, bare = bare_surfaces.dress(scene)
    materials, notes = scene_water.own_materials(scene, routed=False)
    notes += bare
    shape = water.shape
    images = None if water.waves is None else realtime_waves.new_images()
    table = (
        None
        if water.table is None
        else realtime_tables.new_image(
            shape.triples,
            Layout.of_table(water.table, len(realtime_values.band_names(shape))),
        )
    )
    values = realtime_values.build(shape)
    shade = None if water.shade is None else realtime_shade.new_image()
    count = len(water.lamps.lamps)
    lit = realtime_lamps.new_image(shape.lamps, shape.triples) if count else None
    rays = realtime_refraction.build(values, images) if shape.above else None
    tables = TableImages(table, shade, lit, rays)
    surface = realtime_surface.build(values, shape, images, tables)
    background = realtime_background.build(values, shape, images, tables)
    floor, objects = None, []
    if math.isfinite(water.column.floor_depth):
        floor = _floor_material()
        materials.append(floor)
    if water.shafts is not None:
        objects.append(box("UW Shafts", extent, 0.0))
        objects[0].data.materials.append(realtime_volume.build(values, shape, images, tables))
    notes += realtime_materials.insert(materials, surface)
    apparent = realtime_refraction.build_apparent(values) if shape.above else None
    if apparent is not None:
        notes += apparent_places.insert(materials, apparent, extent.bottom)
    sun = bpy.data.lights.new("UW Sun", "SUN")
    sun.energy = 1.0
    sun.shadow_maximum_resolution = _SHADOW if water.waves is None else _WAVY_SHADOW
    above = realtime_shadows.lamps() if water.cone is not None else []
    filling = scene_water.Filling(
        realtime_background.build_world(background),
        [sun, *above],
        floor,
        objects,
        images,
        {_VALUES: values, scene_water.SURFACE: surface}
        | {
            name: image
            for name, image in (
                (_TABLE, table),
                (_SHADE, shade),
                (_LAMPS, lit),
                (_APPARENT, apparent),
                (_PLAIN, plain),
            )
            if image is not None
        },
        list(zip(realtime_lamps.shadow_lamps(count), water.lamps.objects, strict=True)),
    )
    notes += [*water.lamps.notes, *scene_water.add(scene, filling, water.column, extent)]
    values[_OWNER] = scene_water.collection_of(scene)
    set_values(scene, water)
    if water.above is not None:
        apparent_places.subdivide(scene, water.above.camera)
    return notes


def is_dry(item: bpy.types.Object) -> bool:
    """Whether an object came, or got a material, after the water of its scene."""
    return bare_surfaces.is_bare(item) or any(
        realtime_materials.is_dry(material) for material in contents.materials_of(item)
    )


def take_in(scene: bpy.types.Scene) -> list[str]:
    """Let what has come into a scene since its water get wet; other nodes stay.

    Returns
    -------
    list of str
        What could not be treated, one line each.
    """
    plain, notes = bare_surfaces.dress(scene, scene_water.part(scene, _PLAIN))
    collection = scene_water.collection_of(scene)
    if plain is not None and collection is not None:
        collection[_PLAIN] = plain
    materials, _ = scene_water.own_materials(scene, routed=False)
    for material in filter(realtime_materials.is_dry, materials):
        _wet(scene, material)
    return notes


def set_values(scene: bpy.types.Scene, water: RealtimeWater) -> None:
    """Give the water in a scene other values; nothing is rebuilt.

    Raises
    ------
    InputError
        If the scene has no real-time water, or water of another shape.
    """
    values = scene_water.part(scene, _VALUES)
    if values is None:
        raise InputError(f"scene {scene.name!r} has no real-time water; add it first")
    if values[realtime_values.SHAPE] != repr(water.shape):
        raise InputError(
            "this water needs other nodes; remove the real-time water and add it again"
        )
    realtime_values.write(values, water.numbers)
    if water.table is not None:
        numbers = realtime_values.rows(water.numbers, water.shape)
        realtime_tables.write_table(scene_water.part(scene, _TABLE), water.table, numbers)
    if water.shade is not None:
        realtime_shade.write_table(scene_water.part(scene, _SHADE), water.shade)
    if water.around_lamps is not None:
        _set_lamps(scene, water, water.around_lamps)
    if water.waves is not None:
        realtime_waves.write_patterns(scene_water.images(scene), water.waves)
    particles.bring(scene, water.particles, lambda material: _wet(scene, material))
    known = {m.name: m for m in contents.materials(scene) if m.is_editable}
    known[_FLOOR] = scene_water.part(scene, scene_water.FLOOR)
    for name, reflectance in water.reflectances.items():
        if known.get(name) is not None:
            realtime_materials.write_reflectance(known[name], reflectance, water.shape)
    realtime_materials.refresh()
    scene_water.place(scene, water.column)
    for item in scene_water.objects(scene):
        if item.get(scene_water.IS_SUN):
            if water.above is not None:
                scene_water.fan_out_floor(scene, water.above.camera)
                drawn = (water.numbers.single[name] for name in realtime_values.DRAWN_SUN)
                scene_water.turn(item, drawn)
            # At night it would hide the shadows of lamps.
            item.data.energy = float(np.any(water.column.sun_irradiance > 0))
            item.data.angle = scene_water.SUN_DIAMETER_IN_AIR / water.column.refractive_index
            item.data.volume_factor = 1.0 / water.shafts.scale if water.shafts is not None else 0.0
        elif item.type == "LIGHT" and item.data.type == "SUN" and water.cone is not None:
            scene_water.turn(item, water.cone.direction)
            item.data.angle = 2.0 * water.cone.half_angle


def _wet(scene: bpy.types.Scene, material: bpy.types.Material) -> None:
    """Send a material of the water's own through the surface group that is there."""
    realtime_materials.insert([material], scene_water.part(scene, scene_water.SURFACE))
    apparent = scene_water.part(scene, _APPARENT)
    if apparent is not None:
        apparent_places.insert([material], apparent, _LONGEST_SHAFT)


def _set_lamps(scene: bpy.types.Scene, water: RealtimeWater, around: LampWater) -> None:
    lamps, numbers = water.lamps.lamps, water.numbers.single
    codes = realtime_lamps.CODES[int(numbers[realtime_lamps.SUNLIT]) :]
    groups = grouped([lamp.position for lamp in lamps], len(codes))
    colours = [codes[group] for group in groups]
    shown = colours + [realtime_lamps.NO_SHADOW] * len(water.lamps.thrown)
    realtime_lamps.write_lamps(scene_water.part(scene, _LAMPS), water.lamps.all, shown, around)
    for item, lamp, colour in zip(scene_water.followers(scene), lamps, colours, strict=True):
        code = numbers[realtime_lamps.CODE]
        realtime_lamps.write_shadow_lamp(item.data, lamp, colour, code)


def has_realtime(scene: bpy.types.Scene) -> bool:
    """Whether :func:`add_realtime` has put water into the scene."""
    return scene_water.part(scene, _VALUES) is not None


def fits(scene: bpy.types.Scene, water: RealtimeWater) -> bool:
    """Whether :func:`set_values` can give the water in a scene the values of another.

    A full copy of a scene still shows the water of the original, and needs its own.
    """
    values = scene_water.part(scene, _VALUES)
    if values is None or values[realtime_values.SHAPE] != repr(water.shape):
        return False
    has_floor = scene_water.part(scene, scene_water.FLOOR) is not None
    own = values.get(_OWNER) == scene_water.collection_of(scene)
    if not particles.is_there(scene, water.particles):
        return False
    return own and has_floor == math.isfinite(water.column.floor_depth)


def _floor_material() -> bpy.types.Material:
    material = bpy.data.materials.new("UW Floor")
    tree = material.node_tree
    tree.nodes.clear()
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (0.5, 0.5, 0.5, 1.0)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    return material


def _shaft_range(
    column: WaterColumn, beam: SunBeam, camera_depth: float, weights: NDArray[np.float64]
) -> ShaftRange:
    """Reach of the froxels, and a scale that keeps their volume thin away from the sun."""
    clearest = float(column.attenuation.min())
    end = min(_SHAFT_OPTICAL_DEPTH / max(clearest, 1e-6), _LONGEST_SHAFT)
    angles = np.radians(np.linspace(5.0, 175.0, 35))
    sun = np.asarray(column.sun_direction, dtype=np.float64)
    across = np.cross(sun, [1.0, 0.0, 0.0] if abs(sun[0]) < 0.9 else [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    w = -np.cos(angles)[:, None] * sun + np.sin(angles)[:, None] * across
    light = beam.scattered_once(camera_depth, tuple(w.T[..., None]), end)
    seen = np.maximum(light @ weights.T, 0.0).max(axis=1)
    phase = HenyeyGreenstein(realtime_volume.ANISOTROPY)
    opacity = float((seen / phase(np.cos(angles))).max())
    return ShaftRange(end, _SHAFT_OPACITY / max(opacity, 1e-12))
