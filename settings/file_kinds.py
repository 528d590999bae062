"""What a file can be for a scene: told by its header, checked by its reader."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ..uw_spectral.errors import InputError, printable
from ..uw_spectral.housing import read_housing
from ..uw_spectral.housing.description import CONTENT
from ..uw_spectral.lamps.emission import parse_emission
from ..uw_spectral.lamps.ies import read_ies
from ..uw_spectral.lamps.profile import profile_from_csv
from ..uw_spectral.spectra.illuminant import parse_illuminant
from ..uw_spectral.spectra.reflectance import reflectance_from_csv
from ..uw_spectral.spectra.seabass import is_seabass
from ..uw_spectral.spectra.sensor import parse_sensor
from ..uw_spectral.spectra.spectrum import read_text, table_text
from ..uw_spectral.water import measured

_IES = ".ies"


@dataclass(frozen=True)
class FileKind:
    """One object that a file can be.

    ``text`` says what such a file holds; a table with one of the ``columns`` is meant for it;
    ``read`` raises InputError if the file cannot be used; ``setting`` is that of the scene which
    takes it, empty where a lamp does.
    """

    label: str
    text: str
    columns: tuple[str, ...]
    read: Callable[[Path], object]
    setting: str = ""


def _profile(path: Path) -> object:
    return read_ies(path) if path.suffix.lower() == _IES else profile_from_csv(str(path))


FILE_KINDS = {
    "water": FileKind(
        "Water", measured.CONTENT, ("a", "b", "Kd", "depth_m"), measured.read_water, "water"
    ),
    "sensor": FileKind(
        "Camera", "wavelength_nm, R, G, B", ("R", "G", "B"),
        lambda path: parse_sensor(f"file:{path}"), "sensor",
    ),
    "housing": FileKind("Housing of the Camera", CONTENT, (), read_housing, "housing"),
    "floor": FileKind(
        "Reflectance of the Floor", "wavelength_nm, reflectance", ("reflectance",),
        reflectance_from_csv, "floor_reflectance",
    ),
    "light": FileKind(
        "Light above the Water", "wavelength_nm, irradiance; or SeaBASS with es", ("irradiance",),
        lambda path: parse_illuminant(f"file:{path}"), "illuminant",
    ),
    "spectrum": FileKind(
        "Spectrum of the Lamp", "wavelength_nm, power", ("power",),
        lambda path: parse_emission(f"file:{path}"),
    ),
    "profile": FileKind(
        "Profile of the Lamp", "IES, or angle_deg, intensity", ("angle_deg",), _profile,
    ),
}  # fmt: skip
"""The kinds of files by their names."""


def kinds_of_file(path: Path) -> tuple[str, ...]:
    """Return what a file can be: the names of kinds whose readers take it, one or more.

    Raises InputError if it is none of them, or is not right.
    """
    usable, errors = [], []
    for name in _meant(path):
        try:
            FILE_KINDS[name].read(path)
        except InputError as error:
            errors.append(error)
        else:
            usable.append(name)
    if not usable:
        raise errors[0]
    return tuple(usable)


def _meant(path: Path) -> tuple[str, ...]:
    """Return the kinds that a file's name and header speak of."""
    suffix = path.suffix.lower()
    if suffix == _IES:
        return ("profile",)
    text = read_text(path)
    if suffix == ".sb" or is_seabass(text):
        return ("water", "light")
    names = table_text(text, str(path)).names
    if suffix == ".json" and any(f'"{part}"' in text for part in ("port", "lens", "camera")):
        return ("housing",)
    if suffix == ".json" or (suffix != ".csv" and len(names) < 2):
        return ("sensor",)
    meant = tuple(name for name, kind in FILE_KINDS.items() if set(names) & set(kind.columns))
    if not meant:
        known = "; ".join(f"{kind.label}: {kind.text}" for kind in FILE_KINDS.values())
        raise InputError(
            f"{path}: its columns {printable(', '.join(names))!r} tell nothing that a scene can "
            f"use. Name them as one of these does. {known}"
        )
    return meant
