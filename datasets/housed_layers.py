"""Pictures, layers and truth as they are seen through a port, of those of a pinhole in the water.

The camera that is written with them is the pinhole in the water that they resemble most, with
distortion: what a calibration under water finds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..uw_spectral.housing import (
    Housing,
    PinholeView,
    SeenPlaces,
    intrinsics_in_water,
    record_of,
    seen_places,
    warped_flow,
    water_begins,
)
from .axes import Array, inverse, world_to_opencv
from .depth_maps import PLANAR, RANGE
from .layer_file import SENSOR, FrameLayers, LayerImage, is_of_bands

_NUMBERS = ("instance", "material", "Crypto", "normal")
TYPICAL_WAVELENGTH = 550.0
"""Of maps, which are the same for all light, nm."""


@dataclass(frozen=True, eq=False)
class PortView:
    """What a port makes of a frame, by the pinhole ``view`` that rendered it.

    ``depth`` is the planar depth of its picture, m, shape (rows, columns); infinite in open water.
    """

    housing: Housing
    view: PinholeView
    depth: Array
    _known: dict[float, tuple[SeenPlaces, Array]] = field(default_factory=dict)

    def places(self, wavelength: float) -> SeenPlaces:
        """Return what each pixel sees at a wavelength in nm."""
        return self._at(wavelength)[0]

    def picture(self, image: ArrayLike, wavelengths: Sequence[float]) -> NDArray[np.float32]:
        """Return an image as it is seen, shape (h, w, n): black where the port shows nothing.

        What the faces of the port reflect is lost.
        """
        values, found = np.asarray(image), []
        for channel, nm in enumerate(wavelengths):
            places, passed = self._at(nm)
            found.append(places.sampled(values[..., channel]) * passed)
        return np.nan_to_num(np.stack(found, axis=-1)).astype(np.float32)

    def _at(self, wavelength: float) -> tuple[SeenPlaces, Array]:
        """What each pixel sees, and the fraction of it that the port lets through."""
        if wavelength not in self._known:
            passed = self.housing.transmittance(self.housing.camera.pixel_centres(), wavelength)
            places = seen_places(self.housing, self.view, self.depth, wavelength)
            self._known[wavelength] = places, passed
        return self._known[wavelength]


def seen_layers(
    found: FrameLayers,
    port: PortView,
    wavelengths: Mapping[str, float],
    sensor: Sequence[float],
    camera_to_world: ArrayLike,
    camera: str,
) -> FrameLayers:
    """Return the layers of a pinhole's picture as they are seen through the port.

    ``wavelengths`` are of bands, by the names of their channels, and ``sensor`` of the three
    channels of the sensor, nm; ``camera_to_world``, shape (4, 4), is the pose in Blender's axes of
    the pinhole that rendered; ``camera`` names the one behind the port.
    """
    layers = {}
    for name, image in found.layers.items():
        if is_of_bands(name):
            values = port.picture(image.values, [wavelengths[c] for c in image.channels])
        elif image.channels == SENSOR:
            values = port.picture(image.values, sensor)
        else:
            values = _map(name, image, port, camera_to_world)
        layers[name] = replace(image, values=values)
    header = dict(found.header)
    if "camera" in header:
        header |= _camera_header(camera, port, camera_to_world, wavelengths)
    return replace(found, layers=layers, header=header)


def _camera_header(
    name: str, port: PortView, camera_to_world: ArrayLike, wavelengths: Mapping[str, float]
) -> dict[str, Any]:
    """Return what the layers say of the camera: as calibrated in water, and all of its housing."""
    housing, shown = port.housing, port.places(TYPICAL_WAVELENGTH)
    return {
        "camera": {
            "name": name,
            **_calibrated(housing, TYPICAL_WAVELENGTH),
            "camera_to_world": np.asarray(camera_to_world).tolist(),
        },
        "housing": {
            **record_of(housing),
            "cameras_in_water": {
                f"{nm:g} nm": _calibrated(housing, nm) for nm in wavelengths.values()
            },
            "pinhole_in_water_m": list(port.view.position),
            "water_begins_m": water_begins(housing, port.view),
            "hidden_from_pinhole": float(shown.hidden.mean()),
        },
    }


def _calibrated(housing: Housing, wavelength: float) -> dict[str, Any]:
    """Return the pinhole that a calibration in water finds, and its error in pixels."""
    fitted, error = intrinsics_in_water(housing, wavelength, distorted=True)
    camera = fitted.camera
    return {
        "width": camera.width,
        "height": camera.height,
        "K": [[camera.fx, 0.0, camera.cx], [0.0, camera.fy, camera.cy], [0.0, 0.0, 1.0]],
        "distortion": list(camera.lens.numbers.values()),
        "error_pixels": error,
    }


def _map(name: str, image: LayerImage, port: PortView, camera_to_world: ArrayLike) -> NDArray[Any]:
    shown = port.places(TYPICAL_WAVELENGTH)
    offsets = shown.points - np.array(port.view.position)
    if name == RANGE:
        return _far(np.linalg.norm(offsets, axis=-1))[..., None]
    if name == PLANAR:
        return _far(offsets[..., 2])[..., None]
    if name == "position":
        pose = inverse(world_to_opencv(camera_to_world))
        near = np.isfinite(offsets).all(axis=-1, keepdims=True)
        return np.where(near, np.where(near, offsets, 0.0) @ pose[:3, :3].T + pose[:3, 3], 0.0)
    if name == "motion":
        return _motion(image.values, port, shown)
    nearest = name.startswith(_NUMBERS)
    return np.nan_to_num(shown.sampled(image.values, "nearest" if nearest else "linear"))


def _motion(values: NDArray[Any], port: PortView, shown: SeenPlaces) -> Array:
    """Both shifts, whose y goes up; the way to the camera is taken to stay as it is."""
    parts = []
    for first in (0, 2):
        flow = values[..., first : first + 2] * (1.0, -1.0)
        moved = warped_flow(shown, flow, port.depth, port.housing, port.view, TYPICAL_WAVELENGTH)
        parts.append(np.nan_to_num(moved) * (1.0, -1.0))
    return np.concatenate(parts, axis=-1)


def _far(values: Array) -> Array:
    """Distances; what is not seen at all is as far as open water."""
    return np.where(np.isnan(values), np.inf, values)
