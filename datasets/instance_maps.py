"""Pictures of the instances' numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.spectral_image import write_codes
from .picture_codes import read_codes
from .view import DataSetView


def write_instance_map(path: Path, numbers: ArrayLike) -> None:
    """Write the number of the instance in every pixel, 0 where none is, as 16-bit PNG.

    Raises InputError if a number is not whole or not 0 to 65535, or the file cannot be written.
    """
    found = np.asarray(numbers)
    codes = found.astype(np.uint16)
    if not np.array_equal(codes, found):
        raise InputError(f"cannot write {path}: numbers of instances are whole, 0 to 65535")
    write_codes(path, codes)


def visible_masks(view: DataSetView) -> dict[int, NDArray[np.bool_]]:
    """Return where each instance of a view is seen; one that is not, has an empty mask.

    Raises InputError if the view has instances and no picture of them, or the picture has another
    size, or holds a number that no instance has.
    """
    if not view.instances:
        return {}
    if view.instance_map is None:
        raise InputError(f"view {view.name}: it has instances; give the picture of their numbers")
    codes = read_codes(view.instance_map)
    size = (view.camera.height, view.camera.width)
    if codes.shape != size:
        raise InputError(
            f"{view.instance_map} has {codes.shape[1]} × {codes.shape[0]} pixels, the camera "
            f"{size[1]} × {size[0]}; render it at the camera's size"
        )
    known = {item.number for item in view.instances}
    strange = set(np.unique(codes).tolist()) - known - {0}
    if strange:
        raise InputError(
            f"{view.instance_map} holds number {min(strange)}, which no instance of view "
            f"{view.name} has; list it"
        )
    return {number: codes == number for number in sorted(known)}


def box(mask: NDArray[np.bool_]) -> list[int]:
    """Return the box around a mask: left, top, width, height; -1 each if it is empty."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not rows.size:
        return [-1, -1, -1, -1]
    left, top = int(columns[0]), int(rows[0])
    return [left, top, int(columns[-1]) - left + 1, int(rows[-1]) - top + 1]
