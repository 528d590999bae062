"""The elementary functions that per-pixel formulas need, as one injected value.

A per-pixel formula is plain Python over ``+ - * /`` and a :class:`Mathematics`.
With :data:`NUMPY` it runs on arrays; with the functions of a node tree it
builds shader nodes. There is no branch and no division by zero in a formula,
so both give the same number.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Mathematics:
    """Elementary functions over one kind of operand (arrays, sockets).

    Parameters
    ----------
    exp, log, sqrt, absolute : callable
        Of one operand.
    power, minimum, maximum : callable
        Of two operands; the base of ``power`` is positive.
    less : callable
        ``less(x, y)`` is 1 where x < y, else 0.
    interpolate : callable
        ``interpolate(x, xs, ys)``: piecewise linear through fixed points, held
        constant beyond the ends.
    """

    exp: Callable[[Any], Any]
    log: Callable[[Any], Any]
    sqrt: Callable[[Any], Any]
    absolute: Callable[[Any], Any]
    power: Callable[[Any, Any], Any]
    minimum: Callable[[Any, Any], Any]
    maximum: Callable[[Any, Any], Any]
    less: Callable[[Any, Any], Any]
    interpolate: Callable[[Any, Any, Any], Any]

    def clamp(self, x: Any, low: Any, high: Any) -> Any:  # noqa: ANN401
        """Return x held between low and high."""
        return self.minimum(self.maximum(x, low), high)

    def select(self, condition: Any, if_one: Any, if_zero: Any) -> Any:  # noqa: ANN401
        """Pick by a 0/1 condition; both values must be finite."""
        return condition * if_one + (1.0 - condition) * if_zero


def _interpolate(x: Any, xs: Any, ys: Any) -> Any:  # noqa: ANN401
    x = np.asarray(x)
    return np.interp(x, xs, ys).astype(x.dtype)


NUMPY = Mathematics(
    exp=np.exp,
    log=np.log,
    sqrt=np.sqrt,
    absolute=np.abs,
    power=np.power,
    minimum=np.minimum,
    maximum=np.maximum,
    # Multiplied, not cast: the mask keeps the precision of its operands.
    less=lambda x, y: (x < y) * np.ones((), dtype=np.result_type(x, y)),
    interpolate=_interpolate,
)
