"""The image-formation truth of a picture: one JSON file with what its colours are made of.

Lengths are m, coefficients 1/m, wavelengths nm, angles degrees. The names of the coefficients are
those of Akkaynak & Treibitz (2018, 2019).
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..uw_spectral.errors import InputError
from ..uw_spectral.imaging.image_formation import (
    RANGES,
    FormationCurves,
    compute_image_formation,
    ranges_in_water,
)
from ..uw_spectral.imaging.range_attenuation import FEWEST
from ..uw_spectral.imaging.resolved_optics import ResolvedOptics
from ..uw_spectral.imaging.viewpoint import Viewpoint
from ..uw_spectral.imaging.visibility import diffuse_attenuation
from ..uw_spectral.lamps.lamp import Lamp
from ..uw_spectral.transfer.radiance_field import distance_in_water
from .axes import Array, inverse, world_to_opencv
from .camera import PinholeCamera
from .files import write_json
from .view import DataSetView

KIND = "underwater-spectral image formation"
FORMAT = 1
MODEL = "I = J exp(-beta_D(z) z) + B_inf (1 - exp(-beta_B(z) z)), z: Euclidean range, m"
LEVEL, OPTICAL_AXIS = "level", "optical_axis"
_DIGITS = 9  # more than a float of 32 bits holds, half of one of 64
_LEVEL_WITHIN = 1e-6  # of the vertical component of the view direction


def image_truth(
    optics: ResolvedOptics,
    view: DataSetView,
    lamps: Sequence[Lamp | Mapping[str, Any]] = (),
    stops: float | None = None,
) -> dict[str, Any]:
    """Return the truth of a picture as JSON holds it.

    Of the view its camera counts; the world's z = 0 is the surface. ``lamps`` are in the bands of
    the optics, or what :func:`lamp_record` returned: they are listed, and light nothing here.
    ``stops`` is the exposure, if it is not what the optics chooses. Where surface or floor is so
    near along the optical axis that few ranges are left, that direction is left out. Raises
    InputError if the camera is not in the water, or sees no light.
    """
    depth = -float(view.camera_to_world[2, 3])
    place = optics.viewpoint(depth, stops)
    axis = -view.camera_to_world[:3, 2]
    directions = {LEVEL: _level(axis, place)}
    there = ranges_in_water(optics, depth, axis.tolist(), RANGES)
    if abs(axis[2]) > _LEVEL_WITHIN and len(there) >= FEWEST:
        directions[OPTICAL_AXIS] = tuple(axis.tolist())
    formations = {}
    for name, w in directions.items():
        found = compute_image_formation(optics, depth, w, RANGES)
        formations[name] = {
            "direction": found.direction,
            "channels": {"names": ["R", "G", "B"], **_curves(found.channels)},
            "bands": _curves(found.bands),
        }
    description, column, layer = optics.description, optics.column, place.layer
    light, surface = description.light, description.surface
    return {
        "kind": KIND,
        "format": FORMAT,
        "view": view.name,
        "model": MODEL,
        "conventions": {
            "beta_D": "of a grey Lambertian surface lit by Ed of its depth, effective from 0 to z",
            "B_inf": "response of the sensor to radiance, before white balance and exposure",
            "camera_to_world": "Blender axes: looks along -z, y up; world z up, surface at z = 0",
            "K": "image coordinates from the upper left corner of the picture, pixels",
        },
        "camera_depth_m": depth,
        "water": {
            "layers": [
                {"top_m": top, "name": water.name, "source": water.source}
                for top, water in zip(optics.waters.tops, optics.waters.layers, strict=True)
            ],
            "inelastic": description.water.inelastic,
        },
        "bands": {
            "centres_nm": optics.bands.centres.tolist(),
            "widths_nm": optics.bands.widths.tolist(),
            "a": layer.absorption.tolist(),
            "b": layer.scattering.tolist(),
            "c": place.attenuation.tolist(),
            "bb": (layer.scattering * layer.phase.backscatter_ratio).tolist(),
            "Kd": _finite(diffuse_attenuation(place)),
            "Ed": place.light.tolist(),
        },
        "sun": {
            "zenith_deg": light.zenith,
            "azimuth_deg": light.azimuth,
            "zenith_in_water_deg": float(np.degrees(np.arccos(column.sun_cosine))),
            "illuminant": optics.illuminant.name,
            "sky": light.sky,
        },
        "surface": {
            "kind": surface.kind,
            "refractive_index": surface.refractive_index,
            "slope_variance": column.roughness,
        },
        "floor": {
            "depth_m": column.floor_depth if np.isfinite(column.floor_depth) else None,
            "reflectance": column.floor_reflectance.tolist(),
        },
        "sensor": _sensor(place),
        "camera": {**_intrinsics(view.camera), "camera_to_world": view.camera_to_world.tolist()},
        "lamps": [lamp_record(x) if isinstance(x, Lamp) else dict(x) for x in lamps],
        "formation": formations,
    }


def write_truth(path: Path, truth: Mapping[str, Any]) -> None:
    """Write what :func:`image_truth` returned, numbers to nine digits."""
    write_json(path, _to_digits(dict(truth)))


def _to_digits(content: Any) -> Any:  # noqa: ANN401 - what JSON holds
    if isinstance(content, dict):
        return {name: _to_digits(value) for name, value in content.items()}
    if isinstance(content, list | tuple):
        return [_to_digits(value) for value in content]
    return float(f"{content:.{_DIGITS}g}") if isinstance(content, float) else content


def read_formation(path: Path, direction: str = LEVEL) -> FormationCurves:
    """Read the coefficients of the sensor's channels in a direction, of :func:`write_truth`.

    Raises InputError if the file is none, or lacks that direction.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(
            f"cannot read {path}: {error}; give a file of image-formation truth"
        ) from (error)
    if not isinstance(content, dict) or content.get("kind") != KIND:
        raise InputError(f"{path} holds no image-formation truth")
    if content.get("format") != FORMAT:
        raise InputError(f"{path} has format {content.get('format')!r}; this reads {FORMAT}")
    known = content["formation"]
    if direction not in known:
        raise InputError(f"{path} has no direction {direction!r}, but {', '.join(known)}")
    found = known[direction]["channels"]
    names = ("z", "beta_D", "beta_B", "B_inf")
    return FormationCurves(*(np.array(found[name], dtype=np.float64) for name in names))


def _level(axis: np.ndarray, place: Viewpoint) -> tuple[float, float, float]:
    """Level direction that the camera looks to; that of the viewpoint if it looks up or down."""
    x, y = axis[:2].tolist()
    length = float(np.hypot(x, y))
    return (x / length, y / length, 0.0) if length > _LEVEL_WITHIN else place.level


def _curves(curves: FormationCurves) -> dict[str, Any]:
    fit = curves.fitted()
    constants = {
        name: [{"a": k.a, "b": k.b, "c": k.c, "d": k.d} for k in channels]
        for name, channels in (("beta_D", fit.beta_direct), ("beta_B", fit.beta_backscatter))
    }
    return {
        "z": curves.z.tolist(),
        "beta_D": curves.beta_direct.tolist(),
        "beta_B": curves.beta_backscatter.tolist(),
        "B_inf": curves.B_inf.tolist(),
        "fitted": {"form": "beta(z) = a exp(b z) + c exp(d z)", **constants},
    }


def _sensor(place: Viewpoint) -> dict[str, Any]:
    sensor, develop = place.sensor, place.reduction
    return {
        "name": sensor.name,
        "source": sensor.source,
        "licence": sensor.licence,
        "response": develop.response.tolist(),
        "white_balance": place.white_balance,
        "white_balance_gains": (develop.white[1] / develop.white).tolist(),
        "exposure_stops": place.stops,
        "to_linear_rec709": develop.matrix.tolist(),
    }


def _intrinsics(camera: PinholeCamera) -> dict[str, Any]:
    return {
        "width": camera.width,
        "height": camera.height,
        "K": camera.K.tolist(),
        "distortion": {
            "model": "Brown-Conrady k1, k2, p1, p2, k3",
            "coefficients": camera.distortion,
        },
    }


def lamp_record(lamp: Lamp) -> dict[str, Any]:
    """Return a lamp as JSON holds it."""
    return {
        "position": np.asarray(lamp.position, dtype=np.float64).tolist(),
        "axis": np.asarray(lamp.axis, dtype=np.float64).tolist(),
        "radiant_intensity": np.asarray(lamp.intensity, dtype=np.float64).tolist(),
        "profile": type(lamp.profile).__name__,
    }


def _finite(values: np.ndarray) -> list[float | None]:
    return [float(x) if np.isfinite(x) else None for x in values]


def extinction_to(
    optics: ResolvedOptics, camera: PinholeCamera, camera_to_world: ArrayLike, distances: ArrayLike
) -> tuple[Array, Array]:
    """Return mean extinction c before what is seen, 1/m, and the length of the water there, m.

    Their shapes are (height, width, n) and (height, width). ``camera_to_world``, shape (4, 4), is
    the pose in Blender's axes; ``distances``, shape (height, width), are Euclidean ranges, m; where
    they are infinite, the way ends at surface or floor.
    """
    pose = inverse(world_to_opencv(camera_to_world))
    down = -(camera.rays() @ pose[2, :3])
    depth = -float(pose[2, 3])
    z = np.asarray(distances, np.float64)
    far = ~np.isfinite(z)
    way = np.where(far, distance_in_water(depth, down, optics.column.floor_depth), z)
    ends = np.maximum(depth + down * way, 0.0)
    return optics.solved_field().extinction_between(depth, ends, scaled=False), way


def transmittance(
    optics: ResolvedOptics, camera: PinholeCamera, camera_to_world: ArrayLike, distances: ArrayLike
) -> Array:
    """Return the fraction exp(-c z) of light that arrives unscattered, shape (height, width, n).

    Arguments as of :func:`extinction_to`.
    """
    c, way = extinction_to(optics, camera, camera_to_world, distances)
    return np.exp(-c * way[..., None])
