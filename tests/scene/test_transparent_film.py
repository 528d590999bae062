"""With a transparent film, pictures have alpha where there is no open water."""

from __future__ import annotations

import json
from pathlib import Path

import bpy
import numpy as np
import OpenImageIO as oiio
import pytest
from underwater_spectral.jobs import batch
from underwater_spectral.scene import view_transform
from underwater_spectral.scene.viewport import live
from underwater_spectral.tests.scene import scenes
from underwater_spectral.uw_spectral.imaging.matte import without_open_water
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.uw_spectral.spectra.tone import AGX, MEDIUM, STANDARD

pytestmark = pytest.mark.usefixtures("registered")

JOB = ["--resolution", "32", "18", "--phase", "hg:0.8", "--no-scene-floor", "--exposure", "0"]
REALTIME = ["--engine", "eevee", "--mode", "realtime", "--samples", "32", "--bands", "3"]
CYCLES = ["--engine", "cycles", "--bands", "3", "--samples", "64"]
NOTE = "the transparent film is not supported"


def _scene() -> bpy.types.Scene:
    """A wall that fills the middle of the picture."""
    scene = bpy.context.scene
    scenes.add_camera((0.0, 0.0, -3.0), (np.pi / 2, 0.0, 0.0))
    bpy.ops.mesh.primitive_plane_add(size=0.6, location=(0.0, 2.0, -3.0), rotation=(1.57, 0.3, 0.0))
    bpy.context.object.data.materials.append(scenes.principled("Wall", (0.6, 0.4, 0.2, 1.0)))
    return scene


def _rendered(tmp_path: Path, name: str, *options: str, film: bool) -> Path:
    path, out = tmp_path / f"{name}.blend", tmp_path / name
    bpy.context.scene.render.film_transparent = film
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    done = batch.main([str(path), *JOB, *options, "--out", str(out)], inside_blender=False)
    assert done == 0
    bpy.ops.wm.open_mainfile(filepath=str(path))
    return out


@pytest.mark.slow
@pytest.mark.parametrize("options", [REALTIME, CYCLES])
def test_open_water_is_left_out_and_what_stands_before_it_is_not(options, tmp_path):
    _scene()
    whole, film = (_rendered(tmp_path, str(on), *options, film=on) for on in (False, True))
    opaque, image = (read_exr(out / "0001.exr")[0] for out in (whole, film))
    colours, alpha = image[..., :3], image[..., 3]
    item, water = alpha > 0.999, alpha == 0.0
    assert 50 < item.sum() < 200 < water.sum()
    # The scatter before the wall stays.
    np.testing.assert_allclose(colours[item], opaque[item], rtol=1e-4)
    assert not colours[water].any()
    # At the edge, the water beside the wall is taken away: what is left has the wall's colour.
    edge = ~(item | water)
    assert edge.sum() > 10
    left = colours[edge].sum(axis=0) / alpha[edge].sum()
    np.testing.assert_allclose(left, opaque[item].mean(axis=0), rtol=0.15)
    assert (opaque[water].mean(axis=0) > 1.5 * opaque[item].mean(axis=0)).any()
    shown = oiio.ImageBuf(str(film / "0001.png")).get_pixels(oiio.UINT8)
    np.testing.assert_allclose(shown[..., 3], 255.0 * alpha, atol=0.51)
    plain = oiio.ImageBuf(str(whole / "0001.png")).get_pixels(oiio.UINT8)
    np.testing.assert_allclose(shown[item][:, :3], plain[item], atol=1.0)
    assert not _said(film)


def _said(out: Path) -> list[str]:
    return [n for n in json.loads((out / "0001.json").read_text())["notes"] if NOTE in n]


@pytest.mark.parametrize(
    ("options", "height", "why"),
    [(["--housing", "flat"], -3.0, "port"), (["--surface", "flat"], 1.0, "above the water")],
)
def test_where_there_is_no_alpha_it_is_said(options, height, why, tmp_path):
    scene = _scene()
    scene.camera.location.z = height
    out = _rendered(tmp_path, "film", *CYCLES[:-1], "1", *options, film=True)
    (note,) = _said(out)
    assert why in note
    assert read_exr(out / "0001.exr")[0].shape[2] == 3


@pytest.mark.parametrize("tone", [STANDARD, AGX])
def test_a_png_is_not_multiplied_by_alpha(tone, tmp_path):
    colours = np.random.default_rng(1).uniform(0.05, 0.9, (4, 6, 3)).astype(np.float32)
    alpha = np.linspace(0.2, 1.0, 24, dtype=np.float32).reshape(4, 6, 1)
    for name, image in (
        ("plain", colours), ("film", np.concatenate([colours * alpha, alpha], axis=-1)),
    ):  # fmt: skip
        view_transform.write_shown(tmp_path / f"{name}.png", image, tone, MEDIUM)
    plain, film = (
        oiio.ImageInput.open(str(tmp_path / f"{name}.png")) for name in ("plain", "film")
    )
    raw = oiio.ImageSpec()
    raw.attribute("oiio:UnassociatedAlpha", 1)
    film = oiio.ImageInput.open(str(tmp_path / "film.png"), raw)
    shown, expected = film.read_image("uint8"), plain.read_image("uint8")
    np.testing.assert_allclose(shown[..., 3:], np.round(255 * alpha), atol=1.0)
    np.testing.assert_allclose(shown[..., :3], expected[..., :3], atol=1.0)


def test_a_pane_before_nothing_but_itself_keeps_its_share():
    """Without open water anywhere, what is behind is taken to be as what is seen."""
    picture, alpha = np.full((3, 3, 3), 0.4), np.full((3, 3), 0.25)
    image = without_open_water(picture, alpha)
    np.testing.assert_allclose(image[..., :3], 0.1, rtol=1e-6)
    np.testing.assert_allclose(image[..., 3], 0.25)


@pytest.mark.slow
def test_live_water_leaves_the_film_to_blender():
    scene = _scene()
    scene.render.film_transparent = True
    live.add(scene)
    assert scene.render.film_transparent
    live.remove(scene)
    assert scene.render.film_transparent
