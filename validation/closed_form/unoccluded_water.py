"""Pixels of unoccluded water whose light is known in closed form."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...uw_spectral.mathematics import NUMPY, Mathematics, Operand
from ...uw_spectral.transfer.sky import BLACK, Sky
from .closed_form import ClosedForm
from .paths import under_surface
from .pixel import PatchLight, Pixel


@dataclass(frozen=True, eq=False)
class UnoccludedWater:
    """Water with its surface and its floor, as if nothing else were in it."""

    elastic: ClosedForm
    sky: Sky = BLACK  #: In air.
    #: Index of the water against air; without one there is no surface that reflects.
    index: Operand | None = None

    def from_surface(self, w: Sequence[Operand], m: Mathematics = NUMPY) -> Operand:
        """Radiance that comes down from the surface against w."""
        if self.index is None:
            return self.sky.radiance(w, m)
        L_sky = self.sky.seen_through(w, self.index, m)
        return under_surface(self.elastic, w, L_sky, self.index, m)

    def radiance(self, y: Operand, w: Sequence[Operand], m: Mathematics = NUMPY) -> Operand:
        """Radiance L(y, w) of everything ahead of depth y along w, under a flat surface."""
        return self.elastic.radiance(y, w, self.from_surface(w, m), m)

    def surface(
        self,
        y_o: Operand,
        y_e: Operand,
        w: Sequence[Operand],
        P: Operand,
        L_surface: Operand,
        m: Mathematics = NUMPY,
        *,
        coverage: Operand = 1.0,
    ) -> Pixel:
        """Pixel of a surface of which ``L_surface`` is the radiance, multiplied by the coverage."""
        beyond = self.radiance(y_e, w, m)
        return Pixel(self.elastic, y_o, w, P, L_surface, beyond, m, coverage=coverage)

    def open_water(self, y_o: Operand, w: Sequence[Operand], m: Mathematics = NUMPY) -> Pixel:
        """Pixel of open water with the surface or the floor behind; arguments as above."""
        water = self.elastic
        end = water.boundary_radiance(w, self.from_surface(w, m), m)
        return Pixel(water, y_o, w, water.boundary(y_o, w, m), end, end, m)

    def patch_light(self, y: Operand, normal: Sequence[Operand]) -> PatchLight:
        """Return the elastic light on patches, at any depth and along any normal."""
        del y, normal
        return self.elastic.field
