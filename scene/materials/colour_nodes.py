"""What Blender's nodes of colours do, on arrays of shape (n, 3)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_LEAST = 1e-20


def as_hsv(rgb: Array) -> Array:
    """Return hue, saturation and value."""
    most, span = rgb.max(axis=1), np.ptp(rgb, axis=1)
    (r, g, b), divisor = rgb.T, np.maximum(span, _LEAST)
    sixth = np.where(
        rgb.argmax(axis=1) == 0,
        (g - b) / divisor,
        np.where(rgb.argmax(axis=1) == 1, 2.0 + (b - r) / divisor, 4.0 + (r - g) / divisor),
    )
    saturation = np.where(most > 0.0, span / np.maximum(most, _LEAST), 0.0)
    return np.stack([np.where(span > 0.0, sixth / 6.0 % 1.0, 0.0), saturation, most], axis=1)


def from_hsv(hsv: Array) -> Array:
    """Return the colours of hue, saturation and value."""
    hue, saturation, value = (x[:, None] for x in hsv.T)
    k = (np.array([5.0, 3.0, 1.0]) + 6.0 * hue) % 6.0
    return value * (1.0 - saturation * np.clip(np.minimum(k, 4.0 - k), 0.0, 1.0))


def as_hsl(rgb: Array) -> Array:
    """Return hue, saturation and lightness."""
    most, span = rgb.max(axis=1), np.ptp(rgb, axis=1)
    light = most - span / 2.0
    saturation = span / np.maximum(1.0 - np.abs(2.0 * light - 1.0), _LEAST)
    return np.stack([as_hsv(rgb)[:, 0], np.where(span > 0.0, saturation, 0.0), light], axis=1)


def from_hsl(hsl: Array) -> Array:
    """Return the colours of hue, saturation and lightness."""
    hue, saturation, light = hsl.T
    value = light + saturation * np.minimum(light, 1.0 - light)
    found = np.where(value > 0.0, 2.0 * (1.0 - light / np.maximum(value, _LEAST)), 0.0)
    return from_hsv(np.stack([hue, found, value], axis=1))


def _mixed(blend: Callable[[Array, Array], Array]) -> Callable[[Array, Array, Array], Array]:
    return lambda a, b, t: a + t * (blend(a, b) - a)


def _overlay(a: Array, b: Array, t: Array) -> Array:
    m = 1.0 - t
    return np.where(a < 0.5, a * (m + 2.0 * t * b), 1.0 - (m + 2.0 * t * (1.0 - b)) * (1.0 - a))


def _dodge(a: Array, b: Array, t: Array) -> Array:
    rest = 1.0 - t * b
    bright = np.where(rest <= 0.0, 1.0, np.minimum(a / np.where(rest <= 0.0, 1.0, rest), 1.0))
    return np.where(a != 0.0, bright, 0.0)


def _burn(a: Array, b: Array, t: Array) -> Array:
    rest = 1.0 - t + t * b
    return np.where(
        rest <= 0.0, 0.0, np.clip(1.0 - (1.0 - a) / np.where(rest <= 0.0, 1.0, rest), 0.0, 1.0)
    )


def _divide(a: Array, b: Array, t: Array) -> Array:
    return np.where(b != 0.0, (1.0 - t) * a + t * a / np.where(b != 0.0, b, 1.0), a)


def _soft(a: Array, b: Array) -> Array:
    screen = 1.0 - (1.0 - b) * (1.0 - a)
    return (1.0 - a) * b * a + a * screen


def _parts(*places: int) -> Callable[[Array, Array, Array], Array]:
    """Return a blend that takes some of hue, saturation and value from the other colour."""

    def blend(a: Array, b: Array, t: Array) -> Array:
        a, b = np.broadcast_arrays(a, b)
        found, other = as_hsv(a), as_hsv(b)
        found[:, places] = other[:, places]
        # What is grey has no hue to give.
        grey = (other[:, 1:2] == 0.0) & (0 in places)
        return np.where(grey, a, a + t * (from_hsv(found) - a))

    return blend


def _of_one(place: int) -> Callable[[Array, Array, Array], Array]:
    def blend(a: Array, b: Array, t: Array) -> Array:
        a, b = np.broadcast_arrays(a, b)
        found, fraction = as_hsv(a), t[:, 0]
        mixed = found[:, place] + fraction * (as_hsv(b)[:, place] - found[:, place])
        found = np.repeat(found, len(mixed) // len(found), axis=0)
        found[:, place] = np.where((found[:, 1] == 0.0) & (place == 1), found[:, 1], mixed)
        return from_hsv(found)

    return blend


BLENDS: dict[str, Callable[[Array, Array, Array], Array]] = {
    "MIX": _mixed(lambda _, b: b),
    "ADD": lambda a, b, t: a + t * b,
    "SUBTRACT": lambda a, b, t: a - t * b,
    "MULTIPLY": _mixed(np.multiply),
    "DIVIDE": _divide,
    "SCREEN": lambda a, b, t: 1.0 - (1.0 - t * b) * (1.0 - a),
    "OVERLAY": _overlay,
    "DIFFERENCE": _mixed(lambda a, b: np.abs(a - b)),
    "EXCLUSION": lambda a, b, t: np.maximum(a + t * (b - 2.0 * a * b), 0.0),
    "DARKEN": _mixed(np.minimum),
    "LIGHTEN": _mixed(np.maximum),
    "DODGE": _dodge,
    "BURN": _burn,
    "SOFT_LIGHT": _mixed(_soft),
    "LINEAR_LIGHT": lambda a, b, t: a + t * (2.0 * b - 1.0),
    "HUE": _parts(0),
    "SATURATION": _of_one(1),
    "VALUE": _of_one(2),
    "COLOR": _parts(0, 1),
}
"""By blend type: colour, other colour and factor; ``factor`` has the shape (1 or n, 1)."""
