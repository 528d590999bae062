"""What a picture under water is made of, in text and numbers; :func:`.resolve` computes with it.

Every text stands for an object that can be given itself instead: a water, an
illuminant, a sensor, a spectrum, bands.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..spectra.bands import Bands
from ..spectra.barrier_filter import NO_FILTER
from ..spectra.colour_rendering import WhiteBalance
from ..spectra.illuminant import Illuminant
from ..spectra.sensor import Sensor
from ..spectra.spectrum import Spectrum
from ..transfer.sky import UNIFORM
from ..water.bio_optics import Constituents
from ..water.optical_properties import DEFAULT_SOURCE, Water
from ..water.phase import PhaseModel
from ..water.profile import WaterProfile

REFERENCE_BANDS = 60
"""Bands that stand for the continuous spectrum."""


@dataclass(frozen=True)
class WaterDescription:
    """A body of water.

    Parameters
    ----------
    water : str, Constituents, Water or Profile of either
        Text as :func:`.parse_water` takes it. Constituents keep the parts of
        their phase function whatever the amounts, so that these can be animated.
    second : str or Water
        What is mixed in; empty for nothing.
    concentration : float
        Factor on all that is in the water beside the water itself.
    absorption_factor, scattering_factor : float
        On the coefficients.
    phase : str or PhaseModel, optional
        Text as :func:`.parse_phase` takes it; by default that of the constituents, or the
        mixture of molecules and sea particles with the bb/b of the water
        (:attr:`.Water.phase_model`).
    inelastic : str
        What changes the wavelength of light, as :func:`.parse_processes` takes it.
    """

    water: str | Constituents | Water | WaterProfile = "jerlov:IB"
    source: str = DEFAULT_SOURCE
    second: str | Water = ""
    second_fraction: float = 0.0
    absorption_factor: float = 1.0
    scattering_factor: float = 1.0
    phase: str | PhaseModel | None = None
    inelastic: str = ""
    concentration: float = 1.0


@dataclass(frozen=True)
class SunAndSky:
    """The light above the water.

    Parameters
    ----------
    illuminant : str or Illuminant
        Text as :func:`.parse_illuminant` takes it.
    zenith, azimuth : float
        The sun in air, degrees; the azimuth is where its light travels to, from +x towards +y.
    sky_radiance : float
        Of the uniform sky that brings as much light, as a fraction of the direct light, per
        steradian.
    above_surface : bool or None
        Whether the sun's irradiance is known above the surface, so that part of it is
        reflected, or just below; None as the illuminant has it.
    sky : str
        Distribution of the sky's radiance, one of :data:`.SKIES`.
    strength : float
        Factor on all of it; 0 is night.
    """

    illuminant: str | Illuminant = "d65"
    zenith: float = 30.0
    azimuth: float = 0.0
    sky_radiance: float = 0.0
    above_surface: bool | None = None
    sky: str = UNIFORM
    strength: float = 1.0


@dataclass(frozen=True)
class SurfaceDescription:
    """The water surface.

    Parameters
    ----------
    slope_variance : float
        Mean square slope of waves, over which the light is averaged:
        :attr:`.WaveSpectrum.mean_square_slope`.
    """

    kind: str = "none"
    refractive_index: float = 1.34
    slope_variance: float = 0.0


@dataclass(frozen=True)
class FloorDescription:
    """A flat floor.

    Parameters
    ----------
    depth : float
        In m; infinite for none.
    reflectance : str or Spectrum
        Text as :func:`.parse_reflectance` takes it.
    """

    depth: float = math.inf
    reflectance: str | Spectrum = "0.2"


@dataclass(frozen=True)
class CameraDescription:
    """A camera and the development of its pictures.

    Parameters
    ----------
    sensor : str or Sensor
        Text as :func:`.parse_sensor` takes it.
    white_balance : {"daylight", "depth", "none"}
    exposure_stops : float, optional
        None exposes automatically.
    compensation : float
        Stops that are added to an automatic exposure.
    filter : str
        Before the sensor: text as :func:`.barrier_filter.transmittance` takes it.
    """

    sensor: str | Sensor = "cie1931"
    white_balance: WhiteBalance = "daylight"
    exposure_stops: float | None = None
    compensation: float = 0.0
    filter: str = NO_FILTER


@dataclass(frozen=True)
class BandsDescription:
    """Which bands stand for the spectrum.

    Parameters
    ----------
    count : int
        Number of bands.
    start, end : float
        Their range, nm.
    wavelengths : tuple of float
        Centres in nm, instead of so many bands.
    optimised : bool
        Whether bands are placed for the water, see :func:`.optimised_bands`, and weights
        fitted to water, depth and sensor; or equal bands.
    """

    count: int = 8
    start: float = 400.0
    end: float = 700.0
    wavelengths: tuple[float, ...] = ()
    optimised: bool = False


@dataclass(frozen=True)
class Description:
    """Water, light, surface, floor, camera and bands of a picture; equal if all of it is."""

    water: WaterDescription = WaterDescription()
    light: SunAndSky = SunAndSky()
    surface: SurfaceDescription = SurfaceDescription()
    floor: FloorDescription = FloorDescription()
    camera: CameraDescription = CameraDescription()
    bands: BandsDescription | Bands = BandsDescription()
