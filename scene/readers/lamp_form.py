"""What Blender's properties and the settings of a lamp make of its light, spectrum apart."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Matrix, Vector
from numpy.typing import NDArray

from ...uw_spectral.errors import InputError
from ...uw_spectral.lamps.emission import CANDELAS, SPHERE, WATTS
from ...uw_spectral.lamps.ies import read_ies
from ...uw_spectral.lamps.port import BehindFlatPort
from ...uw_spectral.lamps.profile import (
    LAMBERT,
    IsotropicProfile,
    LampProfile,
    SpotProfile,
    SpreadProfile,
    TableProfile,
    profile_from_csv,
    rov_lamp,
)
from .. import marks
from ..stored_lamps import ROV, LampSettings, stored_lamp
from .lamp_files import PROFILE, LampFile, files_of
from .lamp_nodes import LampNodes
from .shown_lamps import ShownLamp
from .unusable_places import has_place

_POINTS = 24
"""Of a measured profile."""
_ALIKE = 0.01  # relative, of scales
_ROUND = 0.1  # of an IES file, by which it may differ from its mean, over the highest
_NARROWEST_SPREAD, _WIDEST_SPREAD = math.radians(1.0), math.radians(179.9)
_NEAR = 1.0
"""m; a beam of an area lamp that is parallel for longer is said."""
_MOST_BOUNCES = 1024  # Blender's own
_RAYS = ("visible_diffuse", "visible_glossy", "visible_transmission", "visible_volume_scatter")


@dataclass(frozen=True, eq=False)
class LampForm:
    """Shape, size and strength of a lamp."""

    profile: LampProfile
    radius: float  #: m.
    power: float  #: In the unit of its settings; negative in the wrong.
    #: On the intensity that a point light of the power and the colour has, (3,).
    gain: NDArray[np.float64]
    #: What the power in its unit is spread over, sr; of candela, the profile on the axis.
    fraction: float


def form_of(lamp: ShownLamp, nodes: LampNodes, n: float) -> LampForm:
    """Return the form of a lamp with its nodes in water of a refractive index.

    InputError if a file cannot be used, or there is no intensity on the axis, and it is asked for.
    """
    light, chosen = lamp.light, stored_lamp(lamp.light)
    measured = _measured(chosen, files_of(light).get(PROFILE))
    gain, blenders = nodes.factor, measured is None
    profile = _of_blender(lamp) if measured is None else measured
    if measured is None and nodes.photometry is not None and light.type != "AREA":
        profile, highest = _times(profile, nodes.photometry.profile())
        gain, blenders = gain * highest, False
    elif nodes.photometry is not None:
        gain = np.ones(3)
    if light.type == "AREA" and measured is None:
        # Blender's area light shines four times as strong along its axis as a point.
        gain = gain * (SPHERE / profile.solid_angle)
    # Of Blender's spot the cone cuts away what a point light would send beside it.
    whole = chosen.unit == WATTS and blenders and light.type != "AREA"
    fraction = SPHERE if whole else float(profile.solid_angle)
    if chosen.unit == CANDELAS:
        fraction = float(profile.value(1.0))
        if chosen.spectrum and not fraction > 0:
            raise InputError("there is no light on its axis; give the power in lm or W")
    if chosen.behind_port and _has_cone(light, chosen, nodes):
        profile = BehindFlatPort(profile, n)
    return LampForm(profile, radius_of(lamp), power_of(lamp), gain, fraction)


def power_of(lamp: ShownLamp) -> float:
    """Power of a whole lamp in the unit of its settings."""
    return lamp.light.energy * 2.0**lamp.light.exposure * _area_of_power(lamp)


def colour_of(light: bpy.types.Light) -> NDArray[np.float64]:
    """Colour of a lamp, its temperature counted; linear Rec.709."""
    colour = np.array(light.color, dtype=np.float64)
    return colour * np.array(light.temperature_color) if light.use_temperature else colour


def radius_of(lamp: ShownLamp) -> float:
    """Radius of the disc, or of the sphere, that is as large as a lamp, m."""
    light = lamp.light
    if light.type != "AREA":
        return float(light.shadow_soft_size)
    across, along = (abs(x) for x in lamp.place.to_scale()[:2])
    width, height = light.size * across, light.size * along
    if light.shape in ("RECTANGLE", "ELLIPSE"):
        height = light.size_y * along
    area = width * height
    if light.shape in ("DISK", "ELLIPSE"):
        area *= math.pi / 4.0
    return math.sqrt(area / math.pi)


def why_no_light(lamp: ShownLamp, nodes: LampNodes) -> str:
    """Say why a lamp sends no light at this frame, empty if it does.

    InputError if it has no usable place.
    """
    light = lamp.light
    if not has_place(lamp.place):
        raise InputError("its place at this frame is not finite, or farther away than 1000 km")
    if not np.isfinite([light.energy, *light.color]).all():
        return "its power or colour is not finite"
    if light.energy < 0:
        return "its power is negative, which no light is"
    if not stored_lamp(light).spectrum and np.any(nodes.factor * colour_of(light) < 0):
        return "its colour is negative, which no light is"
    return "" if np.any(nodes.factor) else "its nodes send no light"


def unsupported(lamp: ShownLamp, nodes: LampNodes) -> Iterator[str]:
    """Yield what a lamp asks for that changes nothing, or is not as Blender has it."""
    light, chosen = lamp.light, stored_lamp(lamp.light)
    if nodes.unsupported:
        yield f"its nodes {', '.join(map(repr, nodes.unsupported))} are not supported"
    if nodes.photometry is not None and (chosen.profile or light.type == "AREA"):
        yield "its IES texture is not supported beside its profile; name the file as its profile"
    file = files_of(light).get(PROFILE)
    sheet = nodes.photometry
    if file is not None:
        sheet = read_ies(file.whole) if _is_ies(file) else None
    if sheet is not None and sheet.asymmetry > _ROUND:
        yield "its IES file is not the same all round: the mean over the azimuth is taken"
    if chosen.spectrum and not nodes.plain:
        yield "its nodes' colour and strength are not supported beside its spectrum"
    if chosen.behind_port and not _has_cone(light, chosen, nodes):
        yield "it has no cone and no profile that were measured in air"
    if light.type == "SPOT" and not chosen.profile:
        across, along, _ = (abs(x) for x in lamp.place.to_scale())
        if abs(across - along) > _ALIKE * max(across, along):
            yield "its cone is elliptical by its scale, and taken as round, as wide in the mean"
        if light.use_square:
            yield "its square cone is taken as round"
    if light.type == "AREA" and not chosen.profile and light.spread < _WIDEST_SPREAD:
        parallel = radius_of(lamp) / math.tan(_spread(light) / 2.0)
        if parallel > _NEAR:
            yield (
                f"its narrow beam is that of a point in EEVEE, too bright within {parallel:.2g} m; "
                "widen its spread or make it smaller"
            )
    factors = light.get(marks.DIMMED) or [getattr(light, name) for name in marks.FACTORS]
    if any(x != 1.0 for x in factors):
        yield "its factors (diffuse, specular, transmission, volume) are not supported"
    if light.use_custom_distance:
        yield "its custom distance is not supported: light ends with the water"
    item, kept = lamp.item, lamp.item.get(marks.UNSEEN)
    rays = list(kept)[1:] if kept else [getattr(item, name) for name in _RAYS]
    if not all(rays) or getattr(getattr(light, "cycles", None), "max_bounces", 0) < _MOST_BOUNCES:
        yield "its ray visibility but to the camera, and its bounces, are not supported"


def _has_cone(light: bpy.types.Light, chosen: LampSettings, nodes: LampNodes) -> bool:
    return light.type == "SPOT" or bool(chosen.profile) or nodes.photometry is not None


def _measured(chosen: LampSettings, file: LampFile | None) -> LampProfile | None:
    if chosen.profile == ROV:
        return rov_lamp()
    if file is None:
        return None
    if _is_ies(file):
        return read_ies(file.whole).profile(_POINTS)
    return profile_from_csv(str(file.whole), _POINTS)


def _is_ies(file: LampFile) -> bool:
    return file.whole.suffix.lower() == ".ies"


def _of_blender(lamp: ShownLamp) -> LampProfile:
    light = lamp.light
    if light.type == "SPOT":
        across, along, length = (abs(x) for x in lamp.place.to_scale())
        wider = math.sqrt(across * along) / length if across * along * length else 1.0
        size = min(light.spot_size, math.pi)
        if abs(wider - 1.0) > _ALIKE:
            size = 2.0 * math.atan(wider * math.tan(size / 2.0))
        return SpotProfile(size, light.spot_blend)
    if light.type == "AREA":
        return SpreadProfile(_spread(light)) if light.spread < _WIDEST_SPREAD else LAMBERT
    return IsotropicProfile()


def _spread(light: bpy.types.AreaLight) -> float:
    return max(light.spread, _NARROWEST_SPREAD)


def _times(blenders: LampProfile, table: TableProfile) -> tuple[TableProfile, float]:
    """Profile of an IES texture on a lamp of Blender's, 1 at its highest, which is returned too."""
    if blenders.edge is None:
        return table, 1.0
    edge = math.degrees(math.acos(blenders.edge))
    angles = np.linspace(0.0, edge, 20 * _POINTS)
    values = blenders.value(np.cos(np.radians(angles))) * table.value(np.cos(np.radians(angles)))
    return TableProfile.of_angles(angles, values, 2 * _POINTS), float(values.max())


def _area_of_power(lamp: ShownLamp) -> float:
    """What the power is of: 1 for the whole lamp, else Blender's area in m²."""
    light = lamp.light
    if light.normalize:
        return 1.0
    if light.type == "AREA":
        return math.pi * radius_of(lamp) ** 2
    return 4.0 * (math.pi * light.shadow_soft_size**2 if light.shadow_soft_size else 1.0)


def axis_of(place: Matrix) -> tuple[float, ...]:
    """Unit direction that a lamp at a place shines to."""
    return tuple((place.to_3x3() @ Vector((0.0, 0.0, -1.0))).normalized())
