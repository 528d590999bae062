"""Places of a picture of all directions about a view."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..mathematics import NUMPY, Mathematics, Operand, dot
from .grid import Array

SIZE = 160
"""Texels along a side of the picture."""
WIDEST = math.radians(170.0)
_MIDDLE = (SIZE - 1) / 2.0
_LEAST = 1e-12
_BEHIND = 1e-3  # 1 + cosine of what lies straight behind


@dataclass(frozen=True)
class ViewMap:
    """Places of a picture of all directions about an axis, of equal area (Lambert's azimuthal)."""

    centre: Sequence[Operand]  #: Of the view, m.
    #: Unit vectors; ``ahead`` is the middle of the picture.
    right: Sequence[Operand]
    up: Sequence[Operand]
    ahead: Sequence[Operand]
    per_unit: Operand  #: Texels per unit of 2 sin(θ/2), for the angle θ from the middle.

    @property
    def corner(self) -> float:
        """Angle from the middle to the picture's corners, rad."""
        return 2.0 * math.asin(min(_MIDDLE / float(self.per_unit) / math.sqrt(2.0), 1.0))

    @property
    def texel(self) -> float:
        """Solid angle of a texel, sr."""
        return 1.0 / float(self.per_unit) ** 2

    def place(self, point: Sequence[Operand], m: Mathematics = NUMPY) -> tuple[Operand, Operand]:
        """Column and row of a point, held to the picture's sides.

        Examples
        --------
        >>> view = view_map((0, 0, 0), np.eye(3), math.radians(60.0))
        >>> [round(float(x), 3) for x in view.place((0.0, 0.0, -2.0))]
        [79.5, 79.5]
        """
        d = [x - c for x, c in zip(point, self.centre, strict=True)]
        near = 1.0 / m.sqrt(m.maximum(dot(d, d), _LEAST))
        cosine = dot(d, self.ahead) * near
        scale = near * self.per_unit * m.sqrt(2.0 / m.maximum(1.0 + cosine, _BEHIND))
        h, v = dot(d, self.right) * scale, dot(d, self.up) * scale
        last = SIZE - 1.0
        return m.clamp(h + _MIDDLE, 0.0, last), m.clamp(v + _MIDDLE, 0.0, last)

    def ways(self) -> Array:
        """Unit vectors to the texels, (SIZE SIZE, 3); beyond the sphere they turn back."""
        x, y = np.meshgrid(np.arange(SIZE) - _MIDDLE, np.arange(SIZE) - _MIDDLE)
        x, y = x.ravel() / float(self.per_unit), y.ravel() / float(self.per_unit)
        squared = np.minimum(x * x + y * y, 4.0)
        side, cosine = np.sqrt(1.0 - squared / 4.0), 1.0 - squared / 2.0
        axes = np.array([self.right, self.up, self.ahead], np.float64)
        return np.stack([x * side, y * side, cosine], axis=1) @ axes


def view_map(centre: Sequence[float], axes: Array, reach: float) -> ViewMap:
    """Return the map of a view as far as an angle ``reach``, rad, at most :data:`WIDEST`.

    Axes are columns: to the right, up, and back, as a camera has them.
    """
    unit = 2.0 * math.sin(min(reach, WIDEST) / 2.0)
    right, up, back = (tuple(float(x) for x in column) for column in np.asarray(axes).T)
    ahead = tuple(-x for x in back)
    return ViewMap(tuple(map(float, centre)), right, up, ahead, _MIDDLE / unit)
