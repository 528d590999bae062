"""Real-time water for EEVEE: put into a scene, given its values, taken out again.

Values change without rebuilding anything; only another :class:`Shape` (parts of the
phase function, surface, sky, shafts, lamps) builds new nodes.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from dataclasses import field as dataclass_field

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups import (
    realtime_background,
    realtime_lamps,
    realtime_refraction,
    realtime_shade,
    realtime_surface,
    realtime_tables,
    realtime_values,
    realtime_volume,
    realtime_waves,
)
from ...node_groups.realtime_values import Numbers, Shape
from ...node_groups.realtime_water import Sources, layout_of
from ...uw_spectral.errors import InputError
from ...uw_spectral.lamps.grouping import grouped
from ...uw_spectral.lamps.lamp_channels import fold_lamps
from ...uw_spectral.lamps.multiple_scattering import LampWater, lamp_water
from ...uw_spectral.shade.shade_table import ShadeTable
from ...uw_spectral.surface.wave_patterns import LAYERS, WavePatterns, interp, layer_position
from ...uw_spectral.transfer.above_water import LightInAir, flattened_sun, light_in_air
from ...uw_spectral.transfer.channel_pixel import COLOURS, along_rays
from ...uw_spectral.transfer.channels import Channels, channels_of
from ...uw_spectral.transfer.folded_light import FoldedLight, Shades, fold
from ...uw_spectral.transfer.radiance_table import TABLE_STREAMS, tabulate
from ...uw_spectral.transfer.solved_field import SolvedField
from ...uw_spectral.transfer.water_column import WaterColumn
from ...uw_spectral.water.phase import BandPhase, HenyeyGreenstein
from .. import contents, marks
from ..materials import bare_surfaces, realtime_materials
from ..materials.realtime_materials import Kinds, Surfaces
from ..seen.lamps import SceneLamps
from . import apparent_places, particles, scene_water
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
# Columns of red, green and blue come before those of measured reflectances.
_FIRST_MEASURED = 3
_WHITE = 0.6  # colour of a white closure in the sunlight at the camera
_ROUNDING = 1e-9  # of weights that are not negative
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
    """The water of a frame; make it with :func:`realtime_water`.

    Its light is solved in n bands and folded into the channels that are drawn.

    Attributes
    ----------
    column : WaterColumn
        The water, its light and its floor.
    phase : BandPhase
        Its phase function.
    depth : float
        Of the camera, m.
    field : SolvedField
    channels : Channels
        What is drawn.
    shape : Shape
    draws_shafts : bool
    reflectances : dict of str to array, shape (n,)
        Measured ones, by the names of materials.
    frame : four floats
        Left, bottom, width and height of the picture of an orthographic camera, m; zero of others.
    pictures : bool
        Whether the channels are those of a picture.
    waves, contrast, strength : WavePatterns, array (KNOTS, n), float
        The moving surface: its patterns, and the strength of what they throw.
    """

    column: WaterColumn
    phase: BandPhase
    depth: float
    field: SolvedField
    channels: Channels
    shape: Shape
    draws_shafts: bool = False
    reflectances: dict[str, NDArray[np.float64]] = dataclass_field(default_factory=dict)
    shade: ShadeTable | None = None
    lamps: SceneLamps = dataclass_field(default_factory=SceneLamps)
    around_lamps: LampWater | None = None
    above: ViewFromAir | None = None
    particles: SceneParticles = dataclass_field(default_factory=SceneParticles)
    waves: WavePatterns | None = None
    contrast: NDArray[np.float64] | None = None
    strength: float = 0.0
    frame: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    pictures: bool = False

    def in_channels(self, channels: Channels, layers: Sequence[str] = ()) -> RealtimeWater:
        """Return the water in other channels, with layers that are written beside the picture."""
        shape = replace(self.shape, layers=tuple(layers))
        return replace(self, channels=channels, shape=shape)

    def seen_from(self, *, in_air: bool) -> RealtimeWater:
        """Return the water for rays that all begin in the air, or all in the water."""
        assert self.above is not None, "the camera may be in the air"
        return replace(self, above=replace(self.above, in_air=in_air))

    def under_waves(
        self, waves: WavePatterns, contrast: NDArray[np.float64], strength: float
    ) -> RealtimeWater:
        """Return the water under waves.

        Parameters
        ----------
        waves : WavePatterns
            Of the frame.
        contrast : array, shape (KNOTS, n)
            Of the bands, its strength included.
        strength : float
            Of the caustics in the shafts; 1 is physical.
        """
        shape = replace(self.shape, waves=True)
        return replace(self, shape=shape, waves=waves, contrast=contrast, strength=strength)

    @property
    def keeps_closures(self) -> bool:
        """Whether materials keep their closures, which only add to the light of the water.

        Layers hold the light of things, which nothing tells of a closure; and where channels are
        negative, as those of a display are, EEVEE would cut the light of the water first. Band
        passes are measurements, and EEVEE keeps the colours of closures in steps of a thousandth.
        """
        weights = self.channels.weights
        positive = weights.min() >= -_ROUNDING * np.abs(weights).max()
        return self.pictures and not self.shape.layers and bool(positive)

    @functools.cached_property
    def folded(self) -> FoldedLight:
        """Light of the water in the channels."""
        return fold(
            self.field,
            self.channels,
            self.depth,
            self.column.skylight.level,
            list(self.reflectances.values()),
            None if self.shade is None else Shades(self.shade.spectrum, self.shade.usual),
            None if self.contrast is None else self._contrast_at,
        )

    def _contrast_at(self, depths: NDArray[np.float64]) -> NDArray[np.float64]:
        assert self.waves is not None
        assert self.contrast is not None
        named = wave_numbers(self.waves, self.strength)
        log, per_log = realtime_values.WAVES_LOG_DEPTH, realtime_values.WAVES_PER_LOG
        place = 2.0 * layer_position(depths, named[log], named[per_log])
        return interp(place[:, None], list(self.contrast))

    @functools.cached_property
    def shafts(self) -> ShaftRange | None:
        """Reach of the froxels, and a scale that keeps their volume thin away from the sun."""
        return _shaft_range(self) if self.draws_shafts else None

    @functools.cached_property
    def sun_gain(self) -> float:
        """What the light of the drawn sun is multiplied with.

        EEVEE keeps the colours of closures in steps of a thousandth, and lobes that have no colour
        of their own are at most 1: a white thing in the sunlight at the camera shall be so near
        to 1 that brighter places have room.
        """
        along = along_rays(self.folded, self.field.sun, [np.zeros((1, 1))] * 3)
        y = np.full((1, 1), min(max(self.depth, 0.0), self.field.floor_depth))
        white = sum(along.sunlight(y, 0.0 * y, k) for k in COLOURS)
        brightest = float(np.max(white))
        return _WHITE / brightest if brightest > 0 else 1.0

    @functools.cached_property
    def numbers(self) -> Numbers:
        """What the node groups need besides tables and images."""
        column, shape = self.column, self.shape
        found = realtime_values.of_light(self.folded, tuple(self.field.sun))
        channels, single = dict(found.channels), dict(found.single)
        single |= dict(zip(realtime_values.SUN_IN_AIR, column.skylight.sun, strict=True))
        single |= {
            realtime_values.CAMERA_DEPTH: self.depth,
            **dict(zip(realtime_values.FRAME, self.frame, strict=True)),
            realtime_values.INDEX: column.refractive_index,
            realtime_values.SUN_GAIN: self.sun_gain,
            realtime_values.SHAFT_END: self.shafts.end if self.shafts else 0.0,
            realtime_values.SHAFT_SCALE: self.shafts.scale if self.shafts else 0.0,
        }
        if self.shade is not None:
            single |= realtime_shade.numbers(self.shade.box)
        if "reflectance" in shape.layers:
            columns = self.channels.fold(self.channels.reflectance.T)
            channels |= dict(zip(realtime_values.REFLECTANCE, columns, strict=True))
        if self.above is not None:
            in_air = light_in_air(column)
            channels |= _in_air(self.channels, in_air)
            single |= self.above.numbers(column)
            single[realtime_values.MIRRORED_SHARE] = float(in_air.mirrored)
        if self.around_lamps is not None:
            single |= _of_lamps(self.lamps, column, self.phase, self.depth)
        if self.waves is not None and self.contrast is not None:
            # Where light falls from the brightest to nothing, no band may fall below it.
            most = max(float(self.contrast.max()), _ROUNDING)
            single[realtime_values.LEAST_PATTERN] = 1.0 - 1.0 / most
            single |= wave_numbers(self.waves, self.strength)
            single |= {
                realtime_values.GLITTER: column.glitter * bool(self.waves.slope_x.any()),
                realtime_values.GLITTER_WIDTH: self.waves.glitter_width(column.refractive_index),
            }
        return Numbers(channels, single)


def _in_air(channels: Channels, light: LightInAir) -> dict[str, NDArray[np.float64]]:
    """Return sun and sky in the air, on colours and alone, and light that colours emit."""
    found = {
        realtime_values.SUN_LEVEL: channels.fold(light.sun),
        realtime_values.SKY_LEVEL: channels.fold(light.level),
    }
    for names, columns in (
        (realtime_values.SUN_ABOVE, channels.fold_colours(light.sun)),
        (realtime_values.SKY_ABOVE, channels.fold_colours(light.sky)),
        (realtime_values.GLOW_ABOVE, channels.fold(channels.emission.T).T),
    ):
        found |= dict(zip(names, columns.T, strict=True))
    return found


def wave_numbers(waves: WavePatterns, strength: float) -> dict[str, float]:
    """Return what the nodes need to look up the images of waves, by name."""
    depths = waves.layers.depths
    return {
        realtime_values.WAVES_PER_METRE: 1 / waves.layers.tile,
        realtime_values.WAVES_HALF_CELL: 0.5 / len(waves.slope_x),
        realtime_values.WAVES_LOG_DEPTH: math.log(depths[0]),
        realtime_values.WAVES_PER_LOG: (LAYERS - 1) / math.log(depths[-1] / depths[0]),
        realtime_values.CAUSTIC_STRENGTH: strength,
    }


def realtime_water(
    column: WaterColumn,
    phase: BandPhase,
    camera_depth: float,
    weights: NDArray[np.float64],
    *,
    solved: SolvedField | None = None,
    shafts: bool = False,
    reflectances: dict[str, NDArray[np.float64]] | None = None,
    shade: ShadeTable | None = None,
    lamps: SceneLamps | None = None,
    above: ViewFromAir | None = None,
    kinds: Kinds | None = None,
) -> RealtimeWater:
    """Return the water of a frame.

    Parameters
    ----------
    column : WaterColumn
        The water, its light and its floor.
    phase : BandPhase
        Its phase function.
    camera_depth : float
        Depth of the camera, m.
    weights : array, shape (3, n)
        What the channels have per unit radiance of each band.
    solved : SolvedField, optional
        Light of the column, if it has been solved already.
    shafts : bool
        Whether single scattering is drawn by the froxel volume, with shadows.
    reflectances : dict of str to array, shape (n,), optional
        Measured reflectance by material name.
    shade : ShadeTable, optional
        What things keep away and throw back.
    lamps : SceneLamps, optional
        In the water.
    above : ViewFromAir, optional
        Of a camera that may be above the water; shafts are not drawn then.
    kinds : Kinds, optional
        Of the things' materials.
    """
    lamps, kinds = lamps or SceneLamps(), kinds or Kinds()
    shafts = shafts and above is None
    if shafts:
        column.require_one_layer("shafts of light know")
    field = solved or column.solved_field(phase, TABLE_STREAMS)
    known = dict(reflectances or {})
    if math.isfinite(column.floor_depth):
        known[_FLOOR] = column.floor_reflectance
    scale = tabulate(field).depth_scale
    shape = Shape(
        field.components, column.reflects, len(scale.zones), scale.slices, shafts,
        sky=column.sky, layered=field.layered, shade=shade is not None, lamps=len(lamps.all),
        lamp_components=phase.components if lamps.lamps else (),
        above=above is not None, mirrors=kinds.mirrors, glows=kinds.glows, measured=len(known),
    )  # fmt: skip
    around_lamps = _around_lamps(column, phase, camera_depth) if lamps.lamps else None
    return RealtimeWater(
        column, phase, camera_depth, field, channels_of(column.bands, weights), shape, shafts,
        known, shade, lamps, around_lamps, above,
    )  # fmt: skip


def _around_lamps(column: WaterColumn, phase: BandPhase, depth: float) -> LampWater:
    """Return the water of a depth as the light of lamps meets it."""
    here = column.layer_at(depth, phase)
    alike = here.phase.components == phase.components
    return lamp_water(here.absorption, here.scattering, here.phase if alike else phase)


def _of_lamps(
    lamps: SceneLamps, column: WaterColumn, phase: BandPhase, depth: float
) -> dict[str, float]:
    """Return the numbers of lamps in water of a depth that are the same in every band."""
    sun = float(np.mean(column.Ed(depth, phase)))
    brightest = max(float(np.mean(lamp.intensity)) for lamp in lamps.lamps)
    sunlit = bool(np.any(column.sun_irradiance > 0))
    code = min(max(_FAINT_SHARE * brightest / sun, _FAINTEST), _BRIGHTEST) if sun > 0 else 1.0
    return dict(zip(realtime_lamps.NUMBERS, (float(sunlit), code), strict=True))


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
    scene_water.prepare(scene)
    plain, bare = bare_surfaces.dress(scene)
    materials, notes = scene_water.own_materials(scene, routed=False)
    notes += bare
    shape = water.shape
    images = None if water.waves is None else realtime_waves.new_images()
    table = realtime_tables.new_image(layout_of(shape))
    values = realtime_values.build(shape)
    shade = None if water.shade is None else realtime_shade.new_image()
    count = len(water.lamps.lamps)
    lit = (
        realtime_lamps.new_image(shape.lamps, len(shape.lamp_components), shape.measured)
        if count
        else None
    )
    rays = realtime_refraction.build(values, images) if shape.above else None
    sources = Sources(values, table, shade, lit, images, rays)
    surface = realtime_surface.build(shape, sources)
    keeping = realtime_surface.build(shape, sources, keeps=True) if water.keeps_closures else None
    background = realtime_background.build(shape, sources)
    floor, objects = None, []
    if math.isfinite(water.column.floor_depth):
        floor = _floor_material()
        materials.append(floor)
    if shape.shafts:
        objects.append(box("UW Shafts", extent, 0.0))
        objects[0].data.materials.append(realtime_volume.build(shape, sources))
    notes += realtime_materials.insert(materials, Surfaces(surface, keeping, floor))
    apparent = realtime_refraction.build_apparent(values) if shape.above else None
    if apparent is not None:
        notes += apparent_places.insert(materials, apparent, extent.bottom)
    sun = bpy.data.lights.new("UW Sun", "SUN")
    sun.energy = 1.0
    sun.shadow_maximum_resolution = _SHADOW if water.waves is None else _WAVY_SHADOW
    filling = scene_water.Filling(
        realtime_background.build_world(background),
        [sun],
        floor,
        objects,
        images,
        {_VALUES: values, marks.SURFACE: surface}
        | {
            name: image
            for name, image in (
                (_TABLE, table),
                (marks.KEEPING, keeping),
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
    values[_OWNER] = marks.collection_of(scene)
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
    plain, notes = bare_surfaces.dress(scene, marks.part(scene, _PLAIN))
    collection = marks.collection_of(scene)
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
    values = marks.part(scene, _VALUES)
    if values is None:
        raise InputError(f"scene {scene.name!r} has no real-time water; add it first")
    if values[realtime_values.SHAPE] != repr(water.shape):
        raise InputError(
            "this water needs other nodes; remove the real-time water and add it again"
        )
    realtime_values.write(values, water.numbers)
    realtime_tables.write_light(marks.part(scene, _TABLE), water.folded)
    if water.shade is not None:
        realtime_shade.write_table(marks.part(scene, _SHADE), water.shade)
    if water.around_lamps is not None:
        _set_lamps(scene, water, water.around_lamps)
    if water.waves is not None:
        realtime_waves.write_patterns(marks.images(scene), water.waves)
    particles.bring(scene, water.particles, lambda material: _wet(scene, material))
    known = {m.name: m for m in contents.materials(scene) if m.is_editable}
    known[_FLOOR] = marks.part(scene, marks.FLOOR)
    for place, (name, reflectance) in enumerate(water.reflectances.items()):
        if known.get(name) is not None:
            measured = water.channels.fold(reflectance)
            realtime_materials.write_reflectance(known[name], _FIRST_MEASURED + place, measured)
    realtime_materials.refresh()
    scene_water.place(scene, water.column)
    for item in marks.objects(scene):
        if item.get(marks.IS_SUN):
            if water.above is not None:
                scene_water.fan_out_floor(scene, water.above.camera)
                drawn = (water.numbers.single[name] for name in realtime_values.DRAWN_SUN)
                scene_water.turn(item, drawn)
            # At night it would hide the shadows of lamps.
            shines = bool(np.any(water.column.sun_irradiance > 0))
            item.data.energy = shines / water.sun_gain
            item.data.angle = scene_water.SUN_DIAMETER_IN_AIR / water.column.refractive_index
            of_volume = water.sun_gain / water.shafts.scale if water.shafts is not None else 0.0
            item.data.volume_factor = of_volume


def keep_images(scene: bpy.types.Scene) -> None:
    """Pack what :func:`set_values` has drawn: a file that is saved then shows it without us."""
    drawn = [marks.part(scene, name) for name in (_TABLE, _SHADE, _LAMPS)]
    waves = marks.images(scene)
    for image in (*drawn, waves.caustics, waves.slopes):
        if image is not None and image.is_dirty:
            image.pack()


def _wet(scene: bpy.types.Scene, material: bpy.types.Material) -> None:
    """Send a material of the water's own through the surface group that is there."""
    lit, keeping = (marks.part(scene, name) for name in (marks.SURFACE, marks.KEEPING))
    realtime_materials.insert([material], Surfaces(lit, keeping))
    apparent = marks.part(scene, _APPARENT)
    if apparent is not None:
        apparent_places.insert([material], apparent, _LONGEST_SHAFT)


def _set_lamps(scene: bpy.types.Scene, water: RealtimeWater, around: LampWater) -> None:
    lamps, numbers = water.lamps.lamps, water.numbers.single
    codes = realtime_lamps.CODES[int(numbers[realtime_lamps.SUNLIT]) :]
    groups = grouped([lamp.position for lamp in lamps], len(codes))
    colours = [codes[group] for group in groups]
    shown = colours + [realtime_lamps.NO_SHADOW] * len(water.lamps.thrown)
    measured = list(water.reflectances.values())
    folded = fold_lamps(water.lamps.all, around, water.channels, measured)
    realtime_lamps.write_lamps(marks.part(scene, _LAMPS), folded, shown)
    for item, lamp, colour in zip(marks.followers(scene), lamps, colours, strict=True):
        code = numbers[realtime_lamps.CODE]
        realtime_lamps.write_shadow_lamp(item.data, lamp, colour, code)


def has_realtime(scene: bpy.types.Scene) -> bool:
    """Whether :func:`add_realtime` has put water into the scene."""
    return marks.part(scene, _VALUES) is not None


def fits(scene: bpy.types.Scene, water: RealtimeWater) -> bool:
    """Whether :func:`set_values` can give the water in a scene the values of another.

    A full copy of a scene still shows the water of the original, and needs its own.
    """
    values = marks.part(scene, _VALUES)
    if values is None or values[realtime_values.SHAPE] != repr(water.shape):
        return False
    has_floor = marks.part(scene, marks.FLOOR) is not None
    own = values.get(_OWNER) == marks.collection_of(scene)
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


def _shaft_range(water: RealtimeWater) -> ShaftRange:
    """Reach of the froxels, and a scale that keeps their volume thin away from the sun."""
    clearest = float(water.column.attenuation.min())
    end = min(_SHAFT_OPTICAL_DEPTH / max(clearest, 1e-6), _LONGEST_SHAFT)
    angles = np.radians(np.linspace(5.0, 175.0, 35))
    sun = np.asarray(water.field.sun, dtype=np.float64)
    across = np.cross(sun, [1.0, 0.0, 0.0] if abs(sun[0]) < 0.9 else [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    w = list((-np.cos(angles)[:, None] * sun + np.sin(angles)[:, None] * across).T[..., None])
    ray = along_rays(water.folded, water.field.sun, w)
    y_o = np.full((len(angles), 1), max(water.depth, 0.0))
    y_e = np.maximum(y_o - w[2] * end, 0.0)
    P = np.where(w[2] > 0, np.minimum(end, y_o / np.maximum(w[2], 1e-6)), end)
    seen = np.maximum(ray.single_scattering(y_o, y_e, w, P), 0.0).max(axis=1)
    phase = HenyeyGreenstein(realtime_volume.ANISOTROPY)
    opacity = float((seen / phase(np.cos(angles))).max())
    return ShaftRange(end, _SHAFT_OPACITY / max(opacity, 1e-12))
