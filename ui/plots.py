"""Small pictures of spectra, drawn with numpy alone.

Every picture is an array of shape (height, width, 4): display (sRGB) values
and alpha from 0 to 1, in single precision, the first row on top. Blender
stores the last row first: give it ``picture[::-1].ravel()``.
"""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.spectra.colour_rendering import rec709_to_XYZ, srgb_encode
from ..uw_spectral.spectra.sensor import Sensor, standard_observer
from ..uw_spectral.spectra.spectrum import Spectrum

SIZE = (320, 160)
"""Width and height of a picture in pixels."""

Picture = NDArray[np.float32]
Colour = tuple[float, float, float]

_CARD: Colour = (0.105, 0.11, 0.12)
_GRID: Colour = (0.24, 0.25, 0.27)
_TEXT: Colour = (0.66, 0.68, 0.71)
_BRIGHT: Colour = (0.92, 0.93, 0.95)
_COEFFICIENT_COLOURS: tuple[Colour, ...] = (
    (1.00, 0.66, 0.30), (0.45, 0.78, 1.00), (0.72, 0.91, 0.48), (0.85, 0.60, 0.95),
)  # fmt: skip
_CHANNEL_COLOURS: tuple[Colour, ...] = ((1.0, 0.36, 0.34), (0.40, 0.86, 0.44), (0.42, 0.60, 1.0))
_DECADES_SHOWN = 3.0
# A font 5 pixels wide and 7 high; each glyph is its rows, from the top, as bits.
_GLYPHS = {
    "0": (14, 17, 19, 21, 25, 17, 14), "1": (4, 12, 4, 4, 4, 4, 14),
    "2": (14, 17, 1, 2, 4, 8, 31), "3": (31, 2, 4, 2, 1, 17, 14),
    "4": (2, 6, 10, 18, 31, 2, 2), "5": (31, 16, 30, 1, 1, 17, 14),
    "6": (6, 8, 16, 30, 17, 17, 14), "7": (31, 1, 2, 4, 8, 8, 8),
    "8": (14, 17, 17, 14, 17, 17, 14), "9": (14, 17, 17, 15, 1, 2, 12),
    ".": (0, 0, 0, 0, 0, 12, 12), "-": (0, 0, 0, 31, 0, 0, 0),
    "/": (0, 1, 2, 4, 8, 16, 0), "%": (24, 25, 2, 4, 8, 19, 3),
    "a": (0, 0, 14, 1, 15, 17, 15), "b": (16, 16, 22, 25, 17, 17, 30),
    "c": (0, 0, 14, 16, 16, 17, 14), "d": (1, 1, 13, 19, 17, 17, 15),
    "e": (0, 0, 14, 17, 31, 16, 14),
    "m": (0, 0, 26, 21, 21, 17, 17), "n": (0, 0, 22, 25, 17, 17, 17),
    "x": (0, 0, 17, 10, 4, 10, 17), "y": (0, 0, 17, 17, 15, 1, 14),
    "z": (0, 0, 31, 2, 4, 8, 31), "B": (30, 17, 17, 30, 17, 17, 30),
    "E": (31, 16, 16, 30, 16, 16, 31), "G": (14, 17, 16, 23, 17, 17, 15),
    "K": (17, 18, 20, 24, 20, 18, 17), "R": (30, 17, 17, 30, 20, 18, 17),
    " ": (0, 0, 0, 0, 0, 0, 0),
}  # fmt: skip
_ADVANCE, _GLYPH_HEIGHT = 6, 7


def spectrum_colours(wavelengths: ArrayLike) -> NDArray[np.float64]:
    """Display colours that stand for wavelengths, shape (n, 3).

    The hue is that of the CIE 1931 observer, brought into sRGB by adding
    white; the ends of the spectrum are dimmed, but stay visible.

    Examples
    --------
    >>> spectrum_colours([450, 650]).argmax(axis=1)
    array([2, 0])
    """
    nm = np.atleast_1d(np.asarray(wavelengths, dtype=np.float64))
    observer = standard_observer().sensitivity
    XYZ = observer.at(np.clip(nm, *observer.range))
    rgb = XYZ @ np.linalg.inv(rec709_to_XYZ()).T
    rgb -= 0.8 * np.minimum(rgb.min(axis=1, keepdims=True), 0.0)
    rgb = np.clip(rgb, 0.0, None)
    # A soft maximum: the hard one has kinks at the primaries, which show as lines.
    rgb /= np.maximum((rgb**3).sum(axis=1, keepdims=True) ** (1 / 3), 1e-12)
    ends = np.clip(np.minimum((nm - 380.0) / 40.0, (740.0 - nm) / 80.0), 0.0, 1.0)
    return srgb_encode(rgb * (0.12 + 0.88 * ends[:, None]))


def plot_coefficients(
    coefficients: Mapping[str, Spectrum], bands: Bands, size: tuple[int, int] = SIZE
) -> Picture:
    """Draw up to four coefficients of a water by label, in 1/m, on a logarithmic axis.

    Labels use the characters of the picture's font; the centres of ``bands`` are marked, and their
    range is drawn; ``size`` is width and height in pixels. Raises InputError if the picture is too
    small, nothing is positive, or a character is not in the font.
    """
    if not 1 <= len(coefficients) <= len(_COEFFICIENT_COLOURS):
        raise InputError(f"plot: give 1 to {len(_COEFFICIENT_COLOURS)} curves")
    axes = _Axes.new(size, bands)
    curves = [_sampled(spectrum, axes.wavelengths) for spectrum in coefficients.values()]
    stacked = np.concatenate(curves)
    positive = stacked[np.isfinite(stacked) & (stacked > 0)]
    if not positive.size:
        raise InputError("plot: every coefficient is zero; there is nothing to draw")
    top = math.log10(positive.max()) + 0.08
    bottom = max(math.log10(positive.min()) - 0.08, top - _DECADES_SHOWN)
    bottom = min(bottom, top - 1.0)
    labelled = (1, 2, 5) if top - bottom < 2 else (1,)
    for decade in range(math.ceil(bottom - 1), math.floor(top) + 1):
        for step in range(1, 10):
            height = (decade + math.log10(step) - bottom) / (top - bottom)
            if 0 <= height <= 1:
                label = _number(step * 10.0**decade) if step in labelled else None
                axes.grid_line(height, label, 1.0 if step == 1 else 0.35)
    axes.mark(bands)
    for curve, colour in zip(curves, _COEFFICIENT_COLOURS, strict=False):
        with np.errstate(divide="ignore", invalid="ignore"):
            axes.curve((np.log10(curve) - bottom) / (top - bottom), colour)
    axes.legend(zip(coefficients, _COEFFICIENT_COLOURS, strict=False))
    axes.text("1/m", axes.left, 5)
    return axes.picture


def plot_sensor(
    sensor: Sensor, bands: Bands | None = None, size: tuple[int, int] = SIZE
) -> Picture:
    """Draw the three curves of a sensor, each over its own largest value, and mark bands.

    ``size`` is width and height in pixels; raises InputError if it is too small.
    """
    axes = _Axes.new(size, bands, margin_left=16)
    for height in (0.0, 0.25, 0.5, 0.75, 1.0):
        axes.grid_line(height / 1.06, None, 0.6)
    axes.mark(bands)
    values = sensor.sensitivity.at_or_zero(axes.wavelengths)
    values /= sensor.sensitivity.values.max(axis=0)
    for column, colour in zip(values.T, _CHANNEL_COLOURS, strict=True):
        axes.fill(column / 1.06, colour, 0.14)
    for column, colour in zip(values.T, _CHANNEL_COLOURS, strict=True):
        axes.curve(column / 1.06, colour)
    labels = "xyz" if sensor.kind == "observer" else "RGB"
    axes.legend(zip(labels, _CHANNEL_COLOURS, strict=True))
    return axes.picture


def plot_transmitted_light(
    light: Spectrum, bands: Bands | None = None, size: tuple[int, int] = SIZE
) -> Picture:
    """Draw the fraction of light that is left at a depth, filled with the spectrum's colours.

    The axis ends at the next of 0.01, 0.02, 0.05 … 100 % above the largest share. Centres of bands
    are marked; ``size`` is width and height in pixels; raises InputError if it is too small.
    """
    axes = _Axes.new(size, bands, margin_left=36)
    fractions = _sampled(light, axes.wavelengths)
    top = _next_round(float(np.nanmax(fractions, initial=0.0)))
    for height in (0.0, 0.5, 1.0):
        axes.grid_line(height * 0.95, _number(height * top * 100) + "%", 0.8)
    heights = fractions / top * 0.95
    axes.fill(heights, spectrum_colours(axes.wavelengths), 0.75)
    axes.mark(bands)
    axes.curve(heights, _BRIGHT)
    return axes.picture


@dataclass(frozen=True, eq=False)
class _Axes:
    """A card with a plot area: wavelength to the right, heights from 0 to 1 upwards."""

    picture: Picture
    left: int
    right: int
    top: int
    bottom: int
    wavelengths: NDArray[np.float64]

    @classmethod
    def new(cls, size: tuple[int, int], bands: Bands | None, margin_left: int = 36) -> _Axes:
        """Paint the card, the strip of the spectrum, and the wavelengths below it."""
        width, height = size
        if width < 120 or height < 60:
            raise InputError(f"plot: {width} × {height} pixels are too few; give 120 × 60 or more")
        picture = np.zeros((height, width, 4), dtype=np.float32)
        picture[..., :3] = _CARD
        picture[..., 3] = _rounded(size, 5.0)
        left, right, top, bottom = margin_left, width - 12, 17, height - 22
        start, end = 400.0, 700.0
        if bands is not None:
            start = min(start, float(bands.centres[0] - bands.widths[0] / 2))
            end = max(end, float(bands.centres[-1] + bands.widths[-1] / 2))
        pixels = np.arange(right - left) + 0.5
        wavelengths = start + (end - start) * pixels / (right - left)
        axes = cls(picture, left, right, top, bottom, wavelengths)
        strip = picture[bottom + 2 : bottom + 6, left:right]
        strip[..., :3] = spectrum_colours(wavelengths)
        for nm in range(100 * math.ceil(start / 100), int(end) + 1, 100):
            column = axes.column(nm)
            text = f"{nm}" if nm + 100 <= end else f"{nm} nm"
            length = _ADVANCE * len(f"{nm}")
            x = min(round(column - length / 2), width - _ADVANCE * len(text) - 2)
            axes.text(text, x, bottom + 10)
            _line(picture[top:bottom], column, _GRID, 0.6)
        return axes

    def column(self, nm: float) -> float:
        """Return the horizontal position of a wavelength, pixels from the left edge."""
        step = self.wavelengths[1] - self.wavelengths[0]
        return self.left + (nm - self.wavelengths[0]) / step + 0.5

    def grid_line(self, height: float, label: str | None, strength: float) -> None:
        """Draw a level line, with a label to its left."""
        row = self.bottom - height * (self.bottom - self.top)
        _paint(self.picture[round(row - 0.5), self.left : self.right], _GRID, strength)
        if label is not None:
            y = round(row - _GLYPH_HEIGHT / 2)
            lowest = self.bottom - (_GLYPH_HEIGHT - 1)
            self.text(label, self.left - len(label) * _ADVANCE - 2, min(y, lowest))

    def mark(self, bands: Bands | None) -> None:
        """Mark the band centres by lines in their colour."""
        if bands is None:
            return
        strength = 0.6 * min(1.0, math.sqrt(16 / len(bands)))
        area = self.picture[self.top : self.bottom]
        for nm, colour in zip(bands.centres, spectrum_colours(bands.centres), strict=True):
            _line(area, self.column(nm), tuple(0.3 + 0.7 * colour), strength)

    def curve(self, heights: NDArray[np.float64], colour: Colour) -> None:
        """Draw an anti-aliased curve, one height per column; not finite is not drawn."""
        rows, y = self._rows(heights)
        steepness = np.sqrt(1.0 + np.gradient(y) ** 2)
        distance = np.abs(rows - y) / steepness
        cover = np.clip(1.35 - distance, 0.0, 1.0)
        self._paint_area(colour, np.nan_to_num(cover))

    def fill(self, heights: NDArray[np.float64], colour: ArrayLike, strength: float) -> None:
        """Fill the area below a curve, with one colour or one per column."""
        rows, y = self._rows(heights)
        self._paint_area(colour, strength * np.nan_to_num(np.clip(rows - y + 0.5, 0.0, 1.0)))

    def legend(self, entries: Iterable[tuple[str, Colour]]) -> None:
        """Write labels in their colours, above the plot area, to the right."""
        x = self.right
        for text, colour in reversed(list(entries)):
            x -= _ADVANCE * len(text)
            self.text(text, x, 5, colour)
            x -= _ADVANCE

    def text(self, text: str, x: int, y: int, colour: Colour = _TEXT) -> None:
        """Write text with its upper left corner at (x, y)."""
        mask = _text_mask(text)
        height, width = self.picture.shape[:2]
        x, y = max(x, 0), max(y, 0)
        mask = mask[: height - y, : width - x]
        _paint(self.picture[y : y + mask.shape[0], x : x + mask.shape[1]], colour, mask)

    def _rows(
        self, heights: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Pixel centres down the area as a column, and the curve in the same measure."""
        extent = self.bottom - self.top
        # Clipped just outside, so that what leaves the area does not run along its edge.
        inside = np.clip(heights, -8.0 / extent, 1.0 + 8.0 / extent)
        return np.arange(extent, dtype=np.float64)[:, None] + 0.5, (1.0 - inside) * extent

    def _paint_area(self, colour: ArrayLike, cover: NDArray[np.float64]) -> None:
        _paint(self.picture[self.top : self.bottom, self.left : self.right], colour, cover)


def _sampled(spectrum: Spectrum, wavelengths: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values of a spectrum, its ends held for half a grid step, NaN beyond."""
    low, high = spectrum.range
    reach = float(np.diff(spectrum.wavelengths).max(initial=0.0)) / 2 + 1e-9
    values = spectrum.at(np.clip(wavelengths, low, high))
    outside = (wavelengths < low - reach) | (wavelengths > high + reach)
    return np.where(outside, np.nan, values)


def _next_round(fraction: float) -> float:
    """Smallest of 1, 2, 5 × 10^k, from 1e-4 to 1, that is no less than a fraction."""
    if fraction <= 1e-4:
        return 1e-4
    power = 10.0 ** math.floor(math.log10(fraction))
    return min(
        next(step * power for step in (1, 2, 5, 10) if step * power >= fraction * 0.999), 1.0
    )


def _number(value: float) -> str:
    """Write a number briefly: 0.05, 1e-5."""
    return re.sub(r"e([+-])0?", lambda found: "e" + found[1].strip("+"), f"{value:.3g}")


def _paint(area: NDArray[np.float32], colour: ArrayLike, cover: ArrayLike) -> None:
    """Lay a colour over an opaque part of a picture, by its cover from 0 to 1."""
    fraction = np.asarray(cover, dtype=np.float32)
    # Channel by channel, because numpy is slow on a last axis of three.
    for channel, target in enumerate(np.asarray(colour, dtype=np.float32).T):
        painted = area[..., channel]
        painted += (target - painted) * fraction


def _line(area: NDArray[np.float32], column: float, colour: ArrayLike, strength: float) -> None:
    """Draw an anti-aliased upright line of one pixel."""
    first = max(math.floor(column - 0.5) - 1, 0)
    pixels = np.arange(first, min(first + 4, area.shape[1])) + 0.5
    cover = np.clip(1.0 - np.abs(pixels - column), 0.0, 1.0) * strength
    part = area[:, first : first + len(pixels)]
    _paint(part, colour, np.broadcast_to(cover, part.shape[:2]))


@functools.lru_cache(maxsize=16)
def _rounded(size: tuple[int, int], radius: float) -> NDArray[np.float64]:
    """Cover of a box with rounded corners that fills a picture."""
    across, down = (
        np.abs(np.arange(pixels) + 0.5 - pixels / 2) - pixels / 2 + radius for pixels in size
    )
    x, y = np.meshgrid(across, down)
    corner = np.hypot(np.maximum(x, 0.0), np.maximum(y, 0.0))
    return np.clip(0.5 + radius - corner - np.minimum(np.maximum(x, y), 0.0), 0.0, 1.0)


@functools.cache
def _text_mask(text: str) -> NDArray[np.integer]:
    unknown = sorted(set(text) - set(_GLYPHS))
    if unknown:
        raise InputError(
            f"plot: {''.join(unknown)!r} cannot be written; its font has {''.join(_GLYPHS)!r}"
        )
    rows = np.array([_GLYPHS[character] for character in text], dtype=np.uint8).T[:, :, None]
    bits = rows >> np.arange(_ADVANCE - 2, -2, -1).clip(0)[None, None, :] & 1
    bits[:, :, -1] = 0
    return bits.reshape(_GLYPH_HEIGHT, -1)
