"""What lamps' light on surfaces is about proportional to, by tables that are quick to look up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..mathematics import dot
from ..table import LOGARITHMIC, Scale, Table, angular
from .lamp import Lamp
from .lamp_channels import LampChannels

Array = NDArray[np.float64]
_LEAST_FACING, _FAINTEST = 0.05, 1e-6
_SCALES = Scale(64, 0.03, 200.0, LOGARITHMIC), Scale(256, 1.0, -1.0, angular(1.0))


@dataclass(frozen=True, eq=False)
class IrradianceDecay:
    """Of each lamp: its irradiance on what faces it times the square of the distance."""

    tables: Sequence[tuple[Lamp, Table]]

    @classmethod
    def of(cls, lamps: LampChannels) -> IrradianceDecay:
        """Tabulate it, the sum of the channels."""
        r, angle = _SCALES[0].values()[:, None, None], _SCALES[1].values()[:, None]
        axes, found = (_SCALES[0].axis("length"), _SCALES[1].axis("cosine")), []
        for lamp, projected in zip(lamps.lamps, lamps.projected, strict=True):
            across = np.cross(lamp.axis, np.eye(3)[np.argmin(np.abs(lamp.axis))])
            across /= np.linalg.norm(across)
            u = [
                a * np.cos(angle) + b * np.sin(angle)
                for a, b in zip(lamp.axis, across, strict=True)
            ]
            point = [a + b * r for a, b in zip(lamp.position, u, strict=True)]
            one = replace(lamps, lamps=(lamp,), projected=(projected,))
            E = np.abs(one.irradiance(point, [-x for x in u])).sum(axis=-1, keepdims=True) * r * r
            least = _FAINTEST * E.max(axis=1, keepdims=True)
            found.append((lamp, Table(np.maximum(E, least), axes)))
        return cls(found)

    def at(self, point: Sequence[Array], w: Sequence[Array]) -> Array:
        """Sum of the lamps at places, seen along directions, (...) each of (..., 1) by coordinate.

        It has the edges of their beams, and falls off as they do: the rest varies little.
        """
        total = np.zeros(())
        for lamp, table in self.tables:
            r, u = lamp.towards(point)
            facing = np.maximum(dot(w, u), _LEAST_FACING) / (r * r)
            total = total + facing * table.at(length=r, cosine=dot(lamp.axis, u))
        return total[..., 0]
