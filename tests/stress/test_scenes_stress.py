"""Scenes at their extremes: water goes in and leaves no trace, or a clear message says why not."""

from __future__ import annotations

import dataclasses
import math

import bpy
import numpy as np
import pytest
from hypothesis import strategies as st
from mathutils import Vector
from underwater_spectral.jobs import command_line, scene_requirements
from underwater_spectral.scene import marks
from underwater_spectral.scene.engines import cycles_settings, eevee_settings, exr_output
from underwater_spectral.scene.readers import cameras
from underwater_spectral.scene.terms.eevee_water import eevee_water
from underwater_spectral.scene.viewport import live, problems
from underwater_spectral.scene.water import (
    cycles_water,
    frame_water,
    pass_values,
    realtime,
    scene_water,
    water_body,
)
from underwater_spectral.scene.water.term import Eye
from underwater_spectral.settings.render_plan import make_plan
from underwater_spectral.settings.scene_settings import SETTINGS, SceneSettings
from underwater_spectral.tests.scene import scenes, snapshot
from underwater_spectral.tests.scene.columns import grey_column, henyey_greenstein, layers_of
from underwater_spectral.tests.stress.cases import few_or_many, try_cases
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.uw_spectral.transfer.channel_pixel import along_rays
from underwater_spectral.uw_spectral.transfer.pixel_parts import SurfaceAbove
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase

pytestmark = pytest.mark.filterwarnings(
    "ignore::underwater_spectral.uw_spectral.errors.DataWarning"
)
PHASE = parse_phase("hg:0.8").for_bands(np.ones(3))


@pytest.fixture(autouse=True)
def _clean(empty_blender):
    return empty_blender


# --- Scenes -----------------------------------------------------------------------------------


def _camera(z=-5.0, **data):
    camera = scenes.add_camera((0.0, 0.0, z))
    for name, value in data.items():
        setattr(camera.data, name, value)
    return camera


def _mesh(name, corners, faces=()):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], faces)
    item = bpy.data.objects.new(name, mesh)
    item.location.z = -6.0
    bpy.context.scene.collection.objects.link(item)
    return item


def _empty():
    pass


def _no_camera():
    scenes._cube("cube", (0.0, 6.0, -5.0))


def _only_a_camera():
    _camera()


def _scaled(factor):
    def make():
        cube = scenes._cube("cube", (0.0, 6.0 * factor, -5.0 * factor))
        cube.scale = (factor,) * 3
        cube.data.materials.append(scenes.principled("paint"))
        _camera(-5.0 * factor)

    return make


def _nothing_there():
    """Meshes without faces, without vertices, without area; objects of scale 0."""
    _mesh("no vertices", [])
    _mesh("one vertex", [(0, 0, 0)])
    _mesh("no area", [(0, 0, 0)] * 4, [(0, 1, 2, 3)])
    flat = scenes._cube("flat", (0.0, 6.0, -5.0))
    flat.scale = (1.0, 1.0, 0.0)
    point = scenes._cube("point", (1.0, 6.0, -5.0))
    point.scale = (0.0, 0.0, 0.0)
    point.data.materials.append(scenes.principled("paint"))
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("empty", None))
    curve = bpy.data.objects.new("curve", bpy.data.curves.new("curve", "CURVE"))
    bpy.context.scene.collection.objects.link(curve)
    _camera()


def _bare_materials():
    """No slots, empty slots, materials without nodes, without an output, used by nobody."""
    scenes._cube("none", (0.0, 6.0, -5.0))
    empty = scenes._cube("empty slot", (3.0, 6.0, -5.0))
    empty.data.materials.append(None)
    bare = scenes._cube("bare", (-3.0, 6.0, -5.0))
    for name in ("no nodes", "no output", "unlinked"):
        material = bpy.data.materials.new(name)
        bare.data.materials.append(material)
        material.node_tree.nodes.clear()
        if name == "unlinked":
            material.node_tree.nodes.new("ShaderNodeOutputMaterial")
    bpy.data.materials["no nodes"].use_fake_user = True
    _camera()


def _of_camera(z=-5.0, **data):
    def make():
        scenes._cube("cube", (0.0, 6.0, -5.0)).data.materials.append(scenes.principled("paint"))
        _camera(z, **data)

    return make


def _flat_camera():
    _of_camera()()
    bpy.context.scene.camera.scale = (0.0, 0.0, 0.0)


SCENES = {
    "empty": _empty,
    "no camera": _no_camera,
    "only a camera": _only_a_camera,
    "tiny": _scaled(1e-3),
    "huge": _scaled(1e5),
    "nothing there": _nothing_there,
    "bare materials": _bare_materials,
    "orthographic": _of_camera(type="ORTHO", ortho_scale=6.0),
    "orthographic, tiny": _of_camera(type="ORTHO", ortho_scale=1e-3),
    "orthographic, huge": _of_camera(type="ORTHO", ortho_scale=1e5),
    "equirectangular": _of_camera(type="PANO", panorama_type="EQUIRECTANGULAR"),
    "fisheye": _of_camera(type="PANO", panorama_type="FISHEYE_EQUISOLID"),
    "1 degree": _of_camera(angle=math.radians(1.0)),
    "179 degrees": _of_camera(angle=math.radians(179.0)),
    "in the surface": _of_camera(0.0),
    "just below": _of_camera(-1e-6),
    "above": _of_camera(3.0),
    "clipped at 1e6": _of_camera(clip_start=1e-6, clip_end=1e6),
    "scale 0": _flat_camera,
}
# The hardest few always, the others when there is time: each builds all nodes.
ALWAYS = ("empty", "nothing there", "bare materials", "huge")


def _some(names, always=ALWAYS):
    return [n if n in always else pytest.param(n, marks=pytest.mark.slow) for n in names]


SEEN_BY_CAMERA = [name for name in SCENES if name not in ("empty", "no camera")]


def _made(name):
    SCENES[name]()
    scene = bpy.context.scene
    bpy.context.view_layer.update()
    return scene


def _column(**changes):
    return grey_column(0.05, 0.1, **({"floor_depth": 9.0, "floor_reflectance": 0.3} | changes))


@pytest.mark.slow_but_first
@pytest.mark.parametrize("name", _some(SCENES, ALWAYS[1:]))
def test_water_of_both_engines_leaves_no_trace(name):
    scene = _made(name)
    before = snapshot.snapshot()
    column = _column(surface="flat", refractive_index=1.34)
    extent = water_body.water_extent(scene, column, 5.0)
    assert all(map(math.isfinite, dataclasses.astuple(extent)))
    water = frame_water.realtime_water(column, PHASE, 5.0, np.eye(3), shafts=True)
    realtime.add_realtime(scene, water, extent)
    realtime.set_values(scene, water)
    assert marks.has_water(scene)
    scene_water.remove(scene)
    assert snapshot.differences(before, snapshot.snapshot()) == []
    cycles_water.add_water(scene, column, layers_of(column, henyey_greenstein(0.8)), extent)
    scene_water.remove(scene)
    assert snapshot.differences(before, snapshot.snapshot()) == []


@pytest.mark.parametrize("name", _some(SCENES, ("empty",)))
def test_live_water_leaves_no_trace(registered, name):
    scene = _made(name)
    scene.underwater.phase = "hg:0.924"
    scene.underwater.exposure = "0"
    before = snapshot.snapshot()
    if name == "scale 0":
        with pytest.raises(InputError, match="looks nowhere"):
            live.add(scene)
        assert snapshot.differences(before, snapshot.snapshot()) == []
        return
    live.add(scene)
    scene.underwater.floor_depth = 4.0
    scene.underwater.floor_depth = 0.0
    assert live.update(scene)
    troubled = name in ("empty", "no camera")
    assert bool(problems.problem(scene)) == troubled, problems.problem(scene)
    live.remove(scene)
    assert snapshot.differences(before, snapshot.snapshot()) == []


def _finite(choice):
    values = [choice.required.delta_e, *map(float, (choice.settings.get("bands", 1),))]
    assert np.isfinite(values).all()
    assert all(choice.lines)


@pytest.mark.parametrize("name", _some(SEEN_BY_CAMERA, ("nothing there", "huge", "above")))
def test_what_extreme_scenes_require(name):
    """The analysis ends in a decision, or says why not."""
    scene = _made(name)
    before = snapshot.snapshot()
    parsed = command_line.parse(["--engine", "eevee", "--mode", "realtime", "--bands", "3"])
    stored = SceneSettings(phase="hg:0.924")

    job = command_line.job(parsed)

    def choose():
        return scene_requirements.choose(
            scene, scene.camera, lambda: command_line.merge(stored, parsed), job,
            target=4.0, keep=frozenset({"bands"}),
        )  # fmt: skip

    refused = {"huge": "no light at that depth", "scale 0": "looks nowhere"}  # 500 km down
    if name in refused:
        with pytest.raises(InputError, match=refused[name]):
            choose()
    else:
        _finite(choose())
    assert snapshot.differences(before, snapshot.snapshot()) == []


def test_no_camera_is_named():
    for name in ("empty", "no camera"):
        scene = _made(name)
        with pytest.raises(InputError, match="no active camera; add one"):
            cameras.find_camera(scene, None)


def _copies(scene, count):
    mesh = bpy.data.objects["cube"].data
    for index in range(count):
        item = bpy.data.objects.new(f"copy {index}", mesh)
        item.location = (index % 63, index // 63, -8.0)
        scene.collection.objects.link(item)


@pytest.mark.slow
def test_thousands_of_instances(registered):
    scene = _made("orthographic")
    scene.underwater.phase = "hg:0.924"
    _copies(scene, 4000)
    count = len(bpy.data.objects)
    live.add(scene)
    live.remove(scene)
    assert len(bpy.data.objects) == count


@pytest.mark.slow
def test_what_thousands_of_instances_require():
    scene = _made("orthographic")
    _copies(scene, 4000)
    choice = scene_requirements.choose(
        scene, scene.camera, lambda: SceneSettings(phase="hg:0.924"),
        command_line.job(command_line.parse(["--engine", "eevee", "--mode", "realtime"])),
        target=8.0, keep=frozenset({"bands"}),
    )  # fmt: skip
    _finite(choice)


# --- Settings ---------------------------------------------------------------------------------


@few_or_many(8, 200)
def test_every_setting_makes_a_plan_or_is_refused(cases_, record_property):
    """Settings at their limits: the numbers of the nodes are finite, or one InputError."""
    scene = _made("nothing there")
    limits = {}
    for name, setting in SETTINGS.items():
        low, high = setting.limits
        if setting.choices:
            limits[name] = st.sampled_from(list(setting.choices))
        elif isinstance(setting.default, bool):
            limits[name] = st.booleans()
        elif not isinstance(setting.default, str) and math.isfinite(low):
            limits[name] = st.sampled_from([setting.default, low, high])
    words = {
        "water": ["jerlov:I", "jerlov:9C", "constituents", "case:baltic", "bio:chl=100,cdom=20"],
        "second_water": ["", "jerlov:5C"],
        "phase": ["mixture", "hg:0.924", "isotropic", "petzold", "fournier-forand:1.5,0.4999"],
        "sensor": ["cie1931", "Nikon D7000", "Fuji Velvia 50"],
        "illuminant": ["d65", "equal-energy", "astm-g173", "clear-sky"],
        "floor_reflectance": ["0", "1"],
        "exposure": ["auto", "-30", "30"],
        "inelastic": ["", "raman", "all"],
    }
    limits |= {name: st.sampled_from(values) for name, values in words.items()}
    limits |= {
        "shafts": st.just(True),
        "bands": st.sampled_from([1, 2, 3, 8, 17, 32, 64]),
        "range_start": st.just(400.0),
        "range_end": st.just(700.0),
        "wave_resolution": st.just(16),
    }

    def check(values, depth):
        try:
            plan = make_plan(SceneSettings(**values))
            reduction = plan.reduction(depth)
            water = eevee_water(plan, scene, Eye(scene.camera, depth), reduction.weights)
        except InputError:
            return
        assert np.isfinite(reduction.weights).all()
        for name, numbers in {**water.numbers.channels, **water.numbers.single}.items():
            assert np.isfinite(np.float32(numbers)).all(), name
        assert len(plan.passes) >= len(plan.bands) / 3

    # A few settings at a limit each, the others as they are.
    few = st.lists(st.sampled_from(sorted(limits)), min_size=1, max_size=8, unique=True)
    values = few.flatmap(lambda names: st.fixed_dictionaries({n: limits[n] for n in names}))
    try_cases(
        check, cases_, record_property,
        values=values, depth=st.sampled_from([1e-6, 0.009, 1.0, 1000.0]),
    )  # fmt: skip


# --- Renders ----------------------------------------------------------------------------------


def _open_water(scene, camera_data, z=-5.0):
    camera = _camera(z, **camera_data)
    camera.rotation_euler = (math.radians(60.0), 0.0, 0.0)
    scene.render.resolution_x, scene.render.resolution_y = 16, 9
    scene.render.filter_size = 0.0
    bpy.context.view_layer.update()
    return camera


def _eevee(scene, camera, column, path):
    water = frame_water.realtime_water(column, PHASE, 5.0, np.eye(3))
    realtime.add_realtime(scene, water, water_body.WaterExtent(2000.0, 2000.0))
    with eevee_settings.realtime_settings(scene, camera, samples=1, water=water):
        exr_output.write_float_exr(scene, path)
    scene_water.remove(scene)
    return read_exr(path)[0].astype(np.float64)


def _expected(column, rays):
    """Radiance of the open water along the rays of a picture, by numpy."""
    water = frame_water.realtime_water(column, PHASE, 5.0, np.eye(3))
    w = [np.array(rays)[:, axis, None] for axis in range(3)]
    ray = along_rays(water.projected, water.field.sun, w)
    sky = dataclasses.replace(column.skylight, level=1.0)
    index = column.refractive_index if column.reflects else None
    return ray.open_water(np.full(w[0].shape, 5.0), w, SurfaceAbove(sky, index)).total


def _rays(scene, camera):
    """Direction of the ray of every pixel, row by row from the top."""
    frame = camera.data.view_frame(scene=scene)
    top_right, _, bottom_left, top_left = (Vector(corner) for corner in frame)
    turn = camera.matrix_world.to_quaternion()
    for row in range(9):
        for column in range(16):
            at = top_left + (top_right - top_left) * ((column + 0.5) / 16)
            at = at + (bottom_left - top_left) * ((row + 0.5) / 9)
            if camera.data.type == "ORTHO":
                at = Vector((0.0, 0.0, -1.0))
            yield (turn @ at).normalized()


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    "data",
    [{"type": "ORTHO", "ortho_scale": 4.0}, {"angle": math.radians(179.0)}, {"type": "PANO"}],
)
def test_eevee_with_extreme_cameras(tmp_path, data):
    """Open water through cameras that are not the usual one, per pixel against numpy.

    The water behind everything is seen from the camera's own depth in every pixel, also by an
    orthographic camera, whose rays start at depths of their own.
    """
    scene = bpy.context.scene
    camera = _open_water(scene, data)
    column = _column(floor_depth=math.inf)
    pixels = _eevee(scene, camera, column, tmp_path / "eevee.exr")
    assert np.isfinite(pixels).all()
    assert (pixels >= 0).all()
    if data.get("type") == "PANO":  # EEVEE has no panoramas: it draws a perspective of its own
        assert pixels.max() > 0
        return
    expected = _expected(column, list(_rays(scene, camera))).reshape(9, 16, 3)
    assert pixels == pytest.approx(expected, rel=0.02, abs=1e-5)


@pytest.mark.parametrize("panorama", ["EQUIRECTANGULAR", "FISHEYE_EQUISOLID"])
def test_cycles_panoramas_are_finite(tmp_path, panorama):
    scene = bpy.context.scene
    camera = _open_water(scene, {"type": "PANO", "panorama_type": panorama})
    column = _column(surface="flat", refractive_index=1.34, sky_radiance=0.1)
    extent = water_body.water_extent(scene, column, 5.0)
    phases = layers_of(column, henyey_greenstein(0.8))
    cycles_water.add_water(scene, column, phases, extent)
    pass_values.PassValues.of_column(column, phases).apply(scene.view_layers[0], (0, 1, 2))
    with cycles_settings.reference_settings(scene, camera, samples=4, seed=1):
        exr_output.write_float_exr(scene, tmp_path / "cycles.exr")
    scene_water.remove(scene)
    pixels = read_exr(tmp_path / "cycles.exr")[0]
    assert np.isfinite(pixels).all()
    assert (pixels >= 0).all()
    assert pixels.max() > 0
