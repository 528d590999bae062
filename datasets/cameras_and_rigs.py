"""Cameras of a data set and lamps that move with them, as a specification gives them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..uw_spectral.errors import InputError
from ..uw_spectral.housing import find_glass
from ..uw_spectral.housing.description import NONE
from ..uw_spectral.lamps import IsotropicProfile, Lamp, SpotProfile, radiant_intensity
from ..uw_spectral.lamps.emission import CANDELAS, LUMENS, SPHERE, UNITS, WATTS, parse_emission
from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.spectra.colour_rendering import WHITE_BALANCES
from ..uw_spectral.spectra.illuminant import RELATIVE, full_sun
from ..uw_spectral.spectra.sensor import parse_sensor
from .axes import Array
from .camera import PinholeCamera
from .tables import SpecTable, in_folder

LAMP_RADIUS = 0.03
"""Of a lamp of a rig, m."""
LAMP_BLEND = 0.35
"""Of a spot's cone."""
_PORT_NUMBERS = (
    *("port_distance", "port_thickness", "port_tilt", "port_tilt_towards"),
    *("dome_radius", "dome_forward", "salinity", "temperature"),
)


@dataclass(frozen=True)
class DataSetCamera:
    """A camera of a data set.

    ``offset`` is its place beside the pose, in the pose's axes (Blender's: right, up, back), m.
    ``port`` is what it looks through, as pairs of a setting and its value; ``optics`` are those in
    air, their distortion included.
    """

    name: str
    optics: PinholeCamera
    sensor: str
    white_balance: str
    exposure: str
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    port: tuple[tuple[str, str | float], ...] = ()

    @property
    def coefficients(self) -> int:
        """Coefficients of its distortion up to the last one that is not 0; 5 with a port."""
        if self.port and self.port[0] != ("housing", NONE):
            return 5
        return max((n for n, k in enumerate(self.optics.distortion, 1) if k), default=0)

    @property
    def settings(self) -> dict[str, str | float]:
        """The settings of a render that its port and lens are."""
        k = self.optics.distortion
        lens = {"lens": f"brown:{','.join(map(repr, k))}"} if any(k) else {}
        return {**dict(self.port), **lens}


@dataclass(frozen=True)
class RigLamp:
    """A lamp that moves with the camera; position (m) and axis in its axes, Blender's.

    ``size`` is the full angle of its cone in degrees, 0 for light to all sides.
    """

    power: float
    unit: str
    emission: str
    position: tuple[float, float, float]
    axis: tuple[float, float, float]
    size: float


@dataclass(frozen=True)
class CameraRig:
    """Lamps that are on together."""

    name: str
    lamps: tuple[RigLamp, ...]


def read_camera(table: SpecTable, folder: Path) -> DataSetCamera:
    """Read one of the tables ``[[camera]]``; files that it names are sought from a folder."""
    name = table.text("name")
    width, height = table.whole("width", least=1), table.whole("height", least=1)
    distortion = table.numbers("distortion", 5, (0.0,) * 5)
    if "field_of_view" in table:
        optics = PinholeCamera.from_field_of_view(width, height, table.number("field_of_view"))
        fx, fy, cx, cy = optics.fx, optics.fy, optics.cx, optics.cy
    else:
        if "focal" not in table:
            raise InputError(f"{table.where}: give field_of_view in degrees, or focal in pixels")
        fx, fy = table.numbers("focal", 2)
        cx, cy = table.numbers("centre", 2, (width / 2, height / 2))
    sensor = in_folder(table.text("sensor", "cie1931"), folder)
    parse_sensor(sensor)
    balance = table.choice("white_balance", WHITE_BALANCES, "daylight")
    automatic = table.get("exposure", "auto") == "auto"
    exposure = "auto" if automatic else repr(table.number("exposure"))
    x, y, z = table.numbers("offset", 3, (0.0, 0.0, 0.0))
    port = _port(table, folder)
    table.close()
    k1, k2, p1, p2, k3 = distortion
    optics = PinholeCamera(width, height, fx, fy, cx, cy, (k1, k2, p1, p2, k3))
    return DataSetCamera(name, optics, sensor, balance, exposure, (x, y, z), port)


def _port(table: SpecTable, folder: Path) -> tuple[tuple[str, str | float], ...]:
    """Read the port of a camera; what is left out is as the settings have it."""
    found: list[tuple[str, str | float]] = []
    if "port" in table:
        found.append(("housing", in_folder(table.text("port"), folder)))
    if "port_glass" in table:
        found.append(("port_glass", find_glass(table.text("port_glass")).name))
    found += [(name, table.number(name)) for name in _PORT_NUMBERS if name in table]
    if found and found[0][0] != "housing":
        raise InputError(f"{table.where}: {found[0][0]} needs port = 'flat' or 'dome'")
    return tuple(found)


def read_rig(table: SpecTable, folder: Path) -> CameraRig:
    """Read one of the tables ``[[rig]]``; files that it names are sought from a folder."""
    name, lamps = table.text("name"), []
    for lamp in table.tables("lamps"):
        emission = in_folder(lamp.text("emission", "led"), folder)
        parse_emission(emission)
        unit = lamp.choice("unit", UNITS, LUMENS)
        power, size = lamp.number("power"), lamp.number("size", 0.0)
        if power <= 0 or not 0 <= size <= 180:
            raise InputError(f"{lamp.where}: power is above 0, and size 0 to 180°")
        px, py, pz = lamp.numbers("position", 3, (0.0, 0.0, 0.0))
        ax, ay, az = lamp.numbers("axis", 3, (0.0, 0.0, -1.0))
        if not (ax or ay or az):
            raise InputError(f"{lamp.place('axis')}: (0, 0, 0) is no direction")
        lamps.append(RigLamp(power, unit, emission, (px, py, pz), (ax, ay, az), size))
        lamp.close()
    table.close()
    return CameraRig(name, tuple(lamps))


def rig_lamps(rig: CameraRig, camera_to_world: Array, bands: Bands, unit: str) -> tuple[Lamp, ...]:
    """Return the lamps of a rig at a camera in Blender's axes, (4, 4), in the world.

    ``unit`` is that of the irradiance that the scene is lit with (:attr:`.Illuminant.unit`).
    """
    turn, place = camera_to_world[:3, :3], camera_to_world[:3, 3]
    found = []
    for lamp in rig.lamps:
        size = math.radians(lamp.size)
        profile = SpotProfile(size, LAMP_BLEND) if size else IsotropicProfile()
        spread = {WATTS: SPHERE, CANDELAS: 1.0}.get(lamp.unit, float(profile.solid_angle))
        shape = parse_emission(lamp.emission)
        intensity = radiant_intensity(shape, lamp.power, bands, lamp.unit, spread)
        intensity = intensity / full_sun() if unit == RELATIVE else intensity
        axis = turn @ (np.array(lamp.axis) / np.linalg.norm(lamp.axis))
        position = tuple((place + turn @ lamp.position).tolist())
        found.append(Lamp(position, tuple(axis.tolist()), intensity, profile, LAMP_RADIUS))
    return tuple(found)
