"""A render region shows what the whole picture shows there, and nothing elsewhere."""

from __future__ import annotations

import json
from pathlib import Path

import bpy
import numpy as np
import OpenImageIO as oiio
import pytest
from underwater_spectral.datasets.layer_file import camera_of, read_layers
from underwater_spectral.jobs import batch, render_region
from underwater_spectral.scene.viewport import live
from underwater_spectral.tests.scene import scenes
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr, read_spectral_exr

pytestmark = pytest.mark.usefixtures("registered")

WIDTH, HEIGHT = 32, 18
JOB = ["--resolution", str(WIDTH), str(HEIGHT), "--phase", "hg:0.8", "--no-scene-floor"]
REALTIME = ["--engine", "eevee", "--mode", "realtime", "--samples", "16", "--bands", "4"]
BANDS = ["--engine", "eevee", "--mode", "bands", "--samples", "16", "--bands", "3"]
CYCLES = ["--engine", "cycles", "--bands", "3", "--samples", "64"]
# By Blender's rounding: columns 8 to 19, and rows 4 to 12 from the top.
SIDES = {"min_x": 0.26, "max_x": 0.63, "min_y": 0.29, "max_y": 0.8}
ROWS, COLUMNS = slice(4, 13), slice(8, 20)


def _scene() -> bpy.types.Scene:
    """A tilted wall that ends in the region, and a lamp."""
    scene = bpy.context.scene
    scenes.add_camera((0.0, 0.0, -3.0), (np.pi / 2, 0.0, 0.0))
    bpy.ops.mesh.primitive_plane_add(size=2.0, location=(0.5, 2.0, -3.4), rotation=(1.2, 0.0, 0.3))
    bpy.context.object.data.materials.append(scenes.principled("Wall", (0.6, 0.4, 0.2, 1.0)))
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    lamp.location, lamp.data.energy = (0.2, 0.8, -2.6), 20.0
    scene.collection.objects.link(lamp)
    return scene


def _ask(scene: bpy.types.Scene, *, crop: bool) -> None:
    scene.render.use_border, scene.render.use_crop_to_border = True, crop
    for name, value in SIDES.items():
        setattr(scene.render, f"border_{name}", value)


def _rendered(tmp_path: Path, name: str, *options: str) -> Path:
    path, out = tmp_path / f"{name}.blend", tmp_path / name
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    done = batch.main([str(path), *JOB, *options, "--out", str(out)], inside_blender=False)
    assert done == 0
    bpy.ops.wm.open_mainfile(filepath=str(path))
    return out


def _near(region: np.ndarray, whole: np.ndarray, *, noise: float = 0.01) -> None:
    """A mean difference: pixels have the noise that they have in the whole picture, nearly."""
    assert whole.mean() > 0.02
    assert np.abs(region - whole).mean() < noise * whole.mean()


@pytest.mark.slow
@pytest.mark.parametrize("options", [REALTIME, BANDS, [*CYCLES, "--no-denoise"]])
def test_the_region_shows_what_the_whole_picture_shows_there(options, tmp_path):
    _scene()
    whole = _rendered(tmp_path, "whole", *options)
    _ask(bpy.context.scene, crop=False)
    part = _rendered(tmp_path, "region", *options)
    expected, image = (read_exr(out / "0001.exr")[0] for out in (whole, part))
    inside = np.zeros((HEIGHT, WIDTH), dtype=bool)
    inside[ROWS, COLUMNS] = True
    assert image.shape == (HEIGHT, WIDTH, 4)
    np.testing.assert_array_equal(image[..., 3], inside)
    assert not image[~inside].any()
    _near(image[inside][:, :3], expected[inside])
    shown = oiio.ImageBuf(str(part / "0001.png")).get_pixels(oiio.UINT8)
    np.testing.assert_array_equal(shown[..., 3], 255 * inside)
    assert not any("region" in note for note in _record(part)["notes"])
    if "realtime" not in options:
        bands = read_spectral_exr(part / "0001_spectral.exr")[0]
        assert not bands[~inside].any()
        _near(bands[inside], read_spectral_exr(whole / "0001_spectral.exr")[0][inside])


@pytest.mark.slow
@pytest.mark.parametrize("layers", [[], ["--layers", "range"]], ids=["traced", "moved"])
def test_a_region_behind_a_port_is_that_of_the_picture_that_it_shows(layers, tmp_path):
    """Not of the pinhole picture that is moved; rays of the port are traced in it alone."""
    _scene()
    options = [*CYCLES, "--no-denoise", "--housing", "flat", *layers]
    whole = _rendered(tmp_path, "whole", *options)
    _ask(bpy.context.scene, crop=False)
    part = _rendered(tmp_path, "region", *options)
    expected, image = (read_exr(out / "0001.exr")[0] for out in (whole, part))
    _near(image[ROWS, COLUMNS, :3], expected[ROWS, COLUMNS])
    assert not image[: ROWS.start].any()
    for name in ("range",) if layers else ():
        found, there = (read_layers(out / "0001_layers.exr")[name] for out in (part, whole))
        np.testing.assert_allclose(found[ROWS, COLUMNS], there[ROWS, COLUMNS], rtol=1e-3)
        assert not found[: ROWS.start].any()


def _record(out: Path) -> dict:
    return json.loads((out / "0001.json").read_text())


@pytest.mark.slow
def test_a_crop_is_the_region_alone_with_its_own_camera_and_layers(tmp_path):
    _scene()
    options = [*CYCLES, "--layers", "range,albedo,position", "--raw", "tiff"]
    whole = _rendered(tmp_path, "whole", *options)
    _ask(bpy.context.scene, crop=True)
    part = _rendered(tmp_path, "crop", *options)
    expected, image = (read_exr(out / "0001.exr")[0] for out in (whole, part))
    assert image.shape == (9, 12, 3)
    # What is denoised alone has less around it.
    _near(image, expected[ROWS, COLUMNS], noise=0.1)
    assert oiio.ImageBuf(str(part / "0001.png")).get_pixels(oiio.UINT8).shape == (9, 12, 3)
    assert oiio.ImageBuf(str(part / "0001.tiff")).spec().width == 12
    layers, cut = (read_layers(out / "0001_layers.exr") for out in (whole, part))
    for name in ("range", "position"):
        np.testing.assert_allclose(cut[name], layers[name][ROWS, COLUMNS], rtol=1e-3, atol=1e-3)
    (camera, _), (small, _) = (camera_of(found.header) for found in (layers, cut))
    assert (small.width, small.height) == (12, 9)
    np.testing.assert_allclose(small.rays(), camera.rays()[ROWS, COLUMNS], atol=1e-6)
    assert _record(part)["job"]["region"] == {"left": 8, "top": 4, "right": 20, "bottom": 13}


@pytest.mark.parametrize("crop", [False, True])
def test_blender_rounds_a_region_so(crop, tmp_path):
    """Its own render of the world, without water."""
    scene = bpy.context.scene
    scenes.add_camera()
    scene.world = bpy.data.worlds.new("White")
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_mode = "RGBA"
    generator = np.random.default_rng(3)
    for number in range(4):
        x, y = np.sort(generator.uniform(size=2)), np.sort(generator.uniform(size=2))
        _ask(scene, crop=crop)
        render = scene.render
        render.border_min_x, render.border_max_x = x
        render.border_min_y, render.border_max_y = y
        region = render_region.region_of(scene)
        if number % 2:  # as a job asks for it
            for owner, name, value in render_region.wanted_settings(scene, region, (WIDTH, HEIGHT)):
                if name != "use_crop_to_border":
                    setattr(owner, name, value)
        render.filepath = str(tmp_path / f"{number}.exr")
        bpy.ops.render.render(write_still=True)
        there = read_exr(render.filepath)[0][..., 3] > 0
        if crop:
            assert there.shape == (region.bottom - region.top, region.right - region.left)
            assert there.all()
        else:
            expected = region.placed(np.ones_like(region.cut(there)), (WIDTH, HEIGHT))
            np.testing.assert_array_equal(there, expected)


def test_an_empty_region_is_refused():
    scene = bpy.context.scene
    _ask(scene, crop=False)
    scene.render.border_max_x = scene.render.border_min_x
    with pytest.raises(InputError, match="empty"):
        render_region.region_of(scene)


@pytest.mark.slow
def test_live_water_leaves_region_to_blender():
    scene = _scene()
    _ask(scene, crop=True)
    live.add(scene)
    assert scene.render.use_border
    assert scene.render.use_crop_to_border
    live.remove(scene)
    assert scene.render.use_border
