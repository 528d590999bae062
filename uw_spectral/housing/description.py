"""A housing as users describe it: by words and numbers, or by a file of what was measured."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from ..errors import InputError, printable
from .camera import LensCamera
from .housing import Housing
from .lens import BrownConrady, KannalaBrandt, LateralColour, Lens
from .media import SeaWater, find_glass
from .port import DomePort, FlatPort, NoPort, Port

NONE, FLAT, DOME = "none", "flat", "dome"
_FILE = "file:"
_BROWN, _FISHEYE = "brown", "fisheye"
_COEFFICIENTS = {_BROWN: 5, _FISHEYE: 4}
_MM = 1e-3
CONTENT = (
    "JSON with port (kind flat: distance_mm, thickness_mm, glass, normal; kind dome: radius_mm, "
    "thickness_mm, glass, pupil_mm, half_angle_deg), lens (brown or fisheye: coefficients), "
    "lateral_colour (magnification, cubic, reference_nm), camera (width, height, fx, fy, cx, cy), "
    "all but one of them optional"
)
"""What a file of a measured housing holds."""


@dataclass(frozen=True)
class HousingDescription:
    """What is between the scene and the picture besides the water.

    Examples
    --------
    >>> HousingDescription("flat", lens="brown:-0.1").measured().port.distance
    0.03
    >>> HousingDescription().is_any
    False
    """

    port: str = NONE  #: ``"none"``, ``"flat"``, ``"dome"``, or ``"file:PATH"`` (:data:`CONTENT`).
    distance: float = 30.0  #: From the entrance pupil to the inner face of a flat port, mm.
    thickness: float = 8.0  #: Of the port, mm.
    glass: str = "BK7"  #: One of :data:`.GLASSES`.
    #: Angle of a flat port's normal to the optical axis, and where it leans to: from the right of
    #: the picture (0) to below (90); degrees.
    tilt: float = 0.0
    towards: float = 0.0
    radius: float = 100.0  #: Of the outer face of a dome, mm.
    forward: float = 0.0  #: How far the entrance pupil lies before the centre of the dome, mm.
    #: Distortion in air: ``"brown:k1,k2,p1,p2,k3"`` or ``"fisheye:k1,k2,k3,k4"``, later
    #: coefficients being 0 where they are left out; empty for none.
    lens: str = ""
    #: Of the water, g/kg and °C.
    salinity: float = 35.0
    temperature: float = 15.0

    @property
    def is_any(self) -> bool:
        """Whether there is a port or a lens at all."""
        return self.port != NONE or bool(self.lens)

    def measured(self) -> MeasuredHousing:
        """Return port and lens.

        Raises
        ------
        InputError
            If a word is unknown, a number impossible, or the file cannot be used.
        """
        if self.port.startswith(_FILE):
            found = read_housing(Path(self.port.removeprefix(_FILE)))
            return replace(found, lens=parse_lens(self.lens)) if self.lens else found
        return MeasuredHousing(self._port(), parse_lens(self.lens))

    def _port(self) -> Port:
        thickness = self.thickness * _MM
        if self.port == NONE:
            return NoPort()
        if self.port == FLAT:
            return FlatPort.tilted(
                self.distance * _MM, thickness, find_glass(self.glass),
                degrees=self.tilt, towards=self.towards,
            )  # fmt: skip
        if self.port == DOME:
            pupil = (0.0, 0.0, self.forward * _MM)
            return DomePort(self.radius * _MM, thickness, find_glass(self.glass), pupil)
        raise InputError(
            f"housing {printable(self.port)!r} is not one of {NONE}, {FLAT}, {DOME}, {_FILE}PATH"
        )

    def water(self, depth: float) -> SeaWater:
        """Return the water at a depth in m, whose pressure is nearly as many dbar."""
        return SeaWater(self.salinity, self.temperature, max(depth, 0.0))


@dataclass(frozen=True)
class MeasuredHousing:
    """Port and lens, and the camera if it was calibrated."""

    port: Port
    lens: Lens = field(default_factory=BrownConrady)
    lateral: LateralColour = field(default_factory=LateralColour)
    camera: LensCamera | None = None  #: As calibrated in air; without, a scene's own camera counts.
    source: str = ""  #: Who measured it.

    def before(self, camera: LensCamera, water: SeaWater) -> Housing:
        """Return the housing of a camera, of which picture size and, if unknown, focus count.

        Raises
        ------
        InputError
            If the calibrated picture has other proportions.
        """
        known = self.camera
        if known is not None:
            scale = camera.width / known.width
            if abs(known.height * scale - camera.height) > 1.0:
                raise InputError(
                    f"housing: its camera was calibrated for {known.width} × {known.height} "
                    f"pixels, and the picture has {camera.width} × {camera.height}; render with "
                    "the same proportions"
                )
            places = {name: getattr(known, name) * scale for name in ("fx", "fy", "cx", "cy")}
            camera = replace(camera, **places)
        return Housing(replace(camera, lens=self.lens, lateral=self.lateral), self.port, water)


def record_of(housing: Housing) -> dict[str, Any]:
    """Return all numbers of a housing, as JSON holds them; lengths in m, angles in degrees."""
    camera = housing.camera
    port = {name: value for name, value in vars(housing.port).items() if name != "glass"}
    return {
        "port": type(housing.port).__name__,
        **port,
        "glass": housing.port.glass.name,
        "water": asdict(housing.water),
        "lens": {"model": type(camera.lens).__name__, **camera.lens.numbers},
        "lateral_colour": asdict(camera.lateral),
        "camera_in_air": {
            name: getattr(camera, name) for name in ("width", "height", "fx", "fy", "cx", "cy")
        },
    }


def parse_lens(text: str) -> Lens:
    """Read a lens, as :class:`HousingDescription` has it.

    Raises
    ------
    InputError
        If it is none.

    Examples
    --------
    >>> parse_lens("fisheye:0.01")
    KannalaBrandt(k1=0.01, k2=0.0, k3=0.0, k4=0.0)
    """
    if not text:
        return BrownConrady()
    model, _, numbers = text.partition(":")
    try:
        return _lens(model, [float(part) for part in numbers.split(",")] if numbers else [])
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"--lens: {printable(text)!r} is neither {_BROWN}:k1,k2,p1,p2,k3 nor "
            f"{_FISHEYE}:k1,k2,k3,k4"
        ) from error


def _lens(model: str, coefficients: Sequence[float]) -> Lens:
    if model not in _COEFFICIENTS:
        raise InputError(f"lens {printable(model)!r} is not one of {', '.join(_COEFFICIENTS)}")
    if len(coefficients) > _COEFFICIENTS[model]:
        raise InputError(
            f"lens: {model} has {_COEFFICIENTS[model]} coefficients at most, got "
            f"{len(coefficients)}"
        )
    return BrownConrady(*coefficients) if model == _BROWN else KannalaBrandt(*coefficients)


def read_housing(path: Path) -> MeasuredHousing:
    """Read a measured housing (:data:`CONTENT`).

    Raises
    ------
    InputError
        If the file is missing, or something in it cannot be used.
    """
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"housing: cannot read {path}: {error.strerror}") from error
    except ValueError as error:
        raise InputError(f"housing: {path} is no JSON: {error}") from error
    where = f"housing {path}"
    known = _Table(where, table)
    parts = ("port", "lens", "lateral_colour", "camera")
    known.only(*parts, "source")
    if not any(name in known for name in parts):
        raise InputError(f"{where}: it describes nothing; give {CONTENT}")
    return MeasuredHousing(
        _read_port(known.table("port")) if "port" in known else NoPort(),
        _read_lens(known.table("lens")) if "lens" in known else BrownConrady(),
        _read_lateral(known.table("lateral_colour")) if "lateral_colour" in known
        else LateralColour(),
        _read_camera(known.table("camera")) if "camera" in known else None,
        known.text("source", ""),
    )  # fmt: skip


class _Table:
    """An object of JSON, whose errors name what and where."""

    def __init__(self, where: str, found: object) -> None:
        if not isinstance(found, Mapping):
            raise InputError(f"{where}: expected an object with {CONTENT}")
        self._where, self._found = where, found

    def __contains__(self, name: str) -> bool:
        return name in self._found

    def only(self, *names: str) -> None:
        """Refuse what is not known, which would be ignored."""
        for name in self._found:
            if name not in names:
                raise InputError(
                    f"{self._where}: unknown entry {printable(str(name))!r}; there are "
                    f"{', '.join(names)}"
                )

    def table(self, name: str) -> _Table:
        return _Table(f"{self._where}, {name}", self._found[name])

    def text(self, name: str, default: str | None = None) -> str:
        found = self._found.get(name, default)
        if not isinstance(found, str):
            raise InputError(f"{self._where}: {name} must be text")
        return found

    def number(self, name: str, default: float | None = None) -> float:
        found = self._found.get(name, default)
        if isinstance(found, bool) or not isinstance(found, int | float):
            raise InputError(f"{self._where}: {name} must be a number")
        return float(found)

    def numbers(self, name: str, count: int | None, default: Sequence[float]) -> tuple[float, ...]:
        found = self._found.get(name, default)
        if not isinstance(found, Sequence) or isinstance(found, str):
            raise InputError(f"{self._where}: {name} must be a list of numbers")
        if any(isinstance(x, bool) or not isinstance(x, int | float) for x in found):
            raise InputError(f"{self._where}: {name} must be a list of numbers")
        if count is not None and len(found) != count:
            raise InputError(f"{self._where}: {name} must be {count} numbers, got {len(found)}")
        return tuple(float(x) for x in found)


def _read_port(table: _Table) -> Port:
    kind, glass = table.text("kind"), find_glass(table.text("glass", "BK7"))
    if kind == FLAT:
        table.only("kind", "glass", "distance_mm", "thickness_mm", "normal")
        x, y, z = table.numbers("normal", 3, (0.0, 0.0, 1.0))
        distance, thickness = table.number("distance_mm"), table.number("thickness_mm")
        return FlatPort(distance * _MM, thickness * _MM, glass, (x, y, z))
    if kind == DOME:
        table.only("kind", "glass", "radius_mm", "thickness_mm", "pupil_mm", "half_angle_deg")
        x, y, z = (_MM * value for value in table.numbers("pupil_mm", 3, (0.0, 0.0, 0.0)))
        radius, thickness = table.number("radius_mm"), table.number("thickness_mm")
        reach = table.number("half_angle_deg", 90.0)
        return DomePort(radius * _MM, thickness * _MM, glass, (x, y, z), reach)
    raise InputError(f"housing: a port's kind is {FLAT} or {DOME}, not {printable(kind)!r}")


def _read_lens(table: _Table) -> Lens:
    table.only("model", "coefficients")
    return _lens(table.text("model"), table.numbers("coefficients", None, ()))


def _read_lateral(table: _Table) -> LateralColour:
    table.only("magnification", "cubic", "reference_nm")
    return LateralColour(
        table.numbers("magnification", None, ()),
        table.numbers("cubic", None, ()),
        table.number("reference_nm", 550.0),
    )


def _read_camera(table: _Table) -> LensCamera:
    names = ("width", "height", "fx", "fy", "cx", "cy")
    table.only(*names)
    width, height, fx, fy, cx, cy = map(table.number, names)
    return LensCamera(round(width), round(height), fx, fy, cx, cy)
