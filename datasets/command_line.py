"""The command of the wheel, ``uw-spectral``."""

from __future__ import annotations

import argparse
import dataclasses
import sys
import tomllib
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path

from ..uw_spectral.errors import DataWarning, InputError
from ..uw_spectral.imaging.description import (
    BandsDescription,
    CameraDescription,
    Description,
    FloorDescription,
    SunAndSky,
    WaterDescription,
)
from ..uw_spectral.spectra.colour_rendering import WHITE_BALANCES
from .applied_pictures import FLAT, INVALID, AppliedSettings
from .applied_sets import FILES, SetSettings, apply_to_set
from .cameras_and_rigs import CameraRig, read_rig
from .fit_command import add_fit
from .rgbd_layouts import LAYOUTS, Intrinsics, find_pairs
from .tables import SpecTable

_APPLY = """put water before pictures with depth

The picture is taken for surfaces under a white light. Each is written under a temporary name and
renamed; started again, the command goes on with those that are missing."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; 0, or 2 with a message on input that cannot be used."""
    options = _parser().parse_args(arguments)
    warnings.simplefilter("ignore", DataWarning)
    try:
        options.run(options, _say)
    except InputError as error:
        sys.stderr.write(f"uw-spectral: {error}\n")
        return 2
    return 0


def _say(text: str) -> None:
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def _apply(options: argparse.Namespace, say: Callable[[str], None]) -> None:
    pairs = find_pairs(options.layout, options.pictures, options.depths)
    done = apply_to_set(pairs, options.out, _settings(options), _of_set(options), say)
    say(f"{options.out}: {len(pairs)} pictures, {done} of them new")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="uw-spectral", description="optics of natural water")
    light = argparse.ArgumentParser(add_help=False)
    add = light.add_argument
    add("--illuminant", default="d65", help="the light above the water")
    add("--sun-zenith", type=float, default=30.0, metavar="DEGREES")
    add("--floor-depth", type=float, default=float("inf"), metavar="M")
    add("--floor-reflectance", default="0.2", help="0 to 1, or file:CSV")
    pictures = argparse.ArgumentParser(add_help=False)
    add = pictures.add_argument
    add("--pitch", type=float, default=0.0, help="degrees above the horizon that the camera looks")
    add("--fov", type=float, metavar="DEGREES", help="horizontal field of view")
    add("--intrinsics", type=_intrinsics, metavar="FX,FY,CX,CY",
        help="pixels, of a first pixel whose centre is (0, 0)")  # fmt: skip
    add(
        "--scale",
        type=float,
        metavar="CODES",
        help="codes of depth in a metre; that of the layout by default",
    )
    add("--ranges", action="store_true", help="depth is Euclidean range, not along the axis")
    add("--invalid", choices=INVALID, default=INVALID[0], help="what pixels without depth are")
    add("--linear", action="store_true", help="codes are linear, not sRGB")
    add("--sun-azimuth", type=float, default=0.0, metavar="DEGREES",
        help="where its light travels to; the camera looks to 90")  # fmt: skip
    add("--white-balance", choices=WHITE_BALANCES, default="daylight")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    add_fit(commands, [light, pictures])
    command = commands.add_parser(
        "apply", help=_APPLY.splitlines()[0], description=_APPLY, parents=[light, pictures],
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    command.set_defaults(run=_apply)
    add = command.add_argument
    add("pictures", type=Path, metavar="RGB", help="a picture, a folder, or the folder of a set")
    add("depths", type=Path, metavar="DEPTH", nargs="?", help="depth of --layout plain")
    add("--out", type=Path, required=True, help="folder for images, layers and truth")
    layouts = "; ".join(f"{name}: {known.text}" for name, known in LAYOUTS.items())
    add("--layout", choices=LAYOUTS, default="plain", help=layouts)
    add("--water", default="jerlov:IB", help="as Blender's --water takes it")
    add("--camera", default="cie1931", metavar="SENSOR", help="a camera, or an observer")
    add("--camera-depth", type=float, default=5.0, metavar="M")
    add("--white", type=float, default=1.0, help="reflectance of what is white in the pictures")
    add("--bands", type=int, default=8)
    add("--exposure", type=float, metavar="STOPS", help="automatic by default")
    add("--blur", action="store_true", help="scatter light of objects forward; takes longer")
    add("--lamps", type=Path, metavar="TOML", help="a file with [[lamps]] as a [[rig]] has them")
    add("--iso", type=float, help="noise of a detector at this ISO")
    add("--truth", action="store_true", help="layers and image-formation truth beside")
    add("--file", choices=FILES, default="png")
    return parser


def _intrinsics(text: str) -> Intrinsics:
    try:
        fx, fy, cx, cy = map(float, text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"{text!r}: give four numbers in pixels, such as 525,525,319.5,239.5"
        ) from None
    return fx, fy, cx, cy


def _settings(options: argparse.Namespace) -> AppliedSettings:
    description = Description(
        WaterDescription(options.water),
        SunAndSky(options.illuminant, options.sun_zenith, options.sun_azimuth),
        FLAT,
        FloorDescription(options.floor_depth, options.floor_reflectance),
        CameraDescription(options.camera, options.white_balance, options.exposure),
        BandsDescription(options.bands),
    )
    return AppliedSettings(
        description, options.camera_depth, options.pitch, options.white, options.linear,
        options.invalid, options.blur, _rig(options.lamps), options.iso,
    )  # fmt: skip


def _rig(path: Path | None) -> CameraRig | None:
    if path is None:
        return None
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"cannot read {path}: {error}; give a file with [[lamps]]") from error
    rig = read_rig(SpecTable({"name": path.stem, **content}, str(path)), path.parent)
    if not rig.lamps:
        raise InputError(f"{path} has no [[lamps]]; write one, or leave --lamps out")
    return dataclasses.replace(rig, name=path.stem)


def _of_set(options: argparse.Namespace) -> SetSettings:
    if options.scale is not None and not options.scale > 0:
        raise InputError(f"--scale {options.scale:g}: give the codes in a metre, above 0")
    return SetSettings(
        options.layout, options.scale, options.ranges, options.intrinsics, options.fov,
        options.file, options.truth,
    )  # fmt: skip
