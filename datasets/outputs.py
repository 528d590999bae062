"""What a specification asks for besides its views: how they are rendered, and which files."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..uw_spectral.detector import PATTERNS, Detector, RawSettings, Vignetting
from ..uw_spectral.errors import InputError, unknown_name
from ..uw_spectral.imaging.layers import NONE, parse_layers
from .axes import Array
from .formats import DEFAULT, FORMATS
from .tables import SpecTable

PICTURES = ("png", "jpg")
RAW_FILES = ("dng", "tiff")


@dataclass(frozen=True)
class Outputs:
    """Files of a set, as the table ``[output]`` has them."""

    picture: str = "png"  #: One of :data:`PICTURES`.
    formats: tuple[str, ...] = DEFAULT  #: Of :data:`FORMATS`.
    #: Whether scene-linear pictures and depth in m are written.
    linear: bool = True
    depth_exr: bool = True
    layers: tuple[str, ...] = ()  #: Of :data:`.layers.NAMES`, in one file a view.
    points: int = 100  #: That COLMAP is given of each view.
    leave_out: tuple[str, ...] = ()  #: Categories that are no instances, such as the ground.
    version: str = "1.0"
    description: str = ""


@dataclass(frozen=True)
class RawOutputs:
    """The camera's detector as a device."""

    detector: Detector = dataclasses.field(default_factory=Detector)
    #: Fraction of the counts that what is developed to white fills in its brightest channel, at any
    #: ISO: a higher one is for less light.
    white: float = 0.5
    exposure_time: float = 0.01  #: s.
    iso: float | None = None
    pattern: str | None = None
    vignetting: Vignetting | None = None
    file: str = "tiff"  #: One of :data:`RAW_FILES`.

    def settings(self, to_rec709: Array, seed: int) -> RawSettings:
        """Return how a picture is taken that a matrix, shape (3, 3), develops from its channels."""
        white = float(np.linalg.solve(to_rec709, np.ones(3)).max())
        base = self.detector.base_iso
        full = self.white * (1.0 if self.iso is None else base / self.iso)
        return RawSettings(
            self.detector,
            white / full,
            self.exposure_time,
            self.iso,
            self.pattern,
            self.vignetting,
            seed,
        )


def read_render(table: SpecTable) -> tuple[str, ...]:
    """Return the options of a render that a table gives, as on the command line.

    Examples
    --------
    >>> read_render(SpecTable({"engine": "eevee", "sky_radiance": 0.1, "shafts": False}, "render"))
    ('--engine', 'eevee', '--sky-radiance', '0.1', '--no-shafts')
    """
    found: list[str] = []
    for key in table.keys():  # noqa: SIM118 - not a dict
        value, name = table.get(key), key.replace("_", "-")
        if isinstance(value, bool):
            found.append(f"--{name}" if value else f"--no-{name}")
        elif isinstance(value, str | int | float):
            found += [f"--{name}", str(value)]
        else:
            raise table.needed(key, "text, a number, true or false", value)
    return tuple(found)


def read_outputs(table: SpecTable) -> Outputs:
    """Read the table ``[output]``; raise InputError for an unknown format."""
    defaults = Outputs()
    picture = table.choice("picture", PICTURES, defaults.picture)
    formats = table.texts("formats", defaults.formats)
    for name in formats:
        if name not in FORMATS:
            raise unknown_name(table.place("formats"), name, FORMATS)
        FORMATS[name].require(name)
    found = Outputs(
        picture,
        formats,
        table.switch("linear", defaults.linear),
        table.switch("depth_exr", defaults.depth_exr),
        parse_layers(table.text("layers", NONE)),
        table.whole("points", defaults.points),
        table.texts("leave_out", ()),
        table.text("version", defaults.version),
        table.text("description", defaults.description),
    )
    table.close()
    return found


def read_raw(table: SpecTable | None) -> RawOutputs | None:
    """Read the table ``[detector]``; None without one. Raises InputError outside of its domain."""
    if table is None:
        return None
    defaults = RawOutputs()
    values: dict[str, Any] = {}
    for field in dataclasses.fields(Detector):
        default = field.default
        assert isinstance(default, bool | int | float)
        if isinstance(default, bool):
            values[field.name] = table.switch(field.name, default)
        elif isinstance(default, int):
            values[field.name] = table.whole(field.name, default)
        else:
            values[field.name] = table.number(field.name, default)
    pattern = table.get("pattern")
    if pattern is not None and pattern not in PATTERNS:
        raise unknown_name(table.place("pattern"), str(pattern), PATTERNS)
    file = table.choice("file", RAW_FILES, "dng" if pattern else defaults.file)
    if file == "dng" and pattern is None:
        raise InputError(f"{table.place('file')}: a DNG holds a mosaic; give pattern = 'RGGB'")
    white = table.number("white", defaults.white)
    time = table.number("exposure_time", defaults.exposure_time)
    if not white > 0 or time < 0:
        raise InputError(f"{table.where}: white is above 0, and exposure_time 0 s or more")
    iso = table.number("iso") if "iso" in table else None
    radial = table.get("vignetting")
    vignetting = None
    if radial is not None:
        if not isinstance(radial, list):
            raise table.needed(
                "vignetting", "a list of radial coefficients, empty for cos⁴", radial
            )
        vignetting = Vignetting(
            radial=table.numbers("vignetting", len(radial)), natural=table.switch("natural", True)
        )
    table.close()
    detector = Detector(**values)
    detector.gain_at(iso)
    return RawOutputs(detector, white, time, iso, pattern, vignetting, file)
