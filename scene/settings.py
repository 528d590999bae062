"""The settings of a render: one table for the command line and for the .blend."""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Literal, NoReturn, get_args

from ..quality.methods import DRAWN, METHODS, Engine, Mode
from ..uw_spectral.errors import InputError
from ..uw_spectral.imaging.layers import NAMES, NONE, parse_layers
from ..uw_spectral.spectra.colour_rendering import WHITE_BALANCES, WhiteBalance
from ..uw_spectral.spectra.tone import CONTRASTS, MEDIUM, STANDARD, TONES
from ..uw_spectral.transfer.sky import SKIES, UNIFORM
from ..uw_spectral.transfer.water_column import SURFACES
from ..uw_spectral.water import measured
from ..uw_spectral.water.particles import SLOPES, USUAL_SLOPE
from .stage import Stage

Device = Literal["cpu", "gpu"]

AUTO = "auto"
BY_PICTURE = "auto-picture"
"""Exposure by the brightness of what the camera sees."""
BANDS, REALTIME = "bands", "realtime"
USUAL_BANDS: dict[Mode, int] = {m.mode: m.usual_bands for m in DRAWN}
"""Bands of each mode where the settings leave their number open."""
PROGRESS = ("text", "openjd")
EQUAL, OPTIMISED = "equal", "optimised"
SOLVED, CLOSED_FORM = "solved", "closed-form"
BOUNDED, EXACT = "bounded", "exact"
DEFAULT_PHASE = "mixture"
CONSTITUENTS = "constituents"
_AMOUNTS = ("chlorophyll", "cdom", "minerals", "detritus")
NO_FLOOR = 0.0
_RANGE = ("range_start", "range_end")
_SPAN = re.compile(r"(-?\d+)(?:-(-?\d+))?")
_BELOW_ZERO = re.compile(r"-\d")
_OUT = Path("bands")
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
    if name in _RANGE:
        return "--range"
    if name in _SHORT:
        return _SHORT[name]
    return f"--{name.replace('_', '-')}"


@dataclass(frozen=True)
class Quality:
    """How a quality is rendered, one of :data:`METHODS`, and the mean ΔE2000 that Auto aims at."""

    method: str
    target: float


QUALITIES = {
    "draft": Quality("realtime", 4.0),
    "preview": Quality("realtime", 2.0),
    "final": Quality("bands", 1.0),
    "reference": Quality("reference", 0.5),
}


@dataclass(frozen=True)
class AutoRequest:
    """What is to be chosen automatically.

    ``target`` is a mean ΔE2000, ``budget`` CPU time in s, or None; settings
    in ``keep`` were given and stay.
    """

    target: float
    budget: float | None
    explain: bool
    keep: frozenset[str]


@dataclass(frozen=True)
class Job:
    """What a batch renders besides the scene's settings.

    ``cameras`` are those of a job of several, else ``camera`` is the one, None for the
    scene's. ``froxels`` are the steps of the shafts' volume, None for the usual ones;
    ``decisions`` the lines that explain what was chosen automatically. ``device`` is None for
    the scene's; ``parts`` are renders of a pass with other seeds, whose mean it is; ``stage``
    is what is added to the scene.
    """

    blend: Path | None
    engine: Engine
    mode: Mode
    frames: tuple[int, ...]
    camera: str | None
    resolution: tuple[int, int] | None
    seed: int
    out: Path
    resume: bool
    denoise: bool
    froxels: int | None = None
    decisions: tuple[str, ...] = ()
    cameras: tuple[str, ...] = ()
    device: Device | None = None
    parts: int = 1
    stage: Stage | None = None


@dataclass(frozen=True)
class SplitRequest:
    """What to do with a manifest, instead of planning, rendering and developing in one go.

    ``plan`` is where to write one, ``bundle`` the folder of a job for a farm; ``work``,
    ``develop`` and ``status`` name one to read.
    ``passes``, ``frames`` and ``cameras`` are the part of the job that is meant, empty for all;
    ``out`` is the folder of the results, if it is not the manifest's; ``path_mapping`` a file of
    rules by which files lie elsewhere.
    """

    plan: Path | None = None
    bundle: Path | None = None
    work: Path | None = None
    develop: Path | None = None
    status: Path | None = None
    json: bool = False
    passes: tuple[int, ...] = ()
    frames: tuple[int, ...] = ()
    cameras: tuple[str, ...] = ()
    out: Path | None = None
    path_mapping: Path | None = None


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message}; see --help")


def parser(program: str | None = None) -> argparse.ArgumentParser:
    """Return the command line of a batch; ``program`` is its name in the help."""
    result = _Parser(
        prog=program,
        description="Render the spectral bands of an underwater scene and develop them.",
        argument_default=argparse.SUPPRESS,
        allow_abbrev=False,
    )
    result.add_argument(
        "blend", nargs="?", type=Path, default=None, help="scene, unless Blender has one open"
    )
    result.add_argument(
        "--engine", choices=("cycles", "eevee"), help="default: that of --quality, else cycles"
    )
    result.add_argument(
        "--mode",
        choices=(BANDS, REALTIME),
        help="eevee: three bands a pass, or all bands in one pass and no spectra",
    )
    result.add_argument(
        "--quality",
        choices=tuple(QUALITIES),
        help="choose engine, bands and terms by what the scene requires; "
        + ", ".join(f"{name}: ΔE {q.target:g}" for name, q in QUALITIES.items())
        + "; other options win",
    )
    result.add_argument(
        "--target-delta-e",
        type=float,
        metavar="X",
        help="choose so that the mean ΔE2000 against everything in many bands stays below X; "
        "objects, floor and open water count equally",
    )
    result.add_argument(
        "--time-budget",
        type=float,
        metavar="S",
        help="stay within S seconds of CPU time, by a measured table, even if ΔE suffers",
    )
    result.add_argument(
        "--explain", action="store_true", default=False, help="print what was chosen and why"
    )
    for setting in fields(SceneSettings):
        if setting.name in _RANGE:
            continue
        text = setting.metadata["help"].replace("%", "%%")
        if isinstance(setting.default, bool):
            result.add_argument(
                flag(setting.name), action=argparse.BooleanOptionalAction, help=text
            )
        else:
            result.add_argument(
                flag(setting.name),
                dest=setting.name,
                type=type(setting.default),
                choices=setting.metadata["choices"] or None,
                help=text,
            )
    result.add_argument("--range", nargs=2, type=float, metavar=("START", "END"), help="nm")
    result.add_argument("--frames", default="", help="e.g. 1-24 or 1,5,9; default: current frame")
    cameras = result.add_mutually_exclusive_group()
    cameras.add_argument("--camera", default=None, help="name; default: the scene's camera")
    cameras.add_argument(
        "--cameras",
        default="",
        metavar="A,B",
        help="several, which share bands and exposure; each gets a folder in --out",
    )
    result.add_argument("--resolution", nargs=2, type=int, default=None, metavar=("W", "H"))
    result.add_argument("--seed", type=int, default=0)
    result.add_argument("--out", type=Path, default=None, metavar="DIR", help="default: bands")
    result.add_argument("--resume", action="store_true", default=False)
    result.add_argument(
        "--denoise", action="store_true", default=False, help="shifts dark bands by a few percent"
    )
    result.add_argument(
        "--device",
        choices=get_args(Device),
        default=None,
        help="what Cycles renders on; default: the scene's, which is the cpu unless it was changed",
    )
    result.add_argument(
        "--parts",
        type=int,
        default=1,
        metavar="N",
        help="cycles: render each pass N times with a share of the samples, rounded up, and "
        "another seed; their mean is the pass, and the record holds their variance",
    )
    split = result.add_argument_group("splitting a job over processes and machines")
    steps = split.add_mutually_exclusive_group()
    steps.add_argument(
        "--plan", type=Path, default=None, metavar="FILE",
        help="decide everything and write it into a manifest; render nothing",
    )  # fmt: skip
    steps.add_argument(
        "--from", type=Path, default=None, dest="manifest", metavar="FILE",
        help="render the passes of a manifest that are not done; nothing else is decided",
    )  # fmt: skip
    steps.add_argument(
        "--bundle", type=Path, default=None, metavar="DIR",
        help="decide everything and write a job for a render farm; render nothing",
    )  # fmt: skip
    steps.add_argument(
        "--status", type=Path, default=None, metavar="FILE",
        help="say what of a manifest is done, broken and missing",
    )  # fmt: skip
    split.add_argument("--passes", default="", help="with --from: these, counted from 0, e.g. 0-3")
    split.add_argument(
        "--develop", action="store_true", default=False,
        help="with --from: make pictures, spectra and records of the finished passes",
    )  # fmt: skip
    split.add_argument(
        "--path-mapping", type=Path, default=None, metavar="FILE",
        help="with --from: rules of Open Job Description, by which files lie elsewhere here",
    )  # fmt: skip
    split.add_argument("--json", action="store_true", default=False, help="with --status")
    split.add_argument(
        "--progress", choices=PROGRESS, default=PROGRESS[0],
        help="openjd: also print lines that Open Job Description reads",
    )  # fmt: skip
    sets = result.add_argument_group("data sets")
    sets.add_argument(
        "--dataset", type=Path, default=None, metavar="SPEC",
        help="plan, render and export the views of a specification (TOML) into --out; again with "
        "the same goes on",
    )  # fmt: skip
    sets.add_argument(
        "--dataset-plan", action="store_true", default=False,
        help="with --dataset: only plan; --from OUT/dataset.json renders",
    )  # fmt: skip
    sets.add_argument(
        "--dataset-export", type=Path, default=None, metavar="DIR",
        help="develop what is rendered of a data set and write its files",
    )  # fmt: skip
    result.add_argument("--list-sensors", action="store_true", default=False)
    result.add_argument("--list-waters", action="store_true", default=False)
    return result


def parse_numbers(text: str, option: str = "--frames") -> tuple[int, ...]:
    """Read a list of frames or passes.

    Examples
    --------
    >>> parse_numbers("1-3,8")
    (1, 2, 3, 8)
    >>> parse_numbers("-5--3")
    (-5, -4, -3)
    """
    numbers: list[int] = []
    for part in filter(None, (p.strip() for p in text.split(","))):
        found = _SPAN.fullmatch(part)
        if found is None:
            raise InputError(f"{option}: {part!r} is not a number or a range like 1-24")
        start = int(found[1])
        end = int(found[2] or start)
        if end < start:
            raise InputError(f"{option}: {part!r} runs backwards")
        numbers.extend(range(start, end + 1))
    return tuple(dict.fromkeys(numbers))


def merge(stored: SceneSettings, options: argparse.Namespace) -> SceneSettings:
    """Return the stored settings, overridden by the options that were given."""
    given = vars(options)
    values = {name: given.get(name, value) for name, value in asdict(stored).items()}
    if "range" in given:
        values["range_start"], values["range_end"] = given["range"]
    if "bands" in given and "wavelengths" not in given:
        values["wavelengths"] = ""
    if given.get("second_water_share") and not values["second_water"]:
        raise InputError("--second-water-share needs a --second-water to mix in")
    amounts = [flag(name) for name in _AMOUNTS if name in given]
    if amounts and values["water"] != CONSTITUENTS:
        raise InputError(f"{amounts[0]} needs --water {CONSTITUENTS}, not {values['water']!r}")
    return SceneSettings(**values)


def job(options: argparse.Namespace) -> Job:
    """Return the job that the options describe."""
    quality = getattr(options, "quality", None)
    usual = METHODS[QUALITIES[quality].method if quality else "reference"]
    engine: Engine = getattr(options, "engine", usual.engine)
    # A method's mode belongs to its engine.
    mode: Mode = getattr(options, "mode", usual.mode if engine == usual.engine else BANDS)
    drawn = any(method.engine == engine for method in DRAWN)
    if not drawn and (mode == REALTIME or getattr(options, "shafts", False)):
        raise InputError("--mode realtime and --shafts need --engine eevee")
    if options.parts < 1:
        raise InputError(f"--parts: {options.parts} is not 1 or more")
    return Job(
        blend=options.blend,
        engine=engine,
        mode=mode,
        frames=parse_numbers(options.frames),
        camera=options.camera,
        resolution=tuple(options.resolution) if options.resolution else None,
        seed=options.seed,
        out=options.out or _OUT,
        resume=options.resume,
        denoise=options.denoise,
        cameras=_names(options.cameras),
        device=options.device,
        parts=options.parts,
    )


def split(options: argparse.Namespace) -> SplitRequest | None:
    """Return what the options ask for with a manifest; None if nothing.

    Raises
    ------
    InputError
        If an option is given without the one that it belongs to.
    """
    source = options.manifest
    for name, needed, there in (
        ("--passes", "--from", not options.passes or source),
        ("--develop", "--from", not options.develop or source),
        ("--path-mapping", "--from", not options.path_mapping or source),
        ("--json", "--status", not options.json or options.status),
    ):
        if not there:
            raise InputError(f"{name} needs {needed} and a manifest")
    planned = options.plan or options.bundle
    if planned is None and source is None and options.status is None:
        return None
    if planned is None:
        decided = ("engine", "mode", "quality", "target_delta_e", "time_budget", "range")
        settled = [flag(s.name) for s in fields(SceneSettings) if s.name in vars(options)]
        settled += [flag(name) for name in decided if name in vars(options)]
        others = ("seed", "denoise", "resolution", "device", "parts", "resume")
        usual = vars(parser().parse_args([]))
        settled += [flag(name) for name in others if getattr(options, name) != usual[name]]
        if settled:
            raise InputError(
                f"{', '.join(settled)}: the manifest decides; plan again with other options"
            )
    return SplitRequest(
        plan=options.plan,
        bundle=options.bundle,
        path_mapping=options.path_mapping,
        work=None if options.develop else source,
        develop=source if options.develop else None,
        status=options.status,
        json=options.json,
        passes=parse_numbers(options.passes, "--passes"),
        frames=parse_numbers(options.frames),
        cameras=_names(options.cameras) or _names(options.camera or ""),
        out=options.out,
    )


def _names(text: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(filter(None, (name.strip() for name in text.split(",")))))


def auto(options: argparse.Namespace) -> AutoRequest | None:
    """Return what the options leave to be chosen; None if nothing.

    Raises
    ------
    InputError
        If there is something to explain but nothing to choose, or a number is not positive.
    """
    given = vars(options)
    quality, budget = given.get("quality"), given.get("time_budget")
    target = given.get("target_delta_e")
    for name, value in (("--target-delta-e", target), ("--time-budget", budget)):
        if value is not None and not 0 < value < float("inf"):
            raise InputError(f"{name}: {value:g} is not a positive number")
    if quality is None and budget is None and target is None:
        if options.explain:
            raise InputError("--explain needs --quality, --target-delta-e or --time-budget")
        return None
    if target is None:
        target = QUALITIES[quality or "final"].target
    keep = {name for name in (*(s.name for s in fields(SceneSettings)), "range") if name in given}
    return AutoRequest(target, budget, options.explain, frozenset(keep))


def parse(arguments: Sequence[str], program: str | None = None) -> argparse.Namespace:
    """Parse a command line.

    Raises
    ------
    InputError
        If an option is unknown or has a value that is not acceptable.
    """
    whole: list[str] = []
    for argument in arguments:
        # argparse would take frames below 0 for an option.
        if whole and whole[-1] == "--frames" and _BELOW_ZERO.match(argument):
            whole[-1] += f"={argument}"
        else:
            whole.append(argument)
    return parser(program).parse_args(whole)
