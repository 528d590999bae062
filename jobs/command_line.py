"""The command line of a batch: options, and what they ask for."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, NoReturn, get_args

import bpy

from ..datasets.quantities import LARGEST_SEED
from ..quality.methods import DRAWN, METHODS, QUALITIES, Device, Engine, Mode
from ..scene import stored_settings
from ..scene.readers.picture_size import check_resolution
from ..scene.scripts import TRUST
from ..settings.scene_settings import BANDS, RANGE, REALTIME, SETTINGS, SceneSettings, flag
from ..settings.setting import FORMER_NAMES, SECTIONS, Setting
from ..settings.water_settings import CONSTITUENTS
from ..uw_spectral.errors import InputError
from .job import AutoRequest, Job, SplitRequest
from .manifest import CHANGEABLE

PROGRESS = ("text", "openjd")
_AMOUNTS = tuple(name for name, setting in SETTINGS.items() if "water" in setting.needs)
_SPAN = re.compile(r"(-?\d+)(?:-(-?\d+)(?::(\d+))?)?")
_MOST_FRAMES = 1048574  # Blender's last
_BELOW_ZERO = re.compile(r"-\d")
_OUT = Path("bands")
_METAVARS = {str: "TEXT", int: "N", float: "X"}


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message}; see --help")


def parser(program: str | None = None) -> argparse.ArgumentParser:
    """Return the command line of a batch; ``program`` is its name in the help."""
    result = _Parser(
        prog=program,
        usage="%(prog)s [SCENE.blend] [options]",
        description="Render the spectral bands of an underwater scene and develop them.",
        argument_default=argparse.SUPPRESS,
        allow_abbrev=False,
    )
    result.add_argument(
        "blend", nargs="?", type=_path, default=None, help="scene, unless Blender has one open"
    )
    _add_decisions(result)
    for name, section in SECTIONS.items():
        _add_settings(result.add_argument_group(section.title, section.text), name)
    _add_work(result)
    # Of scripts from when there was another.
    result.add_argument("--field", choices=["solved"], help=argparse.SUPPRESS)
    _add_splitting(result)
    _add_data_sets(result)
    result.add_argument("--list-sensors", action="store_true", default=False)
    result.add_argument("--list-waters", action="store_true", default=False)
    return result


def _add_decisions(result: argparse.ArgumentParser) -> None:
    """Add what decides how it is rendered."""
    group = result.add_argument_group("What decides", "How it is rendered, and how well")
    group.add_argument(
        "--engine", choices=("cycles", "eevee"), help="default: that of --quality, else cycles"
    )
    group.add_argument(
        "--mode", choices=(BANDS, REALTIME),
        help="eevee: three bands a pass, or all bands in one pass and no spectra",
    )  # fmt: skip
    group.add_argument(
        "--quality", choices=tuple(QUALITIES),
        help="choose engine, bands and terms by what the scene requires; "
        + ", ".join(f"{name}: ΔE {q.target:g}" for name, q in QUALITIES.items())
        + "; other options win",
    )  # fmt: skip
    group.add_argument(
        "--target-delta-e", type=float, metavar="X",
        help="choose so that the mean ΔE2000 against everything in many bands stays below X; "
        "objects, floor and open water count equally",
    )  # fmt: skip
    group.add_argument(
        "--time-budget", type=float, metavar="S",
        help="stay within S seconds of CPU time, by a measured table, even if ΔE suffers",
    )  # fmt: skip
    group.add_argument(
        "--explain", action="store_true", default=False, help="print what was chosen and why"
    )


def _add_work(result: argparse.ArgumentParser) -> None:
    """Add frames and cameras."""
    group = result.add_argument_group("The job", "Frames, cameras, and how they are rendered")
    group.add_argument(
        "--frames", default="", help="e.g. 1-24, 1-99:2 or 1,5,9; default: current frame"
    )
    group.add_argument(
        "--scene", default=None, metavar="NAME", help="default: the file's active one"
    )
    cameras = group.add_mutually_exclusive_group()
    cameras.add_argument("--camera", default=None, help="name; default: the scene's camera")
    cameras.add_argument(
        "--cameras", default="", metavar="A,B",
        help="several, which share bands and exposure; each gets a folder in --out",
    )  # fmt: skip
    group.add_argument("--resolution", nargs=2, type=int, default=None, metavar=("W", "H"))
    group.add_argument("--seed", type=int, default=0)
    group.add_argument("--out", type=_path, default=None, metavar="DIR", help="default: bands")
    group.add_argument("--resume", action="store_true", default=False)
    group.add_argument(
        TRUST, action="store_true", default=False,
        help="let Python drivers and scripts of the scene run; for files of your own",
    )  # fmt: skip
    group.add_argument(
        "--denoise", action=argparse.BooleanOptionalAction, default=None,
        help="cycles: denoise the developed picture, never spectra and layers; default: yes, but "
        "not in data sets",
    )  # fmt: skip
    group.add_argument(
        "--device", choices=get_args(Device), default=None,
        help="what Cycles renders on; default: the scene's, which is the cpu unless it was changed",
    )  # fmt: skip
    group.add_argument(
        "--parts", type=int, default=1, metavar="N",
        help="cycles: render each pass N times with a fraction of the samples, rounded up, and "
        "another seed; their mean is the pass, and the record holds their variance",
    )  # fmt: skip


def _add_splitting(result: argparse.ArgumentParser) -> None:
    """Add what splits a job."""
    group = result.add_argument_group("Splitting a job over processes and machines")
    steps = group.add_mutually_exclusive_group()
    steps.add_argument(
        "--plan", type=_path, default=None, metavar="FILE",
        help="decide everything and write it into a manifest; render nothing",
    )  # fmt: skip
    steps.add_argument(
        "--from", type=_path, default=None, dest="manifest", metavar="FILE",
        help="render the passes of a manifest that are not done; nothing else is decided",
    )  # fmt: skip
    steps.add_argument(
        "--bundle", type=_path, default=None, metavar="DIR",
        help="decide everything and write a job for a render farm; render nothing",
    )  # fmt: skip
    steps.add_argument(
        "--status", type=_path, default=None, metavar="FILE",
        help="say what of a manifest is done, broken and missing",
    )  # fmt: skip
    group.add_argument("--passes", default="", help="with --from: these, counted from 0, e.g. 0-3")
    group.add_argument(
        "--develop", action="store_true", default=False,
        help="with --from: make pictures, spectra and records of the finished passes; with another "
        "--sensor, --white-balance, --exposure, --tone or --denoise into an --out of its own",
    )  # fmt: skip
    group.add_argument(
        "--path-mapping", type=_path, default=None, metavar="FILE",
        help="with --from: rules of Open Job Description, by which files lie elsewhere here",
    )  # fmt: skip
    group.add_argument("--json", action="store_true", default=False, help="with --status")
    group.add_argument(
        "--progress", choices=PROGRESS, default=PROGRESS[0],
        help="openjd: print lines that Open Job Description reads",
    )  # fmt: skip
    group.add_argument(
        "--quiet", action="store_true", default=False, help="print notes and errors only"
    )


def _add_data_sets(result: argparse.ArgumentParser) -> None:
    """Add what makes data sets."""
    group = result.add_argument_group("Data sets")
    group.add_argument(
        "--dataset", type=_path, default=None, metavar="SPEC",
        help="plan, render and export the views of a specification (TOML) into --out; again with "
        "the same goes on",
    )  # fmt: skip
    group.add_argument(
        "--dataset-plan", action="store_true", default=False,
        help="with --dataset: only plan; --from OUT/dataset.json renders",
    )  # fmt: skip
    group.add_argument(
        "--dataset-export", type=_path, default=None, metavar="DIR",
        help="develop what is rendered of a data set and write its files",
    )  # fmt: skip


def _add_settings(group: argparse._ArgumentGroup, section: str) -> None:
    """Add the options of a section."""
    for setting in SETTINGS.values():
        if setting.section != section or setting.name == RANGE[1]:
            continue
        text = _help(setting)
        if setting.name == RANGE[0]:
            group.add_argument("--range", nargs=2, type=float, metavar=("START", "END"), help=text)
            continue
        facts: dict[str, Any] = {"action": argparse.BooleanOptionalAction}
        if not isinstance(setting.default, bool):
            facts = {
                "type": type(setting.default),
                "choices": tuple(setting.choices) or None,
                "metavar": None if setting.choices else _METAVARS[type(setting.default)],
            }
        group.add_argument(flag(setting.name), dest=setting.name, help=text, **facts)
        for name in (was for was, now in FORMER_NAMES.items() if now == setting.name):
            group.add_argument(flag(name), dest=setting.name, help=argparse.SUPPRESS, **facts)


def _help(setting: Setting) -> str:
    """What a setting does, its choices, unit, limits and default."""
    name, default = setting.text, setting.default
    if setting.name == RANGE[0]:
        name, default = "Spectral range", f"{default:g} {SETTINGS[RANGE[1]].default:g}"
    parts = [f"{word}: {text}" for word, (_, text) in setting.choices.items() if text]
    facts = [setting.facts, f"{setting.engine} only" if setting.engine else ""]
    if default != "":
        facts.append(f"default {str(default).lower() if isinstance(default, bool) else default}")
    words, known = "; ".join([name, *parts]), ", ".join(filter(None, facts))
    return (f"{words} ({known})" if known else words).replace("%", "%%")


def parse_numbers(text: str, option: str = "--frames") -> tuple[int, ...]:
    """Read a list of frames or passes such as "1-3,8", "-5--3" or "1-9:4"."""
    numbers: list[int] = []
    for part in filter(None, (p.strip() for p in text.split(","))):
        found = _SPAN.fullmatch(part)
        if found is None:
            raise InputError(f"{option}: {part!r} is not a number or a range like 1-24 or 1-99:2")
        start = int(found[1])
        end, step = int(found[2] or start), int(found[3] or 1)
        if end < start:
            raise InputError(f"{option}: {part!r} runs backwards")
        if step < 1:
            raise InputError(f"{option}: the step of {part!r} is 1 or more")
        if max(-start, end) > _MOST_FRAMES:
            raise InputError(f"{option}: {part!r} goes beyond {_MOST_FRAMES}, Blender's last frame")
        numbers.extend(range(start, end + 1, step))
    if text and not numbers:
        raise InputError(f"{option}: {text!r} names none; give numbers such as 1-24")
    return tuple(dict.fromkeys(numbers))


def merge(stored: SceneSettings, options: argparse.Namespace) -> SceneSettings:
    """Return the stored settings, overridden by the options that were given."""
    given = vars(options)
    values = {name: given.get(name, value) for name, value in asdict(stored).items()}
    if "range" in given:
        values["range_start"], values["range_end"] = given["range"]
    if "bands" in given and "wavelengths" not in given:
        values["wavelengths"] = ""
    if given.get("second_water_fraction") and not values["second_water"]:
        raise InputError("--second-water-fraction needs a --second-water to mix in")
    amounts = [flag(name) for name in _AMOUNTS if name in given]
    if amounts and values["water"] != CONSTITUENTS:
        raise InputError(f"{amounts[0]} needs --water {CONSTITUENTS}, not {values['water']!r}")
    return SceneSettings(**values)


def settings_of(scene: bpy.types.Scene, options: argparse.Namespace) -> Callable[[], SceneSettings]:
    """Return what returns the settings at the current frame of a scene, with the options given."""
    return lambda: merge(stored_settings.stored_settings(scene), options)


def job(options: argparse.Namespace) -> Job:
    """Return the job that the options describe."""
    quality = getattr(options, "quality", None)
    default = METHODS[QUALITIES[quality].method if quality else "reference"]
    engine: Engine = getattr(options, "engine", default.engine)
    # A method's mode belongs to its engine.
    mode: Mode = getattr(options, "mode", default.mode if engine == default.engine else BANDS)
    drawn = any(method.engine == engine for method in DRAWN)
    if not drawn and (mode == REALTIME or getattr(options, "shafts", False)):
        raise InputError("--mode realtime and --shafts need --engine eevee")
    if options.parts < 1:
        raise InputError(f"--parts: {options.parts} is not 1 or more")
    if not 0 <= options.seed <= LARGEST_SEED:
        raise InputError(f"--seed: {options.seed} is not 0 to {LARGEST_SEED}")
    for name in ("denoise", "noise"):
        if drawn and getattr(options, name, False):
            raise InputError(f"{flag(name)}: {engine} has no such noise; leave it out")
    resolution = tuple(options.resolution) if options.resolution else None
    if resolution is not None:
        check_resolution(resolution)
    measured = options.dataset is not None
    return Job(
        blend=options.blend,
        engine=engine,
        mode=mode,
        frames=parse_numbers(options.frames),
        camera=options.camera,
        resolution=resolution,
        seed=options.seed,
        out=options.out or _OUT,
        resume=options.resume,
        denoise=not (drawn or measured) if options.denoise is None else options.denoise,
        cameras=_names(options.cameras),
        device=options.device,
        parts=options.parts,
    )


def split(options: argparse.Namespace) -> SplitRequest:
    """Return what the options ask for with a manifest; nothing, where one process does all."""
    source = options.manifest
    for name, needed, there in (
        ("--passes", "--from", not options.passes or source),
        ("--develop", "--from", not options.develop or source),
        ("--path-mapping", "--from", not options.path_mapping or source),
        ("--json", "--status", not options.json or options.status),
    ):
        if not there:
            raise InputError(f"{name} needs {needed} and a manifest")
    if source is None and options.status is None:
        return SplitRequest(plan=options.plan, bundle=options.bundle)
    decided = ("engine", "mode", "quality", "target_delta_e", "time_budget", "range")
    free = {*CHANGEABLE, "denoise"} if options.develop else set()
    settled = [flag(name) for name in SETTINGS if name in vars(options) and name not in free]
    settled += [flag(name) for name in decided if name in vars(options)]
    others = ("seed", "denoise", "resolution", "device", "parts", "resume", "scene")
    default = vars(parser().parse_args([]))
    settled += [
        flag(name)
        for name in others
        if getattr(options, name) != default[name] and name not in free
    ]
    if settled:
        raise InputError(
            f"{', '.join(settled)}: the manifest decides; plan again with other options"
        )
    changed = {n: v for n, v in vars(options).items() if options.develop and n in CHANGEABLE}
    if options.develop and options.out is None and (changed or options.denoise is not None):
        names = ", ".join(map(flag, changed or ("denoise",)))
        raise InputError(f"{names}: to develop otherwise, name an --out of its own")
    return SplitRequest(
        path_mapping=options.path_mapping,
        source=options.status or source,
        develop=options.develop,
        status=options.status is not None,
        json=options.json,
        passes=parse_numbers(options.passes, "--passes"),
        frames=parse_numbers(options.frames),
        cameras=_names(options.cameras) or _names(options.camera or ""),
        out=options.out,
        changed=changed,
        denoise=options.denoise if options.develop else None,
    )


def _names(text: str) -> tuple[str, ...]:
    found = tuple(dict.fromkeys(filter(None, (name.strip() for name in text.split(",")))))
    if text and not found:
        raise InputError(f"--cameras: {text!r} names none; give names such as Left,Right")
    return found


def _path(text: str) -> Path:
    if not text.strip() or "\0" in text:
        raise argparse.ArgumentTypeError(f"{text!r} is no path; name a file or folder")
    return Path(text)


def auto(options: argparse.Namespace) -> AutoRequest | None:
    """Return what the options leave to be chosen; None if nothing."""
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
    keep = {name for name in (*(s for s in SETTINGS), "range") if name in given}
    return AutoRequest(target, budget, options.explain, frozenset(keep))


def parse(arguments: Sequence[str], program: str | None = None) -> argparse.Namespace:
    """Parse a command line; raise InputError where it is not acceptable."""
    whole: list[str] = []
    for argument in arguments:
        # argparse would take frames below 0 for an option.
        if whole and whole[-1] == "--frames" and _BELOW_ZERO.match(argument):
            whole[-1] += f"={argument}"
        else:
            whole.append(argument)
    return parser(program).parse_args(whole)
