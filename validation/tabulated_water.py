"""Unoccluded water in bands, from the tables that EEVEE's channels are folded from, in numpy.

Shapes are (..., 1) for rays, (..., n) for what is seen of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.table import Table
from ..uw_spectral.transfer.radiance_field import Ripples, mirrored_ray
from ..uw_spectral.transfer.radiance_table import SUN_ANGLE, RadianceTable, tabulate
from ..uw_spectral.transfer.sky import Sky
from ..uw_spectral.transfer.solved_field import SolvedField
from ..uw_spectral.transfer.sun_beam import half_angle2
from .solved_ray import UNOCCLUDED, PathOcclusion, SolvedPatchLight, SolvedPixel, SolvedWater
from .sun_beam import SunBeam

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class TabulatedWater:
    """Unoccluded water with its surface and its floor; make it with :func:`tabulated_water`.

    The ``cp`` of the direct sun is that of the solution; ``floor`` is the radiance of the floor,
    shape (n,); the sky is in air; ``index`` that of the water against air, without which there is
    no surface that reflects.
    """

    table: RadianceTable
    beam: SunBeam
    floor: Array
    sky: Sky
    index: float | None

    def surface(
        self,
        y_o: Array,
        y_e: Array,
        w: Sequence[Array],
        P: Array,
        L_surface: Array,
        occlusion: PathOcclusion = UNOCCLUDED,
    ) -> SolvedPixel:
        """Pixel of a surface; arguments as of :meth:`.SolvedWater.surface`."""
        image = self.table.boundary_image(_rays(0.0, w)[1], self.beam.sun)
        far = self._scattered(y_e, w)
        seen = replace(self._ahead(y_o, w), far=far, image=image, occlusion=occlusion)
        return seen.surface(y_o, y_e, w, P, L_surface)

    def open_water(
        self,
        y_o: Array,
        w: Sequence[Array],
        ripples: Ripples | None = None,
        occlusion: PathOcclusion = UNOCCLUDED,
    ) -> SolvedPixel:
        """Pixel of open water with the surface or the floor behind."""
        seen = replace(self._ahead(y_o, w), occlusion=occlusion)
        if self.index is not None:
            slopes = None if ripples is None else ripples.slopes
            _, away = mirrored_ray(w, slopes=slopes)
            seen = replace(seen, mirrored=self._scattered(np.zeros_like(w[2]), away))
        return seen.open_water(y_o, w, ripples=ripples)

    def patch_light(self, y: Array, normal: Sequence[Array]) -> SolvedPatchLight:
        """Return the light on patches that face along normals, shapes (..., 1), at depths y."""
        patch = self.table.patch_irradiance(*_rays(y, normal), self.beam.sun)
        return SolvedPatchLight(self.beam, patch)

    def _ahead(self, y_o: Array, w: Sequence[Array]) -> SolvedWater:
        return SolvedWater(
            self.beam,
            self._scattered(y_o, w),
            floor=self.floor,
            sky=self.sky,
            index=self.index,
            aureole=aureole_at(self.table, *_rays(y_o, w), self.beam.sun),
        )

    def _scattered(self, y: Array, w: Sequence[Array]) -> Array:
        return self.table.scattered(*_rays(y, w), self.beam.sun)


def tabulated_water(
    field: SolvedField, beam: SunBeam, sky: Sky, index: float | None
) -> TabulatedWater:
    """Return the water of a solved field, whose cp takes the place of that of the beam."""
    return TabulatedWater(
        tabulate(field), replace(beam, cp=field.extinction), field.floor_radiance, sky, index
    )


def aureole_at(table: RadianceTable, y: Array, w: Sequence[Array], sun: Sequence[float]) -> Array:
    """Factor on sunlight scattered once against w, seen from depth y, shape (..., n)."""
    y, s2 = (part[..., None] for part in np.broadcast_arrays(y, half_angle2(w, sun)))
    axes = table.depth_scale.axis, SUN_ANGLE.axis("s2")
    return Table(np.moveaxis(table.aureole, 0, -1), axes).at(depth=y, s2=s2)


def _rays(y: Array | float, w: Sequence[Array | float]) -> tuple[Array, list[Array]]:
    """Depths and directions of shape (..., 1) without their last axis."""
    y, *w = np.broadcast_arrays(y, *w)
    return y[..., 0], [part[..., 0] for part in w]
