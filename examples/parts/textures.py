"""Image textures drawn with numpy, tiling without a seam, packed into the file."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import ArrayLike, NDArray

from .noise import generator

Array = NDArray[np.float64]


def _periodic_noise(size: int, wavelength: float, rng: np.random.Generator) -> Array:
    """Tiling noise of one scale in pixels, zero mean, unit variance."""
    frequency = np.hypot(np.fft.fftfreq(size)[:, None], np.fft.rfftfreq(size))
    spectrum = np.fft.rfft2(rng.normal(size=(size, size)))
    noise = np.fft.irfft2(spectrum * np.exp(-((frequency * wavelength) ** 2) * 4), (size, size))
    return (noise - noise.mean()) / noise.std()


def _cells(size: int, count: int, rng: np.random.Generator) -> tuple[Array, NDArray[np.int64]]:
    """Distance to the nearest of count² jittered points in cell sizes, and its index."""
    jitter = rng.uniform(0.15, 0.85, (count, count, 2))
    row, column = np.meshgrid(*[(np.arange(size) + 0.5) * count / size] * 2, indexing="ij")
    nearest = np.full((size, size), np.inf)
    owner = np.zeros((size, size), np.int64)
    for di in (-1, 0, 1):
        for dj in (-1, 0, 1):
            i, j = row.astype(int) + di, column.astype(int) + dj
            point = jitter[i % count, j % count]
            distance = np.hypot(i + point[..., 0] - row, j + point[..., 1] - column)
            closer = distance < nearest
            nearest = np.where(closer, distance, nearest)
            owner = np.where(closer, (i % count) * count + j % count, owner)
    return nearest, owner


def _image(name: str, linear: Array) -> bpy.types.Image:
    """Pack linear Rec.709 of shape (size, size, 3) as an sRGB image."""
    linear = np.clip(linear, 0, 1)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    pixels = np.concatenate([encoded, np.ones((*encoded.shape[:2], 1))], axis=2)
    image = bpy.data.images.new(name, *encoded.shape[1::-1])
    image.pixels.foreach_set(pixels.astype(np.float32).ravel())
    image.pack()
    return image


def _between(low: ArrayLike, high: ArrayLike, factor: Array) -> Array:
    return np.asarray(low) + (np.asarray(high) - np.asarray(low)) * factor[..., None]


def sand_grain(seed: int, size: int) -> bpy.types.Image:
    """Carbonate sand: pale grains of many tints, a few dark ones, faint stains."""
    rng = generator(seed, "sand grain")
    distance, owner = _cells(size, size // 5, rng)
    tint = rng.uniform(0, 1, (size // 5) ** 2)[owner]
    dark = rng.uniform(0, 1, (size // 5) ** 2)[owner] > 0.965
    color = _between((0.40, 0.33, 0.23), (0.66, 0.60, 0.47), tint)
    color *= (1.08 - 0.35 * np.clip(distance, 0, 1))[..., None]
    color[dark] *= 0.4
    stains = 1 + 0.05 * _periodic_noise(size, size / 6, rng)
    return _image("Sand grain", color * stains[..., None])


def coral_polyps(seed: int, size: int) -> bpy.types.Image:
    """Polyps of a massive coral: dark calices in a pale skeleton."""
    rng = generator(seed, "coral polyps")
    distance, _ = _cells(size, 22, rng)
    calix = np.clip((0.42 - distance) / 0.22, 0, 1)
    ring = np.exp(-(((distance - 0.45) / 0.1) ** 2))
    color = _between((0.38, 0.28, 0.12), (0.14, 0.11, 0.05), calix)
    color = color + ring[..., None] * np.array([0.12, 0.11, 0.05])
    patches = 1 + 0.10 * _periodic_noise(size, size / 5, rng)
    return _image("Coral polyps", color * patches[..., None])
