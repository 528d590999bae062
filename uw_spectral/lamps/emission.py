"""What a lamp emits: its spectral radiant intensity in bands.

A lamp has a shape of spectrum and a power. Measured spectra and blackbodies give
W sr⁻¹ nm⁻¹; a colour gives the relative unit of scenes lit by a relative sun, in which
light (1, 1, 1) is as bright as D65 of 1 at 560 nm (:func:`.emission_basis`).
"""

from __future__ import annotations

import functools
import math
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError, unknown_name
from ..spectra._colour import colour_science
from ..spectra.bands import Bands
from ..spectra.colour_rendering import rec709_to_XYZ
from ..spectra.illuminant import band_mean
from ..spectra.reflectance import emission_basis
from ..spectra.sensor import standard_observer
from ..spectra.spectral_table import read_spectral_table
from ..spectra.spectrum import Spectrum

WATTS, LUMENS, CANDELAS = "W", "lm", "cd"
UNITS = (WATTS, LUMENS, CANDELAS)
"""Of a lamp's power; candela are those on its axis."""
LUMINOUS_EFFICACY = 683.0
"""lm/W at 555 nm, where V(λ) is 1."""
SPHERE = 4.0 * math.pi
FIRST_NM, LAST_NM = 300.0, 830.0
"""Range of a blackbody in nm; what it emits beyond does not count as its power."""
ALIASES = {
    "led": "LED-B5",
    "led-warm": "LED-B1",
    "halogen": "A",
    "hid": "MHC100/U/MP/4K",
}
"""Short names: phosphor LEDs of 6598 and 2733 K (CIE 15:2018), tungsten of 2856 K, metal halide."""

_SECOND_RADIATION_CONSTANT = 1.438776877e7  # h c / k, nm K
_COOLEST, _HOTTEST = 500.0, 50000.0
_STEP_NM = 5.0
_LARGEST_EXPONENT = 600.0
_EDGE = 1e-3  # nm


def blackbody(temperature: float) -> Spectrum:
    """Shape of the spectrum of a blackbody of 500 to 50000 K, 1 at 560 nm, from 300 to 830 nm."""
    if not _COOLEST <= temperature <= _HOTTEST:
        raise InputError(
            f"blackbody of {temperature:g} K: give a temperature of {_COOLEST:g} to {_HOTTEST:g} K"
        )
    wavelengths = np.arange(FIRST_NM, LAST_NM + _STEP_NM / 2, _STEP_NM)

    def log_planck(nm: ArrayLike) -> NDArray[np.float64]:
        x = _SECOND_RADIATION_CONSTANT / (np.asarray(nm, dtype=np.float64) * temperature)
        return -5.0 * np.log(nm) - x - np.log(-np.expm1(-x))

    values = np.exp(np.clip(log_planck(wavelengths) - log_planck(560.0), -_LARGEST_EXPONENT, None))
    return Spectrum(wavelengths, values, f"blackbody of {temperature:g} K", "Planck's law")


def colour_of_blackbody(temperature: float) -> NDArray[np.float64]:
    """Linear Rec.709 of a blackbody, of luminance 1, as Blender's node has it; not negative.

    The temperature, K, is held between 500 and 50000.
    """
    shape = blackbody(min(max(temperature, _COOLEST), _HOTTEST))
    eye = standard_observer().sensitivity
    XYZ = shape.at(eye.wavelengths) @ eye.values
    return np.maximum(np.linalg.solve(rec709_to_XYZ(), XYZ / XYZ[1]), 0.0)


@functools.cache
def luminous_efficiency() -> Spectrum:
    """V(λ) of CIE 1924, 360 to 830 nm, in 1 nm."""
    data = colour_science().colorimetry.SDS_LEFS_PHOTOPIC["CIE 1924 Photopic Standard Observer"]
    return Spectrum(data.wavelengths, data.values, "V(λ)", "CIE 1924, of colour-science")


def parse_emission(text: str) -> Spectrum:
    """Return the shape of the spectrum that an option names.

    Parameters
    ----------
    text : str
        ``"blackbody:5600"``; ``"led:450,20"``, a diode of one colour by its peak and its full width
        at half maximum in nm; ``"led"``, ``"led-warm"``, ``"halogen"``, ``"hid"``; the name of
        a light source or an illuminant of colour-science, such as ``"LED-B3"`` or
        ``"Metal Halide"``; ``"file:PATH"``, a table ``wavelength_nm,power`` in any unit
        proportional to W/nm.

    Raises
    ------
    InputError
        If the name is unknown, the temperature out of range or the file cannot be used.

    Examples
    --------
    >>> parse_emission("halogen").name
    'light source A'
    """
    scheme, _, rest = text.strip().partition(":")
    if scheme.lower() == "blackbody":
        try:
            temperature = float(rest.strip().removesuffix("K"))
        except ValueError as error:
            raise InputError(
                f"emission {text!r}: the temperature is not a number; write blackbody:5600"
            ) from error
        return blackbody(temperature)
    if scheme.lower() == "led" and rest:
        return _diode(text, rest)
    if scheme == "file" and rest:
        return _from_file(rest)
    measured = _measured()
    wanted = ALIASES.get(text.strip().lower(), text.strip()).lower()
    name = {n.lower(): n for n in measured}.get(wanted)
    if name is None:
        known = [*ALIASES, "blackbody:KELVIN", "led:PEAK,WIDTH", "file:PATH", *measured]
        raise unknown_name("emission", text, known)
    data = measured[name]
    values = np.maximum(data.values, 0.0)
    return Spectrum(data.wavelengths, values, f"light source {name}", "colour-science")


def _diode(text: str, rest: str) -> Spectrum:
    """Return a Gaussian line."""
    try:
        peak, width = map(float, rest.split(","))
    except ValueError as error:
        raise InputError(
            f"emission {text!r}: write led:PEAK,WIDTH in nm, such as led:450,20"
        ) from error
    if not FIRST_NM <= peak <= LAST_NM or not 1.0 <= width <= 200.0:
        raise InputError(
            f"emission {text!r}: give a peak of {FIRST_NM:g} to {LAST_NM:g} nm and a width of 1 to "
            "200 nm"
        )
    wavelengths = np.linspace(FIRST_NM, LAST_NM, int(LAST_NM - FIRST_NM) * 2 + 1)
    values = 0.5 ** ((2.0 * (wavelengths - peak) / width) ** 2)
    return Spectrum(wavelengths, values, f"diode of {peak:g} nm", "Gaussian")


def list_emissions() -> tuple[str, ...]:
    """Names of the measured light sources and illuminants that :func:`parse_emission` takes."""
    return tuple(_measured())


def _measured() -> dict:
    colour = colour_science()
    return {**colour.SDS_LIGHT_SOURCES, **colour.SDS_ILLUMINANTS}


def _from_file(path: str) -> Spectrum:
    table = read_spectral_table(path, ("power",))
    values = table.columns["power"]
    if len(values) < 2:
        raise InputError(f"{path} has one row; an emission needs two wavelengths or more")
    if not np.any(values > 0):
        raise InputError(f"{path}: the power is zero at every wavelength; give one that is not")
    return table.spectrum("power", f"emission of {Path(path).name}")


def without_light_beyond(shape: Spectrum) -> Spectrum:
    """Return a spectrum that is dark from 1 to 9999 nm where its table does not reach."""
    low, high = shape.range
    nm = np.concatenate([[1.0, low - _EDGE], shape.wavelengths, [high + _EDGE, 9999.0]])
    return Spectrum(nm, np.pad(shape.values, 2), shape.name, shape.source)


def flux(spectrum: Spectrum, unit: str = WATTS) -> float:
    """Integral of a spectrum per nm, in W, or in lm and cd: 683 lm/W times that with V(λ).

    Raises
    ------
    InputError
        If the unit is another.
    """
    if unit not in UNITS:
        raise unknown_name("unit of a lamp's power", unit, UNITS)
    if unit == WATTS:
        return float(np.trapezoid(spectrum.values, spectrum.wavelengths))
    efficiency = luminous_efficiency()
    low, high = (max(spectrum.range[0], efficiency.range[0]),
                 min(spectrum.range[1], efficiency.range[1]))  # fmt: skip
    if low >= high:
        return 0.0
    grid = np.union1d(spectrum.wavelengths, efficiency.wavelengths)
    grid = np.union1d(grid[(grid > low) & (grid < high)], [low, high])
    seen = spectrum.at(grid) * efficiency.at(grid)
    return LUMINOUS_EFFICACY * float(np.trapezoid(seen, grid))


def radiant_intensity(
    shape: Spectrum,
    power: float,
    bands: Bands,
    unit: str = WATTS,
    solid_angle: float = SPHERE,
) -> NDArray[np.float64]:
    """Spectral radiant intensity of a lamp where its profile is 1, mean over each band, (n,).

    In W sr⁻¹ nm⁻¹. The shape is in any unit proportional to W/nm; the power, in the unit, is that
    of the whole spectrum as tabulated.

    Parameters
    ----------
    solid_angle : float
        What the power is spread over, sr: that of the profile (:attr:`.LampProfile.solid_angle`)
        for the power of the lamp itself; 4π for the power of Blender's point and spot lights,
        of whose spot the cone cuts the rest away; for candela, the profile's value on the axis.

    Raises
    ------
    InputError
        If the power is negative or not finite, the lamp has no flux in the unit, or a band
        lies outside the spectrum.
    """
    _check_power(power, unit)
    if not solid_angle > 0:
        raise InputError(f"lamp: the solid angle must be positive, got {solid_angle:g} sr")
    whole = flux(shape, unit)
    if not whole > 0:
        raise InputError(
            f"{shape.name} has no flux in {unit}; give the power in W or another spectrum"
        )
    return band_mean(shape, bands) * (power / (whole * solid_angle))


def intensity_of_colour(rgb: ArrayLike, power: float, bands: Bands) -> NDArray[np.float64]:
    """Radiant intensity of a Blender point light of a colour, in the relative unit of the scene.

    Blender's light of power P has the intensity P/4π in each channel; the spectrum of its
    colour is that of every emitter here (:func:`.emission_basis`).

    Raises
    ------
    InputError
        If the colour or the power is negative or not finite.
    """
    _check_power(power, WATTS)
    colour = np.asarray(rgb, dtype=np.float64)
    if colour.shape != (3,) or not np.all(np.isfinite(colour)) or np.any(colour < 0):
        raise InputError(f"lamp: the colour must be three numbers from 0, got {colour.tolist()}")
    return emission_basis(bands) @ colour * (power / SPHERE)


def _check_power(power: float, unit: str) -> None:
    if not (math.isfinite(power) and power >= 0):
        raise InputError(f"lamp: the power must be finite and not negative, got {power:g} {unit}")
