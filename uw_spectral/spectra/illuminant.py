"""The light above the water: direct sun and diffuse sky."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..content import ComparedByContent
from ..errors import InputError, printable, unknown_name
from .bands import Bands
from .seabass import is_seabass, read_seabass
from .spectral_table import read_spectral_table
from .spectrum import Spectrum, Table, read_text, shipped_table

ILLUMINANTS = ("d65", "equal-energy", "astm-g173", "clear-sky")
RELATIVE = "relative"
_DARK = 1e-30  # irradiance that counts as none
ABSOLUTE = "W m-2 nm-1"
# Relative illuminants are 1 here, where CIE illuminants are 100.
_REFERENCE_WAVELENGTH = 560.0
_CLEAR_SKY_ZENITHS = (0.0, 30.0, 60.0, 75.0)
_G173_SUN_ZENITH, _G173_TILT = 48.19, 37.0


@dataclass(frozen=True, eq=False)
class Illuminant(ComparedByContent):
    """Horizontal spectral irradiance of sun and sky."""

    name: str
    #: Horizontal irradiance of the sun and of the sky, on one grid.
    direct: Spectrum
    diffuse: Spectrum
    unit: str  #: ``"W m-2 nm-1"``, or ``"relative"`` (direct is 1 at 560 nm).
    source: str
    #: Whether it is that above the surface, of which a part is reflected; spectra without a place
    #: are taken just below it.
    above_surface: bool = False

    @property
    def total(self) -> Spectrum:
        """Sun and sky together."""
        return Spectrum(
            self.direct.wavelengths,
            self.direct.values + self.diffuse.values,
            f"irradiance of {self.name}",
            self.source,
        )

    def direct_in(self, bands: Bands) -> NDArray[np.float64]:
        """Mean direct irradiance over each band, shape (n,)."""
        return band_mean(self.direct, bands)

    def diffuse_in(self, bands: Bands) -> NDArray[np.float64]:
        """Mean diffuse irradiance over each band, shape (n,)."""
        return band_mean(self.diffuse, bands)

    def total_in(self, bands: Bands) -> NDArray[np.float64]:
        """Mean irradiance of sun and sky over each band, shape (n,)."""
        return band_mean(self.total, bands)


def band_mean(spectrum: Spectrum, bands: Bands) -> NDArray[np.float64]:
    """Mean of a spectrum over each band, exact for its linear interpolation.

    Light has lines and steps narrower than a band, which a sample at the
    centre would hit or miss; smooth quantities are better sampled.

    A band that reaches beyond the table is averaged over the part inside. Shape (n,) or (n, k).

    Raises
    ------
    InputError
        If a band centre lies outside the table.
    """
    spectrum.at(bands.centres)
    grid, values = spectrum.wavelengths, spectrum.values
    cells = ((values[1:] + values[:-1]).T / 2 * np.diff(grid)).T
    running = np.concatenate([np.zeros_like(values[:1]), np.cumsum(cells, axis=0)])
    half = bands.widths / 2
    edges = np.clip(np.concatenate([bands.centres - half, bands.centres + half]), *spectrum.range)
    cell = np.clip(np.searchsorted(grid, edges, side="right") - 1, 0, len(grid) - 2)
    rest = ((values[cell] + spectrum.at(edges)).T / 2 * (edges - grid[cell])).T
    start, end = np.split(running[cell] + rest, 2)
    return ((end - start).T / np.diff(np.split(edges, 2), axis=0)[0]).T


def parse_illuminant(text: str, sun_zenith: float = 0.0) -> Illuminant:
    """Return the illuminant that an option names.

    ``"d65"``, ``"equal-energy"``: relative, all of it direct. ``"astm-g173"``: the AM 1.5 sun. Its
    direct normal irradiance times the cosine of the zenith angle is the direct part; the rest of
    the global irradiance on the tilted plane is the diffuse part, taken as horizontal. The spectrum
    stays that of a sun at 48.2°. ``"clear-sky"``: sun and sky by zenith angle, 0 to 75°.
    ``"file:PATH"``: a table ``wavelength_nm,irradiance[,diffuse]``, in W m-2 nm-1, where irradiance
    is the direct part. Or SeaBASS with ``es``, by a wavelength column or as ``es490``: the mean of
    one station, above the water, all of it direct.

    Raises
    ------
    InputError
        If the name is unknown, the sun is below the horizon or outside the
        table, or the file cannot be used.
    """
    if not (math.isfinite(sun_zenith) and 0 <= sun_zenith < 90):
        raise InputError(
            f"sun zenith {sun_zenith:g}° is not above the horizon; give 0 to less than 90"
        )
    scheme, _, rest = text.partition(":")
    if scheme == "file" and rest:
        return _from_seabass(rest) if _is_seabass(rest) else _from_file(rest)
    name = text.strip().lower()
    if name == "d65":
        table = shipped_table("illuminant_d65.csv")
        d65 = table.spectrum("d65", "D65")
        scale = 1 / d65.at([_REFERENCE_WAVELENGTH])[0]
        return _illuminant("d65", table, d65.values * scale, None, RELATIVE)
    if name == "equal-energy":
        # The widest range any table of this project spans.
        table = Table(Path(name), "definition", {"wavelength_nm": np.array([300.0, 830.0])})
        return _illuminant(name, table, np.ones(2), None, RELATIVE)
    if name == "astm-g173":
        return _astm_g173(sun_zenith)
    if name == "clear-sky":
        return _clear_sky(sun_zenith)
    raise unknown_name("illuminant", text, [*ILLUMINANTS, "file:PATH"])


def _illuminant(
    name: str,
    table: Table,
    direct: NDArray[np.float64],
    diffuse: NDArray[np.float64] | None,
    unit: str,
    *,
    above_surface: bool = False,
) -> Illuminant:
    grid = table.columns["wavelength_nm"]
    sky = np.zeros_like(direct) if diffuse is None else diffuse
    return Illuminant(
        name,
        Spectrum(grid, direct, f"direct irradiance of {name}", table.header),
        Spectrum(grid, sky, f"diffuse irradiance of {name}", table.header),
        unit,
        table.header,
        above_surface,
    )


@functools.cache
def full_sun() -> float:
    """Irradiance at 560 nm that a relative sun of 1 stands for where lamps have a power in W.

    That of the AM 1.5 sun (ASTM G173) on a plane across its rays, W m⁻² nm⁻¹.
    """
    table = shipped_table("surface_irradiance.csv")
    return float(table.spectrum("g173_direct_normal", "AM 1.5 sun").at([_REFERENCE_WAVELENGTH])[0])


def _astm_g173(sun_zenith: float) -> Illuminant:
    table = shipped_table("surface_irradiance.csv")
    normal = table.columns["g173_direct_normal"]
    on_plane = normal * math.cos(math.radians(_G173_SUN_ZENITH - _G173_TILT))
    diffuse = table.columns["g173_global_tilt37"] - on_plane
    direct = normal * math.cos(math.radians(sun_zenith))
    return _illuminant("astm-g173", table, direct, diffuse, ABSOLUTE, above_surface=True)


def _clear_sky(sun_zenith: float) -> Illuminant:
    last = _CLEAR_SKY_ZENITHS[-1]
    if sun_zenith > last:
        raise InputError(
            f"clear-sky is tabulated for a sun zenith of 0 to {last:g}°, not {sun_zenith:g}°; "
            "raise the sun, or use d65, astm-g173 or a file"
        )
    table = shipped_table("surface_irradiance.csv")
    upper = next(i for i, z in enumerate(_CLEAR_SKY_ZENITHS) if i and sun_zenith <= z)
    ends = _CLEAR_SKY_ZENITHS[upper - 1 : upper + 1]

    # Beer's law makes the normal irradiance exponential in air mass: leaving out
    # one zenith angle, that gives it back within 0.5 % (mean, 350-750 nm).
    mass, low, high = (1 / math.cos(math.radians(z)) for z in (sun_zenith, *ends))
    t = (mass - low) / (high - low)

    def interpolated(part: str, power: float) -> NDArray[np.float64]:
        first, second = (
            np.log(table.columns[f"clear_sky_z{z:g}_{part}"] * m**power)
            for z, m in zip(ends, (low, high), strict=True)
        )
        return np.exp((1 - t) * first + t * second) * mass**-power

    # The sky has no such law; its horizontal irradiance does best as it is (4 %).
    direct, diffuse = interpolated("direct", 1), interpolated("diffuse", 0)
    return _illuminant("clear-sky", table, direct, diffuse, ABSOLUTE, above_surface=True)


def _from_file(path: str) -> Illuminant:
    table = read_spectral_table(path, ("irradiance",), ("diffuse",))
    direct = table.columns["irradiance"]
    _require_light(path, direct)
    return _illuminant(Path(path).name, table, direct, table.columns.get("diffuse"), ABSOLUTE)


def _is_seabass(path: str) -> bool:
    return Path(path).suffix.lower() == ".sb" or is_seabass(read_text(path))


def _from_seabass(path: str) -> Illuminant:
    data = read_seabass(path)
    data.require_one_station()
    if not data.columns_of("es"):
        raise InputError(
            f"{path}: found {printable(', '.join(data.fields))}; needed is es, the irradiance "
            "above the water, by a wavelength column or in columns like es490"
        )
    light = data.spectrum("es", "\n".join(f"{key}: {x}" for key, x in data.header.items()))
    _require_light(path, light.values)
    table = Table(Path(path), light.source, {"wavelength_nm": light.wavelengths})
    return _illuminant(Path(path).name, table, light.values, None, ABSOLUTE, above_surface=True)


def _require_light(path: str, irradiance: NDArray[np.float64]) -> None:
    if not np.any(irradiance > _DARK):
        raise InputError(
            f"{path}: the irradiance is zero at every wavelength; give it in W m-2 nm-1"
        )
    if len(irradiance) < 2:
        raise InputError(f"{path} has one row; an irradiance needs two wavelengths or more")
