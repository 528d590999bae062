"""Pixels of undisturbed water whose light is known in closed form."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..mathematics import NUMPY, Mathematics, Operand
from ..transfer.pixel import PatchLight, Pixel, light_from_surface
from ..transfer.radiance_field import RadianceField, Ripples, under_surface
from ..transfer.sky import BLACK, Sky
from .closed_form import ClosedForm
from .inelastic_light import InelasticLight


@dataclass(frozen=True, eq=False)
class UndisturbedWater:
    """Water with its surface and its floor, as if nothing else were in it.

    Parameters
    ----------
    elastic : ClosedForm
        Its light.
    sky : Sky
        The sky, in air; black by default.
    index : float, optional
        Index of the water against air; without one there is no surface that reflects.
    inelastic : InelasticLight, optional
        Light of changed wavelength; a surface mirrors it as if it were flat.
    """

    elastic: ClosedForm
    sky: Sky = BLACK
    index: Operand | None = None
    inelastic: InelasticLight | None = None

    def from_surface(
        self,
        y: Operand,
        w: Sequence[Operand],
        m: Mathematics = NUMPY,
        ripples: Ripples | None = None,
    ) -> Operand:
        """Radiance that comes down from the surface against w, seen from depth y."""
        water = self.elastic
        return light_from_surface(water, water.beam, self.sky, self.index, y, w, m, ripples)

    def radiance(self, y: Operand, w: Sequence[Operand], m: Mathematics = NUMPY) -> Operand:
        """Radiance L(y, w) of everything ahead of depth y along w, under a flat surface."""
        return self.elastic.radiance(y, w, self.from_surface(y, w, m), m)

    def surface(
        self,
        y_o: Operand,
        y_e: Operand,
        w: Sequence[Operand],
        P: Operand,
        L_surface: Operand,
        m: Mathematics = NUMPY,
        *,
        L_inelastic: Operand = 0.0,
        coverage: Operand = 1.0,
    ) -> Pixel:
        """Pixel of a surface.

        Parameters
        ----------
        y_o, y_e : float or array
            Depths of the camera and of the surface, m.
        w : three floats or arrays
            Unit view direction, away from the camera, z up.
        P : float or array
            Distance, m.
        L_surface, L_inelastic : float or array
            Radiance of the surface in elastic light, and in light of changed wavelength.
        m : Mathematics
            Elementary functions.
        coverage : float or array
            Share of the pixel that the surface fills; its radiances are multiplied by it.
        """
        changed = None
        if self.inelastic is not None:
            mirrored = self._mirrored(self.inelastic, w, m)
            beyond = self.inelastic.radiance(y_e, w, mirrored, m)
            changed = Pixel(self.inelastic, y_o, w, P, L_inelastic, beyond, m, coverage=coverage)
        beyond = self.radiance(y_e, w, m)
        return Pixel(self.elastic, y_o, w, P, L_surface, beyond, m, changed, coverage)

    def open_water(
        self,
        y_o: Operand,
        w: Sequence[Operand],
        m: Mathematics = NUMPY,
        ripples: Ripples | None = None,
    ) -> Pixel:
        """Pixel of open water with the surface or the floor behind; arguments as above."""
        changed = None
        if self.inelastic is not None:
            mirrored = self._mirrored(self.inelastic, w, m)
            changed = _to_boundary(self.inelastic, y_o, w, mirrored, m)
        L_surface = self.from_surface(y_o, w, m, ripples)
        return _to_boundary(self.elastic, y_o, w, L_surface, m, changed)

    def patch_light(self, y: Operand, normal: Sequence[Operand]) -> PatchLight:
        """Return the elastic light on patches, at any depth and along any normal."""
        del y, normal
        return self.elastic.field

    def _mirrored(self, light: RadianceField, w: Sequence[Operand], m: Mathematics) -> Operand:
        """Radiance of water under a black sky that a flat surface mirrors down."""
        return 0.0 if self.index is None else under_surface(light, w, 0.0, self.index, m)


def _to_boundary(
    water: RadianceField,
    y_o: Operand,
    w: Sequence[Operand],
    L_surface: Operand,
    m: Mathematics,
    changed: Pixel | None = None,
) -> Pixel:
    end = water.boundary_radiance(w, L_surface, m)
    return Pixel(water, y_o, w, water.boundary(y_o, w, m), end, end, m, changed)
