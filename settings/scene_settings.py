"""The settings of a render: one table for the command line and for the .blend."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from typing import Any

from ..quality.methods import DRAWN, Mode
from ..uw_spectral.errors import InputError
from ..uw_spectral.housing import description as housing
from ..uw_spectral.housing.media import GLASSES
from ..uw_spectral.imaging.layers import NAMES, NONE, parse_layers
from ..uw_spectral.spectra.barrier_filter import CONTENT as FILTER_CONTENT
from ..uw_spectral.spectra.barrier_filter import NO_FILTER
from ..uw_spectral.spectra.colour_rendering import WhiteBalance
from ..uw_spectral.spectra.tone import AGX, CAMERA_CURVES, CONTRASTS, MEDIUM, STANDARD
from ..uw_spectral.transfer.sky import UNIFORM
from ..uw_spectral.transfer.water_column import WAVES
from ..uw_spectral.water import measured
from ..uw_spectral.water.particles import SLOPES, TYPICAL_SLOPE
from .setting import Setting

AUTO = "auto"
BY_PICTURE = "auto-picture"
"""Exposure by the brightness of what the camera sees."""
BANDS, REALTIME = "bands", "realtime"
DEFAULT_BANDS: dict[Mode, int] = {m.mode: m.default_bands for m in DRAWN}
"""Bands of each mode where the settings leave their number open."""
EQUAL, OPTIMISED = "equal", "optimised"
BOUNDED, EXACT = "bounded", "exact"
DEFAULT_PHASE = "mixture"
CONSTITUENTS = "constituents"
NO_FLOOR = 0.0
RANGE = ("range_start", "range_end")
"""Settings of one option."""
_ROW = "row"
# Options with a shorter name than their setting.
_SHORT = {"wind_speed": "--wind"}


def _setting[Default: str | float | bool](
    default: Default,
    label: str,
    text: str,
    section: str,
    **facts: Any,  # noqa: ANN401
) -> Default:
    return field(default=default, metadata={_ROW: Setting(label, text, section, **facts)})


_OF_CONSTITUENTS = {"water": (CONSTITUENTS,)}
_OF_WAVES = {"surface": (WAVES,)}
_OF_RAISED = {"surface": (WAVES,), "raised_waves": ()}
_OF_FLOOR = {"floor_depth": (NO_FLOOR,)}
_OF_FLAT, _OF_DOME = {"housing": (housing.FLAT,)}, {"housing": (housing.DOME,)}
_OF_PORT = {"housing": (housing.FLAT, housing.DOME)}
NO_RAW = "none"
_OF_RAW = {"raw": ("dng", "tiff")}
_OF_SECOND_WATER = "second_water", "second_water_fraction"
_JERLOV = "jerlov:"


@dataclass(frozen=True)
class SceneSettings:
    """What a .blend stores and the options of ``render_bands.py`` override.

    Settings that are animatable may differ from frame to frame.

    Raises
    ------
    InputError
        If a word is not one of the choices, or a number outside its limits.
    """

    water: str = _setting(
        "jerlov:IB",
        "Water",
        "Water: jerlov:TYPE or case:NAME (see --list-waters); bio:chl=1,cdom=0.1, made of "
        "constituents; chl:3, open sea with this chlorophyll in mg/m³ and the Kd measured at it; "
        f"file:PATH, {measured.CONTENT}; constituents takes chlorophyll, cdom, "
        "minerals and detritus",
        "water",
        known="waters",
    )
    water_source: str = _setting(
        "solonenko2015",
        "Source",
        "Publication that the coefficients of a Jerlov type come from",
        "water",
        choices={
            "solonenko2015": ("Solonenko 2015", "All ten types, from Jerlov's measurements of Kd"),
            "williamson2022": ("Williamson 2022", "Measured absorption and scattering"),
        },
        who="researcher",
    )
    concentration: float = _setting(
        1.0,
        "Concentration",
        "Factor on all that is in the water besides the water itself: at 2 there is twice as much, "
        "and one sees about half as far; 0 is pure water",
        "water",
        limits=(0.0, 1e3),
        soft_limits=(0.0, 10.0),
        animatable=True,
    )
    chlorophyll: float = _setting(
        1.0,
        "Chlorophyll",
        "Chlorophyll of the phytoplankton",
        "water",
        unit="mg/m³",
        limits=(0.0, 100.0),
        soft_limits=(0.0, 20.0),
        animatable=True,
        needs=_OF_CONSTITUENTS,
    )
    cdom: float = _setting(
        0.05,
        "CDOM",
        "Absorption of coloured dissolved organic matter at 440 nm",
        "water",
        unit="1/m",
        limits=(0.0, 20.0),
        soft_limits=(0.0, 2.0),
        digits=3,
        animatable=True,
        needs=_OF_CONSTITUENTS,
    )
    minerals: float = _setting(
        0.0,
        "Minerals",
        "Suspended minerals",
        "water",
        unit="g/m³",
        limits=(0.0, 1e3),
        soft_limits=(0.0, 20.0),
        animatable=True,
        needs=_OF_CONSTITUENTS,
    )
    detritus: float = _setting(
        0.0,
        "Detritus",
        "Absorption of dead organic particles at 400 nm",
        "water",
        unit="1/m",
        limits=(0.0, 20.0),
        soft_limits=(0.0, 2.0),
        digits=3,
        animatable=True,
        needs=_OF_CONSTITUENTS,
    )
    second_water: str = _setting(
        "",
        "Mixed with",
        "Water that is mixed in, as for --water; empty for none. Keyframe its fraction to swim "
        "from one water into the other",
        "water",
        known="waters",
    )
    second_water_fraction: float = _setting(
        0.0,
        "Fraction",
        "Fraction of the second water",
        "water",
        limits=(0.0, 1.0),
        animatable=True,
        needs={"second_water": ()},
    )
    absorption_factor: float = _setting(
        1.0,
        "Absorption ×",
        "Factor on the absorption, that of the water itself included",
        "water",
        limits=(0.0, 1e3),
        soft_limits=(0.0, 10.0),
        animatable=True,
        who="researcher",
    )
    scattering_factor: float = _setting(
        1.0,
        "Scattering ×",
        "Factor on the scattering, that of the water itself included",
        "water",
        limits=(0.0, 1e3),
        soft_limits=(0.0, 10.0),
        animatable=True,
    )
    phase: str = _setting(
        DEFAULT_PHASE,
        "Phase function",
        "How far light is turned when it is scattered: hg:G, tthg:G1,G2,FRACTION, "
        "fournier-forand:INDEX,BACKSCATTER, petzold, rayleigh, einstein-smoluchowski, isotropic, "
        "or mixture (molecules and sea particles by their fraction in each band)",
        "water",
        known="phases",
        who="researcher",
    )
    inelastic: str = _setting(
        "",
        "Inelastic light",
        "Light that changes its wavelength: raman, chlorophyll, cdom, comma separated, or all; "
        "empty for none. Fluorescence needs constituents, or a bio: or case: water",
        "water",
        who="researcher",
    )
    floor_depth: float = _setting(
        NO_FLOOR,
        "Floor",
        "Depth of an added flat floor; 0 adds none",
        "depth",
        unit="m",
        limits=(0.0, 11000.0),
        soft_limits=(0.0, 100.0),
        animatable=True,
    )
    floor_reflectance: str = _setting(
        "0.2",
        "Reflectance",
        "Reflectance of the added floor: a number, or file:PATH with wavelength_nm, reflectance",
        "depth",
        needs={"floor_depth": ()},
    )
    scene_floor: bool = _setting(
        True,
        "Endless seabed",
        "Without an added floor: the scene's own seabed goes on beyond its border, with the depth "
        "and mean colour that it has around the camera; switch it off where the seabed ends",
        "depth",
        needs=_OF_FLOOR,
    )
    surface: str = _setting(
        "none",
        "Surface",
        "Water surface",
        "waves",
        choices={
            "none": ("None", "No surface: the water goes on; the quickest"),
            "flat": ("Flat", "A still surface, seen from below with Snell's window"),
            WAVES: ("Waves", "Waves by the wind, and their caustics"),
        },
    )
    planar_reflections: bool = _setting(
        False,
        "Planar reflections",
        "Show objects near the surface mirrored in it, seen from below, in renders; a frame takes "
        "twice as long where there are some",
        "waves",
        needs={"surface": ("flat", WAVES)},
        engine="eevee",
    )
    wind_speed: float = _setting(
        5.0,
        "Wind",
        "Wind that raises the waves, at a height of 10 m; 0 is calm",
        "waves",
        unit="m/s",
        limits=(0.0, 40.0),
        soft_limits=(0.0, 20.0),
        animatable=True,
        needs=_OF_WAVES,
    )
    wind_direction: float = _setting(
        0.0,
        "Wind to",
        "Direction the wind blows to, from +x towards +y",
        "waves",
        unit="°",
        limits=(-360.0, 360.0),
        digits=1,
        animatable=True,
        needs=_OF_WAVES,
    )
    fetch: float = _setting(
        500.0,
        "Fetch",
        "Length over which the wind blows",
        "waves",
        unit="km",
        limits=(0.01, 1e4),
        soft_limits=(0.1, 1e3),
        animatable=True,
        needs=_OF_WAVES,
        who="researcher",
    )
    caustics: float = _setting(
        1.0,
        "Caustics",
        "Strength of the caustics; 1 is physical, 0 is none",
        "waves",
        limits=(0.0, 10.0),
        soft_limits=(0.0, 2.0),
        animatable=True,
        needs=_OF_WAVES,
    )
    wave_time_scale: float = _setting(
        1.0,
        "Speed",
        "Speed of the waves; 1 is real time, 0 stops them",
        "waves",
        limits=(-1e3, 1e3),
        soft_limits=(0.0, 2.0),
        animatable=True,
        needs=_OF_WAVES,
    )
    wave_loop: float = _setting(
        0.0,
        "Loop",
        "Time after which the waves repeat; 0 for never",
        "waves",
        unit="s",
        limits=(0.0, 1e4),
        soft_limits=(0.0, 60.0),
        needs=_OF_WAVES,
    )
    wave_seed: int = _setting(
        0,
        "Seed",
        "Seed of the waves' phases",
        "waves",
        limits=(0, 2**31 - 1),
        soft_limits=(0, 100),
        needs=_OF_WAVES,
    )
    wave_tile: float = _setting(
        10.0,
        "Repeats after",
        "Side of the square after which waves and caustics repeat",
        "waves",
        unit="m",
        limits=(0.1, 1e3),
        soft_limits=(1.0, 100.0),
        needs=_OF_WAVES,
    )
    wave_resolution: int = _setting(
        512,
        "Resolution",
        "Samples along the side of that square; more are sharper and slower",
        "waves",
        limits=(16, 4096),
        soft_limits=(64, 1024),
        needs=_OF_WAVES,
    )
    raised_waves: bool = _setting(
        False,
        "Waves with height",
        "Give the surface heights, sharp crests and long waves, not slopes alone: the waterline "
        "follows the waves",
        "waves",
        needs=_OF_WAVES,
    )
    swell_height: float = _setting(
        0.0,
        "Swell",
        "Height from trough to crest of a long wave from afar, under the wind's waves",
        "waves",
        unit="m",
        limits=(0.0, 30.0),
        soft_limits=(0.0, 3.0),
        animatable=True,
        needs=_OF_RAISED,
    )
    swell_length: float = _setting(
        25.0,
        "Swell length",
        "From crest to crest of the swell; at least ten times its height",
        "waves",
        unit="m",
        limits=(1.0, 1000.0),
        soft_limits=(5.0, 100.0),
        needs=_OF_RAISED,
    )
    swell_direction: float = _setting(
        0.0,
        "Swell to",
        "Direction the swell runs to, from +x towards +y",
        "waves",
        unit="°",
        limits=(-360.0, 360.0),
        digits=1,
        needs=_OF_RAISED,
    )
    whitecaps: bool = _setting(
        False,
        "Whitecaps",
        "Foam where waves with height break: as much as was measured over the sea at that wind, "
        "hardly any below 5 m/s",
        "waves",
        needs=_OF_RAISED,
    )
    snow: float = _setting(
        0.0,
        "Marine snow",
        "Flocs larger than 0.1 mm",
        "particles",
        unit="1/l",
        limits=(0.0, 1e5),
        soft_limits=(0.0, 100.0),
        animatable=True,
    )
    snow_of_water: float = _setting(
        0.0,
        "Snow of the water",
        "Marine snow by the water's own scattering, times this: 1 adds as much as it speaks for",
        "particles",
        limits=(0.0, 1e3),
        soft_limits=(0.0, 10.0),
        animatable=True,
    )
    plankton: float = _setting(
        0.0,
        "Plankton",
        "Small animals larger than 0.1 mm",
        "particles",
        unit="1/l",
        limits=(0.0, 1e5),
        soft_limits=(0.0, 100.0),
        animatable=True,
    )
    bubbles: float = _setting(
        0.0,
        "Bubbles",
        "Bubbles larger than 0.1 mm",
        "particles",
        unit="1/l",
        limits=(0.0, 1e5),
        soft_limits=(0.0, 100.0),
        animatable=True,
    )
    silt: float = _setting(
        0.0,
        "Silt",
        "Stirred-up grains larger than 0.1 mm; smaller ones come with them",
        "particles",
        unit="1/l",
        limits=(0.0, 1e5),
        soft_limits=(0.0, 100.0),
        animatable=True,
    )
    drift_speed: float = _setting(
        0.02,
        "Drift",
        "Speed at which the water carries particles along",
        "particles",
        unit="m/s",
        limits=(0.0, 10.0),
        soft_limits=(0.0, 1.0),
        digits=3,
    )
    drift_direction: float = _setting(
        0.0,
        "Drift to",
        "Direction the water carries particles to, from +x towards +y",
        "particles",
        unit="°",
        limits=(-360.0, 360.0),
        digits=1,
    )
    particle_seed: int = _setting(
        0,
        "Seed",
        "Seed of the particles' places and sizes",
        "particles",
        limits=(0, 10**6),
        soft_limits=(0, 100),
    )
    particle_slope: float = _setting(
        TYPICAL_SLOPE,
        "Slope of sizes",
        "Power with which numbers of particles fall with diameter: 3.6 on average, 3 in blooms",
        "particles",
        limits=SLOPES,
        who="researcher",
    )
    particle_angle: float = _setting(
        0.3,
        "Smallest drawn",
        "Smallest particle that is drawn: diameter over distance; half of it draws eight times as "
        "many",
        "particles",
        unit="mrad",
        limits=(0.01, 100.0),
        soft_limits=(0.1, 5.0),
        who="researcher",
    )
    illuminant: str = _setting(
        "d65",
        "Light",
        "Spectrum of the light above the water: d65, equal-energy, astm-g173, clear-sky, or "
        "file:PATH",
        "sun",
        known="illuminants",
    )
    sun_zenith: float = _setting(
        30.0,
        "Sun zenith",
        "Zenith angle of the sun in air: 90° less its elevation",
        "sun",
        unit="°",
        limits=(0.0, 89.9),
        digits=1,
        animatable=True,
    )
    sun_azimuth: float = _setting(
        0.0,
        "Sun azimuth",
        "Direction the sunlight travels to, from +x towards +y",
        "sun",
        unit="°",
        limits=(-360.0, 360.0),
        digits=1,
        animatable=True,
    )
    sky: str = _setting(
        UNIFORM,
        "Sky",
        "Where the sky is bright",
        "sun",
        choices={
            UNIFORM: ("Uniform", "Equally bright everywhere"),
            "overcast": ("Overcast", "Three times as bright overhead as at the horizon"),
            "clear": ("Clear", "Bright around the sun and towards the horizon"),
        },
    )
    sky_radiance: float = _setting(
        0.0,
        "More sky",
        "Radiance in air of a uniform sky that brings as much light as is added to the sky's own, "
        "as a fraction of the illuminant",
        "sun",
        unit="1/sr",
        limits=(0.0, 1e6),
        soft_limits=(0.0, 1.0),
        digits=3,
        animatable=True,
        who="researcher",
    )
    irradiance: str = _setting(
        AUTO,
        "Given",
        "Where the illuminant is the sun's irradiance",
        "sun",
        choices={
            AUTO: ("Automatic", "As its table has it: above for clear-sky and astm-g173"),
            "below": ("Below the surface", "Just below: nothing is lost at the surface"),
            "above": ("Above the surface", "In air: the surface reflects some of it"),
        },
        who="researcher",
    )
    refractive_index: float = _setting(
        1.34,
        "Refractive index",
        "Refractive index of the water against air",
        "sun",
        limits=(1.0, 2.0),
        soft_limits=(1.3, 1.4),
        digits=3,
        who="researcher",
    )
    indices_in_water: bool = _setting(
        True,
        "Indices against water",
        "Take refractive indices of materials, which Blender has against air, against the water "
        "that objects lie in: they mirror less and bend light less. Materials can be left out",
        "quality",
        who="researcher",
    )
    sunlight: float = _setting(
        1.0,
        "Daylight",
        "Factor on the light of sun and sky; 0 is night, where lamps are all the light",
        "lamps",
        limits=(0.0, 1e3),
        soft_limits=(0.0, 1.0),
        digits=3,
        animatable=True,
    )
    housing: str = _setting(
        housing.NONE,
        "Housing",
        "Port that the camera looks through: none, flat, dome, or file:PATH, a measured one "
        f"({housing.CONTENT})",
        "housing",
        known="housings",
    )
    port_distance: float = _setting(
        30.0,
        "Lens to port",
        "From the entrance pupil of the lens to the inner face of the port",
        "housing",
        unit="mm",
        limits=(0.01, 1e4),
        soft_limits=(1.0, 200.0),
        digits=1,
        animatable=True,
        needs=_OF_FLAT,
    )
    dome_radius: float = _setting(
        100.0,
        "Radius",
        "Of the outer face of the dome",
        "housing",
        unit="mm",
        limits=(1.0, 1e4),
        soft_limits=(30.0, 250.0),
        digits=1,
        needs=_OF_DOME,
    )
    dome_forward: float = _setting(
        0.0,
        "Lens forward",
        "How far the entrance pupil lies before the centre of the dome; a dome bends least at 0",
        "housing",
        unit="mm",
        limits=(-1e4, 1e4),
        soft_limits=(-50.0, 50.0),
        digits=1,
        animatable=True,
        needs=_OF_DOME,
    )
    port_thickness: float = _setting(
        8.0,
        "Thickness",
        "Of the port",
        "housing",
        unit="mm",
        limits=(0.0, 1e3),
        soft_limits=(1.0, 30.0),
        digits=1,
        needs=_OF_PORT,
    )
    port_glass: str = _setting(
        "BK7",
        "Made of",
        "What the port is made of",
        "housing",
        choices={name: (name.capitalize(), glass.source) for name, glass in GLASSES.items()},
        needs=_OF_PORT,
        who="researcher",
    )
    port_tilt: float = _setting(
        0.0,
        "Tilt",
        "Angle between the normal of a flat port and the axis of the lens",
        "housing",
        unit="°",
        limits=(0.0, 80.0),
        soft_limits=(0.0, 30.0),
        digits=1,
        animatable=True,
        needs=_OF_FLAT,
        who="researcher",
    )
    port_tilt_towards: float = _setting(
        0.0,
        "Leans to",
        "Where the normal of a flat port leans to: 0 is right in the picture, 90 down",
        "housing",
        unit="°",
        limits=(-360.0, 360.0),
        digits=1,
        animatable=True,
        needs=_OF_FLAT,
        who="researcher",
    )
    lens: str = _setting(
        "",
        "Lens",
        "Distortion of the lens in air, as OpenCV calibrates it: brown:k1,k2,p1,p2,k3 or "
        "fisheye:k1,k2,k3,k4; empty for none",
        "housing",
        who="researcher",
    )
    salinity: float = _setting(
        35.0,
        "Salinity",
        "Of the water before the port, for its refractive index",
        "housing",
        unit="g/kg",
        limits=(0.0, 40.0),
        digits=1,
        needs=_OF_PORT,
        who="researcher",
    )
    temperature: float = _setting(
        15.0,
        "Temperature",
        "Of the water before the port, for its refractive index",
        "housing",
        unit="°C",
        limits=(0.0, 30.0),
        digits=1,
        needs=_OF_PORT,
        who="researcher",
    )
    sensor: str = _setting(
        "cie1931",
        "Camera",
        "Camera (see --list-sensors), cie1931 for the eye, or file:PATH",
        "sensor",
        known="sensors",
    )
    filter: str = _setting(
        NO_FILTER,
        "Filter",
        f"Barrier filter before the camera: {NO_FILTER}, or {FILTER_CONTENT}; white balance and "
        "automatic exposure stay those without it",
        "sensor",
        known="filters",
    )
    white_balance: WhiteBalance = _setting(  # noqa: RUF009 - a field, as the others
        "daylight",
        "White balance",
        "Light that is rendered white",
        "sensor",
        choices={
            "daylight": ("Daylight", "The light at the surface: water keeps its cast"),
            "depth": ("At depth", "The light at the camera's depth, as a diver's camera is set"),
            "none": ("None", "The sensor's own colours"),
        },
    )
    exposure: str = _setting(
        AUTO,
        "Exposure",
        "Exposure in stops; at 0 a white surface in the light that is balanced for is white. "
        "auto: a white surface at the camera's depth has luminance 0.9; auto-picture: the mean of "
        "what the camera sees is middle grey, as long as no more than 2 % of it is white",
        "sensor",
    )
    exposure_compensation: float = _setting(
        0.0,
        "Brighter",
        "Stops that are added to an automatic exposure",
        "sensor",
        unit="EV",
        limits=(-10.0, 10.0),
        soft_limits=(-3.0, 3.0),
        animatable=True,
        needs={"exposure": (AUTO, BY_PICTURE)},
    )
    tone: str = _setting(
        STANDARD,
        "Tone",
        "Tone curve of the PNG and the viewport; all other files stay linear",
        "sensor",
        choices={
            STANDARD: ("Standard", "None: linear, as a display shows it"),
            AGX: ("AgX", "Blender's film-like curve"),
            **{name: (name.replace("-", " ").title(), "Measured curve") for name in CAMERA_CURVES},
        },
    )
    contrast: str = _setting(
        MEDIUM,
        "Contrast",
        "Contrast of the PNG and the viewport: Blender's looks",
        "sensor",
        choices={name: (name.replace("-", " ").capitalize(), "") for name in CONTRASTS},
    )
    raw: str = _setting(
        NO_RAW,
        "Raw file",
        "Counts of the camera's detector with their noise, beside the picture; what is developed "
        "to white fills half of their range",
        "sensor",
        choices={
            NO_RAW: ("None", "No raw file"),
            "dng": ("DNG", "A mosaic of the camera's filters, for raw developers"),
            "tiff": ("TIFF", "Three channels a pixel, 16 bits"),
        },
    )
    iso: float = _setting(
        100.0,
        "ISO",
        "Sensitivity; twice as much doubles the counts, and half as much light fills them",
        "sensor",
        limits=(1.0, 1e6),
        soft_limits=(100.0, 12800.0),
        digits=0,
        animatable=True,
        needs=_OF_RAW,
    )
    full_well: float = _setting(
        15_000.0,
        "Full well",
        "Electrons that a pixel holds",
        "sensor",
        limits=(100.0, 1e7),
        soft_limits=(1e3, 1e5),
        digits=0,
        needs=_OF_RAW,
        who="researcher",
    )
    read_noise: float = _setting(
        3.0,
        "Read noise",
        "Noise without light, electrons",
        "sensor",
        limits=(0.0, 1e4),
        soft_limits=(0.0, 30.0),
        needs=_OF_RAW,
        who="researcher",
    )
    bands: int = _setting(
        0,
        "Bands",
        f"Number of spectral bands; 0 for {DEFAULT_BANDS[REALTIME]} in real time, where they cost "
        f"nothing, and {DEFAULT_BANDS[BANDS]} otherwise",
        "quality",
        limits=(0, 512),
        soft_limits=(0, 60),
        who="researcher",
    )
    wavelengths: str = _setting(
        "",
        "Or at",
        "Band centres in nm, comma separated, instead of equal bands",
        "quality",
        who="researcher",
    )
    band_placement: str = _setting(
        EQUAL,
        "Placed",
        "Where the bands are",
        "quality",
        choices={
            EQUAL: ("Equal", "Of equal width, over the range"),
            OPTIMISED: (
                "Optimised",
                "Placed for the water, and developed with weights fitted to water, depth and "
                "sensor",
            ),
        },
        who="researcher",
    )
    range_start: float = _setting(
        400.0,
        "From",
        "Start of the spectral range",
        "quality",
        unit="nm",
        limits=(300, 830),
        digits=0,
        who="researcher",
    )
    range_end: float = _setting(
        700.0,
        "To",
        "End of the spectral range",
        "quality",
        unit="nm",
        limits=(300, 830),
        digits=0,
        who="researcher",
    )
    samples: int = _setting(
        64, "Samples", "Samples per pixel", "quality", limits=(1, 2**24), soft_limits=(1, 1024)
    )
    noise: float = _setting(
        0.0,
        "Noise",
        "Noise of a pixel before denoising, as mean ΔE2000, until which passes are rendered, those "
        "that the sensor weighs most the longest; Samples is then the most; 0 takes Samples",
        "quality",
        unit="ΔE",
        limits=(0, 100),
        soft_limits=(0, 10),
        engine="cycles",
    )
    bounces: int = _setting(
        64,
        "Bounces",
        "Times that Cycles scatters or reflects light at most",
        "quality",
        limits=(1, 1024),
        soft_limits=(1, 128),
        engine="cycles",
        who="researcher",
    )
    forward_peak: str = _setting(
        BOUNDED,
        "Forward peak",
        "Light that sea particles turn by less than about 3 degrees",
        "quality",
        choices={
            BOUNDED: (
                "Bounded",
                "As if most of it went straight on, which saves most of the noise",
            ),
            EXACT: ("Exact", "As it is, with much noise"),
        },
        engine="cycles",
        who="researcher",
    )
    share_passes: bool = _setting(
        True,
        "Share passes",
        "Up to three neighbouring bands whose phase functions are nearly the same share a pass and "
        "the mean of these; otherwise only bands of equal ones do",
        "quality",
        engine="cycles",
        who="researcher",
    )
    hide_own_water: bool = _setting(
        False,
        "Hide own water",
        "Leave out the water that a scene has of its own: sea surfaces, and bodies about the "
        "camera, which the notes name; it is back afterwards",
        "quality",
    )
    shafts: bool = _setting(
        False,
        "Shafts of light",
        "Draw single scattering as a volume, so that objects cast shadows in the water",
        "quality",
        engine="eevee",
    )
    diffuse_shadows: bool = _setting(
        True,
        "Diffuse shadows",
        "Shade all light that is not direct sun, on objects and in the water between them, and let "
        "objects block what shines past them, so that dark ones are dark",
        "quality",
        engine="eevee",
    )
    layers: str = _setting(
        NONE,
        "Layers",
        "What the picture comes apart in, written beside it as NNNN_layers.exr: "
        f"{', '.join(NAMES)}, comma separated, or all, or none",
        "quality",
        who="researcher",
    )

    def __post_init__(self) -> None:
        parse_layers(self.layers)
        for name, setting in SETTINGS.items():
            value, limits, choices = getattr(self, name), setting.limits, setting.choices
            if choices and value not in choices:
                raise InputError(f"{flag(name)}: {value!r} is not one of {', '.join(choices)}")
            if not isinstance(value, str | bool) and not limits[0] <= value <= limits[1]:
                raise InputError(
                    f"{flag(name)}: {value:g} is outside {limits[0]:g} to {limits[1]:g}"
                )
        if self.range_start >= self.range_end:
            raise InputError(f"--range: {self.range_start:g} to {self.range_end:g} nm is empty")

    def in_mode(self, mode: Mode) -> SceneSettings:
        """Return the settings with the mode's number of bands, if they leave it open."""
        if self.bands:
            return self
        # Placed bands are few by purpose.
        return replace(self, bands=DEFAULT_BANDS[mode if self.band_placement == EQUAL else BANDS])

    def in_effect(self, engine: str) -> dict[str, str | float | bool]:
        """Return the settings that play a part in pictures of an engine, by name."""
        names = [
            name
            for name, row in SETTINGS.items()
            if row.engine in ("", engine) and row.applies(self)
        ]
        if self.second_water_fraction == 0.0:
            names = [name for name in names if name not in _OF_SECOND_WATER]
        if not any(x.lower().startswith(_JERLOV) for x in (self.water, self.second_water)):
            names.remove("water_source")
        return {name: getattr(self, name) for name in names}

    def with_at_most(self, bands: int) -> SceneSettings:
        """Return the settings with fewer bands, if they are equal ones and more."""
        if self.wavelengths or self.band_placement != EQUAL or self.bands <= bands:
            return self
        return replace(self, bands=bands)


SETTINGS: dict[str, Setting] = {
    s.name: replace(s.metadata[_ROW], name=s.name, default=s.default) for s in fields(SceneSettings)
}
"""What is known of each setting, in the order of the reference."""


def flag(name: str) -> str:
    """Return the option of a setting."""
    if name in RANGE:
        return "--range"
    if name in _SHORT:
        return _SHORT[name]
    return f"--{name.replace('_', '-')}"
