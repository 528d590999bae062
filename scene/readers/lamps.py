"""The lamps of a scene as lights in the water, spectrally."""

from __future__ import annotations

import bpy

from ...settings.render_plan import RenderPlan
from ...uw_spectral.errors import InputError
from ...uw_spectral.lamps.inelastic_source import LampExcitation
from ...uw_spectral.lamps.over_water import through_surface
from ...uw_spectral.spectra.bands import Bands
from ...uw_spectral.surface.refraction import REFRACTIVE_INDEX
from ...uw_spectral.transfer.rough_surface import WaterSurface
from .. import marks
from ..stored_lamps import stored_lamp
from .dark_lamps import HIDDEN, THROUGH, lamps_in_water, why_dark, why_not_now
from .lamp_form import unsupported
from .lamp_nodes import nodes_of
from .lit_lamps import lit_lamp
from .scene_lamps import SceneLamps
from .shown_lamps import shown_lamps

_FORM = (
    "shadow_soft_size", "spot_size", "spot_blend", "shape", "size", "size_y", "spread", "normalize",
    "use_shadow",
)  # fmt: skip


def lamps_of(
    scene: bpy.types.Scene,
    bands: Bands,
    unit: str,
    n: float = REFRACTIVE_INDEX,
    surface: WaterSurface | None = None,
    *,
    dark_beyond: bool = False,
) -> SceneLamps:
    """Return the lamps of a scene's current frame.

    z = 0 is the water surface, still unless another is given, through which lamps above it shine.
    ``unit`` is that of the irradiance that the scene is lit with, ``n`` the water's refractive
    index, for lamps behind ports. ``dark_beyond`` is whether spectra are dark beyond their tables.
    InputError names the lamp if a spectrum, a power or a profile cannot be used.
    """
    every, surface = shown_lamps(scene), surface or WaterSurface(n)
    dark = {lamp.name: why_dark(lamp) for lamp in every if why_dark(lamp)}
    notes = [f"lamp {name!r} is left out: {why}" for name, why in dark.items()]
    shown, lamps = [one for one in every if not why_dark(one)], []
    for one in shown:
        try:
            nodes = nodes_of(one.light)
            why = why_not_now(one, nodes)
            lit = lit_lamp(one, nodes, bands, unit, n, dark=bool(why), dark_beyond=dark_beyond)
            lamp = through_surface(lit, surface)
            notes += [f"lamp {one.name!r}: {said}" for said in unsupported(one, nodes)]
        except InputError as error:
            raise InputError(f"lamp {one.name!r}: {error}") from error
        if why and why != HIDDEN:
            notes.append(f"lamp {one.name!r} is dark: {why}")
        if not why and lamp.shines_in:
            notes.append(f"lamp {one.name!r}: {THROUGH}")
        lamps.append(lamp)
    # One that moves may rise: its nodes are there in all frames.
    shining_in = [one for one in shown if stored_lamp(one.light).from_above]
    from_air = any(one.is_above or one.moves for one in shining_in)
    said = tuple(dict.fromkeys(notes))  # instances have what to say in common
    return SceneLamps(tuple(shown), tuple(lamps), said, from_air=from_air)


def plan_lamps(
    scene: bpy.types.Scene, plan: RenderPlan, exciting: Bands | None = None
) -> SceneLamps:
    """Return the lamps of a scene's current frame in the bands of a plan, or in those that excite.

    In the latter, spectra are dark beyond their tables.
    """
    column = plan.column
    surface = column.mean_surface or WaterSurface(1.0)
    return lamps_of(
        scene, exciting or plan.bands, plan.illuminant.unit, column.refractive_index, surface,
        dark_beyond=exciting is not None,
    )  # fmt: skip


def lamp_excitations(scene: bpy.types.Scene, plan: RenderPlan) -> tuple[LampExcitation, ...]:
    """Return what each lamp of a scene's current frame excites in the water."""
    water = plan.lamp_excitation()
    if water is None or plan.excitation is None:
        return ()
    lamps = plan_lamps(scene, plan, plan.excitation.column.bands).lamps
    return tuple(water.by(lamp.intensity) for lamp in lamps)


def state(scene: bpy.types.Scene) -> tuple[object, ...]:
    """Return all that the light of a scene's lamps depends on, to be compared."""
    found = []
    for lamp in lamps_in_water(scene):
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
