"""Water put before pictures that exist: the pixel that EEVEE draws, of colours at distances.

A picture is taken for surfaces under a white light: its linear Rec.709 is their reflectance, with
the shading that it shows. In the water they are lit by the downwelling irradiance Ed of their
depth, as those of :func:`.compute_image_formation` are, and by lamps that they face.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..lamps.irradiance_decay import IrradianceDecay
from ..lamps.lamp import Lamp
from ..lamps.lamp_channels import LampChannels
from ..lamps.lamp_projection import project_lamps
from ..lamps.lamp_surface import lamplight
from ..lamps.multiple_scattering import lamp_water
from ..occlusion.point_spread import spread
from ..transfer.channel_pixel import ChannelWater, along_rays
from ..transfer.channel_tables import ChannelTables
from ..transfer.channels import channels_of
from ..transfer.pixel_parts import (
    COLOURS,
    Around,
    ChannelPixel,
    SeenObject,
    SurfaceAbove,
    SurfaceMaterial,
)
from ..transfer.projection import project
from ..transfer.radiance_table import TABLE_STREAMS
from .resolved_optics import ResolvedOptics
from .viewpoint import Viewpoint

Array = NDArray[np.float64]
UP = (0.0, 0.0, 1.0)
_BESIDE = 0.25  # of a picture: how far its edges go on for what is scattered forward


@dataclass(frozen=True, eq=False)
class AppliedWater:
    """Water about a camera, in the channels of its sensor; make it with :func:`applied_water`.

    Directions are unit vectors away from the camera, z up, shape (..., 3), distances m, (...).
    """

    view: Viewpoint
    light: ChannelTables
    sun: Sequence[float]  #: Unit direction that sunlight travels to in the water.
    lamps: LampChannels | None = None

    @property
    def to_rec709(self) -> Array:
        """From the sensor's channels to the developed picture, linear Rec.709, (3, 3)."""
        return self.view.reduction.matrix

    def unlit(self, w: Array, P: Array) -> ChannelPixel:
        """Pixel of a black surface: what sun and sky bring to the camera besides its own light."""
        ray, parts, y, P = self._placed(w, P)
        return ray.surface(np.asarray(self.view.depth), y, parts, P, SeenObject(0.0))

    def colours(self, w: Array, P: Array) -> tuple[Array, Array]:
        """Channels c of a red, a green and a blue surface k in sun and sky, (..., c, k) each.

        As they are there, and what of it arrives unscattered.
        """
        ray, _, y, P = self._placed(w, P)
        here = self._leaving(ray, y, 0.0 * P)
        left = ray.transmittance(y, P)[..., None]
        return here, left * self._leaving(ray, y, P)

    def lamp_light(self, w: Array, P: Array) -> tuple[Array, Array, Array, Array]:
        """The same of lamps: light on the way (..., c), and surfaces (..., c, k).

        These are as they are there, and what of it arrives unscattered and scattered forward.
        """
        assert self.lamps is not None, "there are lamps"
        point, parts = self._points(w, P)
        facing, each = [-x for x in parts], (-1, *(1,) * np.ndim(point[0]))
        colour = [column.reshape(each) for column in np.eye(len(COLOURS))]
        seen_from = np.stack([0.0 * P, P])[:, None, ..., None]
        (J, D), (_, F) = self.lamps.reflected(point, facing, colour, seen_from)
        path = self.lamps.path_light(
            (0.0, 0.0, -self.view.depth), parts, P[..., None], before_surface=True
        )
        return path, *(np.moveaxis(x, 0, -1) for x in (J, D, F))

    def lamp_decay(self, w: Array, P: Array) -> Array:
        """What light of lamps on surfaces is about proportional to, (...).

        It has the edges of their beams, and falls off as they do: the rest varies little.
        """
        point, parts = self._points(w, P)
        return self._decay.at(point, parts)

    @functools.cached_property
    def _decay(self) -> IrradianceDecay:
        assert self.lamps is not None, "there are lamps"
        return IrradianceDecay.of(self.lamps)

    def _points(self, w: Array, P: Array) -> tuple[list[Array], list[Array]]:
        """Places at distances, and the directions to them, by coordinate, (..., 1)."""
        parts = list(np.moveaxis(w, -1, 0)[..., None])
        origin = (0.0, 0.0, -self.view.depth)
        return [a + b * P[..., None] for a, b in zip(origin, parts, strict=True)], parts

    def open_water(self, w: Array) -> Array:
        """Channels of rays that meet nothing but the surface or the floor, (..., 3)."""
        column = self.view.column
        above = SurfaceAbove(
            replace(column.skylight, level=1.0),
            column.refractive_index if column.reflects else None,
        )
        parts = list(np.moveaxis(w, -1, 0)[..., None])
        ray = along_rays(self.light, self.sun, parts)
        seen = np.asarray(ray.open_water(np.asarray(self.view.depth), parts, above).total)
        if self.lamps is not None:
            seen = seen + self.lamps.path_light((0.0, 0.0, -self.view.depth), parts, 1e6)
        return seen

    def scattered_forward(self, J: Array, w: Array, P: Array, per_unit: float) -> Array:
        """What surfaces in view, spread by the point-spread function, bring besides, (h, w, 3).

        They stand in the way of light from behind them, and send their own: it is that less what
        :meth:`unlit` has of it. J, (h, w, 3), are their channels in sun and sky, there; P, (h, w),
        is infinite where there is none; ``per_unit`` are the pixels in a unit of 2 sin(φ/2), the
        focal length.
        """
        there = np.isfinite(P)
        near = np.where(there, P, 1.0)
        ray, parts, y, P = self._placed(w, near)
        margin = [(math.ceil(_BESIDE * side),) * 2 for side in there.shape]
        pictures = np.moveaxis(np.where(there[..., None], J, 0.0), -1, 0)
        pictures = np.pad(np.stack([1.0 * there, *pictures]), [(0, 0), *margin], mode="edge")
        inner = tuple(slice(low, -low) for low, _ in margin)
        blocked, sent = np.zeros((2, 3, *there.shape))
        for part, phase in zip(self.light.parts, self.light.components, strict=True):
            cover, *light = (x[inner] for x in spread(pictures, phase, per_unit))
            blocked += part[:, None, None] * cover
            sent += part[:, None, None] * np.stack(light)
        mean = np.moveaxis(sent / np.maximum(blocked, 1e-6), 0, -1)
        around = Around(np.moveaxis(np.clip(blocked, 0.0, 1.0), 0, -1), 0.0, mean)
        seen = SeenObject(0.0)
        eye = np.asarray(self.view.depth)
        changed = ray.surface(eye, y, parts, P, seen, around=around).total
        found = changed - ray.surface(eye, y, parts, P, seen).total
        return np.where(there[..., None], found, 0.0)

    def _placed(self, w: Array, P: Array) -> tuple[ChannelWater, list[Array], Array, Array]:
        parts, P = list(np.moveaxis(w, -1, 0)[..., None]), P[..., None]
        y = np.clip(self.view.depth - parts[2] * P, 0.0, self.view.column.floor_depth)
        return along_rays(self.light, self.sun, parts), parts, y, P

    def _leaving(self, ray: ChannelWater, y: Array, P: Array) -> Array:
        """Channels of red, green and blue surfaces in Ed, over what the water leaves of them."""
        facing = [np.asarray(self.light.numbers.mu_s / math.pi)]
        found = [ray.leaving(SurfaceMaterial((k,), facing, (1.0,)), y, UP, P) for k in COLOURS]
        return np.stack(found, axis=-1)


def applied_water(optics: ResolvedOptics, depth: float, lamps: Sequence[Lamp] = ()) -> AppliedWater:
    """Return the water about a camera at a depth, m.

    Lamps, in the bands of the optics, are in world coordinates, where the camera is at x = y = 0
    and the surface at z = 0. An automatic exposure counts them on surfaces 2 m before them.

    Raises
    ------
    InputError
        If the camera is not in the water, or its sensor has not three channels.
    """
    here = optics.column.layer_at(depth, optics.phase)
    water = functools.partial(lamp_water, here.absorption, here.scattering, here.phase)
    view = optics.viewpoint(depth)
    if lamps:
        view = optics.viewpoint(depth, lamplight=lamplight(lamps, water(), (0.0, 0.0, -depth)))
    channels = channels_of(optics.bands, view.reduction.response)
    field = optics.solved_field(TABLE_STREAMS)
    light = project(field, channels, depth, optics.column.skylight.level)
    lit = project_lamps(lamps, water(), channels) if lamps else None
    return AppliedWater(view, light, field.sun, lit)
