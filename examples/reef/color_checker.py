"""The 24-patch ColorChecker with its measured reflectance spectra."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from ...uw_spectral.spectra._colour import colour_science
from ..parts.materials import Materials, Painter
from ..parts.shapes import Shape, box, joined, to_mesh

Array = NDArray[np.float64]

ROWS, COLUMNS = 4, 6
PATCH = 0.084
GAP = 0.012
MARGIN = 0.021
THICKNESS = 0.022
WIDTH = COLUMNS * PATCH + (COLUMNS - 1) * GAP + 2 * MARGIN
HEIGHT = ROWS * PATCH + (ROWS - 1) * GAP + 2 * MARGIN


def reflectances() -> tuple[Array, dict[str, Array]]:
    """Measured reflectance of the patches (BabelColor average of 30 charts, 380-730 nm).

    Returns wavelengths in nm, shape (36,), and reflectances of that shape by patch name, in the
    chart's order: row by row from the top left.
    """
    charts = colour_science().SDS_COLOURCHECKERS["BabelColor Average"]
    wavelengths = np.asarray(next(iter(charts.values())).wavelengths, float)
    return wavelengths, {name: np.asarray(sd.values, float) for name, sd in charts.items()}


def linear_rec709(wavelengths: Array, reflectance: Array) -> Array:
    """Linear Rec.709 under D65, CIE 1931 2° observer; what lies outside the gamut is cut at 0."""
    colour = colour_science()
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    d65 = colour.SDS_ILLUMINANTS["D65"]
    grid = np.arange(wavelengths[0], wavelengths[-1] + 1)
    cmfs = observer.copy().align(colour.SpectralShape(grid[0], grid[-1], 1)).values
    light = d65.copy().align(colour.SpectralShape(grid[0], grid[-1], 1)).values
    weights = cmfs * light[:, None]
    xyz = np.interp(grid, wavelengths, reflectance) @ weights / weights[:, 1].sum()
    return np.clip(colour.RGB_COLOURSPACES["ITU-R BT.709"].matrix_XYZ_to_RGB @ xyz, 0, 1)


def _patch_material(name: str, wavelengths: Array, reflectance: Array) -> bpy.types.Material:
    color = tuple(linear_rec709(wavelengths, reflectance))
    material = Painter(
        f"ColorChecker {name}", color, Roughness=1.0, **{"Specular IOR Level": 0.0}
    ).material
    material["uw_reflectance_wavelengths_nm"] = wavelengths.tolist()
    material["uw_reflectance"] = reflectance.tolist()
    return material


def color_checker(materials: Materials) -> bpy.types.Mesh:
    """Mesh of the board.

    It stands in the xz plane with its face towards -y and its lower edge at z = 0; a strut behind
    it reaches the ground.
    """
    wavelengths, spectra = reflectances()
    frame = Painter("ColorChecker frame", (0.012, 0.012, 0.012), Roughness=0.7).material
    slots = [frame, materials.aluminium]
    slots += [_patch_material(name, wavelengths, values) for name, values in spectra.items()]
    parts: list[Shape] = [
        box((WIDTH, THICKNESS, HEIGHT), (0, THICKNESS / 2, HEIGHT / 2)),
        box((0.05, 0.012, 0.03), (0, THICKNESS + 0.004, 0.8 * HEIGHT)).with_material(1),
    ]
    for side in (-1, 1):
        leg = box((0.018, 0.018, 0.30), (side * 0.36 * WIDTH, THICKNESS + 0.009, -0.02))
        parts.append(leg.with_material(1))
    for index in range(ROWS * COLUMNS):
        row, column = divmod(index, COLUMNS)
        x = -WIDTH / 2 + MARGIN + PATCH / 2 + column * (PATCH + GAP)
        z = HEIGHT - MARGIN - PATCH / 2 - row * (PATCH + GAP)
        # Proud of the board by 1 mm, sunk into it by as much.
        parts.append(box((PATCH, 0.002, PATCH), (x, 0, z)).with_material(2 + index))
    return to_mesh(joined(parts), "ColorChecker", slots, smooth=False)
