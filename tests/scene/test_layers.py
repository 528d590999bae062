"""Layers of a picture: they add up, and say where objects are."""

from __future__ import annotations

import json
import math

import bpy
import numpy as np
import pytest
from mathutils import Vector
from underwater_spectral.benchmarks._layer_scenes import square
from underwater_spectral.datasets import cryptomatte
from underwater_spectral.datasets.layer_file import read_layers
from underwater_spectral.jobs import batch, command_line, manifest, planning
from underwater_spectral.scene.engines import eevee_engine, exr_output
from underwater_spectral.scene.readers import cameras
from underwater_spectral.scene.water import water_body
from underwater_spectral.settings import render_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene import scenes
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr

SIZE = (40, 24)
RANGE, MOVED = 3.0, 0.1  # m from the camera; a frame
PLAIN = ["--bands", "3", "--no-diffuse-shadows", "--no-scene-floor", "--water", "jerlov:IB"]
PLAIN += ["--sun-azimuth", "90"]  # on the squares
EEVEE = ["--engine", "eevee", "--samples", "4"]


@pytest.fixture(scope="module")
def blend(tmp_path_factory):
    """A grey and a moving black square before a level camera."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    material = scenes.principled("paint")
    tree = material.node_tree
    tree.nodes.clear()
    shader, output, info = (
        tree.nodes.new(f"ShaderNode{kind}")
        for kind in ("BsdfDiffuse", "OutputMaterial", "ObjectInfo")
    )
    tree.links.new(info.outputs["Color"], shader.inputs["Color"])
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    square("grey", (-0.7, RANGE, -5.0), 1.2, (0.5, 0.5, 0.5), material)
    item = square("black", (0.0, RANGE, -5.0), 1.2, (0.0, 0.0, 0.0), material)
    for frame in (1, 2, 3):
        item.location.x = 0.7 + MOVED * (frame - 2)
        item.keyframe_insert("location", frame=frame)
    for curve in item.animation_data.action.layers[0].strips[0].channelbags[0].fcurves:
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    scenes.add_camera(rotation=(math.pi / 2, 0.0, 0.0))
    scene = bpy.context.scene
    scene.frame_set(2)
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    path = tmp_path_factory.mktemp("layers") / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def _run(blend, out, *options):
    arguments = [str(blend), *PLAIN, "--out", str(out), "--layers", "all", *options]
    assert batch.main(arguments, inside_blender=False) == 0
    return read_layers(out / "0002_layers.exr"), json.loads((out / "0002_truth.json").read_text())


@pytest.fixture(scope="module")
def eevee(blend, tmp_path_factory):
    return _run(blend, tmp_path_factory.mktemp("eevee"), *EEVEE, "--mode", "bands")


@pytest.fixture(scope="module")
def cycles(blend, tmp_path_factory):
    return _run(blend, tmp_path_factory.mktemp("cycles"), "--samples", "64")


def _inside(frame, name):
    """Pixels that one object fills, those at its edges left out."""
    number = next(n for n, found in frame.instances.items() if found == name)
    here = frame["instance"] == number
    inner = here.copy()
    for axis in (0, 1):
        for step in (-1, 1):
            inner &= np.roll(here, step, axis)
    return inner


@pytest.mark.slow_but_first
@pytest.mark.parametrize("suffix", ["", "_bands"])
def test_layers_add_up_to_the_image(eevee, suffix):
    frame, _ = eevee
    I, D, B, F = (frame[name + suffix].astype(float) for name in "IDBF")  # noqa: E741
    error = np.abs(D + B + F - I) / I
    assert np.median(error) < 1e-3
    assert np.percentile(error, 95) < 1e-2
    parts = sum(frame[f"B_{part}{suffix}"] for part in ("single", "multiple"))
    np.testing.assert_allclose(B, parts, rtol=2e-3)
    # Each of them counts.
    grey = _inside(frame, "grey")
    for part in (D, B, F):
        assert (part[grey] / I[grey]).max() > 0.005


def test_transmittance_is_exact_and_is_what_is_left(eevee):
    frame, truth = eevee
    grey, c = _inside(frame, "grey"), np.array(truth["bands"]["c"])
    z = frame["range"][..., None].astype(float)
    np.testing.assert_allclose(frame.bands("T")[grey], np.exp(-c * z)[grey], rtol=1e-6)
    D, J, E = (frame.bands(name).astype(float)[grey] for name in "DJE")
    np.testing.assert_allclose(D / J, np.exp(-c * z)[grey], rtol=4e-3)
    # A matt surface under an open sky.
    np.testing.assert_allclose(J, frame.bands("albedo")[grey] / np.pi * E, rtol=4e-3)
    assert frame["shadow"][grey].min() > 0.99


@pytest.mark.slow_but_first
@pytest.mark.parametrize("engine", ["eevee", "cycles"])
def test_places_are_those_of_the_objects(engine, request, blend):
    frame, truth = request.getfixturevalue(engine)
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    scene = bpy.context.scene
    depsgraph = bpy.context.evaluated_depsgraph_get()
    place = np.full((*SIZE[::-1], 3), np.nan)
    for index, (origin, ray) in enumerate(cameras.camera_rays(scene, scene.camera, *SIZE)):
        hit, at, *_ = scene.ray_cast(depsgraph, origin, ray)
        if hit:
            place[divmod(index, SIZE[0])] = at
    seen = np.isfinite(place[..., 0])
    np.testing.assert_array_equal(np.isfinite(frame["range"]), seen)
    K, pose = np.array(truth["camera"]["K"]), np.array(truth["camera"]["camera_to_world"])
    assert np.abs(frame["position"] - place)[seen].max() < 0.1 * RANGE / K[0, 0]
    # Known points are where the truth's camera puts them.
    x, y, z = (np.linalg.inv(pose) @ [*place[seen].T, np.ones(seen.sum())])[:3]
    columns, rows = np.meshgrid(np.arange(SIZE[0]) + 0.5, np.arange(SIZE[1]) + 0.5)
    assert np.abs(K[0, 0] * x / -z + K[0, 2] - columns[seen]).max() < 0.1
    assert np.abs(K[1, 1] * y / z + K[1, 2] - rows[seen]).max() < 0.1
    np.testing.assert_allclose(frame["planar_depth"][seen], RANGE, rtol=1e-3)
    distance = np.linalg.norm(place - np.array(Vector((0, 0, -5.0))), axis=-1)
    np.testing.assert_allclose(frame["range"][seen], distance[seen], rtol=1e-3)
    assert np.abs(frame["normal"][_inside(frame, "grey")] - (0.0, -1.0, 0.0)).max() < 1e-3
    moved = frame["motion"][_inside(frame, "black")]
    pixels = K[0, 0] * MOVED / RANGE
    np.testing.assert_allclose(moved[:, [0, 2]], -pixels, rtol=0.02)


def _manifest(texts, typename):
    """Identifiers by name, of attributes of a file."""
    (name,) = (name for name, value in texts.items() if value == typename)
    assert name.startswith("cryptomatte/")
    manifest = json.loads(texts[name.removesuffix("name") + "manifest"])
    return {known: int(bits, 16) for known, bits in manifest.items()}


def _coverage(ranks, bits):
    """Fraction of each pixel that something covers, of identifiers and coverages in turn."""
    pairs = np.ascontiguousarray(ranks, dtype=np.float32)
    here = pairs[..., 0::2].copy().view(np.uint32) == np.uint32(bits)
    return np.where(here, pairs[..., 1::2], np.float32(0.0)).sum(axis=-1)


@pytest.mark.parametrize("engine", ["eevee", "cycles"])
def test_numbers_and_cryptomatte_name_the_objects(engine, request):
    frame, _ = request.getfixturevalue(engine)
    known = _manifest(frame.attributes, "CryptoObject")
    assert {"grey", "black"} <= set(known)
    assert known["grey"] == cryptomatte.identifier("grey")
    ranks = np.concatenate([frame[f"CryptoObject{rank:02d}"] for rank in range(3)], axis=-1)
    for name, left in (("grey", True), ("black", False)):
        fraction = _coverage(ranks, known[name])
        assert fraction[_inside(frame, name)].min() > 0.999
        assert (np.argwhere(fraction > 0.5)[:, 1].mean() < SIZE[0] / 2) == left
        # A square of 1.2 m, of which the picture cuts 0.22 m.
        per_metre = SIZE[0] / 0.72 / RANGE
        assert fraction.sum() == pytest.approx(1.2 * 0.98 * per_metre**2, rel=0.03)


def test_cycles_tells_direct_light_from_the_rest(cycles, eevee):
    (frame, truth), (other, _) = cycles, eevee
    I, D, B, F = (frame.bands(name).astype(float) for name in "IDBF")  # noqa: E741
    np.testing.assert_allclose(D + B + F, I, rtol=2e-3)
    grey, c = _inside(frame, "grey"), np.array(truth["bands"]["c"])
    J, E = frame.bands("J")[grey], other.bands("J")[grey]
    np.testing.assert_allclose(J.mean(axis=0), E.mean(axis=0), rtol=0.05)
    z = frame["range"][grey][:, None].astype(float)
    np.testing.assert_allclose(D[grey], J * np.exp(-c * z), rtol=2e-3)
    np.testing.assert_allclose(frame.bands("albedo")[grey], other.bands("albedo")[grey], atol=2e-3)


@pytest.mark.slow
def test_the_real_time_picture_comes_apart_alike(blend, tmp_path, eevee):
    frame, truth = _run(blend, tmp_path, *EEVEE, "--mode", "realtime")
    I, D, B, F = (frame[name].astype(float) for name in "IDBF")  # noqa: E741
    error = np.abs(D + B + F - I) / I
    assert np.median(error) < 1e-3
    assert np.percentile(error, 95) < 1e-2
    for name in "IJDBF":
        reference = eevee[0][name]
        # Light of surroundings is as colours have it; of the picture 5 % of it are .4 %.
        rtol = 0.05 if name == "F" else 2e-3
        np.testing.assert_allclose(frame[name], reference, rtol=rtol, atol=2e-3 * reference.mean())
    picture = read_exr(tmp_path / "0002.exr")[0]
    developed = frame["I"] @ np.array(truth["sensor"]["to_linear_rec709"]).T
    np.testing.assert_allclose(developed, picture, atol=0.01 * picture.mean())


@pytest.mark.parametrize(
    "changes",
    [
        {"surface": "waves", "diffuse_shadows": False},
        {"surface": "flat", "floor_depth": 30.0},
        {"inelastic": "raman"},
    ],
    ids=str,
)
@pytest.mark.slow
def test_every_kind_of_water_has_its_outputs(changes):
    scene = scenes.varied_scene()
    values = {"layers": "all", "bands": 4, "wave_resolution": 16, **changes}
    plan = render_plan.make_plan(SceneSettings(**values))
    extent = water_body.WaterExtent(50.0, 40.0)
    with eevee_engine.eevee_bands(scene, scene.camera, plan, extent, 5.0):
        for name in ("UW Surface in Water", "UW Background"):
            nodes = bpy.data.node_groups[name].nodes
            found = {n.aov_name: n for n in nodes if n.bl_idname == "ShaderNodeOutputAOV"}
            light = {"J", "D", "B_water", "B_single", "B_lamps"}
            light |= {"F"} if name.startswith("UW Surface") else set()
            fed = {n for n in found if found[n].inputs["Color"].is_linked}
            assert {f"uw_{layer}" for layer in light} <= fed
            of_surfaces = {"uw_E", "uw_albedo", "uw_reflectance", "uw_numbers"}
            assert of_surfaces <= set(found)
            assert (of_surfaces <= fed) == name.startswith("UW Surface")
    assert not list(scene.view_layers[0].aovs)


def test_passes_are_switched_off_again():
    layer = bpy.context.view_layer
    own = layer.aovs.add()
    own.name = "mine"
    with exr_output.switched_on(layer, ["use_pass_normal"], ["uw_D"]):
        assert layer.use_pass_normal
        assert [item.name for item in layer.aovs] == ["mine", "uw_D"]
    assert not layer.use_pass_normal
    assert [item.name for item in layer.aovs] == ["mine"]


def _planned(blend, tmp_path, layers):
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    options = command_line.parse(
        [*EEVEE, "--out", str(tmp_path), "--bands", "3", "--layers", layers]
    )
    chosen = command_line.merge(SceneSettings(), options)
    return planning.plan_job(bpy.context.scene, lambda: chosen, command_line.job(options))


def test_a_pass_depends_on_what_is_drawn_with_it(blend, tmp_path):
    keys = {
        layers: manifest.Manifest.key(job, job.views[0], 0)
        for layers in ("none", "range", "D,B", "B,D", "B_single,B_multiple,B_lamps,B,D")
        for job in [_planned(blend, tmp_path, layers)]
    }
    assert keys["D,B"] == keys["B,D"] == keys["B_single,B_multiple,B_lamps,B,D"]
    assert len(set(keys.values())) == 3


@pytest.mark.slow
def test_resuming_renders_passes_without_their_layers_again(blend, tmp_path):
    options = [str(blend), *PLAIN, "--samples", "1", "--resolution", "8", "6", "--resume"]
    options += ["--out", str(tmp_path), "--layers", "D,range"]
    assert batch.main(options, inside_blender=False) == 0
    names = ["pass_00.exr", "pass_00_layers.exr"]
    files = [tmp_path / "passes" / "0002" / name for name in names]
    first = [file.stat().st_mtime_ns for file in files]
    assert batch.main(options, inside_blender=False) == 0
    assert [file.stat().st_mtime_ns for file in files] == first
    files[1].unlink()
    assert batch.main(options, inside_blender=False) == 0
    assert all(f.stat().st_mtime_ns > t for f, t in zip(files, first, strict=True))
    found = read_layers(tmp_path / "0002_layers.exr")
    assert list(found.layers) == ["D", "D_bands", "range"]


def test_other_cameras_and_words_are_refused(blend, tmp_path):
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    bpy.context.scene.camera.data.type = "ORTHO"
    chosen = SceneSettings(layers="range")
    job = command_line.job(command_line.parse(["--out", str(tmp_path)]))
    with pytest.raises(InputError, match="is of type ORTHO; layers .* need a perspective camera"):
        planning.plan_job(bpy.context.scene, lambda: chosen, job)
    with pytest.raises(InputError, match="--layers: 'depth' is not one of"):
        SceneSettings(layers="depth")


@pytest.mark.parametrize(
    "engine",
    [
        ["--engine", "cycles", "--samples", "4"],
        pytest.param([*EEVEE, "--mode", "realtime"], marks=pytest.mark.slow),
    ],
)
def test_where_objects_are_is_sharp_in_a_blurred_picture(engine, blend, tmp_path):
    """Motion blur and depth of field are the picture's; these are of the frame's moment."""
    names, found = ("range", "normal", "motion", "instance"), []
    for blurred in (False, True):
        bpy.ops.wm.open_mainfile(filepath=str(blend))
        scene, lens = bpy.context.scene, bpy.context.scene.camera.data.dof
        scene.render.use_motion_blur, scene.render.motion_blur_shutter = blurred, 1.5
        lens.use_dof, lens.focus_distance, lens.aperture_fstop = blurred, 0.5, 1.0
        path, out = tmp_path / "scene.blend", tmp_path / str(blurred)
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        job = [str(path), *PLAIN, *engine, "--out", str(out)]
        assert (
            batch.main([*job, "--layers", "range,normal,motion,instance"], inside_blender=False)
            == 0
        )
        layers = read_layers(out / "0002_layers.exr")
        picture = read_exr(out / "0002.exr")[0]
        found.append({"picture": picture} | {name: layers[name] for name in names})
    plain, blurred = found
    assert np.abs(plain["picture"] - blurred["picture"]).max() > 0.02
    assert np.abs(plain["motion"]).max() > 1.0
    for name in names:
        np.testing.assert_array_equal(plain[name], blurred[name], name)
