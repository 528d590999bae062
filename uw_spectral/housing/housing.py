"""A camera in its housing: rays in the water of pixels, and pixels of points in the water."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .camera import LensCamera
from .media import SeaWater
from .port import Port

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Housing:
    """A camera that looks through a port into water.

    Points and directions are in OpenCV's camera axes (x right, y down, z forward), in m from the
    centre of the lens's entrance pupil. All is exact for every wavelength: nothing is paraxial.

    Examples
    --------
    >>> from underwater_spectral.uw_spectral.housing import FlatPort
    >>> camera = LensCamera(1920, 1080, 1400.0, 1400.0, 960.0, 540.0)
    >>> housing = Housing(camera, FlatPort(0.03, 0.008))
    >>> (x, y), (x_red, _) = housing.project([[0.5, 0.0, 2.0]] * 2, [450.0, 650.0])
    >>> round(float(x), 1), round(float(x_red), 1)
    (1440.8, 1437.6)
    """

    camera: LensCamera  #: As calibrated in air.
    port: Port  #: A :class:`.FlatPort` or a :class:`.DomePort`.
    water: SeaWater = field(default_factory=SeaWater)

    def _indices(self, wavelength: ArrayLike) -> tuple[Array, Array]:
        glass = self.port.glass.refractive_index(wavelength)
        return glass, self.water.refractive_index(wavelength)

    def ray_in_water(self, pixels: ArrayLike, wavelength: ArrayLike) -> tuple[Array, Array]:
        """Where the rays of pixels leave the port, and where they go, by wavelength in nm.

        Points of the outer face and unit directions in the water, each (..., 3); NaN for pixels
        that see nothing through the port.
        """
        given, nm = _together(pixels, wavelength)
        axis = self.port.axis
        along, across, side = _split(self.camera.directions(given, nm), axis)
        x, r, angle = self.port.leaving(np.arctan2(across, along), *self._indices(nm))
        origins = x[..., None] * axis + r[..., None] * side
        there = np.cos(angle)[..., None] * axis + np.sin(angle)[..., None] * side
        seen = self.port.passes(origins)[..., None]
        return np.where(seen, origins, np.nan), np.where(seen, there, np.nan)

    def project(self, points: ArrayLike, wavelength: ArrayLike) -> Array:
        """Image coordinates, shape (..., 2), of points in the water, (..., 3), by wavelength in nm.

        NaN for points that are not finite, not in the water before the port, or not seen by the
        lens.
        """
        given, nm = _together(points, wavelength)
        axis, indices = self.port.axis, self._indices(nm)
        along, across, side = _split(given, axis)
        angle = self.port.angle_towards(along, across, *indices)
        x, r, _ = self.port.leaving(angle, *indices)
        seen = self.port.passes(x[..., None] * axis + r[..., None] * side)
        angle = np.where(seen, angle, np.nan)[..., None]
        return self.camera.project(np.cos(angle) * axis + np.sin(angle) * side, nm)

    def transmittance(self, pixels: ArrayLike, wavelength: ArrayLike) -> Array:
        """Fraction of the light that both faces of the port let through, shape (...).

        Radiance in air is that in the water times this over n², the square of the water's index.
        """
        given, nm = _together(pixels, wavelength)
        directions = self.camera.directions(given, nm)
        along, across, _ = _split(directions, self.port.axis)
        passed = self.port.transmittance(np.arctan2(across, along), *self._indices(nm))
        return np.where(np.isfinite(self.ray_in_water(given, nm)[0]).all(axis=-1), passed, np.nan)


def _together(vectors: ArrayLike, wavelength: ArrayLike) -> tuple[Array, Array]:
    """Vectors along the last axis and wavelengths, of one shape; what is not finite is NaN."""
    given, nm = (np.asarray(x, dtype=np.float64) for x in (vectors, wavelength))
    given = np.where(np.isfinite(given), given, np.nan)
    shape = np.broadcast_shapes(given.shape[:-1], nm.shape)
    return np.broadcast_to(given, (*shape, given.shape[-1])), np.broadcast_to(nm, shape)


def _split(vectors: Array, axis: Array) -> tuple[Array, Array, Array]:
    """Lengths along an axis and across it, and the unit vector across (0 on the axis)."""
    along = vectors @ axis
    aside = vectors - along[..., None] * axis
    across = np.linalg.norm(aside, axis=-1)
    return along, across, aside / np.where(across > 0, across, 1.0)[..., None]
