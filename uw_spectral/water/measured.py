"""Waters from files: a and b, Kd alone, a profile, or a SeaBASS file."""

from __future__ import annotations

from pathlib import Path

from ..spectra.seabass import is_seabass
from ..spectra.spectrum import read_text, table_text
from .kd_inversion import water_from_Kd_csv
from .optical_properties import Water
from .profile import DEPTH, WaterProfile, read_profile
from .seabass import water_from_seabass

PATTERNS = ("*.csv", "*.txt", "*.sb", "*.env")
"""Names of the files, for those who look for one."""

CONTENT = (
    "CSV with the columns wavelength_nm and a, b or Kd in 1/m; a profile with depth_m and these "
    "(not Kd), or with depth_m and constituents; or SeaBASS (.sb)"
)
"""What the files hold, in words."""


def read_water(path: str | Path) -> Water | WaterProfile:
    """Return the water of a file, or its layers if it differs with depth.

    ``.sb``, or what begins as SeaBASS does: see :func:`.water_from_seabass`. Else a CSV table:
    ``wavelength_nm,a,b[,Kd]``, or ``wavelength_nm,Kd``, which is inverted (:func:`.invert_Kd`).
    With a column ``depth_m``: see :func:`.read_profile`.

    Raises
    ------
    InputError
        If the file cannot be used.
    """
    path = Path(path)
    text = read_text(path)
    if path.suffix.lower() == ".sb" or is_seabass(text):
        return water_from_seabass(path)
    names = table_text(text, str(path)).names
    if DEPTH in names:
        return read_profile(path)
    if "Kd" in names and not {"a", "b"} & set(names):
        return water_from_Kd_csv(path)
    return Water.from_csv(path)
