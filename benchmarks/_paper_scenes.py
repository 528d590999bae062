"""Patches and open water of Monzon et al. (2024), by each method, in any number of bands."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.closed_form.closed_form import solve_closed_form
from ..uw_spectral.closed_form.light_field import light_field_of
from ..uw_spectral.closed_form.undisturbed_water import UndisturbedWater
from ..uw_spectral.imaging.optics import make_viewpoint
from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.spectra.colour_rendering import luminance, reduction
from ..uw_spectral.spectra.illuminant import Illuminant, parse_illuminant
from ..uw_spectral.spectra.reflectance import colorchecker_patches, colorchecker_reflectance
from ..uw_spectral.spectra.sensor import Sensor, standard_observer
from ..uw_spectral.transfer.pixel import surface_light
from ..uw_spectral.transfer.radiance_field import distance_in_water
from ..uw_spectral.transfer.radiance_table import TABLE_STREAMS
from ..uw_spectral.transfer.tabulated_water import TabulatedWater, tabulated_water
from ..uw_spectral.transfer.water_column import WaterColumn
from ..uw_spectral.water.optical_properties import Water
from ..uw_spectral.water.phase import BandPhase, HenyeyGreenstein
from ..validation.monzon import (
    path_radiance_Monzon2024,
    path_radiance_Monzon2024_corrected,
)

SUN_ZENITH, ASYMMETRY = 30.0, 0.8
CAMERA_ABOVE, FLOOR_REFLECTANCE = 3.0, 0.3
DISTANCES = (0.5, 2.0, 5.0)
TILTS = (0.0, 20.0, -20.0)
"""Of the rays into open water, degrees upwards."""
FINE = Bands.uniform(150)
"""Bands that stand for the spectrum."""
WHITE = 0.9
"""Luminance of a white diffuser at the camera's depth: the exposure of every picture."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PaperScene:
    """One of the combinations of water and depth that the paper compares."""

    water: str
    depth: float
    above_floor: float = CAMERA_ABOVE

    @property
    def title(self) -> str:
        """As the tables of this project spell it."""
        return f"{self.water} {self.depth:g} m"


SCENES = tuple(
    PaperScene(*each)
    for each in (("3C", 3.0), ("3C", 9.0), ("I", 5.0), ("IA", 9.0), ("IB", 5.0), ("II", 3.0))
)


@dataclass(frozen=True, eq=False)
class Setting:
    """Water, light and patches in n bands, or in channels that are taken for bands.

    Attributes
    ----------
    column : WaterColumn
    Kd : array, shape (n,)
        Diffuse attenuation, 1/m.
    patches : array, shape (24, n)
        Reflectances.
    depth : float
        Of the camera, m.
    """

    column: WaterColumn
    Kd: Array
    patches: Array
    depth: float

    @functools.cached_property
    def phase(self) -> BandPhase:
        """Phase function of the paper's path tracer."""
        return BandPhase((HenyeyGreenstein(ASYMMETRY),), np.ones((1, len(self.column.bands))))

    @functools.cached_property
    def tables(self) -> TabulatedWater:
        """What EEVEE looks up."""
        column = self.column
        field = column.solved_field(self.phase, TABLE_STREAMS)
        beam = column.sun_beam(self.phase)
        return tabulated_water(field, beam, column.skylight, None)

    @functools.cached_property
    def light(self) -> Array:
        """Solved downwelling irradiance at the camera, shape (n,)."""
        return self.column.solved_field(self.phase, TABLE_STREAMS).Ed(self.depth)

    @functools.cached_property
    def closed_form(self) -> UndisturbedWater:
        """The light in closed form."""
        column = self.column
        field = light_field_of(column, self.phase)
        water = solve_closed_form(field, self.phase, self.depth, column.sun_direction)
        return UndisturbedWater(water, column.skylight)

    def mixed(self, weights: Array) -> Setting:
        """Return the same in k channels.

        Parameters
        ----------
        weights : array, shape (k, n)
            Response of each channel per unit radiance of a band; its shape weighs coefficients
            and reflectances, and with its size come irradiances that are responses.
        """
        light = weights * self.column.sun_irradiance
        share = light / light.sum(axis=1, keepdims=True)
        return self._channels(light.sum(axis=1), lambda values: values @ share.T)

    def representative(self, weights: Array) -> Setting:
        """Return the same at the mean wavelength of each channel instead; weights as above."""
        light = weights * self.column.sun_irradiance
        nm = self.column.bands.centres
        at = light @ nm / light.sum(axis=1)

        def taken(values: Array) -> Array:
            return np.apply_along_axis(lambda row: np.interp(at, nm, row), -1, values)

        return self._channels(light.sum(axis=1), taken)

    def _channels(self, light: Array, taken: Callable[[Array], Array]) -> Setting:
        column = self.column
        mixed = dataclasses.replace(
            column,
            bands=Bands.uniform(len(light)),
            absorption=taken(column.absorption),
            scattering=taken(column.scattering),
            sun_irradiance=light,
            sky_radiance=np.zeros(len(light)),
            floor_reflectance=taken(column.floor_reflectance),
        )
        return Setting(mixed, taken(self.Kd), taken(self.patches), self.depth)


@functools.cache
def d65() -> Illuminant:
    """Return the sun of the paper."""
    return parse_illuminant("d65")


@functools.lru_cache(maxsize=16)
def setting(scene: PaperScene, bands: Bands = FINE) -> Setting:
    """Put the patches into the water of a scene, on bands."""
    water, nm = Water.jerlov(scene.water), bands.centres
    view = make_viewpoint(
        water,
        d65(),
        standard_observer(),
        scene.depth,
        bands,
        f"hg:{ASYMMETRY:g}",
        sun_zenith=SUN_ZENITH,
        floor_depth=scene.depth + scene.above_floor,
        floor_reflectance=f"{FLOOR_REFLECTANCE:g}",
    )
    patches = [colorchecker_reflectance(name).at(nm) for name in colorchecker_patches()]
    return Setting(view.column, water.Kd(nm), np.stack(patches), scene.depth)


@dataclass(frozen=True, eq=False)
class _Rays:
    """Level rays to patches that are tilted up by 45°, and rays into open water."""

    level: tuple[float, float, float]
    normal: tuple[float, float, float]
    open_water: tuple[Array, Array, Array]


def level_ray(column: WaterColumn) -> tuple[float, float, float]:
    """Level view direction at right angles to the sun."""
    x, y, _ = column.sun_direction
    length = math.hypot(x, y)
    return (-y / length, x / length, 0.0)


def _rays(column: WaterColumn) -> _Rays:
    side = np.array(level_ray(column))
    tilt = np.radians(TILTS)[:, None]
    upwards = np.array([0.0, 0.0, 1.0])
    facing = (upwards - side) / math.sqrt(2.0)
    ahead = np.cos(tilt) * side + np.sin(tilt) * upwards
    return _Rays(
        tuple(side.tolist()),
        tuple(facing.tolist()),
        (ahead[:, :1], ahead[:, 1:2], ahead[:, 2:]),
    )


Method = Callable[[Setting], Array]
"""From a setting to radiances, shape (24 patches × distances + tilts, n)."""


def tables(at: Setting) -> Array:
    """Light that EEVEE looks up."""
    return _seen(at, at.tables)


def closed_form(at: Setting) -> Array:
    """The add-on's closed form."""
    return _seen(at, at.closed_form)


def _seen(at: Setting, water: TabulatedWater | UndisturbedWater) -> Array:
    rays = _rays(at.column)
    y = np.full((1, 1), at.depth)
    w, normal = (tuple(np.full((1, 1), x) for x in v) for v in (rays.level, rays.normal))
    cosine = -float(np.dot(rays.normal, at.column.sun_direction))
    light = surface_light(water.patch_light(y, normal), y, normal[2])
    L = light.reflected(at.patches / math.pi * cosine, at.patches, cosine)
    seen = [water.surface(y, y, w, np.full((1, 1), P), L).total for P in DISTANCES]
    ahead = water.open_water(np.full((len(TILTS), 1), at.depth), rays.open_water)
    return np.vstack([*seen, ahead.total])


def paper_printed(at: Setting) -> Array:
    """Equations 9 and 10 as printed."""
    return _by_formula(at, path_radiance_Monzon2024)


def paper_corrected(at: Setting) -> Array:
    """Equations 9 and 10 with their two exponents apart."""
    return _by_formula(at, path_radiance_Monzon2024_corrected)


def _by_formula(at: Setting, form: Callable[..., Array]) -> Array:
    column, y = at.column, at.depth
    known = (
        column.scattering, column.attenuation, at.Kd, column.sun_irradiance,
        column.floor_reflectance, y,
    )  # fmt: skip
    L = at.patches * _paper_light(at)
    seen = []
    for P in DISTANCES:
        path = form(*known, 0.0, P, column.floor_depth)
        seen.append(path + np.exp(-column.attenuation * P) * L)
    w_y = -_rays(column).open_water[2]
    P = distance_in_water(y, w_y, column.floor_depth)
    path = form(*known, w_y, P, column.floor_depth)
    floor = column.floor_reflectance / math.pi * column.sun_irradiance
    floor = np.where(w_y > 0, floor * np.exp(-at.Kd * column.floor_depth), 0.0)
    return np.vstack([*seen, path + np.exp(-column.attenuation * P) * floor])


def _paper_light(at: Setting) -> Array:
    """Radiance of a white patch: all light from the sun, weakened by Kd."""
    column = at.column
    facing = -float(np.dot(_rays(column).normal, column.sun_direction)) / column.sun_cosine
    return facing / math.pi * column.sun_irradiance * np.exp(-at.Kd * at.depth)


def one_light(at: Setting) -> Array:
    """One ambient light for the whole scene, and a veil without direction.

    What the paper says of the method of Chen et al. (2022); its level, which is not said, is that
    of Equation 9 over a dark floor, looking level.
    """
    column = at.column
    ambient = column.sun_irradiance * np.exp(-at.Kd * at.depth)
    c = column.attenuation
    veil = column.scattering / c * ambient / (4.0 * math.pi)
    seen = []
    for P in DISTANCES:
        left = np.exp(-c * P)
        seen.append(left * at.patches * _paper_light(at) + (1.0 - left) * veil)
    return np.vstack([*seen, np.tile(veil, (len(TILTS), 1))])


@dataclass(frozen=True, eq=False)
class Development:
    """A sensor at a scene: from responses of its channels to linear RGB.

    Attributes
    ----------
    sensor : Sensor
    gain : float
        Exposure.
    balanced : bool
        Whether responses are balanced for daylight and taken to Rec.709, or are RGB themselves.
    """

    sensor: Sensor
    gain: float
    balanced: bool

    def of_bands(self, radiance: Array, bands: Bands = FINE) -> Array:
        """Linear RGB of band radiances, as a display shows it, shape (..., 3)."""
        return self.of_channels(radiance @ self.sensor.response_in(bands).T, bands)

    def of_channels(self, responses: Array, bands: Bands = FINE) -> Array:
        """Linear RGB of responses through a matrix that was fitted for bands."""
        matrix = daylight_matrix(self.sensor, bands) if self.balanced else np.eye(3)
        return np.clip(responses @ matrix.T * self.gain, 0.0, 1.0)


def development(at: Setting, sensor: Sensor, *, balanced: bool) -> Development:
    """Expose for a white diffuser in the solved light at the camera, given many bands.

    Balanced, its luminance becomes :data:`WHITE`; else its largest response.
    """
    responses = sensor.response_in(FINE) @ at.light / math.pi
    if not balanced:
        return Development(sensor, WHITE / float(responses.max()), balanced)
    white = luminance(daylight_matrix(sensor, FINE) @ responses)
    return Development(sensor, WHITE / float(white), balanced)


@functools.cache
def daylight_matrix(sensor: Sensor, bands: Bands) -> Array:
    """From responses to linear Rec.709 with daylight white balance, shape (3, 3)."""
    return reduction(sensor, bands, d65()).matrix
