"""Image formation as the optics has it, β_D(z), β_B(z) and B∞ of a camera in a water; inverted.

In a band the light of an object at range z is left as T = e^{-cz}, and the water adds
B = S(y_o) - T S(y_e): the radiance S that it sends to the camera, less what of it comes from
beyond the object, y being the depths of both. A sensor sums bands, and its channels follow

    I = J e^{-β_D(z) z} + B∞ (1 - e^{-β_B(z) z})

exactly, with coefficients that depend on range (Akkaynak & Treibitz 2018): on the spectrum of
the object for β_D, on that of the backscatter for β_B. In a band of level rays both are c.
Light of surface and floor, dimmed by the water, does not count as backscatter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..spectra.spectrum import Spectrum
from ..transfer.discrete_ordinates import STREAMS
from .formation_fit import Formation, FormationFit
from .range_attenuation import Array, fit_range_attenuation
from .resolved_optics import ResolvedOptics

RANGES = tuple(np.round(np.geomspace(0.25, 30.0, 40), 4).tolist())
"""Ranges in m at which coefficients are tabulated."""
LEVEL = (1.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class FormationCurves(Formation):
    """Coefficients of k channels over m ranges; between them interpolated, beyond them held."""

    z: Array  #: Euclidean ranges, m, (m,).
    #: β_D(z) and β_B(z), 1/m: effective from the camera to z, so that the fraction left is e^{-β(z)
    #: z}, (m, k).
    beta_direct: Array
    beta_backscatter: Array
    B_inf: Array  #: What the water sends to the camera where nothing is in its way, (k,).

    def _left(self, z: ArrayLike, beta: Array) -> Array:
        z = np.asarray(z, dtype=np.float64)
        near = np.where(np.isfinite(z), z, 0.0)
        transmittance = [np.exp(-np.interp(near, self.z, channel) * near) for channel in beta.T]
        return np.where(np.isfinite(z)[..., None], np.stack(transmittance, axis=-1), 0.0)

    def fitted(self) -> FormationFit:
        """Return curves a e^{bz} + c e^{dz} through the coefficients."""
        direct, backscatter = (
            tuple(fit_range_attenuation(self.z, channel) for channel in beta.T)
            for beta in (self.beta_direct, self.beta_backscatter)
        )
        return FormationFit(direct, backscatter, tuple(self.B_inf.tolist()))


@dataclass(frozen=True, eq=False)
class ImageFormation:
    """What turns objects into a picture, for one camera."""

    depth: float  #: Of the camera, m.
    direction: tuple[float, float, float]  #: Unit view direction that it was computed for, z up.
    #: Of the sensor's three channels; B∞ in their response to radiance, before white balance.
    channels: FormationCurves
    bands: FormationCurves  #: Of the n bands; B∞ is a radiance.


def compute_image_formation(
    optics: ResolvedOptics,
    depth: float,
    direction: Sequence[float] = LEVEL,
    ranges: ArrayLike = RANGES,
    reflectance: Spectrum | None = None,
    streams: int = STREAMS,
) -> ImageFormation:
    """Compute the coefficients of image formation.

    The direction is that of the view, z up; its length does not count. Ranges, shape (m,), are
    Euclidean, m; those beyond surface or floor are left out. The reflectance is that of the object,
    lit by Ed of its depth; grey by default.

    D. Akkaynak & T. Treibitz, CVPR 2018, Eq. 8 to 12.

    Raises
    ------
    InputError
        If depth, ranges or direction are out of their domain, or a channel sees no light.
    """
    view = optics.viewpoint(depth)
    length = float(np.linalg.norm(direction))
    if len(direction) != 3 or not 0 < length < np.inf:
        raise InputError(f"image formation: {tuple(direction)} is no direction; give x, y, z")
    w = tuple((np.asarray(direction, np.float64) / length).tolist())
    z = ranges_in_water(optics, depth, w, ranges)
    if z.ndim != 1 or not z.size or not (z > 0).all():
        raise InputError(
            "image formation: give positive ranges that end between surface and floor; the "
            f"camera is at {depth:g} m and looks along {tuple(round(x, 3) for x in w)}"
        )
    ends = depth - w[2] * z
    field = optics.solved_field(streams)

    def sent(y: ArrayLike) -> Array:
        return field.scattered(y, w) + field.single_scattering(y, w)

    c = field.extinction_between(depth, ends, scaled=False)
    transmittance, near = np.exp(-c * z[:, None]), sent(depth)
    # What is left of the backscatter that comes from beyond z; the rest comes from before it.
    beyond = transmittance * sent(ends)
    surface = field.Ed(ends)
    if reflectance is not None:
        surface = surface * reflectance.at(optics.bands.centres)
    response = view.reduction.response.T
    bands = _curves(z, np.ones_like(transmittance), transmittance, near, beyond)
    channels = _curves(z, surface @ response, (transmittance * surface) @ response, near @ response,
                       beyond @ response)  # fmt: skip
    return ImageFormation(depth, w, channels, bands)


def ranges_in_water(
    optics: ResolvedOptics, depth: float, w: Sequence[float], ranges: ArrayLike = RANGES
) -> Array:
    """Return the ranges, in order, at which a ray has reached neither surface nor floor."""
    z = np.sort(np.asarray(ranges, dtype=np.float64))
    ends = depth - w[2] * z
    return z[(ends > 0) & (ends < optics.column.floor_depth)]


def _curves(z: Array, J: Array, D: Array, B_inf: Array, beyond: Array) -> FormationCurves:
    if not ((J > 0).all() and (D > 0).all() and (B_inf > 0).all() and (beyond > 0).all()):
        raise InputError(
            "image formation: a channel sees no light at that depth or range; move the camera up, "
            "or take shorter ranges"
        )
    along = z[:, None]
    return FormationCurves(z, np.log(J / D) / along, np.log(B_inf / beyond) / along, B_inf)


def remove_water(
    values: ArrayLike, z: ArrayLike, formation: Formation, least: float = 0.02
) -> Array:
    """Return J = (I - B(z)) e^{β_D(z) z}, what objects would send if no water were before them.

    Values I, shape (..., k), are linear, of the sensor's channels before white balance; ranges z,
    (...), Euclidean, m, infinite where open water is seen, which becomes black. The transmittance
    does not go below the ``least``, so that noise of what is hardly seen stays bounded.

    D. Akkaynak & T. Treibitz, CVPR 2019, Eq. 8.

    Raises
    ------
    InputError
        If shapes do not match, or a range is not positive.
    """
    seen, z = np.asarray(values, dtype=np.float64), np.asarray(z, dtype=np.float64)
    if seen.shape[:-1] != z.shape:
        raise InputError(f"restoration: values of shape {seen.shape} for ranges of {z.shape}")
    if not (z > 0).all():
        raise InputError("restoration: ranges must be positive; infinite for open water")
    transmittance = np.maximum(formation.transmittance(z), least)
    J = np.maximum(seen - formation.backscatter(z), 0.0) / transmittance
    return np.where(np.isfinite(z)[..., None], J, 0.0)
