"""A picture of the sky: its sun cut out, and what is left by direction, with the energy of both.

Pictures are equirectangular as Blender's are: from the zenith down to the nadir, +x in the middle,
azimuths from +x towards +y to the left; linear Rec.709.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..content import ComparedByContent, constant
from ..errors import InputError
from ..mathematics import NUMPY, Mathematics, Operand
from ..spectra.colour_rendering import luminance
from ..spectra.sky_colours import least_saturation
from ..spectra.spectral_image import read_exr
from ..spectra.spectrum import is_file
from .sky import PICTURE, Sky

Array = NDArray[np.float64]

_SUN, _AROUND = math.radians(4.0), math.radians(7.0)  # angles from the brightest point
_LEAST_SUN = 0.01  # of all light
_LOWEST_SUN = math.cos(math.radians(89.5))  # cosine of its zenith angle
_ORDERS = 8  # of the azimuth; irradiance has one, light scattered once a few
_COARSE = 64  # rows and columns of the colours that are looked at


@dataclass(frozen=True, eq=False)
class SkyPicture(ComparedByContent):
    """Radiance of the sky in a picture, (rows, columns, 3); :meth:`checked` makes one."""

    radiance: Array

    @classmethod
    def checked(cls, radiance: ArrayLike, name: str) -> SkyPicture:
        """Return a picture; below the horizon it goes on as at the horizon.

        Raises
        ------
        InputError
            If it is no picture of all directions, not finite, negative, or black.
        """
        found = np.asarray(radiance)
        if found.ndim != 3 or found.shape[2] < 3 or min(found.shape[:2]) < 4 or len(found) % 2:
            raise InputError(
                f"{name} has the shape {found.shape}; a picture of the sky has all directions, an "
                "even number of rows of at least 4 pixels of red, green and blue"
            )
        found = found[: len(found) // 2, :, :3]
        for bad, what in ((~np.isfinite(found), "not finite"), (found < 0, "negative")):
            if bad.any():
                row, column, channel = np.argwhere(bad)[0]
                raise InputError(
                    f"{name}: {int(bad.any(axis=2).sum())} pixels are {what}, the first in row "
                    f"{row}, column {column} ({['red', 'green', 'blue'][channel]}: "
                    f"{found[row, column, channel]:g}); mend the picture, or clamp it"
                )
        if not found.any():
            raise InputError(
                f"{name} is black above the horizon: no light comes from it; give it a picture, a "
                "sky texture, a colour or a strength above 0, or leave --sky-picture empty"
            )
        return cls(constant(np.concatenate([found, np.repeat(found[-1:], len(found), axis=0)])))

    @classmethod
    def read(cls, path: str) -> SkyPicture:
        """Read a picture of OpenEXR; InputError if it cannot be used."""
        found = Path(path).stat() if is_file(Path(path)) else None
        return _read(path, found and (found.st_mtime_ns, found.st_size))

    @functools.cached_property
    def without_sun(self) -> SkyPicture:
        """The sky without its sun."""
        found = self.radiance.copy()
        found[: len(self._sun)] -= self._sun
        return SkyPicture(constant(found))

    @functools.cached_property
    def sun_irradiance(self) -> Array:
        """Irradiance of the sun on a level plane, shape (3,)."""
        return self._level(self._sun)

    @functools.cached_property
    def irradiance(self) -> Array:
        """Irradiance of everything on a level plane, shape (3,)."""
        return self._level(self.radiance[: len(self.radiance) // 2])

    @functools.cached_property
    def sun(self) -> tuple[float, float, float]:
        """Unit direction that sunlight travels to, z up; without a sun, light on average."""
        shining = self._sun if self.sun_irradiance.any() else self.radiance[: len(self._sun)]
        towards = np.einsum("yx,yxk->k", luminance(shining) * self._solid_angle, self._directions)
        x, y, z = towards / np.linalg.norm(towards)
        z = max(float(z), _LOWEST_SUN)
        across = math.sqrt(1.0 - z * z) / max(math.hypot(x, y), 1e-12)
        return -float(x) * across, -float(y) * across, -z

    @functools.cached_property
    def saturation(self) -> float:
        """The least with which no part has a negative spectrum, see :func:`.sky_basis`."""
        rows, columns = (max(size // _COARSE, 1) for size in self.without_sun.radiance.shape[:2])
        some = self.without_sun.radiance[: len(self._sun) : rows, ::columns].reshape(-1, 3)
        return least_saturation(np.vstack([some, self.sun_irradiance]))

    def at(self, v: Sequence[Operand]) -> Array:
        """Look up the radiance along unit vectors v, arrays of shape (..., 1): (..., 3)."""
        x, y, z = (np.asarray(part, np.float64)[..., 0] for part in v)
        rows, columns = self.radiance.shape[:2]
        row = np.clip(np.arccos(np.clip(z, -1.0, 1.0)) / math.pi * rows - 0.5, 0.0, rows - 1.0)
        column = (0.5 - np.arctan2(y, x) / (2.0 * math.pi)) * columns - 0.5
        top, left = (np.floor(place).astype(np.intp) for place in (row, column))
        down, right = (row - top)[..., None], (column - left)[..., None]
        below, beside = np.minimum(top + 1, rows - 1), (left + 1) % columns
        left = left % columns
        L = self.radiance
        upper = L[top, left] * (1.0 - right) + L[top, beside] * right
        lower = L[below, left] * (1.0 - right) + L[below, beside] * right
        return upper * (1.0 - down) + lower * down

    def modes(self, cosines: Array, modes: int, azimuth: float) -> Array:
        """Cosine terms about an azimuth that light travels to, (modes, q, 3).

        Each is the mean over the sky nearest to a cosine of the zenith angle (q,), so that all of
        the picture counts; 0 where that is 0.
        """
        half = len(self.radiance) // 2
        turn = self._azimuths - (azimuth + math.pi)
        waves = np.cos(np.arange(min(modes, _ORDERS))[:, None] * turn) * 2.0 / len(turn)
        waves[0] /= 2.0
        square = self._edges**2
        # Energy from the zenith on: it grows with the square of the cosine.
        energy = np.zeros((len(waves), half + 1, 3))
        around = np.einsum("mx,yxk->myk", waves, self.radiance[:half])
        energy[:, 1:] = np.cumsum(around * -np.diff(square)[:, None], axis=1)
        wanted, place = np.unique(np.square(cosines), return_inverse=True)
        inside = wanted > 0
        ends = np.concatenate([[0.0], (wanted[inside][1:] + wanted[inside][:-1]) / 2.0, [1.0]])
        at = np.empty((len(waves), len(ends), 3))
        for mode, channel in np.ndindex(len(waves), 3):
            at[mode, :, channel] = np.interp(-ends, -square, energy[mode, :, channel])
        found = np.zeros((modes, len(wanted), 3))
        found[: len(waves), inside] = -np.diff(at, axis=1) / np.diff(ends)[:, None]
        return found[:, place]

    @functools.cached_property
    def _sun(self) -> Array:
        """Light of the sun above the horizon, (rows, columns, 3)."""
        L = self.radiance[: len(self.radiance) // 2]
        place = np.unravel_index(np.argmax(luminance(L)), L.shape[:2])
        cosine = self._directions @ self._directions[place]
        near = cosine > math.cos(_SUN)
        around = (cosine > math.cos(_AROUND)) & ~near
        if not around.any():
            return np.zeros_like(L)
        excess = np.maximum(L - np.median(L[around], axis=0), 0.0) * near[..., None]
        of_all = luminance(self._level(excess)) / luminance(self.irradiance)
        return excess if of_all >= _LEAST_SUN else np.zeros_like(L)

    def _level(self, radiance: Array) -> Array:
        """Irradiance on a level plane of what is above the horizon."""
        per_row = -np.diff(self._edges**2) * math.pi / radiance.shape[1]
        return np.einsum("y,yxk->k", per_row, radiance)

    @functools.cached_property
    def _edges(self) -> Array:
        """Cosines of the zenith angles of the edges of rows, down to the horizon."""
        half = len(self.radiance) // 2
        return np.cos(np.arange(half + 1) * (math.pi / 2.0 / half)).clip(0.0)

    @functools.cached_property
    def _azimuths(self) -> Array:
        columns = self.radiance.shape[1]
        return math.pi - (np.arange(columns) + 0.5) * (2.0 * math.pi / columns)

    @functools.cached_property
    def _solid_angle(self) -> Array:
        return -np.diff(self._edges)[:, None] * (2.0 * math.pi / self.radiance.shape[1])

    @functools.cached_property
    def _directions(self) -> Array:
        """Unit vectors to the pixels above the horizon, (rows, columns, 3)."""
        half = len(self.radiance) // 2
        zenith = ((np.arange(half) + 0.5) * (math.pi / 2.0 / half))[:, None]
        x, y = np.sin(zenith) * np.cos(self._azimuths), np.sin(zenith) * np.sin(self._azimuths)
        return np.stack([x, y, np.cos(zenith) + 0.0 * x], axis=-1)


# Water that changes under a sky asks for it at each change; what is known of its sun stays with it.
@functools.lru_cache(maxsize=2)
def _read(path: str, _version: tuple[int, int] | None) -> SkyPicture:
    pixels, names = read_exr(path)
    try:
        channels = [names.index(name) for name in "RGB"]
    except ValueError as error:
        raise InputError(
            f"{path} has the channels {', '.join(names)}; a picture of the sky has R, G and B"
        ) from error
    return SkyPicture.checked(pixels[..., channels], path)


@dataclass(frozen=True, eq=False)
class PictureSky(Sky):
    """A sky whose radiance is that of a picture.

    ``level`` is that of red, green and blue in each band, (n, 3); with 1 radiance is in red, green
    and blue.
    """

    kind: str = PICTURE
    picture: SkyPicture = field(kw_only=True)
    is_even: bool = False  #: The mean of both sides of the sun's azimuth is seen.

    def as_even(self) -> Sky:  # noqa: D102 - that of the base
        return replace(self, is_even=True)

    def radiance(  # noqa: D102
        self, v: Sequence[Operand], m: Mathematics = NUMPY
    ) -> Operand:
        del m  # pictures are numpy
        found = self.picture.at(np.broadcast_arrays(*v))
        if self.is_even:
            turn = 2.0 * math.atan2(self.sun[1], self.sun[0])
            x, y = (math.cos(turn), math.sin(turn)), (math.sin(turn), -math.cos(turn))
            other = v[0] * x[0] + v[1] * x[1], v[0] * y[0] + v[1] * y[1], v[2]
            found = (found + self.picture.at(np.broadcast_arrays(*other))) / 2.0
        return found @ self.level.T if np.ndim(self.level) == 2 else found * self.level

    def _modes(self, in_air: Array, modes: int, factor: Array | float) -> Array:
        found = self.picture.modes(in_air, modes, math.atan2(self.sun[1], self.sun[0]))
        return np.einsum("mqk,nk->mnq", found, self.level) * factor

    def _around(self, cosine: Array) -> Array:
        return luminance(self.picture.modes(cosine, 1, 0.0)[0])[:, None]
