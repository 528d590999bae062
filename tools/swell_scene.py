"""Ten seconds half under water in a swell: a jetty, a buoy on its chain, and the sand below.

``tools/gallery.py swell`` renders it. The camera stands still while the water rises and falls about
it; the buoy follows the surface where it is.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Sequence
from pathlib import Path

import bpy
import make_pictures

RATE, SECONDS = 8, 10
FRAMES = RATE * SECONDS
OPTIONS = {
    "--surface": "waves", "--wind": "6", "--swell-height": "0.6", "--swell-length": "11",
    "--swell-direction": "60", "--wave-resolution": "256",
}  # fmt: skip
_DEPTH, _BUOY, _DECK = 4.0, (-1.1, 3.4), 1.3
_PILES = ((1.0, 3.2), (2.6, 3.4), (1.2, 6.4), (2.9, 6.8), (1.4, 9.8), (3.2, 10.4))


def _coated(colour: Sequence[float]) -> bpy.types.Object:
    item = bpy.context.object
    material = bpy.data.materials.new(item.name)
    shader = material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*colour, 1.0)
    shader.inputs["Roughness"].default_value = 0.9
    shader.inputs["Specular IOR Level"].default_value = 0.1
    item.data.materials.append(material)
    return item


def _cylinder(
    place: Sequence[float], radius: float, length: float, colour: Sequence[float]
) -> bpy.types.Object:
    bpy.ops.mesh.primitive_cylinder_add(radius=radius, depth=length, location=place, vertices=32)
    bpy.ops.object.shade_auto_smooth(angle=math.radians(40))
    return _coated(colour)


def build(path: Path, rate: int = RATE) -> None:
    """Build the scene, its buoy keyed to the waves of :data:`OPTIONS`, and store it."""
    scene = make_pictures.start()
    package = "underwater_spectral"
    cameras = importlib.import_module(f"{package}.examples.parts.cameras")
    detail = importlib.import_module(f"{package}.examples.parts.detail").DETAILS["panel"]
    materials = importlib.import_module(f"{package}.examples.parts.materials").Materials(1, detail)
    surface = importlib.import_module(f"{package}.scene.readers.moving_surface")
    settings = importlib.import_module(f"{package}.settings.scene_settings").SceneSettings
    scene.render.fps, scene.frame_start, scene.frame_end = rate, 1, rate * SECONDS
    scene.camera = cameras.camera("Swimmer", (0.0, -0.6, 0.05), (0.5, 4.0, -0.35), 22.0)
    bpy.ops.mesh.primitive_plane_add(size=80.0, location=(0.0, 0.0, -_DEPTH))
    bpy.context.object.data.materials.append(materials.sand)
    for x, y in _PILES:
        _cylinder((x, y, (_DECK - _DEPTH) / 2), 0.13, _DECK + _DEPTH, (0.16, 0.1, 0.06))
        _cylinder((x, y, -1.5), 0.16, 2.2, (0.05, 0.07, 0.03))  # weed, from the tide's mark down
    for step in range(16):
        bpy.ops.mesh.primitive_cube_add(size=1.0, location=(2.0, 3.0 + 0.5 * step, _DECK))
        bpy.context.object.scale = (2.6, 0.4, 0.06)
        _coated((0.3, 0.22, 0.15))
    x, y = _BUOY
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.32, location=(x, y, 0.0))
    bpy.ops.object.shade_smooth()
    buoy = _coated((0.75, 0.16, 0.02))
    chain = _cylinder((x, y, -_DEPTH), 0.02, 1.0, (0.1, 0.1, 0.1))
    chosen = settings(
        surface="waves", raised_waves=True,
        wind_speed=float(OPTIONS["--wind"]), swell_height=float(OPTIONS["--swell-height"]),
        swell_length=float(OPTIONS["--swell-length"]),
        swell_direction=float(OPTIONS["--swell-direction"]),
        wave_resolution=int(OPTIONS["--wave-resolution"]),
    )  # fmt: skip
    for frame in range(1, rate * SECONDS + 1):
        scene.frame_set(frame)
        buoy.location.z = float(surface.heights(scene, chosen).elevation(x, y)) + 0.06
        chain.scale.z = buoy.location.z + _DEPTH
        chain.location.z = buoy.location.z - chain.scale.z / 2
        for item, channels in ((buoy, ("location",)), (chain, ("location", "scale"))):
            for channel in channels:
                item.keyframe_insert(channel, frame=frame)
    path.parent.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True, compress=True)
