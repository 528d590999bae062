"""The settings of a render: one table for the command line and for the .blend."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace

from ..quality.methods import DRAWN, Mode
from ..uw_spectral.errors import InputError
from ..uw_spectral.imaging.layers import NAMES, NONE, parse_layers
from ..uw_spectral.spectra.colour_rendering import WHITE_BALANCES, WhiteBalance
from ..uw_spectral.spectra.tone import CONTRASTS, MEDIUM, STANDARD, TONES
from ..uw_spectral.transfer.sky import SKIES, UNIFORM
from ..uw_spectral.transfer.water_column import SURFACES
from ..uw_spectral.water import measured
from ..uw_spectral.water.particles import SLOPES, USUAL_SLOPE

AUTO = "auto"
BY_PICTURE = "auto-picture"
"""Exposure by the brightness of what the camera sees."""
BANDS, REALTIME = "bands", "realtime"
USUAL_BANDS: dict[Mode, int] = {m.mode: m.usual_bands for m in DRAWN}
"""Bands of each mode where the settings leave their number open."""
EQUAL, OPTIMISED = "equal", "optimised"
SOLVED, CLOSED_FORM = "solved", "closed-form"
BOUNDED, EXACT = "bounded", "exact"
DEFAULT_PHASE = "mixture"
CONSTITUENTS = "constituents"
NO_FLOOR = 0.0
RANGE = ("range_start", "range_end")
"""Settings of one option."""
# Options with a shorter name than their setting.
_SHORT = {"wind_speed": "--wind"}


def _setting[Default: str | float | bool](
    default: Default,
    text: str,
    choices: tuple[str, ...] = (),
    limits: tuple[float, float] = (float("-inf"), float("inf")),
    *,
    animatable: bool = False,
) -> Default:
    metadata = {"help": text, "choices": choices, "limits": limits, "animatable": animatable}
    return field(default=default, metadata=metadata)


@dataclass(frozen=True)
class SceneSettings:
    """What a .blend stores and the options of ``render_bands.py`` override.

    Settings that are marked animatable may differ from frame to frame.

    Raises
    ------
    InputError
        If a word is not one of the choices, or a number outside its limits.
    """

    water: str = _setting(
        "jerlov:IB",
        "Water: jerlov:TYPE or case:NAME (see --list-waters); bio:chl=1,cdom=0.1, made of "
        f"constituents; file:PATH, {measured.CONTENT}; constituents takes chlorophyll, cdom, "
        "minerals and detritus",
    )
    chlorophyll: float = _setting(
        1.0, "Chlorophyll, mg/m³, of --water constituents", limits=(0.0, 100.0), animatable=True
    )
    cdom: float = _setting(
        0.05,
        "Absorption of coloured dissolved organic matter at 440 nm, 1/m, of --water constituents",
        limits=(0.0, 20.0),
        animatable=True,
    )
    minerals: float = _setting(
        0.0,
        "Suspended minerals, g/m³, of --water constituents",
        limits=(0.0, 1e3),
        animatable=True,
    )
    detritus: float = _setting(
        0.0,
        "Absorption of dead organic particles at 400 nm, 1/m, of --water constituents",
        limits=(0.0, 20.0),
        animatable=True,
    )
    water_source: str = _setting(
        "solonenko2015",
        "Publication that the coefficients of a Jerlov type come from",
        choices=("solonenko2015", "williamson2022"),
    )
    second_water: str = _setting("", "Water that is mixed in, as for --water; empty for none")
    second_water_share: float = _setting(
        0.0, "Share of the second water, 0 to 1", limits=(0.0, 1.0), animatable=True
    )
    absorption_factor: float = _setting(
        1.0, "Factor on the absorption of the water", limits=(0.0, 1e3), animatable=True
    )
    scattering_factor: float = _setting(
        1.0, "Factor on the scattering of the water", limits=(0.0, 1e3), animatable=True
    )
    phase: str = _setting(
        DEFAULT_PHASE,
        "Phase function: hg:G, tthg:G1,G2,SHARE, fournier-forand:INDEX,BACKSCATTER, petzold, "
        "rayleigh, einstein-smoluchowski, isotropic, or mixture (molecules and sea particles "
        "by their share in each band)",
    )
    bands: int = _setting(
        0,
        f"Number of spectral bands; 0 for {USUAL_BANDS[REALTIME]} in real time, where they cost "
        f"nothing, and {USUAL_BANDS[BANDS]} otherwise",
        limits=(0, 512),
    )
    wavelengths: str = _setting("", "Band centres in nm, comma separated, instead of equal bands")
    band_placement: str = _setting(
        EQUAL,
        "Equal bands, or optimised: placed for the water, and developed with weights fitted to "
        "water, depth and sensor",
        choices=(EQUAL, OPTIMISED),
    )
    range_start: float = _setting(400.0, "Start of the spectral range in nm", limits=(300, 830))
    range_end: float = _setting(700.0, "End of the spectral range in nm", limits=(300, 830))
    sensor: str = _setting("cie1931", "Camera (see --list-sensors), cie1931, or file:PATH")
    illuminant: str = _setting(
        "d65", "Light above the water: d65, equal-energy, astm-g173, clear-sky, or file:PATH"
    )
    sun_zenith: float = _setting(
        30.0, "Zenith angle of the sun in air, degrees", limits=(0.0, 89.9), animatable=True
    )
    sun_azimuth: float = _setting(
        0.0,
        "Direction the sunlight travels to, degrees from +x towards +y",
        limits=(-360.0, 360.0),
        animatable=True,
    )
    sunlight: float = _setting(
        1.0,
        "Factor on the light of sun and sky; 0 is night, where lamps are all the light",
        limits=(0.0, 1e3),
        animatable=True,
    )
    irradiance: str = _setting(
        AUTO,
        "Whether the illuminant is the sun's irradiance just below or above the surface; auto: as "
        "its table has it, above for clear-sky and astm-g173",
        choices=(AUTO, "below", "above"),
    )
    floor_depth: float = _setting(
        NO_FLOOR,
        "Depth of an added flat floor in m; 0 adds none",
        limits=(0.0, 11000.0),
        animatable=True,
    )
    scene_floor: bool = _setting(
        True,
        "EEVEE: without an added floor, the light that the scene's own seabed sends up: its depth "
        "and mean colour are looked for around the camera",
    )
    floor_reflectance: str = _setting(
        "0.2", "Reflectance of the floor: a number, or file:PATH with wavelength_nm, reflectance"
    )
    surface: str = _setting(
        "none",
        "Water surface: none, flat (Snell's window), or waves (and their caustics)",
        choices=SURFACES,
    )
    wind_speed: float = _setting(
        5.0,
        "Wind that raises the waves, m/s at 10 m; 0 is calm",
        limits=(0.0, 40.0),
        animatable=True,
    )
    wind_direction: float = _setting(
        0.0,
        "Direction the wind blows to, degrees from +x towards +y",
        limits=(-360.0, 360.0),
        animatable=True,
    )
    fetch: float = _setting(
        500.0, "Length over which the wind blows, km", limits=(0.01, 1e4), animatable=True
    )
    wave_seed: int = _setting(0, "Seed of the waves' phases", limits=(0, 2**31 - 1))
    wave_tile: float = _setting(
        10.0, "Side of the square after which waves and caustics repeat, m", limits=(0.1, 1e3)
    )
    wave_resolution: int = _setting(
        512,
        "Samples along the side of that square; more are sharper and slower",
        limits=(16, 4096),
    )
    wave_time_scale: float = _setting(
        1.0,
        "Speed of the waves; 1 is real time, 0 stops them",
        limits=(-1e3, 1e3),
        animatable=True,
    )
    wave_loop: float = _setting(
        0.0, "Time after which the waves repeat, s; 0 for never", limits=(0.0, 1e4)
    )
    caustics: float = _setting(
        1.0,
        "Strength of the caustics; 1 is physical, 0 is none",
        limits=(0.0, 10.0),
        animatable=True,
    )
    sky: str = _setting(
        UNIFORM,
        "Where the sky is bright: uniform; overcast, three times as bright overhead as at the "
        "horizon; clear, around the sun and towards the horizon",
        choices=SKIES,
    )
    sky_radiance: float = _setting(
        0.0,
        "Radiance in air of the uniform sky that brings as much light, as a share of the "
        "illuminant, per steradian",
        limits=(0.0, 1e6),
        animatable=True,
    )
    refractive_index: float = _setting(
        1.34, "Refractive index of the water against air", limits=(1.0, 2.0)
    )
    white_balance: WhiteBalance = _setting(  # noqa: RUF009 - a field, as the others
        "daylight",
        "Light that is rendered white: at the surface, at the camera's depth, or none",
        choices=WHITE_BALANCES,
    )
    exposure: str = _setting(
        AUTO,
        "Exposure in stops; at 0 a white surface in the light that is balanced for is white. "
        "auto: a white surface at the camera's depth has luminance 0.9; auto-picture: the mean of "
        "what the camera sees is middle grey, as long as no more than 2 % of it is white",
    )
    exposure_compensation: float = _setting(
        0.0,
        "Stops that are added to an automatic exposure",
        limits=(-10.0, 10.0),
        animatable=True,
    )
    tone: str = _setting(
        STANDARD,
        "Tone curve of the PNG and the viewport: standard (none), agx, or the measured curve of a "
        "camera; all other files stay linear",
        choices=TONES,
    )
    contrast: str = _setting(
        MEDIUM, "Contrast of the PNG and the viewport: Blender's looks", choices=CONTRASTS
    )
    snow: float = _setting(
        0.0,
        "Marine snow: flocs larger than 0.1 mm per litre",
        limits=(0.0, 1e5),
        animatable=True,
    )
    snow_of_water: float = _setting(
        0.0,
        "Marine snow by the water's own scattering, times this: 1 adds as much as it speaks for",
        limits=(0.0, 1e3),
        animatable=True,
    )
    plankton: float = _setting(
        0.0,
        "Small animals larger than 0.1 mm per litre",
        limits=(0.0, 1e5),
        animatable=True,
    )
    bubbles: float = _setting(
        0.0, "Bubbles larger than 0.1 mm per litre", limits=(0.0, 1e5), animatable=True
    )
    silt: float = _setting(
        0.0,
        "Stirred-up grains larger than 0.1 mm per litre; smaller ones come with them",
        limits=(0.0, 1e5),
        animatable=True,
    )
    particle_slope: float = _setting(
        USUAL_SLOPE,
        "Power with which numbers of particles fall with diameter: 3.6 on average, 3 in blooms",
        limits=SLOPES,
    )
    particle_angle: float = _setting(
        0.3,
        "Smallest particle that is drawn: diameter over distance, in milliradians; half of it "
        "draws eight times as many",
        limits=(0.01, 100.0),
    )
    particle_seed: int = _setting(0, "Seed of the particles' places and sizes", limits=(0, 10**6))
    drift_speed: float = _setting(
        0.02, "Speed at which the water carries particles along, m/s", limits=(0.0, 10.0)
    )
    drift_direction: float = _setting(
        0.0,
        "Direction the water carries particles to, degrees from +x towards +y",
        limits=(-360.0, 360.0),
    )
    samples: int = _setting(64, "Samples per pixel", limits=(1, 2**24))
    bounces: int = _setting(
        64, "Times that Cycles scatters or reflects light at most", limits=(1, 1024)
    )
    forward_peak: str = _setting(
        BOUNDED,
        "Cycles: light that sea particles turn by less than about 3 degrees: bounded, as if most "
        "of it went straight on, which saves most of the noise; or exact",
        choices=(BOUNDED, EXACT),
    )
    share_passes: bool = _setting(
        True,
        "Cycles: up to three neighbouring bands whose phase functions are nearly the same share a "
        "pass and the mean of these; otherwise only bands of equal ones do",
    )
    field: str = _setting(
        SOLVED,
        "EEVEE: light scattered many times, solved once per water and looked up, or in closed form",
        choices=(SOLVED, CLOSED_FORM),
    )
    shafts: bool = _setting(
        False,
        "EEVEE: draw single scattering as a volume, so that things cast shadows in the water",
    )
    diffuse_shadows: bool = _setting(
        True,
        "EEVEE: shade all light that is not direct sun, on things and in the water between them; "
        "in closed form, on things only and from above",
    )
    inelastic: str = _setting(
        "",
        "Light that changes its wavelength: raman, chlorophyll, cdom, comma separated, or all; "
        "empty for none. Fluorescence needs constituents, or a bio: or case: water",
    )

    layers: str = _setting(
        NONE,
        "What the picture comes apart in, written beside it as NNNN_layers.exr: "
        f"{', '.join(NAMES)}, comma separated, or all, or none",
    )

    def __post_init__(self) -> None:
        parse_layers(self.layers)
        for setting in fields(self):
            value, limits = getattr(self, setting.name), setting.metadata["limits"]
            choices = setting.metadata["choices"]
            if choices and value not in choices:
                raise InputError(
                    f"{flag(setting.name)}: {value!r} is not one of {', '.join(choices)}"
                )
            if not isinstance(value, str | bool) and not limits[0] <= value <= limits[1]:
                raise InputError(
                    f"{flag(setting.name)}: {value:g} is outside {limits[0]:g} to {limits[1]:g}"
                )
        if self.range_start >= self.range_end:
            raise InputError(f"--range: {self.range_start:g} to {self.range_end:g} nm is empty")

    def in_mode(self, mode: Mode) -> SceneSettings:
        """Return the settings with the mode's number of bands, if they leave it open."""
        if self.bands:
            return self
        # Placed bands are few by purpose, and those of the closed form cost the shader.
        free = self.band_placement == EQUAL and self.field != CLOSED_FORM
        return replace(self, bands=USUAL_BANDS[mode if free else BANDS])

    def with_at_most(self, bands: int) -> SceneSettings:
        """Return the settings with fewer bands, if they are equal ones and more."""
        if self.wavelengths or self.band_placement != EQUAL or self.bands <= bands:
            return self
        return replace(self, bands=bands)


def flag(name: str) -> str:
    """Return the option of a setting."""
    if name in RANGE:
        return "--range"
    if name in _SHORT:
        return _SHORT[name]
    return f"--{name.replace('_', '-')}"
