"""Light that is known by the radiance of its paths."""

from __future__ import annotations

from collections.abc import Sequence

from ...uw_spectral.mathematics import NUMPY, Mathematics, Operand
from ...uw_spectral.transfer.radiance_field import distance_in_water
from .light_field import LightField


class PathField:
    """A radiance field that is known by the radiance of its paths."""

    field: LightField

    @property
    def c(self) -> Operand:
        """Extinction, 1/m."""
        return self.field.c

    @property
    def cp(self) -> Operand:
        """Extinction without the forward peak of the phase function, 1/m."""
        return self.field.cp

    def path(
        self, y_o: Operand, w: Sequence[Operand], P: Operand, m: Mathematics = NUMPY
    ) -> Operand:
        """Radiance of the water between depth y_o and distance P along w."""
        raise NotImplementedError

    def floor_radiance(self, m: Mathematics = NUMPY) -> Operand:
        """Radiance of the Lambertian floor."""
        raise NotImplementedError

    def boundary(self, y: Operand, w: Sequence[Operand], m: Mathematics = NUMPY) -> Operand:
        """Distance from depth y along w to the surface or the floor, m."""
        return distance_in_water(y, -w[2], self.field.y_f, m)

    def boundary_radiance(
        self, w: Sequence[Operand], L_surface: Operand = 0.0, m: Mathematics = NUMPY
    ) -> Operand:
        """Radiance that surface or floor, whichever lies ahead, send against w."""
        return m.select(m.less(-w[2], 0.0), L_surface, self.floor_radiance(m))

    def radiance(
        self,
        y: Operand,
        w: Sequence[Operand],
        L_surface: Operand = 0.0,
        m: Mathematics = NUMPY,
    ) -> Operand:
        """Radiance L(y, w) of the unoccluded water with its floor or surface behind.

        ``w`` is a unit vector away from the camera, z up; ``L_surface`` comes down from the surface
        against it.
        """
        P = self.boundary(y, w, m)
        end = self.boundary_radiance(w, L_surface, m)
        return self.path(y, w, P, m) + m.exp(-self.cp * P) * end
