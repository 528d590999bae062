"""Settings of the water, of what lies in it and of the light from above."""

from __future__ import annotations

from dataclasses import dataclass

from ..uw_spectral.transfer.sky import UNIFORM
from ..uw_spectral.transfer.water_column import WAVES
from ..uw_spectral.water import measured
from ..uw_spectral.water.particles import SLOPES, TYPICAL_SLOPE
from .setting import stored

AUTO = "auto"
DEFAULT_PHASE = "mixture"
CONSTITUENTS = "constituents"
NO_FLOOR = 0.0
WORLD = "world"
"""The scene's own world, which whoever renders draws as a picture first."""


_OF_CONSTITUENTS = {"water": (CONSTITUENTS,)}
_OF_WAVES = {"surface": (WAVES,)}
_OF_RAISED = {"surface": (WAVES,), "raised_waves": ()}
_OF_FORMULA = {"sky_picture": ("",)}
_OF_FLOOR = {"floor_depth": (NO_FLOOR,)}


@dataclass(frozen=True)
class WaterSettings:
    """The first of the settings of a scene; see :class:`.SceneSettings`."""

    # A row: default, label, sentence; then section and facts.
    # fmt: off
    water: str = stored(
        "jerlov:IB", "Water",
        "Water: jerlov:TYPE or case:NAME (see --list-waters); bio:chl=1,cdom=0.1, made of "
        "constituents; chl:3, open sea with this chlorophyll in mg/m³ and the Kd measured at it; "
        f"file:PATH, {measured.CONTENT}; constituents takes chlorophyll, cdom, "
        "minerals and detritus",
        "water", known="waters",
    )
    water_source: str = stored(
        "solonenko2015", "Source", "Publication that the coefficients of a Jerlov type come from",
        "water",
        choices={
            "solonenko2015": ("Solonenko 2015", "All ten types, from Jerlov's measurements of Kd"),
            "williamson2022": ("Williamson 2022", "Measured absorption and scattering"),
        },
        who="researcher",
    )
    concentration: float = stored(
        1.0, "Concentration",
        "Factor on all that is in the water besides the water itself: at 2 there is twice as much, "
        "and one sees about half as far; 0 is pure water",
        "water", limits=(0.0, 1e3), soft_limits=(0.0, 10.0), animatable=True,
    )
    chlorophyll: float = stored(
        1.0, "Chlorophyll", "Chlorophyll of the phytoplankton",
        "water", unit="mg/m³", limits=(0.0, 100.0), soft_limits=(0.0, 20.0), animatable=True,
        needs=_OF_CONSTITUENTS,
    )
    cdom: float = stored(
        0.05, "CDOM", "Absorption of coloured dissolved organic matter at 440 nm",
        "water", unit="1/m", limits=(0.0, 20.0), soft_limits=(0.0, 2.0), digits=3, animatable=True,
        needs=_OF_CONSTITUENTS,
    )
    minerals: float = stored(
        0.0, "Minerals", "Suspended minerals",
        "water", unit="g/m³", limits=(0.0, 1e3), soft_limits=(0.0, 20.0), animatable=True,
        needs=_OF_CONSTITUENTS,
    )
    detritus: float = stored(
        0.0, "Detritus", "Absorption of dead organic particles at 400 nm",
        "water", unit="1/m", limits=(0.0, 20.0), soft_limits=(0.0, 2.0), digits=3, animatable=True,
        needs=_OF_CONSTITUENTS,
    )
    second_water: str = stored(
        "", "Mixed with",
        "Water that is mixed in, as for --water; empty for none. Keyframe its fraction to swim "
        "from one water into the other",
        "water", known="waters",
    )
    second_water_fraction: float = stored(
        0.0, "Fraction", "Fraction of the second water",
        "water", limits=(0.0, 1.0), animatable=True, needs={"second_water": ()},
    )
    absorption_factor: float = stored(
        1.0, "Absorption ×", "Factor on the absorption, that of the water itself included",
        "water", limits=(0.0, 1e3), soft_limits=(0.0, 10.0), animatable=True, who="researcher",
    )
    scattering_factor: float = stored(
        1.0, "Scattering ×", "Factor on the scattering, that of the water itself included",
        "water", limits=(0.0, 1e3), soft_limits=(0.0, 10.0), animatable=True,
    )
    phase: str = stored(
        DEFAULT_PHASE, "Phase function",
        "How far light is turned when it is scattered: hg:G, tthg:G1,G2,FRACTION, "
        "fournier-forand:INDEX,BACKSCATTER, petzold, rayleigh, einstein-smoluchowski, isotropic, "
        "or mixture (molecules and sea particles by their fraction in each band)",
        "water", known="phases", who="researcher",
    )
    inelastic: str = stored(
        "", "Inelastic light",
        "Light of sun, sky and lamps that changes its wavelength: raman, chlorophyll, cdom, comma "
        "separated, or all; empty for none. Fluorescence needs constituents, or a bio: or case: "
        "water",
        "water", who="researcher",
    )
    floor_depth: float = stored(
        NO_FLOOR, "Floor", "Depth of an added flat floor; 0 adds none",
        "depth", unit="m", limits=(0.0, 11000.0), soft_limits=(0.0, 100.0), animatable=True,
    )
    floor_reflectance: str = stored(
        "0.2", "Reflectance",
        "Reflectance of the added floor: a number, or file:PATH with wavelength_nm, reflectance",
        "depth", needs={"floor_depth": ()},
    )
    scene_floor: bool = stored(
        True, "Endless seabed",
        "Without an added floor: the scene's own seabed goes on beyond its border, with the depth "
        "and mean colour that it has around the camera; switch it off where the seabed ends",
        "depth", needs=_OF_FLOOR,
    )
    surface: str = stored(
        "none", "Surface", "Water surface",
        "waves",
        choices={
            "none": ("None", "No surface: the water goes on; the quickest"),
            "flat": ("Flat", "A still surface, seen from below with Snell's window"),
            WAVES: ("Waves", "Waves by the wind, and their caustics"),
        },
    )
    planar_reflections: bool = stored(
        True, "Planar reflections",
        "Show objects near the surface mirrored in it, seen from below, in renders; a frame takes "
        "twice as long where there are some",
        "waves", needs={"surface": ("flat", WAVES)}, engine="eevee",
    )
    wind_speed: float = stored(
        5.0, "Wind", "Wind that raises the waves, at a height of 10 m; 0 is calm",
        "waves", unit="m/s", limits=(0.0, 40.0), soft_limits=(0.0, 20.0), animatable=True,
        needs=_OF_WAVES,
    )
    wind_direction: float = stored(
        0.0, "Wind to", "Direction the wind blows to, from +x towards +y",
        "waves", unit="°", limits=(-360.0, 360.0), digits=1, animatable=True, needs=_OF_WAVES,
    )
    fetch: float = stored(
        500.0, "Fetch", "Length over which the wind blows",
        "waves", unit="km", limits=(0.01, 1e4), soft_limits=(0.1, 1e3), animatable=True,
        needs=_OF_WAVES, who="researcher",
    )
    caustics: float = stored(
        1.0, "Caustics", "Strength of the caustics; 1 is physical, 0 is none",
        "waves", limits=(0.0, 10.0), soft_limits=(0.0, 2.0), animatable=True, needs=_OF_WAVES,
    )
    wave_time_scale: float = stored(
        1.0, "Speed", "Speed of the waves; 1 is real time, 0 stops them",
        "waves", limits=(-1e3, 1e3), soft_limits=(0.0, 2.0), animatable=True, needs=_OF_WAVES,
    )
    wave_loop: float = stored(
        0.0, "Loop", "Time after which the waves repeat; 0 for never",
        "waves", unit="s", limits=(0.0, 1e4), soft_limits=(0.0, 60.0), needs=_OF_WAVES,
    )
    wave_seed: int = stored(
        0, "Seed", "Seed of the waves' phases",
        "waves", limits=(0, 2**31 - 1), soft_limits=(0, 100), needs=_OF_WAVES,
    )
    wave_tile: float = stored(
        10.0, "Repeats after", "Side of the square after which waves and caustics repeat",
        "waves", unit="m", limits=(0.1, 1e3), soft_limits=(1.0, 100.0), needs=_OF_WAVES,
    )
    wave_resolution: int = stored(
        512, "Resolution", "Samples along the side of that square; more are sharper and slower",
        "waves", limits=(16, 4096), soft_limits=(64, 1024), needs=_OF_WAVES,
    )
    raised_waves: bool = stored(
        False, "Waves with height",
        "Give the surface heights, sharp crests and long waves, not slopes alone: the waterline "
        "follows the waves",
        "waves", needs=_OF_WAVES,
    )
    swell_height: float = stored(
        0.0, "Swell",
        "Height from trough to crest of a long wave from afar, under the wind's waves",
        "waves", unit="m", limits=(0.0, 30.0), soft_limits=(0.0, 3.0), animatable=True,
        needs=_OF_RAISED,
    )
    swell_length: float = stored(
        25.0, "Swell length", "From crest to crest of the swell; at least ten times its height",
        "waves", unit="m", limits=(1.0, 1000.0), soft_limits=(5.0, 100.0), needs=_OF_RAISED,
    )
    swell_direction: float = stored(
        0.0, "Swell to", "Direction the swell runs to, from +x towards +y",
        "waves", unit="°", limits=(-360.0, 360.0), digits=1, needs=_OF_RAISED,
    )
    whitecaps: bool = stored(
        False, "Whitecaps",
        "Foam where waves with height break: as much as was measured over the sea at that wind, "
        "hardly any below 5 m/s",
        "waves", needs=_OF_RAISED,
    )
    snow: float = stored(
        0.0, "Marine snow", "Flocs larger than 0.1 mm",
        "particles", unit="1/l", limits=(0.0, 1e5), soft_limits=(0.0, 100.0), animatable=True,
    )
    snow_of_water: float = stored(
        0.0, "Snow of the water",
        "Marine snow by the water's own scattering, times this: 1 adds as much as it speaks for",
        "particles", limits=(0.0, 1e3), soft_limits=(0.0, 10.0), animatable=True,
    )
    plankton: float = stored(
        0.0, "Plankton", "Small animals larger than 0.1 mm",
        "particles", unit="1/l", limits=(0.0, 1e5), soft_limits=(0.0, 100.0), animatable=True,
    )
    bubbles: float = stored(
        0.0, "Bubbles", "Bubbles larger than 0.1 mm",
        "particles", unit="1/l", limits=(0.0, 1e5), soft_limits=(0.0, 100.0), animatable=True,
    )
    silt: float = stored(
        0.0, "Silt", "Stirred-up grains larger than 0.1 mm; smaller ones come with them",
        "particles", unit="1/l", limits=(0.0, 1e5), soft_limits=(0.0, 100.0), animatable=True,
    )
    drift_speed: float = stored(
        0.02, "Drift", "Speed at which the water carries particles along",
        "particles", unit="m/s", limits=(0.0, 10.0), soft_limits=(0.0, 1.0), digits=3,
    )
    drift_direction: float = stored(
        0.0, "Drift to", "Direction the water carries particles to, from +x towards +y",
        "particles", unit="°", limits=(-360.0, 360.0), digits=1,
    )
    particle_seed: int = stored(
        0, "Seed", "Seed of the particles' places and sizes",
        "particles", limits=(0, 10**6), soft_limits=(0, 100),
    )
    particle_slope: float = stored(
        TYPICAL_SLOPE, "Slope of sizes",
        "Power with which numbers of particles fall with diameter: 3.6 on average, 3 in blooms",
        "particles", limits=SLOPES, who="researcher",
    )
    particle_angle: float = stored(
        0.3, "Smallest drawn",
        "Smallest particle that is drawn: diameter over distance; half of it draws eight times as "
        "many",
        "particles", unit="mrad", limits=(0.01, 100.0), soft_limits=(0.1, 5.0), who="researcher",
    )
    illuminant: str = stored(
        "d65", "Light",
        "Spectrum of the light above the water: d65, equal-energy, astm-g173, clear-sky, or "
        "file:PATH",
        "sun", known="illuminants",
    )
    sun_zenith: float = stored(
        30.0, "Sun zenith", "Zenith angle of the sun in air: 90° less its elevation",
        "sun", unit="°", limits=(0.0, 89.9), digits=1, animatable=True, needs=_OF_FORMULA,
    )
    sun_azimuth: float = stored(
        0.0, "Sun azimuth", "Direction the sunlight travels to, from +x towards +y",
        "sun", unit="°", limits=(-360.0, 360.0), digits=1, animatable=True, needs=_OF_FORMULA,
    )
    sky: str = stored(
        UNIFORM, "Sky", "Where the sky is bright",
        "sun",
        choices={
            UNIFORM: ("Uniform", "Equally bright everywhere"),
            "overcast": ("Overcast", "Three times as bright overhead as at the horizon"),
            "clear": ("Clear", "Bright around the sun and towards the horizon"),
        },
        needs=_OF_FORMULA,
    )
    sky_radiance: float = stored(
        0.0, "More sky",
        "Radiance in air of a uniform sky that brings as much light as is added to the sky's own, "
        "as a fraction of the illuminant",
        "sun", unit="1/sr", limits=(0.0, 1e6), soft_limits=(0.0, 1.0), digits=3, animatable=True,
        who="researcher", needs=_OF_FORMULA,
    )
    sky_picture: str = stored(
        "", "Sky picture",
        "What lights the water in place of sun and sky: world, the scene's own world (its picture, "
        "sky texture or colours), or file:PATH, OpenEXR of all directions. Its sun is found. Light "
        "is then what counts as white",
        "sun", known="sky_pictures",
    )
    # fmt: on
