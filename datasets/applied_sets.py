"""Water applied to a set of pictures with depth on disk."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.errors import InputError
from ..uw_spectral.imaging.layer_sums import transmittance_ratio
from ..uw_spectral.imaging.layers import layer
from ..uw_spectral.imaging.ray_tables import SeenComponents
from ..uw_spectral.spectra.spectral_image import write_codes, write_jpeg, write_rgb_exr
from .applied_pictures import AppliedSettings, PictureFilter
from .camera import PinholeCamera
from .depth_maps import planar_depth
from .files import make_folder, write_json
from .layer_file import SENSOR, FrameLayers, LayerImage, write_layers
from .picture_codes import read_rgb, srgb_codes
from .rgbd_layouts import LAYOUTS, Intrinsics, RgbdPair, at_size, camera_from, read_depth
from .truth import write_truth

FILES = ("png", "jpg", "exr")
STAMP = "apply.json"
_LAYERS = ("I", "J", "D", "B", "F", "T", "range", "planar_depth")


@dataclass(frozen=True)
class SetSettings:
    """How a set on disk is read and written."""

    layout: str = "plain"
    scale: float | None = None  #: Codes of depth in a metre; that of the layout by default.
    ranges: bool = False  #: Whether depth is Euclidean range, not planar.
    #: Of all pictures, instead of those of the layout; or the horizontal field of view, degrees.
    intrinsics: Intrinsics | None = None
    field_of_view: float | None = None
    file: str = "png"  #: One of :data:`FILES`.
    truth: bool = False  #: Whether layers and image-formation truth are written beside.


def apply_to_set(
    pairs: Sequence[RgbdPair],
    folder: Path,
    settings: AppliedSettings,
    of_set: SetSettings = SetSettings(),
    progress: Callable[[str], None] = lambda _: None,
) -> int:
    """Write pictures with water into a folder, those that are not there; return how many.

    Each appears whole, after its layers and truth. ``progress`` is told each name. Raises
    InputError if a file cannot be used, or the folder has pictures of other settings.
    """
    stamp = {name: repr(value) for name, value in {**vars(settings), **vars(of_set)}.items()}
    _check_stamp(folder, stamp)
    water: PictureFilter | None = None
    done = 0
    for pair in pairs:
        target = folder / "images" / f"{pair.name}.{of_set.file}"
        if target.exists():
            continue
        water = water or PictureFilter(settings)
        colours, P, camera = _read(water, pair, of_set)
        if not target.parent.is_dir():  # nothing was wrong so far
            write_json(make_folder(folder) / STAMP, stamp)
            make_folder(target.parent)
        parts = None
        if of_set.truth:
            parts = water.tables(camera).components(colours, P, blur=settings.blur)
            _write_truth(water, pair.name, parts, P, camera, folder)
        seed = int.from_bytes(hashlib.sha256(pair.name.encode()).digest()[:4], "big")
        write_picture(target, water.developed(colours, P, camera, seed, parts))
        done += 1
        progress(pair.name)
    return done


def _check_stamp(folder: Path, wanted: dict[str, str]) -> None:
    """Refuse a folder with pictures of other settings."""
    if not (folder / "images").is_dir():
        return
    path = folder / STAMP
    try:
        there = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"cannot read {path}: {error}; take another folder") from error
    other = [name for name, value in wanted.items() if there.get(name) != value]
    if other:
        raise InputError(
            f"{folder} has pictures of other settings ({', '.join(other)}); take another folder, "
            "or the same settings"
        )


def _read(
    water: PictureFilter, pair: RgbdPair, of_set: SetSettings
) -> tuple[NDArray[np.float32], NDArray[np.float32], PinholeCamera]:
    """Reflectances and distances of a pair, and the camera that took it."""
    rgb = read_rgb(pair.picture)
    height, width = rgb.shape[:2]
    camera, layout = camera_of(pair, width, height, of_set), LAYOUTS[of_set.layout]
    depth, ranges = read_depth(pair.depth, of_set.scale, layout.scale, ranges=of_set.ranges)
    if layout.resampled and depth.shape != (height, width):
        depth = at_size(depth, height, width)
    colours = water.colours(rgb, str(pair.picture))
    return colours, water.distances(depth, camera, str(pair.depth), ranges=ranges), camera


def camera_of(pair: RgbdPair, width: int, height: int, of_set: SetSettings) -> PinholeCamera:
    """Return what took a pair; InputError if that is not known."""
    if of_set.field_of_view is not None:
        return PinholeCamera.from_field_of_view(width, height, of_set.field_of_view)
    if of_set.intrinsics is not None:
        return camera_from(of_set.intrinsics, width, height)
    if pair.intrinsics is None:
        raise InputError(
            f"{pair.picture}: the layout {of_set.layout} does not say what took it; give the field "
            "of view (--fov DEGREES), or --intrinsics FX,FY,CX,CY in pixels"
        )
    if pair.size not in (None, (width, height)):
        raise InputError(
            f"{pair.picture} has {width} × {height} pixels, the calibration of its set is for "
            f"{pair.size}; give --intrinsics FX,FY,CX,CY of these pictures"
        )
    return camera_from(pair.intrinsics, width, height)


def _write_truth(
    water: PictureFilter,
    name: str,
    parts: SeenComponents,
    P: NDArray[np.float32],
    camera: PinholeCamera,
    folder: Path,
) -> None:
    truth = {**water.truth(camera), "view": name}
    values = {
        **{part.name: getattr(parts, part.name) for part in dataclasses.fields(parts)},
        "I": parts.D + parts.B + parts.F,
        "T": transmittance_ratio(parts.D, parts.J),
        "range": P[..., None],
        "planar_depth": planar_depth(P, camera)[..., None],
    }
    images = {}
    for known in map(layer, _LAYERS):
        channels = known.channels if known.is_map else SENSOR
        images[known.name] = LayerImage(
            values[known.name], channels, known.units, known.text, known.whole
        )
    taken = {**truth["camera"], "distortion": truth["camera"]["distortion"]["coefficients"]}
    header = {"camera": taken, "sensor": truth["sensor"]["name"],
              "bands_nm": truth["bands"]["centres_nm"]}  # fmt: skip
    write_layers(make_folder(folder / "layers") / f"{name}.exr", FrameLayers(images, header))
    write_truth(make_folder(folder / "truth") / f"{name}.json", truth)


def write_picture(path: Path, linear: NDArray[np.float32]) -> None:
    """Write linear Rec.709, (3, h, w), as its suffix says: sRGB of 8 bits, or linear EXR."""
    if path.suffix == ".exr":
        write_rgb_exr(path, np.moveaxis(linear, 0, -1))
    elif path.suffix == ".jpg":
        write_jpeg(path, np.moveaxis(linear, 0, -1))
    else:
        write_codes(path, srgb_codes(linear), {"oiio:ColorSpace": "srgb_rec709_scene"})
