"""Spectral sensitivities of cameras, of films and of the standard observers."""

from __future__ import annotations

import functools
import json
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from ..content import ComparedByContent
from ..errors import DataWarning, InputError, unknown_name
from ._colour import colour_science
from .bands import Bands
from .spectral_table import LARGEST_NUMBER, read_spectral_table
from .spectrum import Spectrum, read_text, shipped_table, split_location, table_text

if TYPE_CHECKING:
    from colour import MultiSpectralDistributions

OBSERVERS = {
    "cie1931": "CIE 1931 2 Degree Standard Observer",
    "cie1964": "CIE 1964 10 Degree Standard Observer",
    "cie2015": "CIE 2015 2 Degree Standard Observer",
    "cie2015-10": "CIE 2015 10 Degree Standard Observer",
}
FILE_PATTERNS = ("*.csv", "*.json", "*.txt")
"""Names of the files that hold sensors, for those who look for one."""

FILE_CONTENT = "CSV wavelength_nm, R, G, B, rawtoaces JSON, or text as of Jiang et al. 2013"
"""What these files hold, in words."""

_CHANNELS = ("R", "G", "B")
_DARK = 1e-30  # sensitivity that counts as none
Kind = Literal["camera", "film", "observer"]
FILM_NOTE = (
    "film: the sensitivities of its layers, taken as linear; its characteristic curve, masking and "
    "development are left out, so contrast and colours of a print are not its own"
)
"""What a film stock here is not."""

# Layout of the camera files of Jiang et al. 2013: 400 to 720 nm in steps of 10.
_JIANG2013_WAVELENGTHS = np.arange(400.0, 721.0, 10.0)


@dataclass(frozen=True, eq=False)
class Sensor(ComparedByContent):
    """Three spectral sensitivities.

    Raises
    ------
    InputError
        If there are not three columns, one is negative or too large, or one is zero throughout.
    """

    name: str  #: As :func:`list_sensors` spells it.
    #: Three columns: R, G, B of a camera (relative), the cyan-, magenta- and yellow-forming layers
    #: of a film, which record R, G and B, or the colour matching functions x, y, z of an observer.
    sensitivity: Spectrum
    kind: Kind
    source: str
    licence: str

    def __post_init__(self) -> None:
        spectrum = self.sensitivity
        if spectrum.values.ndim != 2 or spectrum.values.shape[1] != 3:
            raise InputError(f"sensor {self.name}: give three sensitivities, R, G and B")
        negative = (spectrum.values < 0).any(axis=1)
        if negative.any():
            raise InputError(
                f"sensor {self.name}: a sensitivity is negative at "
                f"{spectrum.wavelengths[negative][0]:g} nm; correct that row"
            )
        if spectrum.values.max() > LARGEST_NUMBER:
            raise InputError(
                f"sensor {self.name}: a sensitivity of {spectrum.values.max():g} is too large to "
                "be true; correct it"
            )
        if not (spectrum.values > _DARK).any(axis=0).all():
            raise InputError(
                f"sensor {self.name}: a channel is zero at every wavelength; give all three"
            )

    @property
    def note(self) -> str:
        """What a user of this sensor should know; empty for cameras and observers."""
        return FILM_NOTE if self.kind == "film" else ""

    def response_in(self, bands: Bands) -> NDArray[np.float64]:
        """Sensitivity times band width, shape (3, n): responses per unit radiance of each band."""
        return self.sensitivity.at_or_zero(bands.centres).T * bands.widths


@dataclass(frozen=True)
class _Collection:
    """A shipped table of sensors, columns ``"name:channel"``."""

    file: str
    kind: Kind
    source: str
    licence: str

    def names(self) -> list[str]:
        columns = shipped_table(self.file).columns
        return [name[:-2] for name in columns if name.endswith(":R")]

    def sensor(self, name: str) -> Sensor:
        columns = shipped_table(self.file).columns
        values = np.stack([columns[f"{name}:{channel}"] for channel in _CHANNELS], axis=1)
        spectrum = Spectrum(columns["wavelength_nm"], values, f"sensitivity of {name}")
        return Sensor(name, spectrum, self.kind, self.source, self.licence)


_CAMERAS = _Collection("camera_sensitivities.csv", "camera", "rawtoaces-data e9b8503", "Apache-2.0")
_FILMS = _Collection("film_sensitivities.csv", "film", "spectral-film-lut 0.18.13", "MIT")


def list_sensors(kind: Kind | None = None) -> list[str]:
    """Return the names of all sensors that need no file: observers, cameras, films.

    Raises
    ------
    InputError
        If there is no such kind.
    """
    names = {
        "observer": list(OBSERVERS),
        "camera": [*_CAMERAS.names(), *colour_science().MSDS_CAMERA_SENSITIVITIES],
        "film": _FILMS.names(),
    }
    if kind is None:
        return [name for group in names.values() for name in group]
    if kind not in names:
        raise unknown_name("kind of sensor", kind, names)
    return names[kind]


def parse_sensor(text: str) -> Sensor:
    """Return the sensor that an option names.

    A name of :func:`list_sensors` in any case, or ``"file:PATH"``: a CSV table
    ``wavelength_nm,R,G,B``, a rawtoaces JSON file, or a text file in the layout of Jiang, Liu, Gu &
    Süsstrunk, WACV 2013; where that holds several cameras, ``"file:PATH#NAME"``.

    Raises
    ------
    InputError
        If the name is unknown (near names are suggested) or the file cannot
        be used.
    """
    scheme, _, rest = text.partition(":")
    if scheme == "file" and rest:
        return _read_sensor(rest)
    return _named_sensor(text)


@functools.lru_cache(maxsize=32)
def _named_sensor(text: str) -> Sensor:
    names = list_sensors()
    name = {known.lower(): known for known in names}.get(text.strip().lower())
    if name is None:
        raise unknown_name("sensor", text, names)
    if name in OBSERVERS:
        return _from_colour_science(name, colour_science().MSDS_CMFS[OBSERVERS[name]])
    for collection in (_CAMERAS, _FILMS):
        if name in collection.names():
            return collection.sensor(name)
    return _from_colour_science(name, colour_science().MSDS_CAMERA_SENSITIVITIES[name])


def standard_observer() -> Sensor:
    """Return the eye: the CIE 1931 2° observer."""
    return parse_sensor("cie1931")


def _from_colour_science(name: str, data: MultiSpectralDistributions) -> Sensor:
    wavelengths, values = (np.asarray(x, dtype=np.float64) for x in (data.wavelengths, data.values))
    spectrum = Spectrum(wavelengths, values, f"sensitivity of {name}")
    source = f"colour-science {colour_science().__version__}: {data.name}"
    return Sensor(
        name, spectrum, "observer" if name in OBSERVERS else "camera", source, "BSD-3-Clause"
    )


def _read_sensor(location: str) -> Sensor:
    path, name = split_location(location)
    text = read_text(path, "sensor ", "give CSV, JSON or text")
    content = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    if path.suffix.lower() == ".json":
        return _read_rawtoaces(path, text)
    if path.suffix.lower() == ".csv" or (content and "wavelength" in content[0]):
        return _read_csv(path)
    return _read_jiang2013(path, content, name)


def _file_sensor(
    path: Path, name: str, wavelengths: NDArray[np.float64], values: NDArray[np.float64]
) -> Sensor:
    spectrum = Spectrum(wavelengths, values, f"sensitivity of {name}")
    return Sensor(name, spectrum, "camera", f"file {path.name}", "as the file's owner states")


def _read_csv(path: Path) -> Sensor:
    table = read_spectral_table(path, _CHANNELS)
    names = table_text(read_text(path), str(path)).names
    if others := [name for name in names if name not in ("wavelength_nm", *_CHANNELS)]:
        warnings.warn(
            f"sensor {path}: column {others[0]} is not read, a camera has R, G and B; "
            f"--receptors file:{path} renders a channel for each column",
            DataWarning,
            stacklevel=2,
        )
    values = np.stack([table.columns[channel] for channel in _CHANNELS], axis=1)
    return _file_sensor(path, path.stem, table.columns["wavelength_nm"], values)


def _read_rawtoaces(path: Path, text: str) -> Sensor:
    try:
        document = json.loads(text)
        spectral = document["spectral_data"]
        main = spectral["data"]["main"]
        order = [
            str(channel).upper() for channel in spectral.get("index", {}).get("main", _CHANNELS)
        ]
        rows = sorted((float(wavelength), *map(float, row)) for wavelength, row in main.items())
        table = np.array(rows)
        values = table[:, [order.index(channel) + 1 for channel in _CHANNELS]]
        header = dict(document.get("header") or {})
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        raise InputError(
            f"sensor {path} is not a rawtoaces file ({error}); expected "
            'spectral_data.data.main = {"380": [R, G, B], …}'
        ) from error
    name = f"{header.get('manufacturer', '')} {header.get('model', '')}".strip() or path.stem
    return _file_sensor(path, name, table[:, 0], values)


def _read_jiang2013(path: Path, lines: list[str], wanted: str) -> Sensor:
    cameras: dict[str, NDArray[np.float64]] = {}
    count = len(_JIANG2013_WAVELENGTHS)
    expected = (
        f"expected blocks of a camera name and three rows R, G, B of {count} numbers "
        "(400 to 720 nm), or a CSV table wavelength_nm,R,G,B"
    )
    if not lines or len(lines) % 4:
        raise InputError(f"sensor {path} has {len(lines)} lines; {expected}")
    for first in range(0, len(lines), 4):
        name = lines[first].strip()
        try:
            rows = [[float(cell) for cell in line.split()] for line in lines[first + 1 : first + 4]]
        except ValueError as error:
            raise InputError(f"sensor {path}, camera {name!r}: {error}; {expected}") from error
        if any(len(row) != count for row in rows):
            found = ", ".join(str(len(row)) for row in rows)
            raise InputError(f"sensor {path}, camera {name!r}: rows of {found} numbers; {expected}")
        cameras[name] = np.array(rows).T
    if not wanted and len(cameras) > 1:
        raise InputError(
            f"sensor {path} holds {len(cameras)} cameras; choose one as "
            f"file:{path}#NAME: {', '.join(cameras)}"
        )
    name = {known.lower(): known for known in cameras}.get(wanted.strip().lower())
    if wanted and name is None:
        raise unknown_name(f"camera in {path}", wanted, cameras)
    name = name or next(iter(cameras))
    return _file_sensor(path, name, _JIANG2013_WAVELENGTHS, cameras[name])
