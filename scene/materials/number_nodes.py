"""What Blender's nodes of numbers and vectors do, on arrays of columns."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def _safe(x: Array, y: Array) -> Array:
    return np.where(y == 0.0, 0.0, x / np.where(y == 0.0, 1.0, y))


def _wrap(x: Array, high: Array, low: Array) -> Array:
    size = high - low
    return np.where(size == 0.0, low, x - size * np.floor(_safe(x - low, size)))


def _ping_pong(x: Array, y: Array) -> Array:
    return np.where(y == 0.0, 0.0, np.abs(_fraction(_safe(x - y, 2.0 * y)) * 2.0 * y - y))


def _fraction(x: Array) -> Array:
    return x - np.floor(x)


def _smooth_least(a: Array, b: Array, c: Array) -> Array:
    h = _safe(np.maximum(c - np.abs(a - b), 0.0), c)
    return np.where(c == 0.0, np.minimum(a, b), np.minimum(a, b) - h**3 * c / 6.0)


MATHS: dict[str, Callable[..., Array]] = {
    "ADD": np.add,
    "SUBTRACT": np.subtract,
    "MULTIPLY": np.multiply,
    "DIVIDE": _safe,
    "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "POWER": np.power,
    "LOGARITHM": lambda a, b: np.log(a) / np.log(b),
    "SQRT": lambda a: np.sqrt(np.maximum(a, 0.0)),
    "INVERSE_SQRT": lambda a: 1.0 / np.sqrt(a),
    "ABSOLUTE": np.abs,
    "EXPONENT": np.exp,
    "MINIMUM": np.minimum,
    "MAXIMUM": np.maximum,
    "LESS_THAN": lambda a, b: (a < b) * 1.0,
    "GREATER_THAN": lambda a, b: (a > b) * 1.0,
    "SIGN": np.sign,
    "COMPARE": lambda a, b, c: (np.abs(a - b) <= np.maximum(c, 1e-5)) * 1.0,
    "SMOOTH_MIN": _smooth_least,
    "SMOOTH_MAX": lambda a, b, c: -_smooth_least(-a, -b, c),
    "ROUND": lambda a: np.floor(a + 0.5),
    "FLOOR": np.floor,
    "CEIL": np.ceil,
    "TRUNC": np.trunc,
    "FRACT": _fraction,
    "MODULO": np.fmod,
    "FLOORED_MODULO": np.mod,
    "WRAP": _wrap,
    "SNAP": lambda a, b: np.floor(_safe(a, b)) * b,
    "PINGPONG": _ping_pong,
    "SINE": np.sin,
    "COSINE": np.cos,
    "TANGENT": np.tan,
    "ARCSINE": lambda a: np.arcsin(np.clip(a, -1.0, 1.0)),
    "ARCCOSINE": lambda a: np.arccos(np.clip(a, -1.0, 1.0)),
    "ARCTANGENT": np.arctan,
    "ARCTAN2": np.arctan2,
    "SINH": np.sinh,
    "COSH": np.cosh,
    "TANH": np.tanh,
    "RADIANS": np.radians,
    "DEGREES": np.degrees,
}
"""By operation of Math."""


def _dot(a: Array, b: Array) -> Array:
    return (a * b).sum(axis=1, keepdims=True)


def _length(a: Array) -> Array:
    return np.linalg.norm(a, axis=1, keepdims=True)


_BY_AXIS = {
    "ADD", "SUBTRACT", "MULTIPLY", "DIVIDE", "MULTIPLY_ADD", "ABSOLUTE", "POWER", "SIGN", "MINIMUM",
    "MAXIMUM", "FLOOR", "CEIL", "MODULO", "WRAP", "SNAP", "SINE", "COSINE", "TANGENT",
}  # fmt: skip
VECTOR_MATHS: dict[str, Callable[..., Array]] = {name: MATHS[name] for name in _BY_AXIS} | {
    "ROUND": MATHS["ROUND"],
    "FRACTION": _fraction,
    "SCALE": np.multiply,
    "DOT_PRODUCT": _dot,
    "CROSS_PRODUCT": np.cross,
    "LENGTH": _length,
    "DISTANCE": lambda a, b: _length(a - b),
    "NORMALIZE": lambda a: _safe(a, _length(a)),
    "PROJECT": lambda a, b: _safe(_dot(a, b), _dot(b, b)) * b,
    "REFLECT": lambda a, b: a - 2.0 * _safe(_dot(a, b), _dot(b, b)) * b,
}
"""By operation of Vector Math."""


def map_range(
    x: Array,
    low: Array,
    high: Array,
    first: Array,
    last: Array,
    *more: Array,
    kind: str,
    clamp: bool,
) -> Array:
    """Return what Map Range makes of values; ``more`` are its steps."""
    fraction = _safe(x - low, high - low)
    if kind == "STEPPED":
        (steps,) = more
        fraction = np.where(steps > 0.0, _safe(np.floor(fraction * (steps + 1.0)), steps), 0.0)
    elif kind.startswith("SMOOTH"):
        fraction = np.clip(fraction, 0.0, 1.0)
        fraction = (
            fraction**2 * (3.0 - 2.0 * fraction)
            if kind == "SMOOTHSTEP"
            else (fraction**3 * (fraction * (fraction * 6.0 - 15.0) + 10.0))
        )
    found = first + fraction * (last - first)
    return np.clip(found, np.minimum(first, last), np.maximum(first, last)) if clamp else found
