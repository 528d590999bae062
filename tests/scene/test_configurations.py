"""Under the ACES configuration of OpenColorIO, which has other names for nearly everything."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import OpenImageIO as oiio
import pytest
import rawpy
from underwater_spectral.jobs import batch
from underwater_spectral.scene import colour_space, view_transform
from underwater_spectral.tests.scene import scenes
from underwater_spectral.uw_spectral.errors import InputError

pytestmark = pytest.mark.usefixtures("registered")

ROOT = Path(__file__).resolve().parents[2]
ACES = "ocio://cg-config-v1.0.0_aces-v1.3_ocio-v2.1"
SIZE = (32, 18)
FAST = ["--samples", "1", "--resolution", *map(str, SIZE), "--phase", "hg:0.8", "--no-scene-floor"]
SPEC = """
title = "Walls"
licence = "CC0-1.0"
[water]
name = ["jerlov:IB"]
[scene]
file = "scene.blend"
depth = 1.5
[render]
engine = "cycles"
samples = 2
bands = 3
phase = "hg:0.8"
[[camera]]
name = "probe"
width = 64
height = 36
focal = [60, 60]
centre = [32, 18]
sensor = "Nikon D7000"
[[poses]]
name = "one"
kind = "orbit"
target = [0, 3, -3]
radius = 3
elevation = 5
start = -90
arc = 10
count = 1
[[rig]]
name = "sun alone"
[detector]
pattern = "GRBG"
[splits]
train = 1
val = 0
test = 0
"""
LIVE = """
import runpy, sys
runpy.run_path(r"{root}/tools/load_checkout.py")["load"]()
import bpy
from underwater_spectral import registration
from underwater_spectral.scene import colour_space
from underwater_spectral.scene.viewport import live
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
colour_space.bring_images()
registration.register()
scene = bpy.context.scene
scene.underwater.diffuse_shadows = False
scene.eevee.taa_render_samples = 1
scene.render.resolution_x, scene.render.resolution_y = 32, 18
live.add(scene)
for kind, name in (("OPEN_EXR", "0001.exr"), ("PNG", "0001.png")):
    scene.render.image_settings.file_format = kind
    scene.render.image_settings.color_mode = "RGB"
    scene.render.filepath = sys.argv[2] + "/" + name
    bpy.ops.render.render(write_still=True)
live.remove(scene)
"""


def _saved(path: Path) -> None:
    """Walls of a colour, of a texture, and of one that only turns its normals."""
    scene = scenes.bpy.context.scene
    scenes.add_camera((0.0, 0.0, -3.0), (np.pi / 2, 0.0, 0.0))
    bumpy = scenes.principled("Bumpy", (0.0, 0.0, 1.0, 1.0))
    tree = bumpy.node_tree
    texture, turned = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeNormalMap")
    texture.image = bpy.data.images.new("turns", 4, 4)
    texture.image.generated_color = (0.6, 0.5, 0.9, 1.0)
    texture.image.colorspace_settings.is_data = True
    tree.links.new(texture.outputs["Color"], turned.inputs["Color"])
    tree.links.new(turned.outputs[0], tree.nodes["Principled BSDF"].inputs["Normal"])
    plain = scenes.textured()
    drawn = plain.node_tree.nodes["Image Texture"].image
    drawn.generated_type, drawn.generated_color = "BLANK", (0.6, 0.3, 0.1, 1.0)
    for place, material in ((-1.0, bumpy), (1.0, plain)):
        wall = scenes._cube(material.name, (place, 3.0, -3.0))
        wall.scale.y = 0.1
        wall.data.uv_layers.new()
        wall.data.materials.append(material)
    scene.eevee.shadow_pool_size = "128"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def _in_both(command: list[object], out: Path) -> list[Path]:
    """Run a command with Blender's own colours and with those of ACES; it gets its folder."""
    folders = []
    for config in ("", ACES):
        folder = out / (config[-4:] or "plain")
        folder.mkdir()
        environment = {name: text for name, text in os.environ.items() if name != "OCIO"}
        environment |= {"OCIO": config} if config else {}
        whole = [str(part) for part in (sys.executable, *command, folder)]
        done = subprocess.run(whole, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
        said = "does not know the spaces" in done.stdout + done.stderr
        assert said == (bool(config) and "render_bands" in whole[1])
        folders.append(folder)
    return folders


def _same(folders: list[Path], name: str, tolerance: float = 0.01) -> None:
    plain, aces = (oiio.ImageBuf(str(folder / name)) for folder in folders)
    one, other = (image.get_pixels(oiio.FLOAT) for image in (plain, aces))
    brightest = float(one[np.isfinite(one)].max())
    assert brightest > 0.01
    # Eight bits round to one code or its neighbour.
    least = 1.5 / 255 if name.endswith(".png") else 1e-3 * brightest
    np.testing.assert_allclose(other, one, rtol=tolerance, atol=least)
    for word in ("chromaticities", "oiio:ColorSpace", "colorInteropID"):
        assert aces.spec().get(word) == plain.spec().get(word)


JOBS = {
    "cycles": ["--engine", "cycles", "--bands", "6", "--layers", "J,albedo,range"],
    "bands": ["--engine", "eevee", "--mode", "bands", "--bands", "3"],
    "realtime": ["--engine", "eevee", "--mode", "realtime"],
}


@pytest.mark.slow
@pytest.mark.parametrize(
    "kind", ["cycles", *(pytest.param(k, marks=pytest.mark.slow) for k in ("bands", "realtime"))]
)
def test_a_job_renders_the_same(kind, tmp_path):
    _saved(tmp_path / "scene.blend")
    job = [ROOT / "render_bands.py", tmp_path / "scene.blend", *FAST, *JOBS[kind]]
    job += [] if kind == "cycles" else ["--no-diffuse-shadows"]
    folders = _in_both([*job, "--out"], tmp_path)
    for name in ("0001.exr", "0001.png"):
        _same(folders, name)
    if kind != "realtime":
        _same(folders, "0001_spectral.exr")


@pytest.mark.slow
def test_a_data_set_is_the_same_to_its_raw_pictures(tmp_path):
    _saved(tmp_path / "scene.blend")
    (tmp_path / "set.toml").write_text(SPEC)
    job = [ROOT / "render_bands.py", "--dataset", tmp_path / "set.toml", "--out"]
    folders = _in_both(job, tmp_path)
    raw, *others = ("raw/*.dng", "images/*.png", "linear/*.exr", "jobs/*/*_spectral.exr")
    for pattern in others:
        (found,) = folders[0].glob(pattern)
        _same(folders, str(found.relative_to(folders[0])))
    plain, aces = (rawpy.imread(str(next(folder.glob(raw)))).raw_image for folder in folders)
    assert plain.std() > 10
    np.testing.assert_allclose(aces, plain, atol=1)


@pytest.mark.slow
def test_live_water_is_the_same(tmp_path):
    _saved(tmp_path / "scene.blend")
    script = tmp_path / "live.py"
    script.write_text(LIVE.format(root=ROOT))
    folders = _in_both([script, tmp_path / "scene.blend"], tmp_path)
    for name in ("0001.exr", "0001.png"):
        _same(folders, name)


def test_a_tone_that_it_lacks_is_refused_before_anything_is_rendered(tmp_path, monkeypatch):
    _saved(tmp_path / "scene.blend")
    known = view_transform._take

    def lacks(owner, name, words, what):
        known(owner, name, [word for word in words if word != "AgX"], what)

    monkeypatch.setattr(view_transform, "_take", lacks)
    job = [str(tmp_path / "scene.blend"), *FAST, *JOBS["cycles"], "--out", str(tmp_path / "out")]
    assert batch.main([*job, "--tone", "agx"], inside_blender=False) == 2
    assert not list(tmp_path.rglob("*.exr"))
    assert not bpy.data.scenes.get("UW Picture")
    assert batch.main(job, inside_blender=False) == 0


def test_a_view_that_another_configuration_had_is_left_behind():
    view = bpy.context.scene.view_settings
    kept = view_transform.saved_view(view)
    view_transform.show(view, "standard", "medium")
    view_transform.give_back(view, {**kept, "view_transform": "ACES 1.0 - SDR Video"})
    assert view.view_transform == "Standard"
    view_transform.give_back(view, kept)
    assert view.view_transform == kept["view_transform"]


def test_only_what_turns_normals_is_numbers(tmp_path, monkeypatch):
    """As if no name of a space were known."""
    _saved(tmp_path / "scene.blend")
    monkeypatch.setattr(colour_space, "images_without_space", lambda: list(bpy.data.images))
    floats = bpy.data.images.new("floats", 2, 2, float_buffer=True)
    said = colour_space.bring_images()
    names = {image.name: image.colorspace_settings.name for image in bpy.data.images}
    assert (names["checker"], names["turns"]) == ("sRGB", "Non-Color")
    assert floats.colorspace_settings.name == "Linear Rec.709"
    assert "'checker'" in said
    monkeypatch.setattr(colour_space, "_ENCODED", re.compile("none"))
    with pytest.raises(InputError, match="unset OCIO"):
        colour_space.bring_images()
