"""Pictures with depth that others made: where they lie, what their codes mean, what took them."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..uw_spectral.errors import InputError
from ..uw_spectral.housing import PIXEL_CENTRE
from ..uw_spectral.spectra.spectral_image import read_exr
from .axes import Array
from .camera import PinholeCamera
from .depth_maps import PLANAR, RANGE
from .picture_codes import read_codes

Intrinsics = tuple[float, float, float, float]
"""fx, fy, cx, cy in pixels; the first pixel's centre is at (0, 0), as calibrations have it."""
PICTURES = (".png", ".jpg", ".jpeg", ".ppm", ".bmp", ".tif", ".tiff", ".exr")
DEPTHS = (".png", ".exr", ".npy", ".pgm", ".tif", ".tiff")
MILLIMETRES = 1000.0
_APART = 0.02  # s between a picture and its depth
_TUM = (525.0, 525.0, 319.5, 239.5)
_TUM_SIZE = (640, 480)


@dataclass(frozen=True)
class RgbdPair:
    """A picture and its depth."""

    name: str
    picture: Path
    depth: Path
    intrinsics: Intrinsics | None = None  #: If the set has them.
    #: Width and height that they hold for, if that is known.
    size: tuple[int, int] | None = None


@dataclass(frozen=True)
class Layout:
    """How a set lies on the disk."""

    text: str
    find: Callable[[Path, Path | None], list[RgbdPair]]
    scale: float = MILLIMETRES  #: Codes of depth in a metre.
    resampled: bool = False  #: Whether depth has another size than the picture, of the same view.


def find_pairs(layout: str, pictures: Path, depths: Path | None) -> list[RgbdPair]:
    """Return the pairs of a set; InputError if there are none, or a picture has no depth."""
    found = LAYOUTS[layout].find(pictures, depths)
    if not found:
        raise InputError(f"{pictures}: no picture with depth; {layout} is {LAYOUTS[layout].text}")
    return found


def read_depth(
    path: Path, scale: float | None, of_codes: float, *, ranges: bool
) -> tuple[Array, bool]:
    """Read depth in m, not finite or 0 where there is none, and whether it is ranges.

    An EXR may say so of ``range`` or ``planar_depth``; else ``ranges`` tells. What is stored is
    divided by ``scale``, by default codes of whole numbers by ``of_codes`` and others by 1. Raises
    InputError if the file is none.
    """
    if path.suffix == ".npy":
        try:
            found = np.load(path, allow_pickle=False)
        except (OSError, ValueError) as error:
            raise InputError(f"cannot read {path}: {error}; give an array of depth") from error
        whole = np.issubdtype(found.dtype, np.integer)
        found = np.squeeze(np.asarray(found, np.float64)) / (scale or (of_codes if whole else 1.0))
        if found.ndim != 2:
            raise InputError(f"{path}: depth has one number a pixel, not shape {found.shape}")
        return found, ranges
    if path.suffix == ".exr":
        pixels, names = read_exr(path)
        kind = next((name for name in (RANGE, PLANAR) if name in names), "")
        if not kind and np.ptp(pixels, axis=-1).any():
            raise InputError(
                f"{path} has channels {', '.join(names)}; depth is one, or {RANGE} or {PLANAR}"
            )
        found = pixels[..., names.index(kind) if kind else 0].astype(np.float64)
        return found / (scale or 1.0), kind == RANGE if kind else ranges
    return read_codes(path) / (scale or of_codes), ranges


def filled(depth: Array) -> Array:
    """Give pixels without depth the mean of what is known about them, of ever larger blocks.

    Examples
    --------
    >>> filled(np.array([[2.0, np.inf], [np.inf, 2.0]])).tolist()
    [[2.0, 2.0], [2.0, 2.0]]
    """
    known = np.isfinite(depth)
    if known.all() or not known.any():
        return depth
    height, width = depth.shape
    even = [(0, height % 2), (0, width % 2)]
    count, total = (
        np.pad(x, even).reshape((height + 1) // 2, 2, (width + 1) // 2, 2).sum(axis=(1, 3))
        for x in (1.0 * known, np.where(known, depth, 0.0))
    )
    coarse = filled(np.where(count > 0, total / np.maximum(count, 1.0), np.inf))
    return np.where(known, depth, coarse.repeat(2, axis=0).repeat(2, axis=1)[:height, :width])


def at_size(depth: Array, height: int, width: int) -> Array:
    """Return depth of the same view at another size; the nearest, for edges are not mixed."""
    rows, columns = (
        ((np.arange(to) + 0.5) * (of / to)).astype(np.intp)
        for to, of in zip((height, width), depth.shape, strict=True)
    )
    return depth[rows[:, None], columns]


def camera_from(intrinsics: Intrinsics, width: int, height: int) -> PinholeCamera:
    """Return the camera of a calibration whose first pixel's centre is at (0, 0)."""
    fx, fy, cx, cy = intrinsics
    return PinholeCamera(width, height, fx, fy, cx + PIXEL_CENTRE, cy + PIXEL_CENTRE)


def _folder(path: Path, what: str) -> Path:
    if not path.is_dir():
        raise InputError(f"{path} is no folder; {what}")
    return path


def _files(folder: Path, suffixes: Sequence[str]) -> dict[str, Path]:
    """Files of a folder by their names without suffix, numbers in order."""
    found = [path for path in folder.iterdir() if path.suffix.lower() in suffixes]
    key = re.compile(r"\d+|\D+")
    found.sort(key=lambda p: [x.zfill(20) if x.isdigit() else x for x in key.findall(p.name)])
    return {path.stem: path for path in found if not path.name.startswith(".")}


def _paired(
    pictures: dict[str, Path],
    depths: dict[str, Path],
    name_of_depth: Callable[[str], str] = str,
    where: str = "",
) -> list[tuple[str, Path, Path]]:
    missing = [name for name in pictures if name_of_depth(name) not in depths]
    if missing:
        raise InputError(
            f"{len(missing)} of {len(pictures)} pictures have no depth, such as "
            f"{pictures[missing[0]]}: {where} has no file {name_of_depth(missing[0])!r}; add it, "
            "or leave the picture out"
        )
    return [(name, path, depths[name_of_depth(name)]) for name, path in pictures.items()]


def _plain(pictures: Path, depths: Path | None) -> list[RgbdPair]:
    if depths is None:
        raise InputError(f"{pictures}: name its depth, a file or a folder, too")
    if pictures.is_file():
        if not depths.is_file():
            raise InputError(f"{depths} is no file; a picture has one of depth")
        return [RgbdPair(pictures.stem, pictures, depths)]
    _folder(pictures, "give a picture, or a folder of pictures")
    found = _files(_folder(depths, "give one with a file of depth for each picture"), DEPTHS)
    return [RgbdPair(*row) for row in _paired(_files(pictures, PICTURES), found, where=str(depths))]


def _tum(root: Path, _: Path | None) -> list[RgbdPair]:
    rgb, depth = (_listed(root / f"{kind}.txt") for kind in ("rgb", "depth"))
    if not depth:
        return []
    times, found = np.array([time for time, _ in depth]), []
    for time, path in rgb:
        nearest = int(np.argmin(np.abs(times - time)))
        if abs(times[nearest] - time) <= _APART:
            item = root / path, root / depth[nearest][1]
            found.append(RgbdPair(Path(path).stem, *item, _TUM, _TUM_SIZE))
    return found


def _listed(path: Path) -> list[tuple[float, str]]:
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
        rows = [line.split() for line in lines if line.strip() and not line.startswith("#")]
        return [(float(row[0]), row[1]) for row in rows]
    except (OSError, ValueError, IndexError) as error:
        raise InputError(f"cannot read {path}: {error}; it has lines 'timestamp filename'") from (
            error
        )


def _kitti(root: Path, _: Path | None) -> list[RgbdPair]:
    """The selection of the depth benchmark, or a drive: raw pictures beside annotated depth."""
    if (root / "groundtruth_depth").is_dir():
        pictures = _files(_folder(root / "image", "it has the pictures"), PICTURES)
        depths = _files(root / "groundtruth_depth", DEPTHS)
        rows = _paired(
            pictures,
            depths,
            lambda name: name.replace("_sync_image_", "_sync_groundtruth_depth_"),
            str(root / "groundtruth_depth"),
        )
        return [
            RgbdPair(*row, _of_matrix(root / "intrinsics" / f"{row[0]}.txt", 3)) for row in rows
        ]
    found = []
    for side in ("image_02", "image_03"):
        folders = root / "proj_depth" / "groundtruth" / side, root / side / "data"
        if not all(folder.is_dir() for folder in folders):
            continue
        depths, raw = _files(folders[0], DEPTHS), _files(folders[1], PICTURES)
        # The first and last pictures of a drive have no depth.
        shared = {name: path for name, path in raw.items() if name in depths}
        size, intrinsics = _rectified(root, side[-2:]) if shared else (None, None)
        found += [
            RgbdPair(f"{side}_{name}", path, depths[name], intrinsics, size)
            for name, path in shared.items()
        ]
    return found


def _rectified(root: Path, number: str) -> tuple[tuple[int, int], Intrinsics]:
    """Size and projection of a camera of a drive, from calib_cam_to_cam.txt there or above."""
    paths = [folder / "calib_cam_to_cam.txt" for folder in (root, root.parent)]
    path = next(filter(Path.is_file, paths), paths[0])
    try:
        rows = dict(line.split(":", 1) for line in path.read_text().splitlines() if ":" in line)
        width, height = (round(float(x)) for x in rows[f"S_rect_{number}"].split())
        P = [float(x) for x in rows[f"P_rect_{number}"].split()]
        return (width, height), (P[0], P[5], P[2], P[6])
    except (OSError, ValueError, KeyError, IndexError) as error:
        raise InputError(
            f"cannot read S_rect_{number} and P_rect_{number} of {path}: {error}; put KITTI's "
            "calibration there, or give --intrinsics"
        ) from error


def _scannet(root: Path, _: Path | None) -> list[RgbdPair]:
    folders = [_folder(root / name, f"ScanNet's {name} lies there") for name in ("color", "depth")]
    names = "intrinsic/intrinsic_color.txt", "intrinsics_color.txt"
    path = next((root / name for name in names if (root / name).is_file()), root / names[0])
    rows = _paired(_files(folders[0], PICTURES), _files(folders[1], DEPTHS), where=str(folders[1]))
    return [RgbdPair(*row, _of_matrix(path, 4)) for row in rows]


def _of_matrix(path: Path, side: int) -> Intrinsics:
    try:
        K = np.array(path.read_text().split(), dtype=np.float64).reshape(side, side)
    except (OSError, ValueError) as error:
        raise InputError(
            f"cannot read {path}: {error}; it is the camera's matrix of {side} × {side} numbers"
        ) from error
    fx, fy, cx, cy = (float(K[i]) for i in ((0, 0), (1, 1), (0, 2), (1, 2)))
    if not all(map(math.isfinite, (fx, fy, cx, cy))):
        raise InputError(f"{path}: the camera's matrix is not finite; give --intrinsics")
    return fx, fy, cx, cy


LAYOUTS = {
    "plain": Layout("a picture and its depth, or two folders with files of equal names", _plain),
    "tum": Layout("a folder with rgb.txt and depth.txt, codes 5000 to the metre", _tum, 5000.0),
    "kitti": Layout(
        "a folder with image, groundtruth_depth and intrinsics, or a drive with image_02/data, "
        "proj_depth/groundtruth/image_02 and calib_cam_to_cam.txt, codes 256 to the metre",
        _kitti,
        256.0,
    ),
    "scannet": Layout(
        "a folder with color, depth and intrinsic/intrinsic_color.txt, codes in mm",
        _scannet,
        resampled=True,
    ),
}
