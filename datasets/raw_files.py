"""Raw pictures of a data set: counts of a detector as TIFF or DNG."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..uw_spectral.detector import write_dng
from ..uw_spectral.spectra.colour_rendering import rec709_to_XYZ
from ..uw_spectral.spectra.spectral_image import write_codes
from .axes import Array
from .index import IndexedView
from .outputs import RawOutputs


def write_raw(
    path: Path, view: IndexedView, raw: RawOutputs, channels: ArrayLike, to_rec709: Array
) -> dict[str, Any]:
    """Write the counts of a view with the noise of its seed, and return how they were taken.

    ``channels``, shape (height, width, 3), are linear responses of the sensor before white balance
    and exposure; ``to_rec709``, shape (3, 3), leads from these to the developed picture.
    """
    white = np.linalg.solve(to_rec709, np.ones(3))
    counts, record = raw.counts(channels, view.camera, float(white.max()), view.noise_seed)
    write_counts(path, raw, counts, to_rec709, view.record["camera"]["sensor"])
    return {**record, "white_response": white.tolist(), "to_linear_rec709": to_rec709.tolist()}


def write_counts(
    path: Path, raw: RawOutputs, counts: NDArray[np.uint16], to_rec709: Array, sensor: str
) -> None:
    """Write counts, as DNG if there is a mosaic, else as TIFF.

    ``to_rec709`` is as of :func:`write_raw`.
    """
    if raw.file != "dng" or raw.pattern is None:
        write_codes(path, counts, {"black_level": raw.detector.black_level})
        return
    white = np.linalg.solve(to_rec709, np.ones(3))
    to_camera = np.linalg.inv(rec709_to_XYZ() @ to_rec709)
    write_dng(path, counts, raw.settings(1.0, 0), to_camera, white, sensor)
