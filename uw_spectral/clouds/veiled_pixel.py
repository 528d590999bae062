"""A pixel behind clouds: what they leave of its light, and their own."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from ..mathematics import Operand
from ..transfer.channel_pixel import ChannelWater
from ..transfer.pixel_parts import ChannelPixel
from .cloud_numbers import Veil


def veiled(
    pixel: ChannelPixel,
    veil: Veil,
    ray: ChannelWater,
    y_o: Operand,
    w: Sequence[Operand],
    *,
    around: Operand | None = None,
    coverage: Operand = 1.0,
) -> ChannelPixel:
    """Return what a pixel is with clouds before it.

    Light of the water between the camera and the clouds is untouched; they let through a fraction
    of all that comes from behind. What they scatter within their forward peak of an object's light
    is lost in the light of its surroundings. Light of lamps in the water has been through them.

    ``around`` is the light from about the object, over the fraction of the pixel that it fills, its
    own without; ``coverage`` that fraction, with which its light is multiplied already.
    """
    T, passed = veil.unscattered, veil.passed
    before = water_before(ray, veil, y_o, w) * coverage
    around = pixel.direct if around is None else around
    return dataclasses.replace(
        pixel,
        path=before + (pixel.path - before) * passed + veil.light * coverage,
        direct=pixel.direct * T,
        forward_scattered=pixel.forward_scattered * passed + around * (passed - T),
        single_scattering=pixel.single_scattering * passed,
    )


def water_before(ray: ChannelWater, veil: Veil, y_o: Operand, w: Sequence[Operand]) -> Operand:
    """Light that the water between the camera and clouds sends, less what these block of it."""
    s, m = veil.middle, ray.m
    y = m.maximum(y_o - w[2] * s, 0.0)
    M, _ = ray.ahead(y, w)
    behind = _peaked(ray, y, s, M) * m.exp(veil.forward * s)
    single = ray.scaled_single_scattering(y_o, y, w, s) * ray.aureole(y_o, w) * veil.sunlit
    return m.maximum(single + (ray.scattered(y_o, w) - behind) * veil.daylit, 0.0)


def surroundings(
    ray: ChannelWater, y_o: Operand, y: Operand, w: Sequence[Operand], P: Operand
) -> Operand:
    """Light that comes from beyond a distance P, depth y, along a ray that meets no object."""
    M, rest = ray.ahead(y, w)
    return _peaked(ray, y, P, M + rest) + ray.boundary(y_o, w)


def _peaked(ray: ChannelWater, y: Operand, P: Operand, light: Operand) -> Operand:
    """What is left of light at depth y after P, the forward peak included."""
    return ray.peaked(light, y, P) * ray.transmittance_with_peak(y, P)
