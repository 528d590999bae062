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
from ..transfer.sky_picture import SkyPicture
from ..water.bio_optics import Constituents
from ..water.optical_properties import DEFAULT_SOURCE, Water
from ..water.phase import PhaseModel
from ..water.profile import WaterProfile

REFERENCE_BANDS = 60
"""Bands that stand for the continuous spectrum."""


@dataclass(frozen=True)
class WaterDescription:
    """A body of water."""

    #: Text as :func:`.parse_water` takes it. Constituents keep the parts of their phase function
    #: whatever the amounts, so that these can be animated.
    water: str | Constituents | Water | WaterProfile = "jerlov:IB"
    source: str = DEFAULT_SOURCE
    second: str | Water = ""  #: What is mixed in; empty for nothing.
    second_fraction: float = 0.0
    #: On the coefficients.
    absorption_factor: float = 1.0
    scattering_factor: float = 1.0
    #: Text as :func:`.parse_phase` takes it; by default that of the constituents, or the mixture of
    #: molecules and sea particles with the bb/b of the water (:attr:`.Water.phase_model`).
    phase: str | PhaseModel | None = None
    #: What changes the wavelength of light, as :func:`.parse_processes` takes it.
    inelastic: str = ""
    concentration: float = 1.0  #: Factor on all that is in the water beside the water itself.


@dataclass(frozen=True)
class SunAndSky:
    """The light above the water."""

    illuminant: str | Illuminant = "d65"  #: Text as :func:`.parse_illuminant` takes it.
    #: The sun in air, degrees; the azimuth is where its light travels to, from +x towards +y.
    zenith: float = 30.0
    azimuth: float = 0.0
    #: Of the uniform sky that brings as much light, as a fraction of the direct light, per
    #: steradian.
    sky_radiance: float = 0.0
    #: Whether the sun's irradiance is known above the surface, so that part of it is reflected, or
    #: just below; None as the illuminant has it.
    above_surface: bool | None = None
    sky: str = UNIFORM  #: Distribution of the sky's radiance, one of :data:`.SKIES`.
    strength: float = 1.0  #: Factor on all of it; 0 is night.
    #: What lights the water instead: ``file:PATH``, in OpenEXR, as :class:`.SkyPicture` has it. The
    #: illuminant is then what a camera is balanced and exposed for.
    sky_picture: str | SkyPicture = ""


@dataclass(frozen=True)
class SurfaceDescription:
    """The water surface."""

    kind: str = "none"
    refractive_index: float = 1.34
    #: Mean square slope of waves, over which the light is averaged:
    #: :attr:`.WaveSpectrum.mean_square_slope`.
    slope_variance: float = 0.0


@dataclass(frozen=True)
class FloorDescription:
    """A flat floor."""

    depth: float = math.inf  #: In m; infinite for none.
    reflectance: str | Spectrum = "0.2"  #: Text as :func:`.parse_reflectance` takes it.


@dataclass(frozen=True)
class CameraDescription:
    """A camera and the development of its pictures."""

    sensor: str | Sensor = "cie1931"  #: Text as :func:`.parse_sensor` takes it.
    white_balance: WhiteBalance = "daylight"
    exposure_stops: float | None = None  #: None exposes automatically.
    compensation: float = 0.0  #: Stops that are added to an automatic exposure.
    #: Before the sensor: text as :func:`.barrier_filter.transmittance` takes it.
    filter: str = NO_FILTER


@dataclass(frozen=True)
class BandsDescription:
    """Which bands stand for the spectrum."""

    count: int = 8
    #: Their range, nm.
    start: float = 400.0
    end: float = 700.0
    wavelengths: tuple[float, ...] = ()  #: Centres in nm, instead of so many bands.
    #: Whether bands are placed for the water, see :func:`.optimised_bands`, and weights fitted to
    #: water, depth and sensor; or equal bands.
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
