"""Files of trajectories: TUM, EuRoC, KITTI, nerfstudio; read as poses, and written as rows.

Poses here are camera to world in Blender's axes. Times are read as exact fractions of
a second and written as whole nanoseconds, of which a float of today's date has 256 in a step.
TUM, EuRoC and KITTI have OpenCV's axes of the camera. The world of a file is taken as it is:
metres, z up.
"""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import numpy as np

from ..uw_spectral.errors import InputError
from .axes import Array, placed, quaternion, rotation, turned

NANOSECONDS = 10**9
"""In a second."""
_KITTI, _TUM, _EUROC = 12, 8, 8  # numbers of a row
_ROUNDED = 1e-3  # that rows with few digits may scale by
_LATEST = 2**31  # s: the year 2038, where stamps of ROS end
_DECIMALS = 6  # of a second, that times in text have at least


@dataclass(frozen=True)
class TimedPoses:
    """Poses in Blender's axes, each with its exact time in s; None where the file has no times."""

    poses: tuple[Array, ...]
    times: tuple[Fraction, ...] | None


def read_tum(path: Path) -> TimedPoses:
    """Read ``time tx ty tz qx qy qz qw``, camera to world in OpenCV's axes.

    Raises InputError if the file cannot be read or a row is none.

    Source: TUM RGB-D benchmark, *File formats*.
    """
    rows = _rows(path, None, _TUM, "time tx ty tz qx qy qz qw")
    poses = [_pose(path, n, r[1:4], np.roll(r[4:8], 1)) for n, _, r in rows]
    return TimedPoses(tuple(map(turned, poses)), _times(path, _stamps(rows)))


def read_euroc(path: Path, camera_in_body: Array | None = None) -> TimedPoses:
    """Read EuRoC's ``data.csv`` of states: time in ns, place, quaternion (w first), of the body.

    ``camera_in_body``, shape (4, 4), is T_BS of the camera's ``sensor.yaml``; without it the body
    is the camera in OpenCV's axes. Raises InputError if the file cannot be read or a row is none.

    Source: M. Burri et al., Int. J. Robot. Res. 35, 1157 (2016).
    """
    rows = _rows(path, ",", _EUROC, "time [ns], x, y, z, qw, qx, qy, qz")
    body = np.eye(4) if camera_in_body is None else camera_in_body
    poses = [_pose(path, n, r[1:4], r[4:8]) @ body for n, _, r in rows]
    times = _times(path, _stamps(rows, NANOSECONDS))
    return TimedPoses(tuple(map(turned, poses)), times)


def read_kitti(path: Path) -> TimedPoses:
    """Read KITTI's poses: twelve numbers a row, 3 rows of a matrix, OpenCV's axes; no times.

    Raises InputError if the file cannot be read or a row is none.

    Source: A. Geiger et al., CVPR 2012; *devkit_odometry*.
    """
    poses = []
    for number, _, row in _rows(path, None, _KITTI, "the 12 numbers of a 3×4 matrix"):
        poses.append(turned(_rounded(row[:_KITTI].reshape(3, 4), f"{path}, line {number}")))
    return TimedPoses(tuple(poses), None)


def read_nerfstudio(path: Path) -> TimedPoses:
    """Read the poses of ``transforms.json`` in its order; their ``time`` where all have one."""
    try:
        frames = json.loads(_text(path))["frames"]
        poses = [np.array(frame["transform_matrix"], dtype=np.float64)[:3] for frame in frames]
        stamps = [frame.get("time") for frame in frames]
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(
            f"{path} holds no frames of nerfstudio ({type(error).__name__}: {error}); give a "
            "transforms.json with frames and their transform_matrix"
        ) from error
    _require_some(path, poses)
    found = tuple(_rounded(pose, f"{path}, frame {n}") for n, pose in enumerate(poses))
    timed = all(isinstance(x, int | float) and abs(x) < math.inf for x in stamps)
    known = [(n, Fraction(x)) for n, x in enumerate(stamps)] if timed else []
    return TimedPoses(found, _times(path, known) if timed else None)


def tum_rows(poses: Iterable[Array], times: Iterable[int]) -> str:
    """Return the lines of a TUM trajectory; times are ns."""
    lines = ["# time tx ty tz qx qy qz qw; the camera's pose in the world, OpenCV's axes"]
    for pose, time in zip(poses, times, strict=True):
        w, x, y, z = _quaternion(pose)
        row = [*map(float, pose[:3, 3]), x, y, z, w]
        lines.append(" ".join([seconds(time), *map(repr, row)]))
    return "\n".join(lines) + "\n"


def euroc_rows(poses: Sequence[Array], times: Sequence[int]) -> str:
    """Return the lines of EuRoC's states; times in ns, speeds from places, biases 0."""
    head = ["#timestamp [ns]"]
    head += [f"p_RS_R_{a} [m]" for a in "xyz"] + [f"q_RS_{a} []" for a in "wxyz"]
    head += [f"v_RS_R_{a} [m s^-1]" for a in "xyz"]
    head += [f"b_w_RS_S_{a} [rad s^-1]" for a in "xyz"] + [f"b_a_RS_S_{a} [m s^-2]" for a in "xyz"]
    places = np.array([turned(pose)[:3, 3] for pose in poses])
    since = [(time - times[0]) / NANOSECONDS for time in times]
    speeds = np.gradient(places, since, axis=0) if len(times) > 1 else np.zeros_like(places)
    lines = [",".join(head)]
    moved = np.hstack([places, speeds]).tolist()
    for pose, time, numbers in zip(poses, times, moved, strict=True):
        row = [str(time)]
        row += map(repr, [*numbers[:3], *_quaternion(pose), *numbers[3:], *[0.0] * 6])
        lines.append(",".join(row))
    return "\n".join(lines) + "\n"


def kitti_rows(poses: Sequence[Array]) -> str:
    """Return the lines of KITTI's poses, in the axes of the first camera."""
    first = np.linalg.inv(turned(poses[0]))
    rows = [(first @ turned(pose))[:3].ravel().tolist() for pose in poses]
    return "".join(" ".join(map(repr, row)) + "\n" for row in rows)


def nanoseconds(time: Fraction) -> int:
    """Return a time in s as whole nanoseconds."""
    return round(time * NANOSECONDS)


def seconds(time: int) -> str:
    """Return nanoseconds as seconds in decimals, all there are and six at least."""
    whole, point, decimals = f"{Decimal(time).scaleb(-9):f}".partition(".")
    return whole + point + decimals.rstrip("0").ljust(_DECIMALS, "0")


def _quaternion(pose: Array) -> list[float]:
    return quaternion(turned(pose)[:3, :3]).tolist()


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot read {path}: {error}; check the path") from error


Row = tuple[int, str, Array]
"""Number of a line, its first word as it is written, its numbers."""


def _rows(path: Path, separator: str | None, least: int, what: str) -> list[Row]:
    found: list[Row] = []
    for number, line in enumerate(_text(path).splitlines(), 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        words = line.split(separator)
        try:
            row = np.array([float(word) for word in words])
        except ValueError:
            row = np.array([])
        if len(row) < least or not np.isfinite(row[:least]).all():
            raise InputError(f"{path}, line {number}: {line.strip()[:60]!r} should be {what}")
        found.append((number, words[0].strip(), row))
    _require_some(path, found)
    return found


def _require_some(path: Path, found: Sequence[object]) -> None:
    if not found:
        raise InputError(f"{path} holds no pose; give a file with one at least")


def _pose(path: Path, number: int, place: Array, turn: Array) -> Array:
    if not 0.9 < float(turn @ turn) < 1.1:
        raise InputError(
            f"{path}, line {number}: the quaternion {turn.tolist()} (w first) has not the length "
            "1; is the order of its numbers another?"
        )
    return placed(rotation(turn), place)


def _rounded(rows: Array, what: str) -> Array:
    """Return the pose of a matrix whose rotation was written with few digits."""
    if rows.shape != (3, 4) or not np.isfinite(rows).all():
        raise InputError(f"{what}: a pose has 3×4 or 4×4 finite numbers, not {rows.shape}")
    left, sizes, right = np.linalg.svd(rows[:, :3])
    turn = left @ right
    if np.abs(sizes - 1.0).max() > _ROUNDED or np.linalg.det(turn) < 0:
        raise InputError(
            f"{what}: the matrix scales or mirrors (by {', '.join(f'{x:.4g}' for x in sizes)}); "
            "undo that scale, and keep it right-handed"
        )
    return placed(turn, rows[:, 3])


def _stamps(rows: Sequence[Row], per_second: int = 1) -> list[tuple[int, Fraction]]:
    """Return times as they are written, to the nanosecond, each with its line's number."""
    exponent = NANOSECONDS // per_second
    whole = [(number, round(Decimal(word) * exponent)) for number, word, _ in rows]
    return [(number, Fraction(time, NANOSECONDS)) for number, time in whole]


def _times(path: Path, stamps: Sequence[tuple[int, Fraction]]) -> tuple[Fraction, ...]:
    for number, time in stamps:
        if abs(time) > _LATEST:
            raise InputError(
                f"{path}, line {number}: time {float(time):g} s is no date before 2038; give TUM "
                "and nerfstudio seconds, EuRoC nanoseconds"
            )
    for (_, before), (number, time) in itertools.pairwise(stamps):
        if not nanoseconds(time) > nanoseconds(before):
            one, other = (seconds(nanoseconds(x)) for x in (time, before))
            raise InputError(
                f"{path}, line {number}: time {one} s is not after {other} s; sort the "
                "lines, and leave out what is there twice"
            )
    return tuple(time for _, time in stamps)


READERS: dict[str, Callable[[Path], TimedPoses]] = {
    "tum": read_tum,
    "euroc": read_euroc,
    "kitti": read_kitti,
    "nerfstudio": read_nerfstudio,
}
"""By the kind of ``[[poses]]``."""
