"""What a file stores about the panel and its renders, besides the optics of the scene."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from typing import Any

import bpy

from ..quality.methods import METHODS
from ..scene import scripts, stored_settings
from ..settings.scene_settings import BY_PICTURE, SETTINGS, SceneSettings
from ..settings.water_settings import AUTO, CONSTITUENTS
from ..uw_spectral.errors import InputError
from ..uw_spectral.imaging.layers import LAYERS, NONE, parse_layers
from ..uw_spectral.water.inelastic_processes import parse_processes
from ..uw_spectral.water.optical_properties import JERLOV_TYPES
from . import previews
from .panel_job import PROPERTY, job, method

_JERLOV = "jerlov:"


def _water(group: bpy.types.PropertyGroup) -> bpy.types.PropertyGroup:
    return getattr(group.id_data, stored_settings.PROPERTY)


def _over(
    setting: str, shown: Callable[[Any], Any], stored: Callable[[Any], Any]
) -> dict[str, Any]:
    """Return what lets a property show a setting of the water otherwise than it is stored."""
    return {
        "get": lambda group: shown(getattr(_water(group), setting)),
        "set": lambda group, value: setattr(_water(group), setting, stored(value)),
        "options": set(),
    }


def _gallery(water: str) -> int:
    name = water.removeprefix(_JERLOV)
    is_shown = water.startswith(_JERLOV) and name in JERLOV_TYPES
    return JERLOV_TYPES.index(name) if is_shown else 0


def _get_constituents(group: bpy.types.PropertyGroup) -> bool:
    return _water(group).water == CONSTITUENTS


def _set_constituents(group: bpy.types.PropertyGroup, value: bool) -> None:
    if value != _get_constituents(group):
        _water(group).water = CONSTITUENTS if value else SceneSettings().water


_PROCESSES = {
    "raman": ("Raman", "Scattering by the water molecules"),
    "chlorophyll": ("Chlorophyll", "Red fluorescence of the phytoplankton, 685 nm"),
    "cdom": ("CDOM", "Blue to green fluorescence of dissolved organic matter"),
}
_LAYERS = {layer.name: (layer.name, layer.text.capitalize()) for layer in LAYERS}


def _ticked(
    setting: str,
    items: dict[str, tuple[str, str]],
    read: Callable[[str], tuple[str, ...]],
    nothing: str = "",
) -> object:
    """Return tick boxes over a setting that is a list of words."""
    words = list(items)

    def get(group: bpy.types.PropertyGroup) -> int:
        try:
            ticked = read(getattr(_water(group), setting))
        except InputError:  # the panel says so, and shows what was written
            return 0
        return sum(1 << words.index(word) for word in ticked)

    def put(group: bpy.types.PropertyGroup, value: int) -> None:
        ticked = [word for place, word in enumerate(words) if value & 1 << place]
        setattr(_water(group), setting, ",".join(ticked) or nothing)

    return bpy.props.EnumProperty(
        name=SETTINGS[setting].label,
        description=SETTINGS[setting].text,
        items=[(word.upper(), *items[word], 1 << place) for place, word in enumerate(words)],
        options={"ENUM_FLAG"},
        get=get,
        set=put,
    )


def _azimuth(bearing: float) -> float:
    azimuth = (270.0 - math.degrees(bearing)) % 360.0
    return azimuth - 360.0 if azimuth > 180.0 else azimuth


def _get_visibility(group: bpy.types.PropertyGroup) -> float:
    found = previews.of_scene(group.id_data).readouts
    return found.visibility if found is not None and math.isfinite(found.visibility) else 0.0


def _set_visibility(group: bpy.types.PropertyGroup, value: float) -> None:
    with contextlib.suppress(InputError):  # the panel says so
        _water(group).concentration = previews.concentration_for(group.id_data, value)


def _stops(exposure: str) -> float:
    try:
        return float(exposure)
    except ValueError:
        return 0.0


_METERS, _LOWEST = (AUTO, BY_PICTURE), SETTINGS["sun_zenith"].limits[1]
_GALLERY = _over("water", _gallery, lambda place: f"{_JERLOV}{JERLOV_TYPES[place]}")
_ELEVATION = _over(
    "sun_zenith",
    lambda zenith: math.radians(90.0 - zenith),
    lambda value: min(90.0 - math.degrees(value), _LOWEST),
)
_BEARING = _over("sun_azimuth", lambda azimuth: math.radians((270.0 - azimuth) % 360.0), _azimuth)
_METER = _over(
    "exposure", lambda text: (*_METERS, text).index(text), lambda value: (*_METERS, "0")[value]
)
_STOPS = _over("exposure", _stops, "{:g}".format)


def _get_pass_count(group: bpy.types.PropertyGroup) -> int:
    from ..scene.engines import engines, world_picture
    from ..settings import render_plan

    wanted = job(group.id_data)
    try:
        chosen = stored_settings.stored_settings(group.id_data)
        plan = render_plan.plan_of(world_picture.shown(group.id_data, chosen))
    except InputError:  # the panel says so
        return 1
    return len(engines.engine_of(wanted.engine, wanted.mode).passes(plan))


def _get_job_options(group: bpy.types.PropertyGroup) -> str:
    wanted = job(group.id_data)
    options = f"--engine {wanted.engine} --mode {wanted.mode}"
    if scripts.scripts_run():
        options += f" {scripts.TRUST}"
    if not method(group.id_data).traced:
        return options
    return f"{options} {'--denoise' if wanted.denoise else '--no-denoise'}"


class UnderwaterPanelProperties(bpy.types.PropertyGroup):
    """How a scene is rendered, and views of its optics that suit a panel."""

    # fmt: off
    version: bpy.props.IntProperty(
        name="Version",
        description="Version of the settings in this file; 0 if no water was ever added",
        options={"HIDDEN"},
    )
    gallery: bpy.props.EnumProperty(
        name="Jerlov type",
        description="Each water as it looks from the camera: a level view into the open sea",
        items=previews.swatch_items, **_GALLERY,
    )
    from_constituents: bpy.props.BoolProperty(
        name="From constituents",
        description="Compute the water from what is in it, instead of taking a Jerlov type",
        options=set(), get=_get_constituents, set=_set_constituents,
    )
    inelastic: _ticked("inelastic", _PROCESSES, parse_processes)
    layers: _ticked("layers", _LAYERS, parse_layers, NONE)
    visibility: bpy.props.FloatProperty(
        name="Visibility",
        description="Distance at which a black object fades into the open water, looking level "
        "from the camera (contrast 2 %). Setting it sets the concentration of what is in the water",
        min=0.05, soft_min=1.0, soft_max=50.0, max=200.0, precision=1, subtype="DISTANCE",
        unit="LENGTH", options=set(), get=_get_visibility, set=_set_visibility,
    )
    elevation: bpy.props.FloatProperty(
        name="Sun Elevation", description="Height of the sun over the horizon, in air",
        min=math.radians(90.0 - _LOWEST), max=math.radians(90.0), precision=1, subtype="ANGLE",
        unit="ROTATION", **_ELEVATION,
    )
    bearing: bpy.props.FloatProperty(
        name="Sun From",
        description="Where the sun stands: its compass bearing, from north (+y) over east (+x)",
        min=0.0, max=math.radians(360.0), precision=1, subtype="ANGLE", unit="ROTATION",
        **_BEARING,
    )
    meter: bpy.props.EnumProperty(
        name="Exposure", description="What the exposure follows",
        items=[
            ("LIGHT", "By the light", "A white surface in the light at the camera is nearly white"),
            (
                "PICTURE",
                "By the picture",
                "What the camera sees is as bright as middle grey, on "
                "average, and hardly any of it brighter than white",
            ),
            ("FIXED", "By hand", "As many stops as you give"),
        ],
        **_METER,
    )
    stops: bpy.props.FloatProperty(
        name="Exposure",
        description="Stops; at 0 a white surface in the light that is balanced for is white",
        soft_min=-10.0, soft_max=10.0, **_STOPS,
    )
    quality: bpy.props.EnumProperty(
        name="Quality", description="How the water is rendered",
        items=[(name.upper(), m.label, m.text) for name, m in METHODS.items()], options=set(),
    )
    target_delta_e: bpy.props.FloatProperty(
        name="Colour error",
        description="Mean ΔE2000, against everything in many bands, that Auto aims at, objects, "
        "floor and open water counting equally; 1 is just visible",
        default=1.0, min=0.05, soft_max=5.0, options=set(),
    )
    decisions: bpy.props.StringProperty(
        name="Decisions", description="What Auto has chosen and why, a line each",
        options={"HIDDEN"},
    )
    chosen: bpy.props.StringProperty(
        name="Chosen", description="What Auto has changed: by setting, its value before and after",
        options={"HIDDEN"},
    )
    denoise: bpy.props.BoolProperty(
        name="Denoise",
        description="Denoise the reference's picture; spectra and layers stay as rendered",
        default=True, options=set(),
    )
    output: bpy.props.StringProperty(
        name="Folder",
        description="Pictures, spectral images and records go here; // is the file's folder",
        default="//underwater", subtype="DIR_PATH", options={"PATH_SUPPORTS_BLEND_RELATIVE"},
    )
    animation: bpy.props.BoolProperty(
        name="Whole animation",
        description="Render every frame of the scene instead of the current one", options=set(),
    )
    pass_count: bpy.props.IntProperty(
        name="Passes", description="Render passes of a frame, for render farms", options={"HIDDEN"},
        get=_get_pass_count,
    )
    job_options: bpy.props.StringProperty(
        name="Options",
        description="What the panel says besides the settings of the water, for render farms",
        options={"HIDDEN"}, get=_get_job_options,
    )
    # fmt: on


def register() -> None:
    """Add ``scene.underwater_panel``."""
    bpy.utils.register_class(UnderwaterPanelProperties)
    pointer = bpy.props.PointerProperty(type=UnderwaterPanelProperties)
    setattr(bpy.types.Scene, PROPERTY, pointer)


def unregister() -> None:
    """Take ``scene.underwater_panel`` away; the values stay in the file."""
    delattr(bpy.types.Scene, PROPERTY)
    bpy.utils.unregister_class(UnderwaterPanelProperties)
