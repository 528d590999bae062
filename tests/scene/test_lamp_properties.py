"""What Blender's lamps can be set to, in Real-time, Bands and Reference alike."""

from __future__ import annotations

import dataclasses
import math

import bpy
import numpy as np
import pytest
from underwater_spectral.node_groups.node_mathematics import MARK
from underwater_spectral.scene.engines import engines, exr_output
from underwater_spectral.scene.readers import cameras, lamp_records, lamps
from underwater_spectral.scene.readers.lamp_nodes import WATTS_PER_CANDELA, nodes_of
from underwater_spectral.scene.water import water_body
from underwater_spectral.settings import render_plan
from underwater_spectral.settings.known_words import LAMP_SPECTRA
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene import scenes
from underwater_spectral.uw_spectral.lamps.emission import flux, parse_emission
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.spectra.illuminant import ABSOLUTE, RELATIVE, band_mean
from underwater_spectral.uw_spectral.spectra.reflectance import emission_basis
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr

BANDS, DEPTH = Bands.uniform(3), 20.0
COLUMNS, ROWS, PIXELS = 6, 3, 14  # cells of the wall, of 2 m, each with a lamp; of a cell
_BEFORE, _AWAY = 0.75, 8.0  # m, of lamps and the camera
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
        given["size"] = 0.02
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
    return scenes.wall(name, (x, y, z - DEPTH), size, colour)


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
        "area per area": (_light("AREA", normalize=False, energy=1.2e5), (0.5, 2.0, 1.0)),
        "area of 70 deg": (_light("AREA", spread=deg(70.0), energy=50.0), one),
        "area of 90 deg": (_light("AREA", spread=deg(90.0), energy=50.0), one),
        "table on an area": (_own(_light("AREA", energy=100.0), profile=ies), one),
    }


@pytest.mark.slow
def test_modes_agree(scene, tmp_path):
    """Within 3 %, each lamp on a wall of its own in one picture of each mode."""
    made = _lamps(tmp_path)
    for number, (light, scale) in enumerate(made.values()):
        _hang(scene, light, number, scale)
    x, z = _place(list(made).index("without shadow"))
    _plane("screen", _AWAY - 0.3, 0.6, x, z, colour=0.0).visible_camera = False
    drawn = {}
    for mode in ("realtime", "bands", "reference"):
        chosen = dataclasses.replace(NIGHT, samples=256) if mode == "reference" else NIGHT
        drawn[mode] = _drawn(mode, scene, render_plan.make_plan(chosen), tmp_path)
    for number, name in enumerate(made):
        realtime, bands, reference = (drawn[mode][number] for mode in drawn)
        assert bands == pytest.approx(reference, rel=0.03), name
        assert realtime == pytest.approx(bands, rel=0.01), name
    assert not [c for c in bpy.data.collections if MARK in c]


def test_brightness_is_blenders(scene, tmp_path):
    """Without water Cycles lights the wall before a lamp as its intensity says, within 2 %."""
    bpy.context.scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.max_bounces = 256, False, 0
    scene.render.resolution_x = scene.render.resolution_y = 4
    scene.camera.data.lens, scene.world = 2e4, None
    item = _hang(scene, _light())
    item.location = (0.0, _AWAY - 2.0, -DEPTH)
    found = {}
    for name, (light, scale) in _lamps(tmp_path).items():
        if not light.underwater.profile and not light.underwater.spectrum:
            light.underwater.behind_port = False
            item.data, item.scale = light, scale
            bpy.context.view_layer.update()
            exr_output.write_float_exr(scene, tmp_path / "dry.exr")
            (lamp,) = lamps.lamps_of(scene, BANDS, RELATIVE).lamps
            seen = read_exr(tmp_path / "dry.exr")[0].astype(np.float64).mean(axis=(0, 1))
            basis = emission_basis(BANDS) @ (seen * math.pi / 0.8 * 2.0**2)
            found[name] = basis / (lamp.intensity * float(lamp.profile.value(1.0)))
    assert len(found) > 10
    for name, ratio in found.items():
        assert ratio == pytest.approx(1.0, rel=0.02), name


def _notes(scene):
    return " | ".join(lamps.lamps_of(scene, BANDS, RELATIVE).notes)


def test_negative_light_is_left_out_with_the_reason(scene):
    item = _hang(scene, _light(energy=-10.0))
    assert "'Lamp' is dark: its power is negative" in _notes(scene)
    assert not lamps.lamps_of(scene, BANDS, RELATIVE).lamps[0].intensity.any()
    (row,) = lamp_records.records(scene)
    assert "negative" in row["left_out"]
    item.data.energy = 10.0
    assert _notes(scene) == ""
    _emission(item.data, Strength=0.0)
    assert "its nodes send no light" in _notes(scene)


SAID = {
    "elliptical": (lambda item: setattr(item, "scale", (2.0, 1.0, 1.0)), "SPOT"),
    "square cone": (lambda item: setattr(item.data, "use_square", True), "SPOT"),
    "too bright within": (lambda item: setattr(item.data, "size", 1.0), "AREA"),
    "factors": (lambda item: setattr(item.data, "diffuse_factor", 0.5), "POINT"),
    "custom distance": (lambda item: setattr(item.data, "use_custom_distance", True), "POINT"),
    "bounces": (lambda item: setattr(item, "visible_diffuse", False), "POINT"),
    "'Image Texture'": (
        lambda item: _emission(item.data, "ShaderNodeTexImage", target="Color"), "POINT",
    ),
    "'Light Falloff'": (
        lambda item: _emission(item.data, "ShaderNodeLightFalloff", 1, Strength=1.0), "POINT",
    ),
    "no cone": (lambda item: _own(item.data, behind_port=True), "POINT"),
    "portal": (lambda item: setattr(item.data.cycles, "is_portal", True), "AREA"),
}  # fmt: skip


@pytest.mark.parametrize("words", SAID)
def test_what_is_not_heeded_is_said(scene, words):
    change, kind = SAID[words]
    item = _hang(scene, _light(kind, **({"spread": math.radians(20.0)} if kind == "AREA" else {})))
    assert _notes(scene) == ""
    change(item)
    bpy.context.view_layer.update()
    assert words in _notes(scene)


def test_constant_nodes_are_read(scene, tmp_path):
    def factor(light):
        return nodes_of(light).factor

    bulb = _emission(_light(), "ShaderNodeBlackbody", target="Color")
    bulb.node_tree.nodes["Blackbody"].inputs[0].default_value = 3000.0
    light = _light(use_temperature=True, temperature=3000.0)
    assert factor(bulb) == pytest.approx(list(light.temperature_color), rel=0.01, abs=0.01)
    falloff = _emission(_light(), "ShaderNodeLightFalloff", Strength=2.5)
    assert factor(falloff) == pytest.approx([2.5] * 3)
    assert nodes_of(falloff).unsupported == ()
    product = _emission(_light(), "ShaderNodeMath", operation="MULTIPLY")
    for socket, value in zip(product.node_tree.nodes["Math"].inputs, (2.0, 3.0), strict=False):
        socket.default_value = value
    assert factor(product) == pytest.approx([6.0] * 3)
    sheet = _emission(_light(), "ShaderNodeTexIES", mode="EXTERNAL", filepath=_ies(tmp_path))
    assert factor(sheet) == pytest.approx([1000.0 * WATTS_PER_CANDELA] * 3)


@pytest.mark.parametrize("bound", ["itself", "parent", "vertex"])
def test_a_lamp_that_a_simulation_may_lift_has_its_nodes_from_the_start(scene, bound):
    """Those of a lamp that shines in from the air; one that stays in the water needs none."""
    item = _hang(scene, _own(_light(), from_above=True))
    item.location.z = -2.0
    bpy.context.view_layer.update()
    assert not lamps.lamps_of(scene, BANDS, RELATIVE).from_air
    body = _plane("buoy", 1.0, 1.0)
    if bound == "vertex":
        item.parent, item.parent_type = body, "VERTEX"
    else:
        carrier = item if bound == "itself" else body
        item.parent = None if bound == "itself" else body
        if bound == "itself":
            carrier.constraints.new("COPY_LOCATION")
        else:
            bpy.context.view_layer.objects.active = carrier
            bpy.ops.rigidbody.object_add()
    item.matrix_world.translation.z = -2.0
    bpy.context.view_layer.update()
    assert lamps.lamps_of(scene, BANDS, RELATIVE).from_air


def test_candela_are_on_the_axis(scene):
    """1 cd of a flat spectrum, whatever the cone; behind a port it gains n²."""
    item = _hang(scene, _own(_light("SPOT", energy=1.0), spectrum="E", unit="cd"))
    seen = []
    for port in (False, True):
        item.data.underwater.behind_port = port
        (lamp,) = lamps.lamps_of(scene, BANDS, ABSOLUTE, 1.34).lamps
        seen.append(lamp.intensity * lamp.profile.value(1.0))
    whole = flux(parse_emission("E"), "cd")
    assert seen[0] == pytest.approx(1.0 / whole * band_mean(parse_emission("E"), BANDS), rel=1e-3)
    assert seen[1] == pytest.approx(1.34**2 * seen[0], rel=1e-6)
    assert lamp_records.records(scene)[0]["unit"] == "cd"


def test_an_asymmetric_file_is_said(scene, tmp_path):
    lines = IES.splitlines()
    lines[2], lines[5] = "1 -1 1 10 2 1 2 0 0 0", "0 180"
    path = tmp_path / "half.ies"
    path.write_text("\n".join([*lines, " ".join(["100"] * 10)]))
    item = _hang(scene, _own(_light(), profile=_ies(tmp_path)))
    assert _notes(scene) == ""
    item.data.underwater.profile = str(path)
    assert "all round" in _notes(scene)


def test_a_keyed_cone_is_that_of_each_frame(scene, tmp_path):
    """In Cycles, whose lamps have their profile in nodes."""
    item = _hang(scene, _light("SPOT", energy=400.0, spot_blend=1.0))
    for frame, degrees in ((1, 60.0), (2, 40.0)):
        item.data.spot_size = math.radians(degrees)
        item.data.keyframe_insert("spot_size", frame=frame)
    plan = render_plan.make_plan(dataclasses.replace(NIGHT, samples=64))
    means, whole = [], []
    scene.frame_set(1)
    extent = water_body.water_extent(scene, plan.column, _AWAY)
    with engines.cycles_bands(scene, scene.camera, plan, extent, seed=1) as water:
        for frame in (1, 2):
            scene.frame_set(frame)
            water.frame(plan, DEPTH)(water.passes[0], tmp_path / "wall.exr")
            means.append(read_exr(tmp_path / "wall.exr")[0].mean())
            (lamp,) = lamps.plan_lamps(scene, plan).lamps
            whole.append(lamp.profile.solid_angle)
    assert means[1] / means[0] == pytest.approx(whole[1] / whole[0], rel=0.05)
    assert not [light for light in bpy.data.lights if MARK in light]


def test_a_spectrum_of_the_menu_is_taken(scene):
    light = _light()
    names = list(LAMP_SPECTRA)
    assert all(parse_emission(name).values.max() > 0 for name in names)
    assert {"LED-B3", "A", "Kinoton 75P"} <= set(names)
    bpy.ops.underwater.choose_spectrum(lamp=light.name, spectrum="Kinoton 75P")
    assert light.underwater.spectrum == "Kinoton 75P"
