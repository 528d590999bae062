"""From band radiances to scene-linear Rec.709: one linear map per sensor."""

from __future__ import annotations

import functools
import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..content import constant
from ..errors import DataWarning, InputError, unknown_name
from ._colour import colour_science
from .bands import Bands
from .illuminant import Illuminant, band_mean
from .sensor import Sensor, standard_observer
from .spectrum import Spectrum
from .tone import MIDDLE_GREY

WhiteBalance = Literal["daylight", "depth", "none"]
WHITE_BALANCES: tuple[str, ...] = get_args(WhiteBalance)
# Fraction of a sensor's sensitivity that the bands must cover to pass without a warning.
_COVERED_FRACTION = 0.98
# Width of the bands that stand for the continuous spectrum, nm.
_FINE_WIDTH = 2.0
DARKEST = 1e-30
"""Fraction of the light at the surface that still counts: the gain for less overflows in single
precision."""
_ALIKE = 1e-12  # relative, of responses
# Fraction of a metered picture that may be brighter than white.
_HIGHLIGHTS = 0.02


@dataclass(frozen=True, eq=False)
class SensorReduction:
    """The linear map from band radiances to scene-linear Rec.709.

    ``rgb = weights @ radiance``, with radiance per nm at the band centres.
    """

    #: Sensitivity times band width, white balance, colour matrix, exposure, (3, n).
    weights: NDArray[np.float64]
    #: The part of ``weights`` that acts on the sensor's three responses; of few bands it may have
    #: no inverse, (3, 3).
    matrix: NDArray[np.float64]
    #: Sensitivities of the sensor's channels times band widths, or what was fitted in their place,
    #: (3, n).
    response: NDArray[np.float64]
    #: Sensor responses to a white diffuser in the light that was balanced for (in the surface light
    #: if the white balance is ``"none"``), (3,).
    white: NDArray[np.float64]
    #: Mean ΔE2000 of the training reflectances in the surface light, balanced for it, against CIE
    #: 1931 on a fine grid: what sensor and bands together cost in colour.
    delta_e: float
    method: str  #: What was done, in words.
    stops: float = 0.0  #: The exposure in ``weights``.

    @property
    def description(self) -> str:
        """What the map is, with its exposure."""
        return f"{self.method}; {self.stops:+.2f} stops"

    def exposed(self, stops: float) -> SensorReduction:
        """Return the map at as many stops more."""
        gain = 2.0**stops
        return replace(
            self, weights=self.weights * gain, matrix=self.matrix * gain, stops=self.stops + stops
        )

    def behind(self, transmittance: ArrayLike, name: str) -> SensorReduction:
        """Return the map of the same camera, set as it is, behind a filter."""
        T = np.asarray(transmittance, dtype=np.float64)
        return replace(
            self,
            weights=self.weights * T,
            response=self.response * T,
            method=f"{self.method}, behind the filter {name}",
        )

    def stops_to(self, weights: ArrayLike) -> float:
        """Return the stops that the exposure of weights lies above that of these."""
        there = np.asarray(weights, dtype=np.float64)
        return float(np.log2((there * self.weights).sum() / (self.weights**2).sum()))

    def apply(self, radiance: ArrayLike) -> NDArray[np.float64]:
        """Reduce radiances of shape (..., n) to Rec.709 of shape (..., 3)."""
        return np.asarray(radiance) @ self.weights.T


@functools.cache
def rec709_to_XYZ() -> NDArray[np.float64]:
    """Matrix from scene-linear Rec.709 (D65) to CIE XYZ, white at Y = 1, unrounded."""
    colour = colour_science()
    space = colour.RGB_COLOURSPACES["ITU-R BT.709"]
    return constant(colour.normalised_primary_matrix(space.primaries, space.whitepoint))


def luminance(rgb: ArrayLike) -> NDArray[np.float64]:
    """Luminance Y of scene-linear Rec.709, shape (..., 3) to (...)."""
    return np.asarray(rgb) @ rec709_to_XYZ()[1]


def reduction(
    sensor: Sensor,
    bands: Bands,
    illuminant: Illuminant,
    depth_white: ArrayLike | None = None,
    white_balance: WhiteBalance = "daylight",
    exposure_stops: float = 0.0,
) -> SensorReduction:
    """Build the map from band radiances to scene-linear Rec.709.

    A white Lambertian surface (radiance E/π) in the surface light becomes
    (1, 1, 1) · 2^exposure with ``"daylight"``, and has luminance 2^exposure
    but the colour of the light with ``"none"``. With ``"depth"`` that surface
    becomes (1, 1, 1) · 2^exposure in the light at depth.

    Band integrals are midpoint sums, Σ S(λ_i) L(λ_i) Δλ_i. An observer's XYZ
    is adapted to D65 by Bradford, at depth by Von Kries with
    Hunt-Pointer-Estevez cones, because Bradford's sharpened cones respond
    negatively to saturated blue-green light. A camera's responses are
    balanced channel by channel and taken to Rec.709 by the white-preserving
    3×3 matrix that fits the 190 reflectances of rawtoaces best (least
    squares) in the surface light. The fit goes from the responses through
    these bands to the colours on a fine grid, so that it also absorbs part
    of the error of few bands.

    The illuminant is the light above the surface, ``depth_white`` (n,) the irradiance at depth for
    that white balance; a stop is a factor of two.

    Raises
    ------
    InputError
        If a channel sees none of the light to balance for, or an argument
        is out of its domain.
    """
    if white_balance not in WHITE_BALANCES:
        raise unknown_name("white balance", white_balance, WHITE_BALANCES)
    if not math.isfinite(exposure_stops):
        raise InputError(f"exposure must be a finite number of stops, got {exposure_stops}")
    if white_balance == "depth" and depth_white is None:
        raise InputError("white balance depth needs the light at depth (depth_white)")
    warn_coverage(sensor.name, sensor.sensitivity, bands)
    # Where daylight is not balanced for, an observer's only serves to state delta_e.
    daylight = _in_daylight(sensor, bands, illuminant, white_balance == "daylight")
    response, surface_white = daylight.response, daylight.white
    white = surface_white
    if white_balance == "depth":
        light = np.asarray(depth_white, dtype=np.float64)
        if light.shape != (len(bands),):
            raise InputError(f"depth_white has shape {light.shape} for {len(bands)} bands")
        white = _white(sensor, response, light, "at depth", DARKEST * surface_white)

    if sensor.kind == "observer":
        matrix = {
            "daylight": daylight.matrix,
            "depth": _observer_matrix(white, "Von Kries"),
            "none": np.linalg.inv(rec709_to_XYZ()) / surface_white[1],
        }[white_balance]
        adaptation = {"daylight": "Bradford", "depth": "Von Kries (HPE)", "none": "no"}
        how = f"{adaptation[white_balance]} chromatic adaptation"
    else:
        matrix = daylight.matrix / white
        if white_balance == "none":
            fine_white = _training_colours(illuminant)[2]
            undone = _adaptation(fine_white, _possible_adaptation(fine_white))
            matrix = np.linalg.solve(undone, matrix)
        how = "channel gains and a 3×3 matrix fitted to the rawtoaces reflectances"
        if white_balance == "none":
            how += ", adaptation to D65 undone"
    method = (
        f"{sensor.name} in {illuminant.name}, {len(bands)} bands, white balance {white_balance} "
        f"({how}), mean ΔE2000 {daylight.delta_e:.2f} in daylight"
    )
    developed = SensorReduction(
        matrix @ response, matrix, response, white, daylight.delta_e, method
    )
    return developed.exposed(exposure_stops)


@dataclass(frozen=True, eq=False)
class _InDaylight:
    """A sensor behind bands in the light at the surface."""

    response: NDArray[np.float64]  #: To radiances, (3, n).
    white: NDArray[np.float64]  #: To a white diffuser, (3,).
    #: Of an observer, or what fits a camera's responses, over those to white, to colours, (3, 3).
    matrix: NDArray[np.float64]
    delta_e: float


# Only the light at depth differs between the frames of a camera that is balanced there.
@functools.lru_cache(maxsize=8)
def _in_daylight(
    sensor: Sensor, bands: Bands, illuminant: Illuminant, by_bradford: bool
) -> _InDaylight:
    response, light = sensor.response_in(bands), illuminant.total_in(bands)
    white = _white(sensor, response, light, "at the surface")
    reflectances, colours, _ = _training_colours(illuminant)
    training = (_held(reflectances, bands) * light[:, None] / math.pi).T @ response.T
    if sensor.kind == "observer":
        transform = "Bradford" if by_bradford else _possible_adaptation(white)
        matrix = to_colours = _observer_matrix(white, transform)
    else:
        matrix = _white_preserving_fit(training / white, colours)
        to_colours = matrix / white
    delta_e = float(np.mean(delta_e_CIE2000_images(training @ to_colours.T, colours)))
    return _InDaylight(constant(response), constant(white), constant(matrix), delta_e)


def response_matrix(weights: ArrayLike, response: ArrayLike) -> NDArray[np.float64]:
    """Matrix from a sensor's channels to colours, white balance and exposure included, (3, 3).

    ``weights`` (3, n) are those of a :class:`SensorReduction`, ``response`` (3, n) that of the
    sensor's channels.

    Raises
    ------
    InputError
        If there are too few bands to tell the channels apart.
    """
    found = np.asarray(response, dtype=np.float64)
    if np.linalg.matrix_rank(found) < 3:
        raise InputError(
            f"{found.shape[1]} band(s) do not tell the sensor's channels apart; take 3 or more"
        )
    return np.asarray(weights, dtype=np.float64) @ np.linalg.pinv(found)


def auto_exposure_stops(
    reduction: SensorReduction, depth_white: ArrayLike, target: float = 0.9
) -> float:
    """Stops, beyond those of a map, that bring a white diffuser at depth to a luminance.

    ``depth_white`` (n,) is the irradiance on the bands there; a luminance of 1 is display white.

    Raises
    ------
    InputError
        If the sensor sees no light at depth.
    """
    now = float(luminance(reduction.apply(np.asarray(depth_white) / math.pi)))
    if not (math.isfinite(now) and now > DARKEST):
        raise InputError(
            "automatic exposure: no light at that depth; add lamps, or set the exposure in stops"
        )
    return math.log2(target / now)


def metered_stops(Y: ArrayLike, fraction: ArrayLike) -> float:
    """Stops by which a picture is exposed, as a reflected-light meter has it.

    The mean luminance becomes that of middle grey (ISO 2720 meters the mean too), unless the
    brightest 2 % of the picture would be brighter than white: then these become white.

    Luminances of parts of the picture are at 0 stops.

    Raises
    ------
    InputError
        If the picture is black.
    """
    Y, fraction = np.asarray(Y, dtype=np.float64), np.asarray(fraction, dtype=np.float64)
    order = np.argsort(Y)
    below = np.cumsum(fraction[order]) / fraction.sum()
    bright = Y[order][min(int(np.searchsorted(below, 1.0 - _HIGHLIGHTS)), len(Y) - 1)]
    mean = float(Y @ fraction / fraction.sum())
    if not (math.isfinite(mean) and mean > DARKEST):
        raise InputError(
            "exposure by the picture: nothing in it is lit; add lamps, or set the exposure in stops"
        )
    return math.log2(min(MIDDLE_GREY / mean, 1.0 / max(float(bright), DARKEST)))


def srgb_encode(rgb: ArrayLike) -> NDArray[np.float64]:
    """Clip scene-linear Rec.709 to [0, 1] and encode it for an sRGB display."""
    return np.asarray(
        colour_science().cctf_encoding(np.clip(rgb, 0.0, 1.0), function="sRGB"), dtype=np.float64
    )


def srgb_decode(codes: ArrayLike) -> NDArray[np.float64]:
    """Linear Rec.709 of sRGB values from 0 to 1."""
    return np.asarray(colour_science().cctf_decoding(codes, function="sRGB"), dtype=np.float64)


def delta_e_CIE2000_images(rgb: ArrayLike, reference: ArrayLike) -> NDArray[np.float64]:
    """ΔE2000 per pixel of two scene-linear Rec.709 images, white at (1, 1, 1)."""
    return np.asarray(
        colour_science().delta_E(rec709_to_Lab(rgb), rec709_to_Lab(reference), method="CIE 2000")
    )


def rec709_to_Lab(rgb: ArrayLike) -> NDArray[np.float64]:
    """CIE Lab (white D65) of scene-linear Rec.709, shape (..., 3)."""
    colour = colour_science()
    to_XYZ = rec709_to_XYZ()
    white = colour.XYZ_to_xy(to_XYZ @ np.ones(3))
    return np.asarray(colour.XYZ_to_Lab(np.asarray(rgb) @ to_XYZ.T, white))


def white_response(
    response: NDArray[np.float64],
    light: ArrayLike,
    names: Sequence[str],
    where: str,
    least: NDArray[np.float64] | float = 0.0,
) -> NDArray[np.float64]:
    """Responses of channels (k, n) to a white diffuser in an irradiance (n,), shape (k,).

    ``names`` are those of the sensor and of its channels; ``where`` the light is, for the message.

    Raises
    ------
    InputError
        If a channel responds no more than ``least``.
    """
    white = response @ np.asarray(light, np.float64) / math.pi
    dark = ~(np.isfinite(white) & (white > least))
    if dark.any():
        sensor, *channels = names
        raise InputError(
            f"{sensor}: channel {channels[int(np.argmax(dark))]} sees no light {where} in these "
            "bands; widen the range of bands, or choose another white balance"
        )
    return white


def _white(
    sensor: Sensor,
    response: NDArray[np.float64],
    light: NDArray[np.float64],
    where: str,
    darkest: NDArray[np.float64] | float = 0.0,
) -> NDArray[np.float64]:
    channels = "XYZ" if sensor.kind == "observer" else "RGB"
    return white_response(response, light, (f"sensor {sensor.name}", *channels), where, darkest)


def _adaptation(white_XYZ: NDArray[np.float64], transform: str) -> NDArray[np.float64]:
    """Rec.709 to Rec.709 matrix that takes a white to (1, 1, 1) · Y."""
    to_XYZ = rec709_to_XYZ()
    return np.linalg.solve(to_XYZ, _chromatic_adaptation(white_XYZ, transform) @ to_XYZ)


def _chromatic_adaptation(white_XYZ: NDArray[np.float64], transform: str) -> NDArray[np.float64]:
    """XYZ to XYZ matrix that takes a white to D65 of the same luminance."""
    colour = colour_science()
    cones = np.asarray(colour.CHROMATIC_ADAPTATION_TRANSFORMS[transform])
    if np.any(cones @ white_XYZ <= 0):
        raise InputError(
            f"the light in these bands is too saturated for {transform} adaptation; "
            "take more bands, or white balance none or depth"
        )
    white = white_XYZ / white_XYZ[1]
    return np.asarray(
        colour.adaptation.matrix_chromatic_adaptation_VonKries(
            white, rec709_to_XYZ() @ np.ones(3), transform=transform
        )
    )


def _possible_adaptation(white_XYZ: NDArray[np.float64]) -> str:
    """Bradford, or Von Kries for light so saturated that Bradford's cones turn negative."""
    cones = np.asarray(colour_science().CHROMATIC_ADAPTATION_TRANSFORMS["Bradford"])
    return "Bradford" if np.all(cones @ white_XYZ > 0) else "Von Kries"


def _observer_matrix(white_XYZ: NDArray[np.float64], transform: str) -> NDArray[np.float64]:
    adapted = _chromatic_adaptation(white_XYZ, transform) / white_XYZ[1]
    return np.linalg.solve(rec709_to_XYZ(), adapted)


def _white_preserving_fit(
    responses: NDArray[np.float64], colours: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Least-squares 3×3 matrix from responses to colours whose rows sum to 1."""
    free = responses[:, :2] - responses[:, 2:]
    # Behind one band all channels are alike: what differs is rounding, and fits anything.
    free[np.abs(free) < _ALIKE * np.abs(responses).max()] = 0.0
    rows = np.linalg.lstsq(free, colours - responses[:, 2:], rcond=None)[0]
    return np.vstack([rows, 1 - rows.sum(axis=0)]).T


def _held(reflectances: Spectrum, bands: Bands) -> NDArray[np.float64]:
    """Reflectances at the band centres, their end values held outside the table."""
    return reflectances.at(np.clip(bands.centres, *reflectances.range))


@functools.cache
def training_reflectances() -> Spectrum:
    """Measured reflectances of 190 materials, from rawtoaces, as columns."""
    colour = colour_science()
    data = colour.characterisation.read_training_data_rawtoaces_v1()
    return Spectrum(data.wavelengths, data.values, "training reflectances of rawtoaces")


@functools.lru_cache(maxsize=8)
def _training_colours(
    illuminant: Illuminant,
) -> tuple[Spectrum, NDArray[np.float64], NDArray[np.float64]]:
    """Training reflectances, their Rec.709 under a light on a fine grid, and its white XYZ."""
    reflectances = training_reflectances()
    low = max(illuminant.direct.range[0], reflectances.range[0])
    high = min(illuminant.direct.range[1], reflectances.range[1])
    if high - low < _FINE_WIDTH:
        raise InputError(
            f"illuminant {illuminant.name} covers {illuminant.direct.range[0]:g} to "
            f"{illuminant.direct.range[1]:g} nm, which is not visible light"
        )
    fine = Bands.uniform(int((high - low) / _FINE_WIDTH), low, high)
    light = band_mean(illuminant.total, fine)
    observer = standard_observer().sensitivity.at(fine.centres) * fine.widths[:, None]
    white = light @ observer
    colours = (reflectances.at(fine.centres) * light[:, None]).T @ observer
    return reflectances, colours @ _observer_matrix(white, _possible_adaptation(white)).T, white


def warn_coverage(name: str, table: Spectrum, bands: Bands) -> None:
    """Warn about sensitivity outside the bands and bands outside the sensitivity."""
    low, high = table.range
    grid = np.arange(low, high + 0.5)
    sensitivity = table.at(np.minimum(grid, high))
    inside = np.any(np.abs(grid[:, None] - bands.centres) <= bands.widths / 2 + 1e-9, axis=1)
    fraction = float((sensitivity[inside].sum(axis=0) / sensitivity.sum(axis=0)).min())
    if fraction < _COVERED_FRACTION:
        warnings.warn(
            f"the bands cover {fraction:.1%} of the least covered channel of {name}; "
            "widen --range for its full response",
            DataWarning,
            stacklevel=3,
        )
    blind = bands.centres[(bands.centres < low) | (bands.centres > high)]
    if blind.size:
        warnings.warn(
            f"{name} is known from {low:g} to {high:g} nm; {blind.size} band(s) outside, "
            f"the first at {blind[0]:g} nm, add nothing to the picture",
            DataWarning,
            stacklevel=3,
        )
