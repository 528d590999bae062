"""Raw pictures of a data set: counts of a detector as TIFF or DNG."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..uw_spectral.detector import RawSettings, capture, write_dng
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
    taken, camera = raw.settings(to_rec709, view.noise_seed), view.camera
    focal, centre = (camera.fx, camera.fy), (camera.cx, camera.cy)
    counts = capture(channels, taken, focal=focal, centre=centre)
    write_counts(path, taken, counts, to_rec709, view.record["camera"]["sensor"], raw.file)
    record = {**taken.record(), "white_response": white.tolist()}
    return {**record, "to_linear_rec709": to_rec709.tolist()}


def write_counts(
    path: Path,
    taken: RawSettings,
    counts: NDArray[np.uint16],
    to_rec709: Array,
    sensor: str,
    kind: str,
) -> None:
    """Write counts, as DNG if that is wanted and there is a mosaic, else as TIFF.

    ``to_rec709`` is as of :func:`write_raw`.
    """
    if kind != "dng" or taken.pattern is None:
        write_codes(path, counts, {"black_level": taken.detector.black_level})
        return
    white = np.linalg.solve(to_rec709, np.ones(3))
    to_camera = np.linalg.inv(rec709_to_XYZ() @ to_rec709)
    write_dng(path, counts, taken, to_camera, white, sensor)
