"""Corals on sand, and silt that has been stirred up beside them: a volume object's own grid.

``tools/gallery.py silt`` renders it.
"""

from __future__ import annotations

import importlib
import math
from pathlib import Path

import bpy
import make_pictures

DEPTH = 5.0
_CORALS = {
    "brain": (-0.6, 0.0, 0.0),
    "staghorn": (0.1, 0.2, -0.05),
    "small table": (0.9, 0.6, -0.1),
}
_SILT, _SIZE, _AMOUNT = (0.75, 0.2, -4.85), (1.0, 0.6, 0.4), 14.0  # m, m, g/m³
_EYE, _GAZE = (0.1, -2.8, -4.25), (0.15, 0.2, -4.65)


def build(path: Path) -> None:
    """Build the scene, with a torch at the camera, and store it."""
    scene = make_pictures.start()
    package = "underwater_spectral"
    importlib.import_module(f"{package}.scene.stored_settings").register()
    growth, materials, shapes, cameras = make_pictures.grown()
    add_plume = importlib.import_module(f"{package}.benchmarks.clouds").add_plume
    for kind, (x, y, z) in _CORALS.items():
        mesh = growth.meshes(kind)[-1]
        shapes.place(mesh, scene.collection, (x, y, z - DEPTH), scale=0.8)
    make_pictures.sand(materials, DEPTH)
    silt = add_plume(scene, _SILT)
    silt.scale = _SIZE
    silt.underwater.constituent, silt.underwater.concentration = "minerals", _AMOUNT
    scene.camera = cameras.camera("Diver", _EYE, _GAZE, 42.0)
    light = bpy.data.lights.new("Torch", "SPOT")
    light.energy, light.spot_size, light.shadow_soft_size = 120.0, math.radians(70), 0.03
    torch = bpy.data.objects.new("Torch", light)
    scene.collection.objects.link(torch)
    cameras.aim(torch, (-0.6, -2.6, -3.9), _GAZE)
    make_pictures.store(path)
