"""Water applied to pictures with depth that others made."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..uw_spectral.detector import capture
from ..uw_spectral.errors import InputError
from ..uw_spectral.imaging.applied_water import applied_water
from ..uw_spectral.imaging.description import Description, SurfaceDescription
from ..uw_spectral.imaging.optics import resolve
from ..uw_spectral.imaging.ray_tables import RayTables, SeenComponents, ray_tables
from .axes import Array
from .camera import PinholeCamera
from .cameras_and_rigs import CameraRig, rig_lamps
from .outputs import RawOutputs
from .picture_codes import linear_codes
from .pose_sets import heading_pose
from .rgbd_layouts import filled
from .truth import image_truth
from .view import DataSetView

OPEN, FILL = "open", "fill"
INVALID = (OPEN, FILL)
"""What pixels without depth are: open water, or surfaces as far as those around."""
FLAT = SurfaceDescription("flat")
_TYPICAL, _LOOKED_AT = (0.02, 5000.0), 20_000  # m, of the median of so many pixels
HEADING = 90.0
"""Along +y, where a camera looks."""
_ROWS = 32  # of a picture that are done together, which stay in the processor's cache


@dataclass(frozen=True)
class AppliedSettings:
    """What is applied to pictures."""

    description: Description = field(default_factory=lambda: Description(surface=FLAT))
    depth: float = 5.0  #: Of the camera, m.
    pitch: float = 0.0  #: Degrees above the horizon that it looks; it looks along +y of the world.
    #: Reflectance of what is white in the pictures, which are under a white light of that exposure.
    white: float = 1.0
    linear: bool = False  #: Whether codes are linear, not sRGB; those of EXR are.
    invalid: str = OPEN  #: One of :data:`INVALID`.
    blur: bool = False  #: Whether light of the objects in view is scattered forward.
    rig: CameraRig | None = None  #: Lamps at the camera.
    iso: float | None = None  #: Of a detector with its noise; None is without.

    def __post_init__(self) -> None:
        if self.invalid not in INVALID:
            raise InputError(f"pixels without depth are {' or '.join(INVALID)}, not {self.invalid}")
        if not 0 < self.white < math.inf or not -90 <= self.pitch <= 90:
            raise InputError(
                f"give a reflectance of white above 0 and a pitch of -90 to 90°, not "
                f"{self.white:g} and {self.pitch:g}°"
            )


class PictureFilter:
    """Puts water before pictures; what does not depend on them is computed once a camera.

    What a picture has above the surface or below the floor is lit as what is at them; the water on
    the way to it goes on. Raises InputError if the water is unknown, the camera not in it, or its
    sensor not of three channels.
    """

    def __init__(self, settings: AppliedSettings) -> None:
        self.settings, self.optics = settings, resolve(settings.description)
        self.pose = heading_pose((0.0, 0.0, -settings.depth), HEADING, settings.pitch)
        rig = settings.rig
        self.lamps = () if rig is None else rig_lamps(
            rig, self.pose, self.optics.bands, self.optics.illuminant.unit
        )  # fmt: skip
        self.water = applied_water(self.optics, settings.depth, self.lamps)
        self.tables = functools.lru_cache(maxsize=2)(self._tables)
        self.truth = functools.lru_cache(maxsize=2)(self._truth)

    def picture(
        self, rgb: ArrayLike, depth: ArrayLike, camera: PinholeCamera, *, seed: int = 0
    ) -> NDArray[np.float32]:
        """Return a picture in the water, linear Rec.709 (h, w, 3).

        ``rgb``, shape (h, w, 3), are 8 or 16-bit codes, or linear Rec.709; ``depth``, shape (h, w),
        is planar, m, 0 or not finite where there is none; ``seed`` is of the detector's noise.
        Raises InputError if sizes differ, or a number is not finite or negative.
        """
        colours = self.colours(np.asarray(rgb), "the picture")
        distances = self.distances(np.asarray(depth), camera, "the depth")
        return np.moveaxis(self.developed(colours, distances, camera, seed), 0, -1)

    def colours(self, rgb: NDArray[Any], where: str) -> NDArray[np.float32]:
        """Reflectances of a picture's codes or linear values, (3, h, w)."""
        if rgb.ndim != 3 or rgb.shape[2] != 3:
            raise InputError(f"{where}: three channels are needed, got shape {rgb.shape}")
        if np.issubdtype(rgb.dtype, np.floating):
            found = np.ascontiguousarray(np.moveaxis(rgb, -1, 0), np.float32)
            bad = ~(np.isfinite(found) & (found >= 0)).all(axis=0)
            if bad.any():
                row, column = np.argwhere(bad)[0]
                raise InputError(
                    f"{where}: {int(bad.sum())} pixels are negative or not finite, the first in "
                    f"row {row}, column {column}; mend them, or give 8-bit pictures"
                )
            return found * np.float32(self.settings.white)
        codes = linear_codes(rgb.dtype, linear=self.settings.linear)
        table = codes * np.float32(self.settings.white)
        return np.stack([table.take(rgb[..., k], mode="clip") for k in range(3)])

    def distances(
        self, depth: NDArray[Any], camera: PinholeCamera, where: str, *, ranges: bool = False
    ) -> NDArray[np.float32]:
        """Distances of planar depth (or of ranges), infinite where there is none, (h, w)."""
        known = known_depth(depth, camera, where)
        if self.settings.invalid == FILL:
            known = filled(known)
        found = known.astype(np.float32)
        return found if ranges else found * secant(camera)

    def developed(
        self,
        colours: NDArray[np.float32],
        P: NDArray[np.float32],
        camera: PinholeCamera,
        seed: int = 0,
        parts: SeenComponents | None = None,
    ) -> NDArray[np.float32]:
        """Picture of reflectances at distances, linear Rec.709 (3, h, w)."""
        tables, chosen = self.tables(camera), self.settings
        if parts is None and (chosen.blur or self.lamps):
            parts = tables.components(colours, P, blur=chosen.blur)

        def seen(rows: slice = slice(None)) -> NDArray[np.float32]:
            if parts is not None:
                return parts.total(rows)
            return tables.total(colours[:, rows], P[rows], rows)

        noisy = None if chosen.iso is None else self._noisy(seen(), seed)
        matrix, found = self.water.to_rec709.astype(np.float32), np.empty_like(colours)
        for first in range(0, len(P), _ROWS):
            rows = slice(first, first + _ROWS)
            channels = seen(rows) if noisy is None else noisy[:, rows]
            for d, row in enumerate(matrix):
                mixed = row[0] * channels[0]
                mixed += row[1] * channels[1]
                mixed += row[2] * channels[2]
                found[d, rows] = mixed
        return found

    def _noisy(self, seen: NDArray[np.float32], seed: int) -> NDArray[np.float32]:
        """Channels as the detector's counts tell them."""
        raw = RawOutputs(white=1.0, iso=self.settings.iso).settings(self.water.to_rec709, seed)
        detector = raw.detector
        counts = capture(np.moveaxis(seen, 0, -1), raw) - np.float32(detector.black_level)
        per_count = raw.saturation / (detector.gain_at(raw.iso) * detector.full_well)
        return np.moveaxis(counts, -1, 0) * np.float32(per_count)

    def _tables(self, camera: PinholeCamera) -> RayTables:
        return ray_tables(self.water, picture_rays(camera, self.pose), camera.fx)

    def _truth(self, camera: PinholeCamera) -> dict[str, Any]:
        view = DataSetView("", Path(), camera, self.pose)
        return image_truth(self.optics, view, self.lamps, stops=self.water.view.stops)


def known_depth(depth: NDArray[Any], camera: PinholeCamera, where: str) -> Array:
    """Return depth in m, infinite where there is none, (h, w).

    Raises InputError if it has another size, there is none, or its unit seems another.
    """
    size = camera.height, camera.width
    if depth.shape != size:
        raise InputError(
            f"{where} has {depth.shape[::-1]} pixels, the picture {size[::-1]}; give depth of "
            "the picture's size, of the same view"
        )
    known = np.where(np.isfinite(depth) & (depth != 0), depth, np.inf)
    least = float(known.min())
    if not 0 < least < math.inf:
        raise InputError(
            f"{where} has {'negative values' if least < 0 else 'no pixel with depth'}; give m "
            "along the camera's axis, 0 or NaN where there is none, or leave the picture out"
        )
    some = known.flat[:: 1 + known.size // _LOOKED_AT]
    some = some[np.isfinite(some)]
    middle = float(np.median(some)) if some.size else least
    if not _TYPICAL[0] <= middle <= _TYPICAL[1]:
        raise InputError(
            f"{where} has a median of {middle:.3g} m, so its unit is another; give how many "
            "of its numbers are a metre (--scale, 1000 of mm)"
        )
    return known


def picture_rays(camera: PinholeCamera, pose: Array) -> Array:
    """Return unit vectors from the camera through its pixels, z up, (h, w, 3)."""
    return camera.rays() * (1.0, -1.0, -1.0) @ pose[:3, :3].T


@functools.lru_cache(maxsize=2)
def secant(camera: PinholeCamera) -> NDArray[np.float32]:
    """Euclidean range over planar depth."""
    return (1.0 / camera.rays()[..., 2]).astype(np.float32)
