"""A lamp in the water for Cycles: radiant intensity per band, by its profile."""

from __future__ import annotations

import math

import bpy

from ..uw_spectral.lamps.lamp import Lamp
from ..uw_spectral.lamps.profile import LAMBERT, LampProfile, SpreadProfile
from . import attributes
from .data_blocks import new_emission
from .node_mathematics import NODES

NAME = "UW Lamp"
_FORM = "uw_form"


def build(index: int, lamp: Lamp, like: bpy.types.Light) -> bpy.types.Light:
    """Build a lamp that shines along its own -z; ``index`` is of its intensity in a pass's values.

    If it is like an area lamp it keeps the shape, unless its profile is a measured one.
    """
    flat = like.type == "AREA" and (
        lamp.profile == LAMBERT or isinstance(lamp.profile, SpreadProfile)
    )
    if flat:
        light = _area(like, lamp.profile)
    else:
        light = bpy.data.lights.new(NAME, "POINT")
        light.shadow_soft_size, light.energy = float(lamp.radius), 4.0 * math.pi
    light[_FORM] = _form(lamp, like)
    graph, emission = new_emission(light, attributes.lamp(index))
    if not flat:
        # The normal of a point lamp's texture is the direction it shines in, in its own axes.
        here = graph.node("ShaderNodeTexCoord").outputs["Normal"]
        _, _, up = graph.components(graph.term(here))
        graph.assign(lamp.profile.value(-up, NODES), emission.inputs["Strength"])
    return light


def fits(light: bpy.types.Light, lamp: Lamp, like: bpy.types.Light) -> bool:
    """Whether a lamp that was built has the profile and the size that it would have now."""
    return light.get(_FORM) == _form(lamp, like)


def _form(lamp: Lamp, like: bpy.types.Light) -> str:
    shape = [getattr(like, name, "") for name in ("type", "shape", "size", "size_y")]
    return repr((lamp.profile, float(lamp.radius), shape))


def _area(like: bpy.types.AreaLight, profile: LampProfile) -> bpy.types.AreaLight:
    light = bpy.data.lights.new(NAME, "AREA")
    # Cycles divides by this, so that the intensity on the axis is that of the emission.
    light.energy = float(profile.solid_angle)
    light.spread = profile.spread if isinstance(profile, SpreadProfile) else math.pi
    light.shape, light.size, light.size_y = like.shape, like.size, like.size_y
    return light
