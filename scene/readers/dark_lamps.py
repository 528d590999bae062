"""Which lamps of a scene light its water, and why others do not."""

from __future__ import annotations

import bpy

from ...uw_spectral.errors import InputError
from .. import marks
from ..stored_lamps import stored_lamp
from .lamp_form import unsupported, why_no_light
from .lamp_nodes import LampNodes, nodes_of
from .shown_lamps import ShownLamp, shown_lamps
from .unusable_places import has_place

HIDDEN = "it is hidden"
_ABOVE = "it is above the water; lower it, or let it shine in from above with its switch"
THROUGH = (
    "it is above the water: what of its light enters through the mean surface lights the water; "
    "objects in the air have none of it as they should, and it is not seen from below"
)


def objects_of(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Return the lamps that light the water of a scene, by name, each once."""
    return list(dict.fromkeys(lamp.item for lamp in lamps_in_water(scene)))


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
        notes = [f"it is dark: {why}"] if why else [THROUGH] if lamp.is_above else []
        return (*unsupported(lamp, nodes), *notes)
    except InputError as error:
        return (str(error),)


def why_not_now(lamp: ShownLamp, nodes: LampNodes) -> str:
    """Say why a lamp with its nodes does not light the water at this frame, empty if it does."""
    is_hidden = lamp.instancer is None and marks.is_hidden(lamp.item)
    why = why_dark(lamp) or (HIDDEN if is_hidden else "") or why_no_light(lamp, nodes)
    return why or (_ABOVE if _stays_dark_above(lamp) else "")


def _stays_dark_above(lamp: ShownLamp) -> bool:
    return lamp.is_above and not stored_lamp(lamp.light).from_above


def lamps_in_water(scene: bpy.types.Scene) -> list[ShownLamp]:
    """Return those that light the water, instances too."""
    return [lamp for lamp in shown_lamps(scene) if not why_dark(lamp)]
