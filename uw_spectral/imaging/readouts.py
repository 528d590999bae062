"""What a diver or photographer reads off a water: visibility, colour, light, colour error."""

from __future__ import annotations

import dataclasses
import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..spectra.bands import Bands
from ..spectra.colour_rendering import (
    SensorReduction,
    WhiteBalance,
    auto_exposure_stops,
    delta_e_CIE2000_images,
    reduction,
    srgb_encode,
)
from ..spectra.illuminant import Illuminant
from ..spectra.reflectance import colorchecker_reflectance, parse_reflectance
from ..spectra.sensor import OBSERVERS, Sensor, parse_sensor
from ..spectra.spectrum import Spectrum
from ..surface.refraction import fresnel_reflectance, in_water_cosine, sun_travel_direction
from ..transfer.closed_form import ClosedForm, solve_closed_form
from ..transfer.inelastic_light import InelasticLight
from ..transfer.light_field import LightField
from ..transfer.pixel import Pixel
from ..transfer.water_column import WaterColumn
from ..water.optical_properties import Water, molecular_scattering
from ..water.phase import BandPhase, PhaseModel, parse_phase

REFERENCE_BANDS = 60
"""Bands that stand for the continuous spectrum."""

LIMINAL_CONTRAST = 0.02
"""Smallest contrast that counts as visible."""

PATCHES = ("white 9.5 (.05 D)", "dark skin", "foliage", "orange", "red", "yellow")
"""ColorChecker patches that the colour error looks at."""

# Hues of the spectrum by the wavelength in nm where they end, as usually quoted from Bruno &
# Svoronos, CRC Handbook of Fundamental Spectroscopic Correlation Charts (2005); other accounts of
# it have no cyan and differ by up to 10 nm elsewhere. Names only: no number depends on them.
_HUES = {
    450.0: "violet",
    485.0: "blue",
    500.0: "cyan",
    565.0: "green",
    590.0: "yellow",
    625.0: "orange",
    math.inf: "red",
}
_SMALLEST_PURITY = 0.02


@dataclass(frozen=True, eq=False)
class Viewpoint:
    """A camera at a depth in a column of water.

    What is computed from it is kept. Make many viewpoints with the same
    ``illuminant``, ``sensor`` and ``column.bands`` *objects*: what they share,
    the reduction above all, is then computed once.

    Parameters
    ----------
    column : WaterColumn
    phase : BandPhase
        Phase function on the bands of the column.
    illuminant : Illuminant
    sensor : Sensor
    depth : float
        Depth of the camera, m.
    white_balance : {"daylight", "depth", "none"}
    exposure_stops : float, optional
        None exposes automatically: a white diffuser at depth has luminance 0.9.

    Raises
    ------
    InputError
        If the camera is not between surface and floor; on first use of
        ``reduction`` where the sensor sees no light.
    """

    column: WaterColumn
    phase: BandPhase
    illuminant: Illuminant
    sensor: Sensor
    depth: float
    white_balance: WhiteBalance = "daylight"
    exposure_stops: float | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.depth <= self.column.floor_depth:
            raise InputError(
                f"the camera is at depth {self.depth:g} m, but the water reaches from 0 to "
                f"{self.column.floor_depth:g} m; move the camera or the floor"
            )

    @functools.cached_property
    def field(self) -> LightField:
        """Light field of the column."""
        return self.column.light_field(self.phase)

    @functools.cached_property
    def light(self) -> NDArray[np.float64]:
        """Downwelling irradiance Ed at the camera's depth, shape (n,)."""
        return self.field.Ed(self.depth)

    @functools.cached_property
    def path_radiance(self) -> ClosedForm:
        """Closed form of the water's radiance for this camera."""
        return solve_closed_form(self.field, self.phase, self.depth, self.column.sun_direction)

    @functools.cached_property
    def level(self) -> tuple[float, float, float]:
        """Level view direction at right angles to the sun."""
        x, y, _ = self.column.sun_direction
        length = math.hypot(x, y)
        return (-y / length, x / length, 0.0) if length > 1e-9 else (1.0, 0.0, 0.0)

    @functools.cached_property
    def background(self) -> NDArray[np.float64]:
        """Radiance of the open water along :attr:`level`, shape (n,)."""
        return self.path_radiance.radiance(self.depth, self.level)

    @functools.cached_property
    def reduction(self) -> SensorReduction:
        """Map from band radiances to scene-linear Rec.709."""
        if self.white_balance == "depth":
            develop = reduction(
                self.sensor, self.column.bands, self.illuminant, self.light, "depth"
            )
        else:
            develop = _reduction_everywhere(
                self.sensor, self.column.bands, self.illuminant, self.white_balance
            )
        stops = self.exposure_stops
        gain = 2.0 ** (auto_exposure_stops(develop, self.light) if stops is None else stops)
        return dataclasses.replace(
            develop, weights=develop.weights * gain, matrix=develop.matrix * gain
        )


def make_viewpoint(
    water: Water,
    illuminant: Illuminant,
    sensor: Sensor,
    depth: float,
    bands: Bands,
    phase: PhaseModel | str = "mixture",
    *,
    sun_zenith: float = 30.0,
    sun_azimuth: float = 0.0,
    floor_depth: float = math.inf,
    floor_reflectance: Spectrum | str = "0.2",
    surface: str = "none",
    sky_radiance: float = 0.0,
    refractive_index: float = 1.34,
    above_surface: bool = False,
    white_balance: WhiteBalance = "daylight",
    exposure_stops: float | None = None,
) -> Viewpoint:
    """Put a camera into a water.

    Parameters
    ----------
    water : Water
    illuminant : Illuminant
    sensor : Sensor
    depth : float
        Depth of the camera, m.
    bands : Bands
    phase : PhaseModel or str
        Phase function, or its text as :func:`.parse_phase` takes it.
    sun_zenith, sun_azimuth : float
        The sun in air, degrees.
    floor_depth : float
        Depth of the floor in m; infinite for none.
    floor_reflectance : Spectrum or str
        Of the floor; text as :func:`.parse_reflectance` takes it.
    surface : {"none", "flat"}
    sky_radiance : float
        Uniform sky, as a share of the direct light, per steradian.
    refractive_index : float
    above_surface : bool
        Whether the illuminant's sun is known above the surface, so that
        part of it is reflected, or just below.
    white_balance, exposure_stops
        See :class:`Viewpoint`.

    Raises
    ------
    InputError
        If an argument is out of its domain or a table does not reach the bands.

    Examples
    --------
    >>> from ..spectra.illuminant import parse_illuminant
    >>> camera = make_viewpoint(Water.jerlov("IB"), parse_illuminant("d65"),
    ...                         parse_sensor("cie1931"), 5.0, Bands.uniform(60))
    >>> round(horizontal_visibility(camera)), round(euphotic_depth(camera.column, camera.phase))
    (39, 101)
    """
    model = parse_phase(phase) if isinstance(phase, str) else phase
    floor = (
        parse_reflectance(floor_reflectance)
        if isinstance(floor_reflectance, str)
        else floor_reflectance
    )
    b = water.b(bands.centres)
    direct, diffuse = _light_above(illuminant, bands)
    transmitted = 1.0
    if above_surface:
        cosine = math.cos(math.radians(sun_zenith))
        transmitted -= float(fresnel_reflectance(cosine, refractive_index))
    column = WaterColumn(
        bands=bands,
        absorption=water.a(bands.centres),
        scattering=b,
        sun_irradiance=direct * transmitted,
        sun_cosine=float(in_water_cosine(sun_zenith, refractive_index)),
        sun_direction=sun_travel_direction(sun_zenith, sun_azimuth, refractive_index),
        sky_radiance=diffuse / math.pi + sky_radiance * direct,
        floor_depth=floor_depth,
        floor_reflectance=floor.at(bands.centres),
        surface=surface,
        refractive_index=refractive_index,
    )
    band_phase = model.for_bands(b, _molecular_scattering(bands))
    return Viewpoint(column, band_phase, illuminant, sensor, depth, white_balance, exposure_stops)


def sighting_range(
    c: ArrayLike, background: ArrayLike, contrast: float = LIMINAL_CONTRAST
) -> float:
    """Distance at which a black target fades into the water, looking level.

    The difference between the radiance of a target and of the water behind it
    decays as e^{-c r} in every band (Duntley 1963). Weighted with the
    background as the eye sees it, a black target keeps the contrast
    Σ w e^{-c r} / Σ w; the range r is where that falls to ``contrast``. For
    one c it is -ln(contrast)/c, 3.91/c at 2 %.

    Parameters
    ----------
    c : array_like, shape (n,)
        Extinction of the bands, 1/m.
    background : array_like, shape (n,)
        Weight of each band: background radiance times luminous efficiency.
    contrast : float
        Between 0 and 1.

    Returns
    -------
    float
        Range in m; infinite where no weighted band attenuates.

    Raises
    ------
    InputError
        If no weight is positive, or the contrast is out of its domain.

    References
    ----------
    S. Q. Duntley, J. Opt. Soc. Am. 53, 214 (1963); J. R. V. Zaneveld &
    W. S. Pegau, Opt. Express 11, 2997 (2003), who find 4.8/c for divers' eyes.

    Examples
    --------
    >>> round(sighting_range([0.2], [1.0]), 2)
    19.56
    """
    if not 0 < contrast < 1:
        raise InputError(f"visible contrast must lie between 0 and 1, got {contrast:g}")
    weights = np.maximum(np.asarray(background, dtype=np.float64), 0.0)
    attenuation = np.asarray(c, dtype=np.float64)
    total = weights.sum()
    if not (np.isfinite(total) and total > 0):
        raise InputError("visibility: there is no light to see by; move the camera up")
    attenuation, weights = attenuation[weights > 0], weights[weights > 0] / total
    if not attenuation.min() > 0:
        return math.inf
    # The logarithm of the contrast is convex and falls, so Newton's steps from 0 never overshoot.
    distance, excess = 0.0, -math.log(contrast)
    while excess > 1e-9:
        left = weights * np.exp(-attenuation * distance)
        excess = math.log(left.sum() / contrast)
        distance += excess * left.sum() / (left @ attenuation)
    return float(distance)


def horizontal_visibility(view: Viewpoint, contrast: float = LIMINAL_CONTRAST) -> float:
    """Sighting range in m of a black target before the open water, for the eye.

    :func:`sighting_range` with the level background radiance at the camera's
    depth and the CIE 1931 luminous efficiency.

    Raises
    ------
    InputError
        If no light is left at that depth.
    """
    weights = _observer(view.column.bands)[1] * view.background
    return sighting_range(view.column.attenuation, weights, contrast)


def euphotic_depth(column: WaterColumn, phase: BandPhase, share: float = 0.01) -> float:
    """Depth at which a share of the light is left.

    The light is PAR, the photons of Ed from 400 to 700 nm, against PAR just
    below the surface; at 1 % this is the euphotic depth. It belongs to the
    water: a floor is taken away.

    Parameters
    ----------
    column : WaterColumn
        Its bands between 400 and 700 nm count.
    phase : BandPhase
        Phase function on its bands.
    share : float
        Between 0 and 1.

    Returns
    -------
    float
        Depth in m; infinite for water that takes no light away.

    Raises
    ------
    InputError
        If the share is out of its domain, or no band carries light.

    References
    ----------
    J. T. O. Kirk, Light and Photosynthesis in Aquatic Ecosystems, 3rd ed.
    (2011), ch. 6.
    """
    if not 0 < share < 1:
        raise InputError(f"share of light must lie between 0 and 1, got {share:g}")
    centres = column.bands.centres
    photons = centres * column.bands.widths * ((centres >= 400) & (centres <= 700))
    field = dataclasses.replace(column, floor_depth=math.inf).light_field(phase)
    wanted = share * float(field.Ed(0.0) @ photons)
    if not wanted > 0:
        raise InputError("depth of light: no light between 400 and 700 nm enters the water")
    # Nested grids, each 8 times finer; the last cell is then almost exponential.
    low, high = 0.0, 1.0
    while float(field.Ed(high) @ photons) > wanted:
        low, high = high, 2.0 * high
        if high > field.y_f:
            return math.inf
    for _ in range(3):
        depths = np.linspace(low, high, 9)
        below = int(np.argmax(field.Ed(depths[:, None]) @ photons <= wanted))
        low, high = depths[below - 1], depths[below]
    ends = np.log(field.Ed(np.array([[low], [high]])) @ photons)
    return float(low + (high - low) * (ends[0] - math.log(wanted)) / (ends[0] - ends[1]))


def light_left(view: Viewpoint) -> NDArray[np.float64]:
    """Share of each band's Ed just below the surface that is left at depth, shape (n,).

    A band without light has 0 left.
    """
    surface = view.field.Ed(0.0)
    return np.divide(view.light, surface, out=np.zeros_like(surface), where=surface > 0)


def diffuse_attenuation(view: Viewpoint) -> NDArray[np.float64]:
    """Diffuse attenuation Kd = -d ln Ed/dy at the camera's depth in 1/m, shape (n,).

    Of the project's own light field, so every water has it; near a bright
    floor it may be negative. A band without light has NaN.
    """
    step = 1e-3
    top = max(view.depth - step, 0.0)
    bottom = min(view.depth + step, view.column.floor_depth)
    above, below = view.field.Ed(top), view.field.Ed(bottom)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.log(above / below) / (bottom - top)


@dataclass(frozen=True)
class DominantColour:
    """Colour of a light against a white.

    Parameters
    ----------
    wavelength : float
        Dominant wavelength in nm; of the complementary colour, and negative,
        for purples; NaN for a light without colour.
    purity : float
        Excitation purity, 0 (white) to 1 (spectral).
    name : str
        Hue in words, ``"grey"`` without colour.
    """

    wavelength: float
    purity: float
    name: str


def dominant_colour(view: Viewpoint) -> DominantColour:
    """Colour of the open water to an eye adapted to the light above it (CIE 15, CIE 1931).

    Raises
    ------
    InputError
        If no light is left at that depth.
    """
    bands = view.column.bands
    observer, light = _observer(bands), sum(_light_above(view.illuminant, bands))
    return dominant_colour_of(observer @ view.background, observer @ light)


def dominant_colour_of(XYZ: ArrayLike, white: ArrayLike) -> DominantColour:
    """Dominant wavelength, excitation purity and hue of a colour.

    Parameters
    ----------
    XYZ, white : array_like, shape (3,)
        CIE 1931 tristimulus values of the colour and of the white.

    Raises
    ------
    InputError
        If the colour is black.

    Examples
    --------
    >>> dominant_colour_of([0.18, 0.2, 0.6], [1.0, 1.0, 1.0]).name
    'blue'
    """
    XYZ, white = np.asarray(XYZ, dtype=np.float64), np.asarray(white, dtype=np.float64)
    if not XYZ.sum() > 0:
        raise InputError("dominant colour: there is no light to see; move the camera up")
    xy, xy_white = XYZ[:2] / XYZ.sum(), white[:2] / white.sum()
    if np.hypot(*(xy - xy_white)) < 1e-4:
        return DominantColour(math.nan, 0.0, "grey")
    wavelength, boundary = _dominant_wavelength(xy, xy_white)
    purity = float(np.hypot(*(xy - xy_white)) / np.hypot(*(boundary - xy_white)))
    if purity < _SMALLEST_PURITY:
        return DominantColour(math.nan, purity, "grey")
    name = next(hue for end, hue in _HUES.items() if wavelength < end)
    return DominantColour(wavelength, purity, "purple" if wavelength < 0 else name)


def _dominant_wavelength(
    xy: NDArray[np.float64], white: NDArray[np.float64]
) -> tuple[float, NDArray[np.float64]]:
    """Where the line from a white through a colour leaves the CIE 1931 locus: nm and xy.

    The wavelength of a purple is its complementary one, negative. Like
    ``colour.dominant_wavelength``, which needs scipy; Blender has none.
    """
    observer = parse_sensor(next(iter(OBSERVERS))).sensitivity
    nm = np.arange(380.0, 701.0)
    XYZ = observer.at(nm)
    locus = XYZ[:, :2] / XYZ.sum(axis=1, keepdims=True)

    def crossing(
        direction: NDArray[np.float64], first: NDArray[np.float64], step: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Positions along a ray from the white and along segments where they meet."""
        away = first - white
        det = direction[0] * step[:, 1] - direction[1] * step[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            along = (away[:, 0] * step[:, 1] - away[:, 1] * step[:, 0]) / det
            share = (away[:, 0] * direction[1] - away[:, 1] * direction[0]) / det
        return np.where((along > 0) & (share >= 0) & (share <= 1), along, np.inf), share

    direction = xy - white
    for sign in (1.0, -1.0):
        along, share = crossing(sign * direction, locus[:-1], np.diff(locus, axis=0))
        nearest = int(np.argmin(along))
        if np.isfinite(along[nearest]):
            break
    wavelength = sign * float(nm[nearest] + share[nearest])
    if sign < 0:
        along, _ = crossing(direction, locus[:1], locus[-1:] - locus[:1])
        return wavelength, white + along[0] * direction
    return wavelength, white + along[nearest] * direction


def water_swatch(view: Viewpoint) -> NDArray[np.float64]:
    """Display colour (sRGB) of the open water through the camera, looking level, shape (3,).

    Encoded values from 0 to 1. Black where no light at all is left.

    Raises
    ------
    InputError
        If a white object at that depth has no positive luminance to expose for.
    """
    if not np.any(view.light > 0):
        return np.zeros(3)
    return srgb_encode(view.reduction.apply(view.background))


def inelastic_share(view: Viewpoint, light: InelasticLight) -> float:
    """Share of light of changed wavelength in the luminance of the open water, looking level.

    Parameters
    ----------
    view : Viewpoint
    light : InelasticLight
        In the bands and the column of the view.
    """
    extra = light.radiance(view.depth, view.level)
    luminance = _observer(view.column.bands)[1]
    return float(luminance @ extra / (luminance @ (extra + view.background)))


@dataclass(frozen=True)
class ColourError:
    """ΔE2000 of few bands against many: each colour, by name, and their mean and maximum."""

    by_colour: dict[str, float]

    @property
    def mean(self) -> float:
        """Mean over the colours."""
        return float(np.mean(list(self.by_colour.values())))

    @property
    def maximum(self) -> float:
        """Largest of the colours."""
        return max(self.by_colour.values())


def colour_error(view: Viewpoint, reference: Viewpoint, distance: float = 2.0) -> ColourError:
    """Colour error of a choice of bands in this water, for this camera and depth.

    ΔE2000 of the open water, looking level, and of the ColorChecker
    :data:`PATCHES` at a distance before it, each developed as the renderer
    would, automatic exposure included.

    Parameters
    ----------
    view : Viewpoint
        With the bands in question.
    reference : Viewpoint
        The same with :data:`REFERENCE_BANDS` or so.
    distance : float
        Distance of the patches in m.

    Raises
    ------
    InputError
        If the depths differ, or a sensor sees no light at that depth.
    """
    if view.depth != reference.depth:
        raise InputError(
            f"colour error: the depths differ, {view.depth:g} and {reference.depth:g} m"
        )
    if not distance > 0:
        raise InputError(f"colour error: the distance must be positive, got {distance:g} m")
    errors = delta_e_CIE2000_images(
        _developed_colours(view, distance), _developed_colours(reference, distance)
    )
    return ColourError(dict(zip(("water", *PATCHES), errors.tolist(), strict=True)))


@dataclass(frozen=True, eq=False)
class Readouts:
    """Everything a panel shows about one water.

    Parameters
    ----------
    visibility : float
        Level sighting range of a black target at 2 % contrast, m.
    euphotic_depth : float
        Depth of 1 % of PAR, m.
    colour : DominantColour
        Of the open water.
    swatch : array, shape (3,)
        sRGB of the open water through the camera.
    light_left : Spectrum
        Share of the light that reaches the camera's depth, per reference band.
    colour_error : ColourError
        Of the chosen bands.
    """

    visibility: float
    euphotic_depth: float
    colour: DominantColour
    swatch: NDArray[np.float64]
    light_left: Spectrum
    colour_error: ColourError


def readouts(view: Viewpoint, reference: Viewpoint) -> Readouts:
    """All read-outs of a water.

    Parameters
    ----------
    view : Viewpoint
        With the bands of the renderer.
    reference : Viewpoint
        The same with :data:`REFERENCE_BANDS` bands; everything but the colour
        error is read from it.

    Raises
    ------
    InputError
        If no light is left at the camera's depth.
    """
    return Readouts(
        horizontal_visibility(reference),
        euphotic_depth(reference.column, reference.phase),
        dominant_colour(reference),
        water_swatch(reference),
        Spectrum(reference.column.bands.centres, light_left(reference), "light left at depth"),
        colour_error(view, reference),
    )


def _developed_colours(view: Viewpoint, distance: float) -> NDArray[np.float64]:
    """Scene-linear colours of the open water and of the patches before it."""
    patches = _patch_reflectances(view.column.bands) * view.light / math.pi
    water = view.path_radiance, view.depth, view.level
    seen = Pixel(*water, distance, patches, view.background).total
    return view.reduction.apply(np.vstack([view.background, seen]))


# Keyed by object, since values of these classes compare by identity; few are alive at a time.
@functools.lru_cache(maxsize=8)
def _reduction_everywhere(
    sensor: Sensor, bands: Bands, illuminant: Illuminant, white_balance: WhiteBalance
) -> SensorReduction:
    """Reduction that does not depend on depth, at 0 stops."""
    return reduction(sensor, bands, illuminant, white_balance=white_balance)


@functools.lru_cache(maxsize=8)
def _light_above(
    illuminant: Illuminant, bands: Bands
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    return illuminant.direct_in(bands), illuminant.diffuse_in(bands)


@functools.lru_cache(maxsize=8)
def _molecular_scattering(bands: Bands) -> NDArray[np.float64]:
    return molecular_scattering(bands.centres)


@functools.lru_cache(maxsize=8)
def _patch_reflectances(bands: Bands) -> NDArray[np.float64]:
    spectra = [colorchecker_reflectance(patch) for patch in PATCHES]
    return np.stack([s.at(np.clip(bands.centres, *s.range)) for s in spectra])


@functools.lru_cache(maxsize=8)
def _observer(bands: Bands) -> NDArray[np.float64]:
    """CIE 1931 colour matching functions times band width, shape (3, n)."""
    observer = parse_sensor(next(iter(OBSERVERS))).sensitivity
    return observer.at_or_zero(bands.centres).T * bands.widths
