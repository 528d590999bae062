"""What the closed form and what is compared with it ask of water, and of paths in it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from ...uw_spectral.mathematics import NUMPY, Mathematics, Operand
from ...uw_spectral.transfer.radiance_field import (
    distance_in_water,
    mirrored_ray,
    sky_and_mirrored,
)


class Radiant(Protocol):
    """What has a radiance everywhere in the water."""

    def radiance(
        self,
        y: Operand,
        w: Sequence[Operand],
        L_surface: Operand = 0.0,
        m: Mathematics = NUMPY,
    ) -> Operand:
        """Radiance L(y, w) of everything that lies ahead of depth y along w."""
        ...


class PathLight(Protocol):
    """Light that water brings on the way of a ray.

    ``c`` is the extinction, ``cp`` that of the beam that a camera blurs over what it
    sees, both 1/m: light scattered by less than the forward peak stays in the picture.
    They are equal in a field that holds this light itself.
    """

    @property
    def c(self) -> Operand:
        """Extinction, 1/m."""
        ...

    @property
    def cp(self) -> Operand:
        """Extinction without the forward peak of the phase function, 1/m."""
        ...

    def path(
        self, y_o: Operand, w: Sequence[Operand], P: Operand, m: Mathematics = NUMPY
    ) -> Operand:
        """Radiance of the water between depth y_o and distance P along w."""
        ...


class Scattering(Protocol):
    """A phase function per band."""

    def per_steradian(self, s2: Operand, m: Mathematics = NUMPY) -> Operand:
        """Value at s2 = sin²(angle / 2), 1/sr."""
        ...


def end_of_path(
    y_o: Operand, w: Sequence[Operand], P: Operand, y_f: Operand, m: Mathematics = NUMPY
) -> tuple[Operand, Operand]:
    """Length of a path from depth y_o that surface or floor may end, and the depth of its end."""
    P = m.minimum(P, distance_in_water(y_o, -w[2], y_f, m))
    return P, m.clamp(y_o + -w[2] * P, 0.0, y_f)


def under_surface(
    water: Radiant,
    w: Sequence[Operand],
    L_sky: Operand,
    relative_index: Operand,
    m: Mathematics = NUMPY,
    slopes: tuple[Operand, Operand] | None = None,
) -> Operand:
    """Radiance just below the surface, looking up along w.

    The sky inside Snell's window and the mirrored water outside it.

    ``w`` is a unit vector away from the camera, z > 0; the radiance gains a factor n².

    Parameters
    ----------
    water : Radiant
        What the surface mirrors.
    L_sky : float or array
        Radiance of the sky, in air, where the refracted ray meets it.
    slopes : two floats or arrays, optional
        Slopes of the surface along x and y where w meets it; flat without.
    """
    cosine, reflected = mirrored_ray(w, m, slopes)
    mirrored = water.radiance(0.0 * w[2], reflected, m=m)
    return sky_and_mirrored(cosine, L_sky, mirrored, relative_index, m)
