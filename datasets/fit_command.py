"""``uw-spectral fit``: the water that explains what a camera saw, in a table or a picture."""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.errors import InputError
from ..uw_spectral.imaging.description import (
    CameraDescription,
    Description,
    FloorDescription,
    SunAndSky,
)
from ..uw_spectral.imaging.optics import resolve
from ..uw_spectral.imaging.picture_cells import SeenPicture
from ..uw_spectral.imaging.picture_fit import fit_picture
from ..uw_spectral.imaging.water_fit import FITTED, FittedWater, SeenSurfaces, fit_water
from ..uw_spectral.spectra.reflectance import (
    colorchecker_reflectance,
    parse_reflectance,
    reflectance_from_csv,
)
from ..uw_spectral.spectra.spectrum import Spectrum, read_table, read_text, table_text
from ..uw_spectral.water.optical_properties import BACKSCATTER, Water
from .applied_pictures import FILL, FLAT, HEADING, known_depth, picture_rays, secant
from .applied_sets import SetSettings, camera_of
from .files import joined, write_text
from .picture_codes import linear_codes, read_rgb
from .pose_sets import heading_pose
from .rgbd_layouts import LAYOUTS, RgbdPair, read_depth

_CHANNELS = ("r", "g", "b")
_DEVIATIONS = ("sd_r", "sd_g", "sd_b")
_UNITS = {"chlorophyll": "mg/m³", "cdom": "1/m", "minerals": "g/m³"}
_OPEN_WATER = "water"
_NOISE = 2.0  # standard deviations
_FIT = """fit chlorophyll, CDOM and minerals to what a level camera saw

TABLE is a CSV with the columns reflectance (0 to 1, file:patch.csv, a ColorChecker patch, or
water for open water), distance_m, r, g, b (linear, without black level, of one exposure), and, if
they are known, the standard deviations sd_r, sd_g, sd_b.

Of a PICTURE with DEPTH, what surfaces reflect need not be known; some must be dark, at all
distances. It is linear, or sRGB codes, as the camera developed it, or its own channels (--raw)."""


def add_fit(
    commands: argparse._SubParsersAction[argparse.ArgumentParser],
    shared: list[argparse.ArgumentParser],
) -> None:
    """Add the command, with options of light and pictures that others share."""
    command = commands.add_parser(
        "fit", help=_FIT.splitlines()[0], description=_FIT, parents=shared,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    add = command.add_argument
    add("seen", type=Path, metavar="TABLE|PICTURE")
    add("depths", type=Path, metavar="DEPTH", nargs="?", help="depth of a picture")
    add("--camera", required=True, metavar="SENSOR", help="a camera, or an observer")
    add("--depth", type=float, required=True, metavar="M", help="of camera and surfaces")
    add("--facing-up", action="store_true", help="surfaces are lit by all of Ed")
    add("--raw", action="store_true", help="a picture has the camera's own channels, linear")
    add("--mean-reflectance", metavar="0..1|FILE", help="of a picture, at all distances")
    add("--out", type=Path, metavar="CSV", help="a file of the water, for --water file:CSV")
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace, say: Callable[[str], None]) -> None:
    description = Description(
        light=SunAndSky(options.illuminant, options.sun_zenith, options.sun_azimuth),
        floor=FloorDescription(options.floor_depth, options.floor_reflectance),
        camera=CameraDescription(options.camera, options.white_balance),
    )
    if options.depths is None:
        seen = read_seen(options.seen)
        fitted = fit_water(seen, description, options.depth, facing_up=options.facing_up)
    else:
        description = dataclasses.replace(description, surface=FLAT)
        picture = read_picture(options, description)
        mean = options.mean_reflectance
        known = None if mean is None else parse_reflectance(mean)
        fitted = fit_picture(picture, description, options.depth, known)
    say(fitted.text)
    for name in FITTED:
        best, low, high = (getattr(x, name) for x in (fitted.constituents, fitted.low, fitted.high))
        say(f"{name}: {best:.3g} {_UNITS[name]}, 95 % from {low:.3g} to {high:.3g}")
    say(f"not explained: {fitted.misfit:.2g} standard deviations")
    if fitted.misfit > _NOISE:
        say("more than noise: check camera, depth, floor, gamma, clipped channels, deviations")
    if options.out is not None:
        write_text(options.out, _table(fitted))


def read_seen(path: Path) -> SeenSurfaces:
    """Read what a camera saw, as the command takes it; InputError if that cannot be used."""
    numbers = read_table(path, _CHANNELS, _DEVIATIONS).columns
    text = table_text(read_text(path), str(path))
    missing = [name for name in ("reflectance", "distance_m") if name not in text.names]
    deviations = [name for name in _DEVIATIONS if name in numbers]
    if deviations and len(deviations) < len(_DEVIATIONS):
        missing += [name for name in _DEVIATIONS if name not in numbers]
    if missing:
        raise InputError(f"{path}: column {', '.join(missing)} is missing; add or rename it")
    surfaces = []
    for line, cells in text.rows[1:]:
        row = dict(zip(text.names, cells, strict=True))
        try:
            surfaces.append(_surface(row["reflectance"], row["distance_m"], path.parent))
        except InputError as error:
            raise InputError(f"{path}, line {line}: {error}") from error
    return SeenSurfaces(
        [reflectance for reflectance, _ in surfaces],
        np.array([distance for _, distance in surfaces]),
        np.stack([numbers[name] for name in _CHANNELS], axis=1),
        np.stack([numbers[name] for name in deviations], axis=1) if deviations else None,
    )


def read_picture(options: argparse.Namespace, description: Description) -> SeenPicture:
    """Read a picture with depth as the command takes it; InputError if that cannot be used."""
    values = read_rgb(options.seen)
    of_set = SetSettings("plain", options.scale, options.ranges, options.intrinsics, options.fov)
    pair = RgbdPair(options.seen.stem, options.seen, options.depths)
    camera = camera_of(pair, values.shape[1], values.shape[0], of_set)
    depth, ranges = read_depth(
        options.depths, options.scale, LAYOUTS["plain"].scale, ranges=options.ranges
    )
    P = known_depth(depth, camera, str(options.depths))
    if not ranges:
        P = P * secant(camera)
    pose = heading_pose((0.0, 0.0, -options.depth), HEADING, options.pitch)
    return SeenPicture(
        _channels(values, options, description),
        np.where(np.isinf(P), np.nan, P) if options.invalid == FILL else P,
        picture_rays(camera, pose),
    )


def _channels(
    values: NDArray[Any], options: argparse.Namespace, description: Description
) -> NDArray[np.float64]:
    """Channels of the camera, NaN where one is clipped, (h, w, 3)."""
    found = np.asarray(values, np.float64)
    if not np.issubdtype(values.dtype, np.floating):
        linear = linear_codes(values.dtype, linear=options.linear or options.raw)
        clipped = (values == 0) | (values == np.iinfo(values.dtype).max)
        found = np.where(clipped, np.nan, linear[values])
    if options.raw:
        return found
    if options.white_balance == "depth":
        raise InputError("fit: white balance depth hangs on the water; give raw channels (--raw)")
    matrix = resolve(description).viewpoint(options.depth, stops=0.0).reduction.matrix
    return found @ np.linalg.inv(matrix).T


def _surface(reflectance: str, distance: str, folder: Path) -> tuple[Spectrum | float, float]:
    if reflectance == _OPEN_WATER:
        return 0.0, float("inf")
    try:
        away = float(distance)
    except ValueError:
        raise InputError(f"distance_m {distance!r} is not a number; correct that cell") from None
    if reflectance.startswith("file:"):
        return reflectance_from_csv(joined(reflectance.removeprefix("file:"), folder)), away
    if reflectance[:1].isalpha():
        return colorchecker_reflectance(reflectance), away
    return parse_reflectance(reflectance), away


def _table(fitted: FittedWater) -> str:
    water: Water = fitted.constituents.water()
    comments = [f"fitted to pictures: {fitted.text}"]
    if water.particle_backscatter is not None:
        comments.append(f"{BACKSCATTER}: {water.particle_backscatter:.6g}")
    wavelengths = water.absorption.wavelengths
    rows = zip(wavelengths, water.absorption.values, water.b(wavelengths), strict=True)
    lines = [f"{nm:g},{a:.6g},{b:.6g}" for nm, a, b in rows]
    return "\n".join([*(f"# {x}" for x in comments), "wavelength_nm,a,b", *lines, ""])
