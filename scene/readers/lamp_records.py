"""Lamps of a scene as records of pictures hold them."""

from __future__ import annotations

import math
from typing import Any

import bpy

from ...uw_spectral.lamps.emission import WATTS
from ..stored_lamps import stored_lamp
from .dark_lamps import why_dark, why_not_now
from .lamp_form import axis_of, colour_of, power_of, radius_of
from .lamp_nodes import LampNodes, nodes_of
from .shown_lamps import ShownLamp, shown_lamps


def records(scene: bpy.types.Scene) -> tuple[dict[str, Any], ...]:
    """Return the lamps of a scene's current frame as JSON holds them, dark ones with the reason."""
    found = []
    for lamp in shown_lamps(scene):
        nodes = _nodes(lamp)
        why = why_not_now(lamp, nodes)
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
        "axis": list(axis_of(place)),
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
