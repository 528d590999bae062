"""The lamps of a scene as lights in the water, spectrally."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix, Vector
from numpy.typing import NDArray

from ...node_groups.node_mathematics import MARK
from ...settings.render_plan import RenderPlan
from ...uw_spectral.errors import InputError
from ...uw_spectral.lamps.emission import (
    WATTS,
    intensity_of_colour,
    parse_emission,
    radiant_intensity,
)
from ...uw_spectral.lamps.lamp import Lamp
from ...uw_spectral.lamps.lamp_surface import lamplight as irradiance_seen
from ...uw_spectral.lamps.layers import waters_of_lamps
from ...uw_spectral.lamps.multiple_scattering import LampWater, lamp_water
from ...uw_spectral.lamps.over_water import through_surface
from ...uw_spectral.lamps.virtual_point_lights import LampRays, LitSurfaces, virtual_point_lights
from ...uw_spectral.spectra.bands import Bands
from ...uw_spectral.spectra.illuminant import RELATIVE, full_sun
from ...uw_spectral.spectra.reflectance import uplift_basis
from ...uw_spectral.surface.refraction import REFRACTIVE_INDEX
from ...uw_spectral.transfer.rough_surface import WaterSurface
from ...uw_spectral.transfer.water_column import WaterColumn
from ...uw_spectral.water.phase import BandPhase
from .. import marks
from ..stored_lamps import stored_lamp
from . import cameras
from .lamp_files import SPECTRUM, files_of
from .lamp_form import colour_of, form_of, power_of, radius_of, unsupported, why_no_light
from .lamp_nodes import LampNodes, nodes_of
from .shown_lamps import ShownLamp, shown_lamps
from .unusable_places import has_place

_RAYS = (12, 8)
_LAYERS, _STEP = 4, 1e-3  # of the water's own objects that a ray passes; m behind each
_FORM = (
    "shadow_soft_size", "spot_size", "spot_blend", "shape", "size", "size_y", "spread", "normalize",
    "use_shadow",
)  # fmt: skip
_DOWN = Vector((0.0, 0.0, -1.0))
_HIDDEN = "it is hidden"
_ABOVE = "it is above the water; lower it, or let it shine in from above with its switch"
_THROUGH = (
    "it is above the water: what of its light enters through the mean surface lights the water; "
    "objects in the air have none of it as they should, and it is not seen from below"
)


@dataclass(frozen=True, eq=False)
class SeenByLamp:
    """What lies in directions, k rays, from a lamp."""

    rays: LampRays
    distances: NDArray[np.float64]  #: m, (k,); infinite where nothing is.
    normals: NDArray[np.float64]  #: Unit vectors towards the lamp, (k, 3).
    colours: NDArray[np.float64]  #: Mean base colours, linear Rec.709, (k, 3).


@dataclass(frozen=True, eq=False)
class SceneLamps:
    """Lamps of a scene that light its water, and what of the scene they come from."""

    shown: tuple[ShownLamp, ...] = ()
    lamps: tuple[Lamp, ...] = ()
    notes: tuple[str, ...] = ()
    seen: tuple[SeenByLamp | None, ...] = ()
    virtual: tuple[Lamp, ...] = ()  #: What stands for the objects that throw their light back.
    from_air: bool = False  #: Some shine into the water from above, or may at another frame.
    waters: tuple[LampWater, ...] = ()  #: Of each lamp, where water differs with depth.
    around: LampWater | None = None  #: The water of all of them then.

    @property
    def all(self) -> tuple[Lamp, ...]:
        """The lamps, and what stands for objects."""
        return self.lamps + self.virtual

    def of_bands(self, indices: Sequence[int]) -> SceneLamps:
        """Return the lamps in some of the bands."""
        chosen = list(indices)
        lamps, virtual = (
            tuple(lamp.of_bands(chosen) for lamp in part) for part in (self.lamps, self.virtual)
        )
        return replace(self, lamps=lamps, virtual=virtual)

    def in_layers(self, column: WaterColumn, phase: BandPhase, depth: float) -> SceneLamps:
        """Return them in the layers of a water, seen by a camera at a depth in m."""
        if not column.below or not self.lamps:
            return self
        around, waters = waters_of_lamps(column, phase, self.lamps, depth)
        return replace(self, waters=waters, around=around)

    def water_around(self, column: WaterColumn, phase: BandPhase, depth: float) -> LampWater | None:
        """Return the water at a depth, m, or of all layers, as their light meets it."""
        if not self.lamps or self.around is not None:
            return self.around
        here = column.layer_at(depth, phase)
        alike = here.phase.components == phase.components
        return lamp_water(here.absorption, here.scattering, here.phase if alike else phase)

    def with_virtual_lights(
        self, water: LampWater, bands: Bands, camera: Sequence[float]
    ) -> SceneLamps:
        """Return them with what stands for the objects they light, seen by a camera in m."""
        basis = uplift_basis(bands).T
        surfaces = [
            x and LitSurfaces(x.rays, x.distances, x.normals, np.clip(x.colours @ basis, 0.0, 1.0))
            for x in self.seen
        ]
        virtual = virtual_point_lights(self.lamps, surfaces, water, camera)
        return replace(self, virtual=virtual)


def objects_of(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Return the lamps that light the water of a scene, by name, each once."""
    return list(dict.fromkeys(lamp.item for lamp in _lighting(scene)))


def left_out(scene: bpy.types.Scene) -> dict[bpy.types.Object, str]:
    """Return the lamps of a scene that do not light its water, and why."""
    return {lamp.item: why_dark(lamp) for lamp in shown_lamps(scene) if why_dark(lamp)}


def why_dark(lamp: ShownLamp) -> str:
    """Say why a lamp does not light the water, empty if it does.

    One that moves counts everywhere: nodes for it are needed in all frames.
    """
    if not stored_lamp(lamp.light).in_water:
        return "it belongs to the air; let it light the water with its switch"
    if getattr(getattr(lamp.light, "cycles", None), "is_portal", False):
        return "it is a portal, which sends no light itself"
    if not (has_place(lamp.place) or lamp.moves):
        return "its place is not finite, or farther away than 1000 km"
    return _ABOVE if _stays_dark_above(lamp) and not lamp.moves else ""


def diagnostics(item: bpy.types.Object) -> tuple[str, ...]:
    """Return what to know of a lamp that lights the water, for the panel."""
    lamp = ShownLamp(item, item.matrix_world)
    try:
        nodes = nodes_of(lamp.light)
        why = why_no_light(lamp, nodes)
        notes = [f"it is dark: {why}"] if why else [_THROUGH] if lamp.is_above else []
        return (*unsupported(lamp, nodes), *notes)
    except InputError as error:
        return (str(error),)


def _why_not_now(lamp: ShownLamp, nodes: LampNodes) -> str:
    """Say why a lamp with its nodes does not light the water at this frame, empty if it does."""
    is_hidden = lamp.instancer is None and marks.is_hidden(lamp.item)
    why = why_dark(lamp) or (_HIDDEN if is_hidden else "") or why_no_light(lamp, nodes)
    return why or (_ABOVE if _stays_dark_above(lamp) else "")


def _stays_dark_above(lamp: ShownLamp) -> bool:
    return lamp.is_above and not stored_lamp(lamp.light).from_above


def _lighting(scene: bpy.types.Scene) -> list[ShownLamp]:
    return [lamp for lamp in shown_lamps(scene) if not why_dark(lamp)]


def lamps_of(
    scene: bpy.types.Scene,
    bands: Bands,
    unit: str,
    n: float = REFRACTIVE_INDEX,
    surface: WaterSurface | None = None,
) -> SceneLamps:
    """Return the lamps of a scene's current frame.

    z = 0 is the water surface, still unless another is given, through which lamps above it shine.
    ``unit`` is that of the irradiance that the scene is lit with, ``n`` the water's refractive
    index, for lamps behind ports. InputError names the lamp if a spectrum, a power or a profile
    cannot be used.
    """
    every, surface = shown_lamps(scene), surface or WaterSurface(n)
    dark = {lamp.name: why_dark(lamp) for lamp in every if why_dark(lamp)}
    notes = [f"lamp {name!r} is left out: {why}" for name, why in dark.items()]
    shown, lamps = [one for one in every if not why_dark(one)], []
    for one in shown:
        try:
            nodes = nodes_of(one.light)
            why = _why_not_now(one, nodes)
            lamp = through_surface(_lamp(one, nodes, bands, unit, n, dark=bool(why)), surface)
            notes += [f"lamp {one.name!r}: {said}" for said in unsupported(one, nodes)]
        except InputError as error:
            raise InputError(f"lamp {one.name!r}: {error}") from error
        if why and why != _HIDDEN:
            notes.append(f"lamp {one.name!r} is dark: {why}")
        if not why and lamp.shines_in:
            notes.append(f"lamp {one.name!r}: {_THROUGH}")
        lamps.append(lamp)
    # One that moves may rise: its nodes are there in all frames.
    shining_in = [one for one in shown if stored_lamp(one.light).from_above]
    from_air = any(one.is_above or one.moves for one in shining_in)
    said = tuple(dict.fromkeys(notes))  # instances have what to say in common
    return SceneLamps(tuple(shown), tuple(lamps), said, from_air=from_air)


def plan_lamps(scene: bpy.types.Scene, plan: RenderPlan) -> SceneLamps:
    """Return the lamps of a scene's current frame in the bands of a plan."""
    column = plan.column
    surface = column.mean_surface or WaterSurface(1.0)
    return lamps_of(scene, plan.bands, plan.illuminant.unit, column.refractive_index, surface)


def lamplight(
    scene: bpy.types.Scene,
    camera: bpy.types.Object | None,
    plan: RenderPlan,
    seen: Sequence[tuple[float, ...]] | None = None,
) -> NDArray[np.float64] | None:
    """Return the irradiance of lamps that a camera exposes by; None without lamps or camera.

    What it sees is looked for unless it is given, see :func:`seen_places`.
    """
    lamps = plan_lamps(scene, plan).lamps
    if not lamps or camera is None:
        return None
    place = tuple(camera.matrix_world.translation)
    water = plan.lamp_water(max(-place[2], 0.0))
    seen = seen_places(scene, camera) if seen is None else seen
    return irradiance_seen(lamps, water, place, seen)


def records(scene: bpy.types.Scene) -> tuple[dict[str, Any], ...]:
    """Return the lamps of a scene's current frame as JSON holds them, dark ones with the reason."""
    found = []
    for lamp in shown_lamps(scene):
        nodes = _nodes(lamp)
        why = _why_not_now(lamp, nodes)
        found.append({**_record(lamp, nodes), **({"left_out": why} if why else {})})
    return tuple(found)


def record(lamp: ShownLamp) -> dict[str, Any]:
    """Return what a lamp is, where it is and where it shines to; lengths are m."""
    return _record(lamp, _nodes(lamp))


def _nodes(lamp: ShownLamp) -> LampNodes:
    # The files of lamps that are left out may be missing.
    return LampNodes() if why_dark(lamp) else nodes_of(lamp.light)


def _record(lamp: ShownLamp, nodes: LampNodes) -> dict[str, Any]:
    light, chosen, place = lamp.light, stored_lamp(lamp.light), lamp.place
    found: dict[str, Any] = {
        "name": lamp.name,
        "kind": light.type.lower(),
        "spectrum": chosen.spectrum or "colour",
        "power": power_of(lamp),
        "unit": chosen.unit if chosen.spectrum else WATTS,
        "profile": chosen.profile or "Blender",
        "position": list(place.translation),
        "axis": list(_axis(place)),
        "radius": radius_of(lamp),
    }
    if not chosen.spectrum:
        found["colour"] = (colour_of(light) * nodes.factor).tolist()
    if light.type == "SPOT" and not chosen.profile:
        found["cone_deg"], found["blend"] = math.degrees(light.spot_size), light.spot_blend
    if light.type == "AREA" and not chosen.profile:
        found["spread_deg"] = math.degrees(light.spread)
    if nodes.photometry is not None and not chosen.profile:
        found["profile"] = "IES texture"
    if chosen.behind_port:
        found["behind_port"] = True
    if not light.use_shadow:
        found["shadow"] = False
    if lamp.is_above and chosen.from_above:
        found["through_surface"] = True
    return found


def seen_places(scene: bpy.types.Scene, camera: bpy.types.Object) -> list[tuple[float, ...]]:
    """Return places on the objects that a camera sees, by a few rays."""
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
    for lamp in _lighting(scene):
        light, item = lamp.light, lamp.item
        numbers = (
            light.energy, light.exposure, *light.color, light.use_temperature, light.temperature,
            marks.is_seen(item), marks.is_hidden(item),
            *(x for row in lamp.place for x in row),
        )  # fmt: skip
        form = [getattr(light, name, 0.0) for name in _FORM]
        nodes = nodes_of(light)
        form += [*nodes.factor.tolist(), nodes.photometry and nodes.photometry.candela.tobytes()]
        found.append((item.name_full, lamp.name, light.type, stored_lamp(light), *numbers, *form))
    return tuple(found)


def _lamp(
    shown: ShownLamp, nodes: LampNodes, bands: Bands, unit: str, n: float, *, dark: bool
) -> Lamp:
    light, chosen, form = shown.light, stored_lamp(shown.light), form_of(shown, nodes, n)
    if dark:
        intensity = np.zeros(len(bands))
    elif chosen.spectrum:
        table = files_of(light).get(SPECTRUM)
        shape = parse_emission(f"file:{table.whole}" if table else chosen.spectrum)
        intensity = radiant_intensity(shape, form.power, bands, chosen.unit, form.fraction)
        if unit == RELATIVE:
            intensity = intensity / full_sun()
    else:
        intensity = intensity_of_colour(colour_of(light) * form.gain, form.power, bands)
    place, seen = shown.place, float(marks.is_seen(shown.item))
    return Lamp(
        tuple(place.translation), _axis(place), intensity, form.profile, form.radius, seen,
        unblocked=float(not light.use_shadow),
    )  # fmt: skip


def _axis(place: Matrix) -> tuple[float, ...]:
    return tuple((place.to_3x3() @ _DOWN).normalized())
