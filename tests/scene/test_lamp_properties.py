"""What Blender's lamps can be set to, in Real-time, Bands and Reference alike."""

from __future__ import annotations

import dataclasses
import math

import bpy
import numpy as np
import pytest
from underwater_spectral.scene.engines import engines
from underwater_spectral.scene.seen import cameras, lamps
from underwater_spectral.scene.water import water_body
from underwater_spectral.settings import render_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.spectra.illuminant import ABSOLUTE, RELATIVE
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr

BANDS, DEPTH = Bands.uniform(3), 20.0
COLUMNS, ROWS, PIXELS = 6, 3, 16  # cells of the wall, of 2 m, each with a lamp; of a cell
_BEFORE, _AWAY = 0.5, 8.0  # m, of lamps and the camera
NIGHT = SceneSettings(
    water="jerlov:IB", bands=3, sunlight=0.0, samples=4, surface="none", scattering_factor=0.0,
)  # fmt: skip
IES = """IESNA:LM-63-2002
TILT=NONE
1 -1 1 10 1 1 2 0 0 0
1 1 50
0 5 10 15 20 25 30 40 60 90
0
1000 980 940 870 760 640 500 250 60 0
"""


def _light(kind="POINT", **properties):
    light = bpy.data.lights.new("Lamp", kind)
    given = {"energy": 100.0, "shadow_soft_size": 0.02}
    if kind == "AREA":
        given["size"] = 0.04
    if kind == "SPOT":
        given |= {"spot_size": math.radians(60.0), "spot_blend": 0.2}
    for name, value in (given | properties).items():
        setattr(light, name, value)
    return light


def _own(light, **properties):
    for name, value in properties.items():
        setattr(light.underwater, name, value)
    return light


def _emission(light, source=None, output=0, target="Strength", **inputs):
    tree = light.node_tree
    emission = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeEmission")
    if source is None:
        for name, value in inputs.items():
            emission.inputs[name].default_value = value
        return light
    node = tree.nodes.new(source)
    for name, value in inputs.items():
        if name in node.inputs:
            node.inputs[name].default_value = value
        else:
            setattr(node, name, value)
    tree.links.new(node.outputs[output], emission.inputs[target])
    return light


@pytest.fixture
def scene(registered):
    """A camera before a matt wall, and no lamp."""
    scene = registered
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler.x = (0.0, 0.0, -DEPTH), math.pi / 2
    camera.data.angle = 2.0 * math.atan(COLUMNS / _AWAY)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = COLUMNS * PIXELS, ROWS * PIXELS
    scene.render.resolution_percentage = 100
    _plane("wall", _AWAY, 40.0)
    return scene


def _plane(name, y, size, x=0.0, z=0.0, colour=0.8):
    bpy.ops.mesh.primitive_plane_add(
        size=size, location=(x, y, z - DEPTH), rotation=(math.pi / 2, 0.0, 0.0)
    )
    material = bpy.data.materials.new(name)
    tree = material.node_tree
    tree.nodes.clear()
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (colour, colour, colour, 1.0)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    bpy.context.object.data.materials.append(material)
    bpy.context.object.name = name
    return bpy.context.object


def _place(number):
    row, column = divmod(number, COLUMNS)
    return 2.0 * column - COLUMNS + 1.0, ROWS - 1.0 - 2.0 * row


def _hang(scene, light, number=0, scale=(1.0, 1.0, 1.0)):
    x, z = _place(number)
    item = bpy.data.objects.new("Lamp", light)
    item.location = (x, _AWAY - _BEFORE, z - DEPTH)
    item.rotation_euler.x, item.scale, item.visible_camera = math.pi / 2, scale, False
    scene.collection.objects.link(item)
    bpy.context.view_layer.update()
    return item


def _drawn(mode, scene, plan, folder):
    """Mean radiance of each cell in each band, shape (cells, 3)."""
    camera, given = scene.camera, None
    extent = water_body.water_extent(scene, plan.column, cameras.camera_depth(camera, math.inf))
    if mode == "reference":
        opened = engines.cycles_bands(scene, camera, plan, extent, seed=1)
    elif mode == "bands":
        opened = engines.eevee_bands(scene, camera, plan, extent, DEPTH)
    else:
        # What it draws, turned into bands: there are as many as channels.
        opened = engines.eevee_realtime(scene, camera, plan, extent, DEPTH)
        given = np.eye(3)
    with opened as water:
        (bands,) = water.passes
        water.frame(plan, DEPTH, given)(bands, folder / "wall.exr")
    picture = read_exr(folder / "wall.exr")[0].astype(np.float64)
    cells = picture.reshape(ROWS, PIXELS, COLUMNS, PIXELS, 3)
    return cells.mean(axis=(1, 3)).reshape(-1, 3)


def _ies(folder):
    path = folder / "lamp.ies"
    path.write_text(IES)
    return str(path)


def _lamps(folder):
    """Name, lamp, scale; in this order on the wall."""
    ies, deg, one = _ies(folder), math.radians, (1.0, 1.0, 1.0)
    texture = {"mode": "EXTERNAL", "filepath": ies}
    return {
        "point": (_light(), one),
        "point per area": (_light(normalize=False, energy=2e4), one),
        "point with nodes": (_emission(_light(), Strength=1.5, Color=(1.0, 0.5, 0.25, 1.0)), one),
        "IES texture": (_emission(_light(energy=1.5), "ShaderNodeTexIES", **texture), one),
        "table on a point": (_own(_light(), profile=ies), one),
        "without shadow": (_light(use_shadow=False), one),
        "spot": (_light("SPOT", energy=400.0), one),
        "spot scaled": (_light("SPOT", energy=400.0), (3.0, 3.0, 3.0)),
        "spot wider": (_light("SPOT", spot_size=deg(30.0), energy=400.0), (2.0, 2.0, 1.0)),
        "spot behind a port": (_own(_light("SPOT", energy=400.0), behind_port=True), one),
        "spot by candela": (_own(_light("SPOT", energy=8000.0), spectrum="E", unit="cd"), one),
        "area": (_light("AREA", energy=50.0), one),
        "area per area": (_light("AREA", normalize=False, energy=3e4), (0.5, 2.0, 1.0)),
        "area of 30 deg": (_light("AREA", spread=deg(30.0), energy=50.0), one),
        "area of 90 deg": (_light("AREA", spread=deg(90.0), energy=50.0), one),
        "table on an area": (_own(_light("AREA", energy=100.0), profile=ies), one),
    }


def test_modes_agree(scene, tmp_path):
    made = _lamps(tmp_path)
    for number, (light, scale) in enumerate(made.values()):
        _hang(scene, light, number, scale)
    x, z = _place(list(made).index("without shadow"))
    screen = _plane("screen", _AWAY - 0.3, 0.6, x, z, colour=0.0)
    screen.visible_camera = False
    plan = render_plan.make_plan(NIGHT)
    found = {}
    import time
    for mode in ("realtime", "bands"):
        t = time.time()
        found[mode] = _drawn(mode, scene, plan, tmp_path)
        print(mode, time.time() - t)
    t = time.time()
    found["reference"] = _drawn("reference", scene, render_plan.make_plan(dataclasses.replace(NIGHT, samples=256)), tmp_path)
    print("ref", time.time() - t)
    for number, name in enumerate(made):
        r, b, c = (found[e][number] for e in ("realtime", "bands", "reference"))
        print(f"{name:18s}", "bands/ref", (b / c).round(3).tolist(), "rt/ref", (r / c).round(3).tolist(), "vs point", (c / found["reference"][0]).round(4).tolist())
