"""Pictures of skies whose sun and whose diffuse light are known."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uw_spectral.transfer.sky import CLEAR, OVERCAST, Sky

Array = NDArray[np.float64]


@dataclass(frozen=True)
class KnownSky:
    """A sky of the CIE, relative, in colours, and a sun of 0.5°."""

    kind: str
    colour: tuple[float, float, float]
    zenith: float = 30.0  #: Of the sun, degrees.
    azimuth: float = 0.0  #: That its light travels to, degrees.
    sun_colour: tuple[float, float, float] = (0.0, 0.0, 0.0)  #: Its irradiance across its rays.
    tint: tuple[float, float, float] = (0.0, 0.0, 0.0)  #: More towards -y, as a fraction.

    @property
    def sun(self) -> Array:
        """Unit direction that sunlight travels to."""
        z, a = math.radians(self.zenith), math.radians(self.azimuth)
        return np.array([math.sin(z) * math.cos(a), math.sin(z) * math.sin(a), -math.cos(z)])

    def radiance(self, x: Array, y: Array, z: Array) -> Array:
        """Radiance of the sky along directions, (..., 3), its sun apart."""
        sky = Sky(1.0, self.kind, self.sun.tolist()).radiance((x, y, np.maximum(z, 0.02)))
        tinted = 1.0 + np.maximum(-y, 0.0)[..., None] * np.array(self.tint)
        return np.where(z > 0, sky, 0.05)[..., None] * np.array(self.colour) * tinted

    @property
    def sun_irradiance(self) -> Array:
        """Irradiance of the sun on a level plane, (3,)."""
        return math.cos(math.radians(self.zenith)) * np.array(self.sun_colour)

    @property
    def diffuse_irradiance(self) -> Array:
        """That of the rest, on a level plane, (3,), by Gauss in cosine and evenly in azimuth."""
        nodes, weights = (x.astype(np.float64) for x in np.polynomial.legendre.leggauss(200))
        z = (nodes[:, None] + 1.0) / 2.0
        turn = (np.arange(720) + 0.5) * (math.pi / 360.0)
        across = np.sqrt(1.0 - z * z)
        L = self.radiance(*np.broadcast_arrays(across * np.cos(turn), across * np.sin(turn), z))
        return np.einsum("q,qtk->k", weights / 2.0 * z[:, 0], L) * (2.0 * math.pi / len(turn))

    def picture(self, rows: int = 256) -> Array:
        """Pixels, (rows, 2 rows, 3), as Blender has them."""
        zenith = ((np.arange(rows) + 0.5) * (math.pi / rows))[:, None]
        turn = math.pi - (np.arange(2 * rows) + 0.5) * (math.pi / rows)
        x, y = np.sin(zenith) * np.cos(turn), np.sin(zenith) * np.sin(turn)
        z = (np.cos(zenith) + 0.0 * turn).astype(np.float64)
        L = self.radiance(x, y, z)
        # As a lens blurs it; above the horizon alone.
        near = x * self.sun[0] + y * self.sun[1] + z * self.sun[2]
        disc = np.exp((-near - 1.0) / (2.0 * math.radians(0.6) ** 2)) * (z > 0)
        level = (disc * z * np.sin(zenith)).sum() * (math.pi / rows) ** 2
        return L + disc[..., None] * self.sun_irradiance / level


NOON = KnownSky(CLEAR, (0.05, 0.09, 0.16), 35.0, 40.0, (2.6, 2.5, 2.3))
LOW = KnownSky(CLEAR, (0.09, 0.08, 0.08), 78.0, -120.0, (1.3, 0.8, 0.35))
CLOUDY = KnownSky(OVERCAST, (0.5, 0.52, 0.55))
COLOURED = KnownSky(CLEAR, (0.3, 0.12, 0.2), 60.0, 160.0, (1.0, 0.5, 0.2), (1.5, 0.2, 0.0))
KNOWN_SKIES = {"noon": NOON, "low": LOW, "cloudy": CLOUDY, "coloured": COLOURED}
