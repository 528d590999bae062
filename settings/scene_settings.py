"""The settings of a render: one table for the command line and for the .blend."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

from ..quality.methods import DRAWN, Mode
from ..uw_spectral.errors import InputError
from ..uw_spectral.housing import description as housing
from ..uw_spectral.housing.media import GLASSES
from ..uw_spectral.imaging.layers import NAMES, NONE, parse_layers
from ..uw_spectral.spectra.barrier_filter import CONTENT as FILTER_CONTENT
from ..uw_spectral.spectra.barrier_filter import NO_FILTER
from ..uw_spectral.spectra.colour_rendering import WhiteBalance
from ..uw_spectral.spectra.receptors import RECEPTORS_CONTENT
from ..uw_spectral.spectra.tone import AGX, CAMERA_CURVES, CONTRASTS, MEDIUM, STANDARD
from .setting import ROW, Setting, stored
from .water_settings import AUTO, WaterSettings

BY_PICTURE = "auto-picture"
"""Exposure by the brightness of what the camera sees."""
BANDS, REALTIME = "bands", "realtime"
DEFAULT_BANDS: dict[Mode, int] = {m.mode: m.default_bands for m in DRAWN}
"""Bands of each mode where the settings leave their number open."""
EQUAL, OPTIMISED = "equal", "optimised"
BOUNDED, EXACT = "bounded", "exact"
RANGE = ("range_start", "range_end")
"""Settings of one option."""
# Options with a shorter name than their setting.
_SHORT = {"wind_speed": "--wind"}


_OF_FLAT, _OF_DOME = {"housing": (housing.FLAT,)}, {"housing": (housing.DOME,)}
_OF_PORT = {"housing": (housing.FLAT, housing.DOME)}
NO_RAW = "none"
_OF_RAW = {"raw": ("dng", "tiff")}
_OF_SECOND_WATER = "second_water", "second_water_fraction"
_JERLOV = "jerlov:"


@dataclass(frozen=True)
class SceneSettings(WaterSettings):
    """What a .blend stores and the options of ``render_bands.py`` override.

    Settings that are animatable may differ from frame to frame. Raises InputError if a word is not
    one of the choices, or a number outside its limits.
    """

    # A row: default, label, sentence; then section and facts.
    # fmt: off
    irradiance: str = stored(
        AUTO, "Given", "Where the illuminant is the sun's irradiance",
        "sun",
        choices={
            AUTO: ("Automatic", "As its table has it: above for clear-sky and astm-g173"),
            "below": ("Below the surface", "Just below: nothing is lost at the surface"),
            "above": ("Above the surface", "In air: the surface reflects some of it"),
        },
        who="researcher", needs={"sky_picture": ("",)},
    )
    refractive_index: float = stored(
        1.34, "Refractive index", "Refractive index of the water against air",
        "sun", limits=(1.0, 2.0), soft_limits=(1.3, 1.4), digits=3, who="researcher",
    )
    indices_in_water: bool = stored(
        True, "Indices against water",
        "Take refractive indices of materials, which Blender has against air, against the water "
        "that objects lie in: they mirror less and bend light less. Materials can be left out",
        "quality", who="researcher",
    )
    sunlight: float = stored(
        1.0, "Daylight",
        "Factor on the light of sun and sky; 0 is night, where lamps are all the light",
        "lamps", limits=(0.0, 1e3), soft_limits=(0.0, 1.0), digits=3, animatable=True,
    )
    housing: str = stored(
        housing.NONE, "Housing",
        "Port that the camera looks through: none, flat, dome, or file:PATH, a measured one "
        f"({housing.CONTENT})",
        "housing", known="housings",
    )
    port_distance: float = stored(
        30.0, "Lens to port", "From the entrance pupil of the lens to the inner face of the port",
        "housing", unit="mm", limits=(0.01, 1e4), soft_limits=(1.0, 200.0), digits=1,
        animatable=True, needs=_OF_FLAT,
    )
    dome_radius: float = stored(
        100.0, "Radius", "Of the outer face of the dome",
        "housing", unit="mm", limits=(1.0, 1e4), soft_limits=(30.0, 250.0), digits=1,
        needs=_OF_DOME,
    )
    dome_forward: float = stored(
        0.0, "Lens forward",
        "How far the entrance pupil lies before the centre of the dome; a dome bends least at 0",
        "housing", unit="mm", limits=(-1e4, 1e4), soft_limits=(-50.0, 50.0), digits=1,
        animatable=True, needs=_OF_DOME,
    )
    port_thickness: float = stored(
        8.0, "Thickness", "Of the port",
        "housing", unit="mm", limits=(0.0, 1e3), soft_limits=(1.0, 30.0), digits=1, needs=_OF_PORT,
    )
    port_glass: str = stored(
        "BK7", "Made of", "What the port is made of",
        "housing",
        choices={name: (name.capitalize(), glass.source) for name, glass in GLASSES.items()},
        needs=_OF_PORT, who="researcher",
    )
    port_tilt: float = stored(
        0.0, "Tilt", "Angle between the normal of a flat port and the axis of the lens",
        "housing", unit="°", limits=(0.0, 80.0), soft_limits=(0.0, 30.0), digits=1, animatable=True,
        needs=_OF_FLAT, who="researcher",
    )
    port_tilt_towards: float = stored(
        0.0, "Leans to",
        "Where the normal of a flat port leans to: 0 is right in the picture, 90 down",
        "housing", unit="°", limits=(-360.0, 360.0), digits=1, animatable=True, needs=_OF_FLAT,
        who="researcher",
    )
    lens: str = stored(
        "", "Lens",
        "Distortion of the lens in air, as OpenCV calibrates it: brown:k1,k2,p1,p2,k3 or "
        "fisheye:k1,k2,k3,k4; empty for none",
        "housing", who="researcher",
    )
    salinity: float = stored(
        35.0, "Salinity", "Of the water before the port, for its refractive index",
        "housing", unit="g/kg", limits=(0.0, 40.0), digits=1, needs=_OF_PORT, who="researcher",
    )
    temperature: float = stored(
        15.0, "Temperature", "Of the water before the port, for its refractive index",
        "housing", unit="°C", limits=(0.0, 30.0), digits=1, needs=_OF_PORT, who="researcher",
    )
    sensor: str = stored(
        "cie1931", "Camera", "Camera (see --list-sensors), cie1931 for the eye, or file:PATH",
        "sensor", known="sensors",
    )
    filter: str = stored(
        NO_FILTER, "Filter",
        f"Barrier filter before the camera: {NO_FILTER}, or {FILTER_CONTENT}; white balance and "
        "automatic exposure stay those without it",
        "sensor", known="filters",
    )
    white_balance: WhiteBalance = stored(  # noqa: RUF009 - a field, as the others
        "daylight", "White balance", "Light that is rendered white",
        "sensor",
        choices={
            "daylight": ("Daylight", "The light at the surface: water keeps its cast"),
            "depth": ("At depth", "The light at the camera's depth, as a diver's camera is set"),
            "none": ("None", "The sensor's own colours"),
        },
    )
    exposure: str = stored(
        AUTO, "Exposure",
        "Exposure in stops; at 0 a white surface in the light that is balanced for is white. "
        "auto: a white surface at the camera's depth has luminance 0.9; auto-picture: the mean of "
        "what the camera sees is middle grey, as long as no more than 2 % of it is white",
        "sensor",
    )
    exposure_compensation: float = stored(
        0.0, "Brighter", "Stops that are added to an automatic exposure",
        "sensor", unit="EV", limits=(-10.0, 10.0), soft_limits=(-3.0, 3.0), animatable=True,
        needs={"exposure": (AUTO, BY_PICTURE)},
    )
    tone: str = stored(
        STANDARD, "Tone", "Tone curve of the PNG and the viewport; all other files stay linear",
        "sensor",
        choices={
            STANDARD: ("Standard", "None: linear, as a display shows it"),
            AGX: ("AgX", "Blender's film-like curve"),
            **{name: (name.replace("-", " ").title(), "Measured curve") for name in CAMERA_CURVES},
        },
    )
    contrast: str = stored(
        MEDIUM, "Contrast", "Contrast of the PNG and the viewport: Blender's looks",
        "sensor", choices={name: (name.replace("-", " ").capitalize(), "") for name in CONTRASTS},
    )
    raw: str = stored(
        NO_RAW, "Raw file",
        "Counts of the camera's detector with their noise, beside the picture; what is developed "
        "to white fills half of their range",
        "sensor",
        choices={
            NO_RAW: ("None", "No raw file"),
            "dng": ("DNG", "A mosaic of the camera's filters, for raw developers"),
            "tiff": ("TIFF", "Three channels a pixel, 16 bits"),
        },
    )
    iso: float = stored(
        100.0, "ISO",
        "Sensitivity; twice as much doubles the counts, and half as much light fills them",
        "sensor", limits=(1.0, 1e6), soft_limits=(100.0, 12800.0), digits=0, animatable=True,
        needs=_OF_RAW,
    )
    full_well: float = stored(
        15_000.0, "Full well", "Electrons that a pixel holds",
        "sensor", limits=(100.0, 1e7), soft_limits=(1e3, 1e5), digits=0, needs=_OF_RAW,
        who="researcher",
    )
    read_noise: float = stored(
        3.0, "Read noise", "Noise without light, electrons",
        "sensor", limits=(0.0, 1e4), soft_limits=(0.0, 30.0), needs=_OF_RAW, who="researcher",
    )
    receptors: str = stored(
        "", "Receptors",
        f"Sensor of any number of channels, file:PATH, {RECEPTORS_CONTENT}: beside the picture, an "
        "EXR and a TIFF have a channel for each, a PNG false colours; not in real time",
        "sensor", who="researcher",
    )
    false_colour: str = stored(
        "", "Shown as",
        "Receptors that the PNG shows as red, green and blue, as NIR,GREEN,UV; + averages several; "
        "empty for thirds of them by wavelength",
        "sensor", needs={"receptors": ()}, who="researcher",
    )
    bands: int = stored(
        0, "Bands",
        f"Number of spectral bands; 0 for {DEFAULT_BANDS[REALTIME]} in real time, where they cost "
        f"nothing, and {DEFAULT_BANDS[BANDS]} otherwise",
        "quality", limits=(0, 512), soft_limits=(0, 60), who="researcher",
    )
    wavelengths: str = stored(
        "", "Or at", "Band centres in nm, comma separated, instead of equal bands",
        "quality", who="researcher",
    )
    band_placement: str = stored(
        EQUAL, "Placed", "Where the bands are",
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
    range_start: float = stored(
        400.0, "From", "Start of the spectral range",
        "quality", unit="nm", limits=(300, 830), digits=0, who="researcher",
    )
    range_end: float = stored(
        700.0, "To", "End of the spectral range",
        "quality", unit="nm", limits=(300, 830), digits=0, who="researcher",
    )
    samples: int = stored(
        64, "Samples", "Samples per pixel", "quality", limits=(1, 2**24), soft_limits=(1, 1024)
    )
    noise: float = stored(
        0.0, "Noise",
        "Noise of a pixel before denoising, as mean ΔE2000, until which passes are rendered, those "
        "that the sensor weighs most the longest; Samples is then the most; 0 takes Samples",
        "quality", unit="ΔE", limits=(0, 100), soft_limits=(0, 10), engine="cycles",
    )
    bounces: int = stored(
        64, "Bounces", "Times that Cycles scatters or reflects light at most",
        "quality", limits=(1, 1024), soft_limits=(1, 128), engine="cycles", who="researcher",
    )
    forward_peak: str = stored(
        BOUNDED, "Forward peak", "Light that sea particles turn by less than about 3 degrees",
        "quality",
        choices={
            BOUNDED: (
                "Bounded",
                "As if most of it went straight on, which saves most of the noise",
            ),
            EXACT: ("Exact", "As it is, with much noise"),
        },
        engine="cycles", who="researcher",
    )
    share_passes: bool = stored(
        True, "Share passes",
        "Up to three neighbouring bands whose phase functions are nearly the same share a pass and "
        "the mean of these; otherwise only bands of equal ones do",
        "quality", engine="cycles", who="researcher",
    )
    hide_own_water: bool = stored(
        False, "Hide own water",
        "Leave out the water that a scene has of its own: sea surfaces, and bodies about the "
        "camera, which the notes name; it is back afterwards",
        "quality",
    )
    shafts: bool = stored(
        False, "Shafts of light",
        "Draw single scattering as a volume, so that objects cast shadows in the water",
        "quality", engine="eevee",
    )
    diffuse_shadows: bool = stored(
        True, "Diffuse shadows",
        "Shade all light that is not direct sun, on objects and in the water between them, and let "
        "objects block what shines past them, so that dark ones are dark",
        "quality", engine="eevee",
    )
    layers: str = stored(
        NONE, "Layers",
        "What the picture comes apart in, written beside it as NNNN_layers.exr: "
        f"{', '.join(NAMES)}, comma separated, or all, or none",
        "quality", who="researcher",
    )
    # fmt: on

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
    s.name: replace(s.metadata[ROW], name=s.name, default=s.default) for s in fields(SceneSettings)
}
"""What is known of each setting, in the order of the reference."""


def flag(name: str) -> str:
    """Return the option of a setting."""
    return "--range" if name in RANGE else _SHORT.get(name, f"--{name.replace('_', '-')}")
