"""What a scene requires, seen through its camera; and the options that use it."""

from __future__ import annotations

import json
import math
import tempfile
from pathlib import Path

import bpy
import numpy as np
import pytest
from mathutils import Vector
from underwater_spectral.jobs import batch, command_line, scene_requirements
from underwater_spectral.node_groups.node_mathematics import MARK
from underwater_spectral.quality import requirements
from underwater_spectral.scene import stored_settings
from underwater_spectral.scene.engines import engines
from underwater_spectral.scene.readers import cameras, view_tracing
from underwater_spectral.scene.water import new_clouds, water_body
from underwater_spectral.settings.render_plan import make_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene import scenes
from underwater_spectral.tests.scene.columns import grey_column
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase

pytestmark = pytest.mark.filterwarnings(
    "ignore::underwater_spectral.uw_spectral.errors.DataWarning"
)


def _scene(rotation=(math.pi / 2, 0.0, 0.0)):
    ball = scenes._cube("ball", (0.0, 8.0, -5.0))
    ball.data.materials.append(scenes.principled("paint", (0.7, 0.3, 0.2, 1.0)))
    camera = scenes.add_camera((0.0, 0.0, -5.0), rotation)
    bpy.context.view_layer.update()
    return bpy.context.scene, camera


def _column(**how):
    return grey_column(0.05, 0.1, sun_direction=np.array([0.0, 0.0, -1.0]), **how)


def _look(scene, camera, column=None, **how):
    column = column or _column()
    return view_tracing.trace_view(scene, camera, column, _field(column), **how)


def _field(column):
    return column.solved_field(parse_phase("hg:0.8").for_bands(np.ones(3)), 16)


def test_a_cube_ahead_is_seen_where_it_is():
    scene, camera = _scene()
    seen = _look(scene, camera)
    hit = np.isfinite(seen.distance)
    assert 0 < hit.sum() < len(seen)
    points = seen.origin[hit] + seen.direction[hit] * seen.distance[hit, None]
    assert points[:, 1] == pytest.approx(7.0, abs=1e-4)
    assert seen.normal[hit] == pytest.approx(np.tile([0.0, -1.0, 0.0], (hit.sum(), 1)), abs=1e-5)
    assert seen.colour[hit] == pytest.approx(np.tile([0.7, 0.3, 0.2], (hit.sum(), 1)), abs=1e-6)
    assert not seen.on_floor.any()
    assert seen.path_sunlit.all()
    assert (seen.openness == 1).all()


def test_a_subject_of_one_percent_counts_as_the_water_does():
    scene, camera = _scene()
    bpy.data.objects["ball"].scale = (0.2,) * 3
    bpy.context.view_layer.update()
    seen = _look(scene, camera)
    hit = np.isfinite(seen.distance)
    fraction = seen.pixels[hit].sum()
    assert 0.005 < fraction < 0.02
    assert hit.sum() >= 1000 * fraction / 2
    assert seen.pixels.sum() == pytest.approx(1)
    assert seen.weight[hit].sum() == pytest.approx(
        min(fraction, 0.01) / (min(fraction, 0.01) + 0.01)
    )
    assert len(_look(scene, camera, rays=20)) == 20


def test_floor_and_shadows_are_found():
    scene, camera = _scene((1.2, 0.0, 0.0))
    slab = scenes._cube("slab", (0.0, 6.0, -1.0))
    slab.scale = (4.0, 3.0, 0.1)
    bpy.context.view_layer.update()
    seen = _look(scene, camera, _column(floor_depth=9.0, floor_reflectance=0.3))
    floor = seen.on_floor
    assert floor.any()
    down = -seen.direction[floor, 2] * seen.distance[floor]
    assert down == pytest.approx(4.0, rel=1e-5)
    assert 0.1 < seen.occluded_path < 0.9
    assert not seen.sunlit[np.isfinite(seen.distance)].all()
    under = floor & (np.abs(seen.origin + seen.direction * seen.distance[:, None])[:, 0] < 1)
    assert seen.openness[floor].min() < 0.7
    assert seen.openness[under].mean() < seen.openness[floor & ~under].mean()


def test_a_ceiling_keeps_the_light_from_above_away():
    scene, camera = _scene()
    slab = scenes._cube("slab", (0.0, 8.0, -3.0))
    slab.scale = (40.0, 40.0, 0.1)
    bpy.context.view_layer.update()
    seen = _look(scene, camera)
    assert (seen.openness[np.isfinite(seen.distance)] == 0).sum() > 10
    assert (seen.openness[np.isinf(seen.distance)] == 1).all()


def test_live_water_is_not_in_the_way():
    scene, camera = _scene()
    before = _look(scene, camera)
    box = scenes._cube("shafts", (0.0, 0.0, -5.0))
    box[MARK] = True
    box.scale = (50.0, 50.0, 4.9)
    bpy.context.view_layer.update()
    after = _look(scene, camera)
    assert after.distance == pytest.approx(before.distance, abs=0.01)
    assert (after.path_sunlit == before.path_sunlit).all()


def test_rays_of_a_perspective_camera_fill_its_view():
    scene, camera = _scene()
    camera.data.angle = math.radians(60)
    scene.render.resolution_x, scene.render.resolution_y = 100, 100
    rays = [w for _, w in cameras.camera_rays(scene, camera, 48, 27)]
    widest = max(abs(w.x / w.y) for w in rays)
    assert 0.9 * math.tan(math.radians(30)) < widest < math.tan(math.radians(30))


def test_rays_of_an_orthographic_camera_are_parallel():
    scene, camera = _scene()
    camera.data.type, camera.data.ortho_scale = "ORTHO", 4.0
    rays = list(cameras.camera_rays(scene, camera, 48, 27))
    assert all((w - Vector((0, 1, 0))).length < 1e-6 for _, w in rays)
    across = [o.x for o, _ in rays]
    assert 3.5 < max(across) - min(across) < 4.0
    seen = _look(scene, camera)
    assert seen.distance[np.isfinite(seen.distance)] == pytest.approx(7.0, abs=1e-4)


def test_rays_of_a_panorama_look_everywhere():
    scene, camera = _scene()
    camera.data.type, camera.data.panorama_type = "PANO", "EQUIRECTANGULAR"
    rays = np.array([w for _, w in cameras.camera_rays(scene, camera, 48, 27)])
    assert np.abs(rays.mean(axis=0)).max() < 0.01
    camera.data.panorama_type, camera.data.fisheye_fov = "FISHEYE_EQUIDISTANT", math.radians(90)
    rays = np.array([w for _, w in cameras.camera_rays(scene, camera, 48, 27)])
    assert rays[:, 1].min() == pytest.approx(math.cos(math.radians(45)), abs=0.01)


@pytest.fixture
def registered():
    if not hasattr(bpy.types.Scene, stored_settings.PROPERTY):
        stored_settings.register()


def _choose(scene, camera, options, **how):
    parsed = command_line.parse(options)
    stored = SceneSettings()
    return scene_requirements.choose(
        scene, camera, lambda: command_line.merge(stored, parsed), command_line.job(parsed), **how
    )


def test_choice_changes_only_what_was_left_to_it():
    scene, camera = _scene()
    options = ["--engine", "eevee", "--mode", "realtime", "--surface", "flat", "--samples", "7"]
    auto = command_line.auto(command_line.parse([*options, "--target-delta-e", "8"]))
    assert auto.keep == {"surface", "samples"}
    choice = _choose(scene, camera, options, target=8.0, keep=auto.keep)
    assert not {"surface", "samples"} & set(choice.settings)
    assert "surface" in choice.required.options
    assert "bands" not in choice.settings
    assert "40, which cost nothing" in choice.lines[0]
    placed = [*options, "--band-placement", "optimised"]
    kept = _choose(scene, camera, placed, target=8.0, keep=frozenset(["band_placement"]))
    assert "optimised" in kept.lines[0]
    by_pass = [word.replace("realtime", "bands") for word in options]
    assert _choose(scene, camera, by_pass, target=8.0).settings["bands"] == 3
    assert choice.settings["diffuse_shadows"] is False
    assert "shafts" not in choice.settings
    fixed = _choose(
        scene, camera, [*options, "--bands", "5"], target=8.0, keep=frozenset(["bands"])
    )
    assert "bands" not in fixed.settings
    assert "5, as given" in fixed.lines[0]


def _picture(scene, camera, options):
    """Linear Rec.709 as a job of options draws it, clipped to the display."""
    plan = make_plan(command_line.merge(SceneSettings(), command_line.parse(options)))
    depth = -camera.location.z
    extent = water_body.water_extent(scene, plan.column, depth)
    scene.render.resolution_x, scene.render.resolution_y = 48, 27
    scene.render.resolution_percentage = 100
    with (
        engines.eevee_realtime(scene, camera, plan, extent, depth) as engine,
        tempfile.TemporaryDirectory() as folder,
    ):
        scene.eevee.shadow_resolution_scale = 0.1
        path = Path(folder, "picture.exr")
        engine.frame(plan, depth)(engine.passes[0], path)
        return np.clip(read_exr(path)[0].astype(np.float64), 0.0, 1.0)


@pytest.mark.slow
@pytest.mark.parametrize("grey", [pytest.param(0.0, marks=pytest.mark.slow), 0.4])
def test_what_objects_block_is_worth_what_renders_say(grey):
    scenes._cube("block", (0.0, 4.0, -5.6)).data.materials.append(
        scenes.principled("paint", (grey, grey, grey, 1.0))
    )
    bpy.data.objects["block"].scale = (0.6,) * 3
    camera = scenes.add_camera((0.0, 0.0, -5.0), (1.3, 0.0, 0.0))
    scene = bpy.context.scene
    bpy.context.view_layer.update()
    options = ["--engine", "eevee", "--mode", "realtime", "--water", "jerlov:IB", "--samples", "2"]
    options += ["--surface", "flat", "--floor-depth", "8"]
    choice = _choose(scene, camera, options, target=0.4, keep=frozenset(["floor_depth", "samples"]))
    effect = {d.name: d for d in choice.required.decisions}["diffuse shadows"].effect_delta_e
    # Each kind of object counts alike, as in the estimate.
    kind = _look(scene, camera, _column(floor_depth=8.0), rays=48 * 27).kind.reshape(27, 48)
    pictures = [_picture(scene, camera, [*options, occlusion])
                for occlusion in ("--diffuse-shadows", "--no-diffuse-shadows")]  # fmt: skip
    difference = delta_e_CIE2000_images(*pictures)
    drawn = np.mean([difference[kind == k].mean() for k in np.unique(kind)])
    assert effect == pytest.approx(drawn, rel=0.3)
    assert drawn > 0.5
    assert "diffuse_shadows" in choice.required.options


def test_an_edited_file_counts_for_the_next_choice(tmp_path, monkeypatch):
    scene, camera = _scene()
    path = tmp_path / "water.csv"
    found = []

    def decide(views, everything, *arguments, **options):
        found.append(float(everything.view.column.scattering[0]))
        return requirements.decide(views, everything, *arguments, **options)

    monkeypatch.setattr(scene_requirements, "decide", decide)
    options = ["--water", f"file:{path}", "--bands", "3"]
    for b in (0.1, 0.3):
        path.write_text(f"wavelength_nm,a,b\n300,0.05,{b}\n800,0.5,{b}\n")
        _choose(scene, camera, options, target=8.0, keep=frozenset(["bands"]))
    assert found == pytest.approx([0.1, 0.3])


def test_terms_that_are_given_stay():
    scene, camera = _scene()
    options = ["--engine", "eevee", "--bands", "4", "--no-diffuse-shadows", "--shafts"]
    options += ["--surface", "flat", "--inelastic", ""]
    keep = command_line.auto(command_line.parse([*options, "--target-delta-e", "8"])).keep
    choice = _choose(scene, camera, options, target=8.0, keep=keep)
    assert choice.required.options == {"shafts", "surface"}
    lines = {line.split(";")[0] for line in choice.lines}
    assert {
        "shafts: on, as given",
        "diffuse shadows: off, as given",
        "surface with Snell's window: on, as given",
    } <= lines
    assert not any(line.startswith(("waves", "inelastic")) for line in lines)
    assert not {"diffuse_shadows", "shafts", "surface", "inelastic"} & set(choice.settings)


def test_cycles_has_terms_that_are_switches_of_eevee():
    scene, camera = _scene()
    slab = scenes._cube("slab", (0.0, 6.0, -1.0))
    slab.scale = (20.0, 20.0, 0.1)
    bpy.context.view_layer.update()
    options = ["--engine", "cycles", "--bands", "4", "--no-diffuse-shadows"]
    keep = frozenset(["bands", "diffuse_shadows"])
    choice = _choose(scene, camera, options, target=8.0, keep=keep)
    assert "diffuse_shadows" in choice.required.options
    assert not {"shafts", "diffuse_shadows"} & set(choice.settings)
    assert not any(line.startswith("diffuse shadows") for line in choice.lines)


def test_frames_along_the_path_are_looked_at():
    scene, camera = _scene()
    for frame, z in ((1, -5.0), (11, -2.0)):
        camera.location.z = z
        camera.keyframe_insert("location", frame=frame)
    scene.frame_set(1)
    choice = _choose(
        scene, camera, ["--engine", "eevee", "--mode", "realtime", "--frames", "1-11"], target=2.0
    )
    assert scene.frame_current == 1
    assert choice.required.delta_e <= 2.0


LAYERS = """depth_m,wavelength_nm,a,b
0,300,0.06,0.25
0,800,0.92,0.20
5,300,0.20,0.60
5,800,0.95,0.50
"""


@pytest.mark.slow
def test_layered_water_is_weighed_in_equal_bands_and_without_shafts(tmp_path):
    scene, camera = _scene()
    (tmp_path / "water.csv").write_text(LAYERS)
    options = ["--engine", "eevee", "--mode", "bands", "--water", f"file:{tmp_path / 'water.csv'}"]
    options += ["--surface", "flat", "--floor-depth", "8"]
    choice = _choose(scene, camera, options, target=1.0)
    assert "optimised" not in choice.required.bands.name
    assert "shafts" not in choice.required.options
    worth = {d.name: d.effect_delta_e for d in choice.required.decisions}
    # The lower layer, in which the camera is, hides surface and floor; its own light does not.
    assert worth["single scattering"] > 0.5
    assert max(worth["floor"], worth["surface with Snell's window"]) < 0.5


@pytest.mark.slow
def test_clouds_change_what_terms_are_worth(registered):
    scene, camera = _scene()
    options = ["--engine", "eevee", "--mode", "realtime", "--surface", "flat", "--floor-depth", "8"]
    options += ["--no-diffuse-shadows", "--no-shafts"]
    keep = frozenset(["diffuse_shadows", "shafts"])
    worth = []
    for dense in (False, True):
        if dense:
            item = new_clouds.add_blob(scene, "minerals")
            item.location, item.scale = (0.0, 3.0, -5.0), (4.0,) * 3
            item.underwater.concentration = 40.0
            bpy.context.view_layer.update()
        found = _choose(scene, camera, options, target=1.0, keep=keep)
        worth.append({d.name: d.effect_delta_e for d in found.required.decisions})
    clear, hidden = worth
    # The floor lights the cloud, which is seen in the place of water; bands are as different.
    assert hidden["floor light"] > 1.1 * clear["floor light"]
    assert hidden["bands"] == pytest.approx(clear["bands"], abs=0.05)


def test_night_is_refused():
    scene, camera = _scene()
    options = ["--sunlight", "0"]
    with pytest.raises(InputError, match="--sunlight is 0"):
        _choose(scene, camera, options, target=2.0)


def test_quality_gives_engine_mode_and_target():
    parsed = command_line.parse(["--quality", "draft"])
    job = command_line.job(parsed)
    assert (job.engine, job.mode) == ("eevee", "realtime")
    assert command_line.auto(parsed).target == 4.0
    parsed = command_line.parse(
        ["--quality", "draft", "--engine", "cycles", "--target-delta-e", "2"]
    )
    assert (command_line.job(parsed).engine, command_line.job(parsed).mode) == ("cycles", "bands")
    assert command_line.auto(parsed).target == 2.0
    assert command_line.auto(command_line.parse([])) is None
    assert command_line.job(command_line.parse([])).engine == "cycles"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--explain"], "--explain needs --quality"),
        (["--target-delta-e", "0"], "--target-delta-e: 0 is not a positive number"),
        (["--time-budget", "nan"], "--time-budget: nan is not a positive number"),
    ],
)
def test_bad_wishes(options, message):
    with pytest.raises(InputError, match=message):
        command_line.auto(command_line.parse(options))


def test_batch_explains_and_records_what_it_chose(registered, tmp_path, capfd):
    _scene()
    blend = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    options = ["--quality", "reference", "--explain", "--samples", "1"]
    small = ["--resolution", "8", "8", "--out", str(tmp_path / "out")]
    assert batch.main([str(blend), *options, *small], inside_blender=False) == 0
    printed = capfd.readouterr().out
    record = json.loads((tmp_path / "out" / "0001.json").read_text())
    for line in record["job"]["decisions"]:
        assert line in printed
    assert "bounces: " in printed
    assert record["settings"]["bounces"] < 64
    assert record["settings"]["bands"] == len(record["bands"]["centres_nm"])


_FROM_ABOVE = ("--engine", "eevee", "--mode", "bands", "--water", "jerlov:3C", "--floor-depth", "4")


def test_from_above_what_is_seen_in_the_water_counts():
    scene, _ = _scene()
    camera = scenes.add_camera((0.0, -4.0, 4.0), (math.radians(65.0), 0.0, 0.0))
    bpy.context.view_layer.update()
    column = _column(floor_depth=9.0, surface="flat", refractive_index=1.34)
    view = view_tracing.trace_from_above(scene, camera, column, _field(column))
    seen = view.seen
    assert seen.pixels.sum() == pytest.approx(1.0)
    assert seen.depth == pytest.approx(1e-3)
    hit = (seen.kind == 2) & (seen.direction[:, 0] ** 2 < 1e-2)
    points = seen.origin[hit] + seen.direction[hit] * seen.distance[hit, None]
    # The cube's top and its front, below where the camera sees it without refraction.
    assert hit.sum() > 5
    assert (np.isclose(points[:, 2], -4.0) | np.isclose(points[:, 1], 7.0)).all()
    # Each counts by what Fresnel lets through, here by the angles of the refracted ray.
    t = np.arccos(-seen.direction[:, 2])
    i = np.arcsin(np.minimum(1.34 * np.sin(t), 1.0))
    R = (np.sin(i - t) / np.sin(i + t)) ** 2 / 2 + (np.tan(i - t) / np.tan(i + t)) ** 2 / 2
    assert R.max() > 0.2
    assert seen.pixels == pytest.approx((1.0 - R) / (1.0 - R).sum(), rel=1e-3)


@pytest.mark.slow
def test_auto_from_above_meets_its_target_and_leaves_the_surface_as_it_is():
    scene, _ = _scene()
    camera = scenes.add_camera((0.0, 3.0, 4.0), (math.radians(50.0), 0.0, 0.0))
    slab = scenes._cube("slab", (0.0, 6.0, -1.0))
    slab.scale = (4.0, 3.0, 0.1)
    bpy.context.view_layer.update()
    found = {}
    for target in (8.0, 0.5):
        options = [*_FROM_ABOVE, "--surface", "waves", "--shafts"]
        found[target] = _choose(scene, camera, options, target=target)
        assert {"surface", "waves"} <= found[target].required.options
        assert found[target].settings["shafts"] is False
        assert "surface" not in found[target].settings
    few, many = (found[target].settings.get("bands", 8) for target in (8.0, 0.5))
    assert few < many
    assert found[0.5].required.delta_e < 0.5


def test_auto_says_that_a_camera_sees_only_sky():
    scene, _ = _scene()
    camera = scenes.add_camera((0.0, 0.0, 4.0), (math.radians(170.0), 0.0, 0.0))
    bpy.context.view_layer.update()
    with pytest.raises(InputError, match="sees only sky"):
        _choose(scene, camera, _FROM_ABOVE, target=2.0)
