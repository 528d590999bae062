"""The specification of a data set: a TOML file, read and checked.

Lists are crossed with each other: every water with every sun, camera, pose. A range without
steps is drawn once for each pose, so that all waters and cameras show it alike.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.illuminant import parse_illuminant
from ..uw_spectral.spectra.sensor import parse_sensor
from ..uw_spectral.transfer.sky import SKIES
from ..uw_spectral.transfer.water_column import SURFACES
from ..uw_spectral.water.named import parse_water
from ..uw_spectral.water.optical_properties import DEFAULT_SOURCE, JERLOV_SOURCES
from .cameras_and_rigs import CameraRig, DataSetCamera, read_camera, read_rig
from .formats import FORMATS
from .outputs import Outputs, RawOutputs, read_outputs, read_raw, read_render
from .pairs import UNATTENUATED
from .pose_sets import PoseSet, RandomPoses, read_pose_set
from .quantities import LARGEST_SEED, Quantity
from .tables import SpecTable, in_folder
from .view import AIR, SPLITS

CONSTITUENTS = "constituents"
AMOUNTS = ("chlorophyll", "cdom", "minerals", "detritus")
MOST_VIEWS = 100_000
_SPLIT_FRACTIONS = (0.8, 0.1, 0.1)
_FACTORS = ("absorption_factor", "scattering_factor")


@dataclass(frozen=True)
class DataSetSpec:
    """A data set, specified."""

    title: str
    licence: str
    seed: int  #: Of all that is drawn.
    #: By the names of the settings of a scene; what is not named is left to the scene.
    settings: Mapping[str, Quantity]
    lowered: Quantity  #: Metres that the scene and its cameras are lowered by.
    cameras: tuple[DataSetCamera, ...]
    poses: tuple[PoseSet, ...]
    rigs: tuple[CameraRig, ...]
    repeats: int  #: Pictures of a view that differ by their noise.
    fractions: tuple[float, ...]  #: Of train, val and test.
    most: int  #: Views that are not exceeded by mistake.
    scene: Path | None = None
    frame: int | None = None  #: At which the scene's animation is held; its current one by default.
    render: tuple[str, ...] = ()  #: Options of the render, as on the command line.
    outputs: Outputs = field(default_factory=Outputs)
    raw: RawOutputs | None = None  #: The detector, if there are raw pictures.


def read_spec(path: Path) -> DataSetSpec:
    """Read a specification; files that it names are sought from its folder.

    Raises InputError if it cannot be read, is not TOML, or holds what is unknown, empty or out of
    its domain; the message names the place and what to do.
    """
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}; check the path") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path} is not TOML: {error}; correct it there") from error
    try:
        return parse_spec(content, path.absolute().parent)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def parse_spec(content: Mapping[str, object], folder: Path) -> DataSetSpec:
    """Return the specification of what tomllib has read; files are sought from ``folder``.

    Raises InputError as :func:`read_spec` does.
    """
    top = SpecTable(dict(content), "")
    settings = {
        **_water(top.table("water"), folder),
        **_sun(top.table("sun"), folder),
        **_sea(top.table("sea")),
    }
    scene = top.table("scene")
    lowered = scene.quantity("depth", 0.0)
    blend = folder / scene.text("file") if "file" in scene else None
    frame = scene.whole("frame") if "frame" in scene else None
    scene.close()
    if any(isinstance(v, str) or v < 0 for v in (*lowered.values, *(lowered.drawn or ()))):
        raise InputError("scene.depth: a scene is lowered by 0 m or more")
    cameras = tuple(read_camera(table, folder) for table in top.tables("camera"))
    poses = tuple(read_pose_set(table, folder) for table in top.tables("poses"))
    rigs = tuple(read_rig(table, folder) for table in top.tables("rig")) or (CameraRig("none", ()),)
    for key, found in (("camera", cameras), ("poses", poses)):
        if not found:
            raise InputError(f"[[{key}]] is missing; a data set needs one at least")
    for key, found in (("camera", cameras), ("poses", poses), ("rig", rigs)):
        names = [item.name for item in found]
        twice = {name for name in names if names.count(name) > 1}
        if twice:
            raise InputError(f"[[{key}]]: two are named {min(twice)!r}; name one anew")
    spec = DataSetSpec(
        top.text("title"),
        top.text("licence"),
        _seed(top),
        MappingProxyType(settings),
        lowered,
        cameras,
        poses,
        rigs,
        top.whole("repeats", 1, least=1),
        _fractions(top.table("splits")),
        top.whole("most_views", MOST_VIEWS, least=1),
        blend,
        frame,
        read_render(top.table("render")),
        read_outputs(top.table("output")),
        read_raw(top.table("detector") if "detector" in top else None),
    )
    top.close()
    _require_mosaic(spec)
    _require_formats(spec)
    return spec


def _require_mosaic(spec: DataSetSpec) -> None:
    """Refuse a mosaic of what has none."""
    if spec.raw is None or spec.raw.pattern is None:
        return
    for camera in spec.cameras:
        sensor = parse_sensor(camera.sensor)
        if sensor.kind != "camera":
            raise InputError(
                f"camera {camera.name!r}: the {sensor.kind} {sensor.name} has no mosaic "
                f"{spec.raw.pattern}, and so no raw picture with one; give the camera a sensor "
                "such as 'Nikon D7000' (--list-sensors), or leave out detector.pattern"
            )


def _require_formats(spec: DataSetSpec) -> None:
    """Refuse formats that the views cannot fill, before anything is rendered."""
    waters = spec.settings["water"].values
    for name in spec.outputs.formats:
        needed = FORMATS[name]
        where = f"output.formats: {name!r}"
        if needed.way and all(isinstance(poses, RandomPoses) for poses in spec.poses):
            raise InputError(
                f"{where} needs poses that follow each other, and [[poses]] are random; add an "
                "orbit, a transect, a camera or a file, or leave the format out"
            )
        if needed.way and spec.lowered.drawn:
            raise InputError(
                f"{where} needs ways, and scene.depth is drawn for each pose of them anew; give a "
                "depth or a list, or leave the format out"
            )
        if needed.side_by_side and not _side_by_side(spec.cameras):
            raise InputError(
                f"{where} takes one [[camera]], or two of the same picture and lens whose offset "
                f"differs to the right alone, not {', '.join(x.name for x in spec.cameras)}; leave "
                "out cameras, or the format"
            )
        for camera in spec.cameras:
            needed.require_lens(name, camera.name, camera.coefficients)
        if UNATTENUATED in needed.layers and set(waters) <= {AIR}:
            raise InputError(f"{where} needs a water; name one in water.name")
        if needed.dry and not {AIR} < set(waters):
            raise InputError(f"{where} needs a water, and {AIR!r} beside it in water.name")


def _side_by_side(cameras: Sequence[DataSetCamera]) -> bool:
    """Whether there is one camera, or two as of a rectified pair."""
    if len(cameras) == 1:
        return True
    if len(cameras) > 2 or cameras[0].optics != cameras[1].optics:
        return False
    (x, *others), (also_x, *also_others) = (camera.offset for camera in cameras)
    return x != also_x and others == also_others


def _water(table: SpecTable, folder: Path) -> dict[str, Quantity]:
    names = table.quantity("name", text=True)
    source = table.quantity("source", DEFAULT_SOURCE, known=JERLOV_SOURCES)
    placed = []
    for name in map(str, names.values):
        found = in_folder(name, folder)
        if name not in (AIR, CONSTITUENTS):
            for text in source.values:
                try:
                    parse_water(found, str(text))
                except InputError as error:
                    raise InputError(f"{table.place('name')}: {error}") from error
        placed.append(found)
    settings = {"water": Quantity(tuple(placed)), "water_source": source}
    for key in (*AMOUNTS, *_FACTORS):
        if key in table:
            if key in AMOUNTS and CONSTITUENTS not in names.values:
                raise InputError(
                    f"{table.place(key)} is only for name = {CONSTITUENTS!r}; add it to the names"
                )
            settings[key] = _positive(table, key)
    table.close()
    return settings


def _sun(table: SpecTable, folder: Path) -> dict[str, Quantity]:
    settings = {}
    if "zenith" in table:
        zenith = settings["sun_zenith"] = table.quantity("zenith")
        if not all(0 <= float(v) < 90 for v in (*zenith.values, *(zenith.drawn or ()))):
            raise InputError(f"{table.place('zenith')}: the sun is 0 to 89.9° from the zenith")
    if "azimuth" in table:
        settings["sun_azimuth"] = table.quantity("azimuth")
    if "sky" in table:
        settings["sky"] = table.quantity("sky", known=SKIES)
    if "sky_radiance" in table:
        settings["sky_radiance"] = _positive(table, "sky_radiance")
    if "illuminant" in table:
        given = table.quantity("illuminant", text=True)
        placed = tuple(in_folder(str(text), folder) for text in given.values)
        for text in placed:
            parse_illuminant(text)
        settings["illuminant"] = Quantity(placed)
    table.close()
    return settings


def _sea(table: SpecTable) -> dict[str, Quantity]:
    settings = {}
    if "surface" in table:
        settings["surface"] = table.quantity("surface", known=SURFACES)
    for key, name in (("wind", "wind_speed"), ("fetch", "fetch"), ("seed", "wave_seed")):
        if key in table:
            settings[name] = _positive(table, key)
    if "wind_direction" in table:
        settings["wind_direction"] = table.quantity("wind_direction")
    if "wave_seed" in settings:
        seeds = settings["wave_seed"]
        if seeds.drawn or not all(float(v).is_integer() for v in seeds.values):
            raise InputError(f"{table.place('seed')}: seeds are a list of whole numbers")
        settings["wave_seed"] = Quantity(tuple(int(v) for v in seeds.values))
    table.close()
    return settings


def _seed(table: SpecTable) -> int:
    seed = table.whole("seed", 0)
    if seed > LARGEST_SEED:
        raise InputError(f"{table.place('seed')}: {seed} is above {LARGEST_SEED}")
    return seed


def _fractions(table: SpecTable) -> tuple[float, ...]:
    fractions = tuple(
        table.number(split, 0.0 if any(s in table for s in SPLITS) else default)
        for split, default in zip(SPLITS, _SPLIT_FRACTIONS, strict=True)
    )
    table.close()
    if min(fractions) < 0 or abs(sum(fractions) - 1) > 1e-6:
        raise InputError(f"splits: the fractions {fractions} must not be negative and add up to 1")
    return fractions


def _positive(table: SpecTable, key: str) -> Quantity:
    found = table.quantity(key)
    if any(float(v) < 0 for v in (*found.values, *(found.drawn or ()))):
        raise InputError(f"{table.place(key)}: values are 0 or more")
    return found
