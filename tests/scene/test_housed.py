"""Pictures through ports: where objects are, what they weigh, and what is refused."""

from __future__ import annotations

import json
import math

import bpy
import numpy as np
import pytest
from underwater_spectral.datasets.layer_file import camera_of, read_layers
from underwater_spectral.jobs import batch
from underwater_spectral.scene import stored_settings
from underwater_spectral.scene.readers import port_eye
from underwater_spectral.tests.scene import scenes
from underwater_spectral.uw_spectral.housing import HousingDescription
from underwater_spectral.uw_spectral.spectra.spectral_image import read_spectral_exr

DEPTH, SIZE = 5.0, (160, 90)
# In OpenCV's axes of the camera, m: near and far, in the middle and towards corners.
PLACES = ((0.02, -0.01, 0.6), (0.32, 0.16, 1.0), (-0.9, -0.45, 2.5), (-0.55, 0.3, 1.6))
PORTS = {
    "flat": HousingDescription("flat", distance=40.0),
    "tilted": HousingDescription("flat", tilt=8.0, towards=60.0),
    "dome": HousingDescription("dome", radius=60.0, forward=12.0, lens="brown:-0.12,0.03"),
}
OPTIONS = {
    "flat": ["--housing", "flat", "--port-distance", "40"],
    "tilted": ["--housing", "flat", "--port-tilt", "8", "--port-tilt-towards", "60"],
    "dome": [
        *("--housing", "dome", "--dome-radius", "60", "--dome-forward", "12"),
        *("--lens", "brown:-0.12,0.03"),
    ],
}


def _camera():
    """A turned camera on a scaled parent: what hangs on it must not be scaled."""
    camera = scenes.add_camera((0.3, -0.2, -DEPTH), (math.radians(80), 0.0, math.radians(25)))
    camera.scale = (2.0, 2.0, 2.0)
    camera.data.lens = 24.0
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y = SIZE
    bpy.context.view_layer.update()
    return camera


def _ball(camera, place, radius, material):
    x, y, z = place
    turn = camera.matrix_world.to_3x3().normalized()
    at = camera.matrix_world.translation + turn @ type(camera.location)((x, -y, -z))
    bpy.ops.mesh.primitive_uv_sphere_add(radius=radius, location=at, segments=48, ring_count=24)
    bpy.context.object.data.materials.append(material)
    bpy.ops.object.shade_smooth()


@pytest.fixture
def balls(properties, tmp_path):
    """Bright balls before the camera, at PLACES."""
    camera, light = _camera(), scenes.glow(30.0)
    for place in PLACES:
        _ball(camera, place, 0.012 * place[2], light)
    path = tmp_path / "balls.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def _run(*arguments):
    return batch.main([str(a) for a in arguments], inside_blender=False)


def _rendered(blend, out, *options):
    size = ("--resolution", *SIZE, "--wavelengths", "450,550,650")
    assert _run(blend, *size, *options, "--out", out) == 0
    return read_spectral_exr(out / "0001_spectral.exr")[0].astype(np.float64)


def _middles(image, expected):
    """Middles of the light around places in a picture, x and y in pixels."""
    found = []
    for x, y in expected:
        left, top = round(x) - 9, round(y) - 9
        part = np.maximum(image[top : top + 18, left : left + 18] - 0.05, 0.0)
        rows, columns = np.indices(part.shape) + 0.5
        total = part.sum()
        found.append((left + (columns * part).sum() / total, top + (rows * part).sum() / total))
    return np.array(found)


def _housing(name):
    scene = bpy.context.scene
    camera = port_eye.lens_camera(scene, scene.camera)
    return PORTS[name].measured().before(camera, PORTS[name].water(DEPTH))


# Of a pixel. Cycles' rays are exact; edges that EEVEE has smoothed move as the nearer side does.
NEAR = {"eevee": 0.2, "cycles": 0.1}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("port", "engine"),
    [
        ("tilted", "cycles"),
        ("dome", "cycles"),
        pytest.param("flat", "cycles", marks=pytest.mark.slow),
    ]
    + [pytest.param(port, "eevee", marks=pytest.mark.slow) for port in PORTS],
)
def test_objects_are_where_the_port_shows_them(balls, tmp_path, port, engine):
    samples = ("--samples", 64, "--water", "jerlov:I", "--engine", engine)
    image = _rendered(balls, tmp_path / "out", *samples, *OPTIONS[port], "--no-denoise")
    housing = _housing(port)
    shift = []
    for band, nm in enumerate((450.0, 550.0, 650.0)):
        expected = housing.project(np.array(PLACES), nm)
        missed = _middles(image[..., band], expected) - expected
        assert np.abs(missed).max() < NEAR[engine], f"{nm} nm: {missed}"
        shift.append(expected)
    # Bands do lie apart, or nothing was shown by this.
    if port != "dome":
        assert np.abs(shift[2] - shift[0]).max() > 0.3


@pytest.mark.parametrize("engine", [pytest.param("eevee", marks=pytest.mark.slow), "cycles"])
def test_water_begins_at_the_port(properties, tmp_path, engine):
    """In water that only absorbs, light is left by the way from the port on."""
    camera = _camera()
    scenes.wall("wall", (0.0, 0.0, 0.0), 20.0)
    wall = bpy.context.object
    wall.data.materials.clear()
    wall.data.materials.append(scenes.glow(1.0))
    wall.parent, wall.location = camera, (0.0, 0.0, -0.5)
    wall.scale = (0.5, 0.5, 0.5)
    wall.rotation_euler = (0.0, 0.0, 0.0)
    camera.scale = (1.0, 1.0, 1.0)
    path = tmp_path / "wall.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    still = ("--water", "jerlov:3C", "--scattering-factor", 0, "--absorption-factor", 4)
    still += ("--samples", 4, "--engine", engine, "--no-denoise", "--no-scene-floor")
    with_port = _rendered(path, tmp_path / "port", *still, *OPTIONS["flat"])
    without = _rendered(path, tmp_path / "none", *still)
    absorption = np.array(
        json.loads((tmp_path / "port" / "0001.json").read_text())["bands"]["absorption_per_m"]
    )
    housing = _housing("flat")
    for band, nm in enumerate((450.0, 550.0, 650.0)):
        pixels = np.array([[80.5, 45.5], [30.5, 20.5], [140.5, 70.5]])
        origins, w = housing.ray_in_water(pixels, nm)
        far = (0.5 - origins[:, 2]) / w[:, 2]
        passed = housing.transmittance(pixels, nm)
        straight = 0.5 * np.linalg.norm(housing.camera.directions(pixels), axis=-1)
        straight = 0.5 / housing.camera.directions(pixels)[:, 2]
        x, y = pixels.astype(int).T
        ratio = with_port[y, x, band] / without[y, x, band]
        expected = passed * np.exp(-absorption[band] * (far - straight))
        # Without the distance of the port, which is 48 mm, this would be 6 to 20 % more.
        assert ratio == pytest.approx(expected, rel=0.015)


@pytest.mark.slow
@pytest.mark.parametrize("port", ["tilted", "dome"])
def test_truth_lies_where_the_picture_shows_it(properties, tmp_path, port):
    camera = _camera()
    bpy.ops.mesh.primitive_plane_add(size=60.0, location=(0.0, 0.0, -7.0))
    for place in PLACES:
        _ball(camera, place, 0.1 * place[2], scenes.principled(f"ball {place}"))
    path = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    layers = ("--layers", "range,position,instance,normal,motion,T", "--samples", 2)
    pose = np.array(camera.matrix_world)
    turn, at = pose[:3, :3] / np.linalg.norm(pose[:3, :3], axis=0), pose[:3, 3]
    _rendered(path, tmp_path / "out", "--engine", "eevee", *layers, *OPTIONS[port])
    found = read_layers(tmp_path / "out" / "0001_layers.exr")
    housing, pixels = _housing(port), _housing(port).camera.pixel_centres()
    there = np.isfinite(found["range"])
    assert there.mean() > 0.5
    points = (found["position"] - at) @ turn
    seen = housing.project(points * (1.0, -1.0, -1.0), 550.0)
    assert np.abs((seen - pixels)[there]).max() < 0.01
    # What the layers say of the camera is the pinhole that fits best.
    pinhole, where = camera_of(found.header)
    offsets = (found["position"] - where[:3, 3]) @ where[:3, :3] * (1.0, -1.0, -1.0)
    missed = np.linalg.norm(pinhole.project(offsets) - pixels, axis=-1)[there]
    stated = found.header["camera"]["error_pixels"]
    assert np.sqrt(np.mean(missed**2)) < max(1.5 * stated, 0.02)
    assert np.linalg.norm(offsets, axis=-1)[there] == pytest.approx(found["range"][there], rel=1e-3)
    # Numbers of objects are those of the places' own.
    ids = {name: number for number, name in found.instances.items()}
    x, y = np.floor(housing.project(np.array([PLACES[0]]), 550.0)[0]).astype(int)
    assert found["instance"][y, x] == ids["Sphere"]
    assert len(found.header["housing"]["cameras_in_water"]) == 3


@pytest.mark.parametrize(
    ("options", "why"),
    [
        (["--housing", "round"], "not one of none, flat, dome"),
        (["--housing", "dome", "--dome-forward", "95"], "not inside the inner face"),
        (["--housing", "file:nowhere.json"], "nowhere.json"),
        (["--housing", "flat", "--lens", "brown:a"], "neither brown"),
        (["--lens", "fisheye:1,2,3,4,5"], "4 coefficients at most"),
        (["--housing", "flat", "--port-distance", "0"], "outside"),
    ],
)
def test_what_is_no_port_is_refused_before_anything_is_rendered(
    balls, tmp_path, capsys, options, why
):
    assert _run(balls, "--samples", 1, *options, "--out", tmp_path / "out") == 2
    assert why in capsys.readouterr().err
    assert not list(tmp_path.glob("out/*.png"))


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (lambda camera: setattr(camera, "location", (0.0, 0.0, 1.0)), "under water only"),
        (lambda camera: setattr(camera.data, "type", "ORTHO"), "perspective camera"),
    ],
)
def test_a_port_needs_a_perspective_camera_under_water(properties, tmp_path, capsys, change, why):
    change(_camera())
    path = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    assert _run(path, *OPTIONS["flat"], "--samples", 1, "--out", tmp_path / "out") == 2
    assert why in capsys.readouterr().err


@pytest.mark.slow
def test_a_file_decides_port_lens_and_camera(balls, tmp_path):
    table = {
        "port": {"kind": "flat", "distance_mm": 40.0, "thickness_mm": 8.0},
        "camera": {"width": 320, "height": 180, "fx": 220.0, "fy": 220.0, "cx": 170.0, "cy": 88.0},
        "source": "calibrated in a tank",
    }
    path = tmp_path / "rov.json"
    path.write_text(json.dumps(table))
    options = ("--samples", 64, "--water", "jerlov:I", "--engine", "cycles", "--no-denoise")
    image = _rendered(balls, tmp_path / "out", *options, "--housing", f"file:{path}")
    description = HousingDescription(f"file:{path}")
    scene = bpy.context.scene
    camera = port_eye.lens_camera(scene, scene.camera)
    housing = description.measured().before(camera, description.water(DEPTH))
    assert (housing.camera.fx, housing.camera.cx) == (110.0, 85.0)
    expected = housing.project(np.array(PLACES), 550.0)
    assert np.abs(_middles(image[..., 1], expected) - expected).max() < NEAR["cycles"]
    record = json.loads((tmp_path / "out" / "0001.json").read_text())
    assert any("in water the picture is that of a camera of" in note for note in record["notes"])


def test_nothing_is_left_in_the_scene(balls, tmp_path):
    before = sorted(item.name for item in bpy.data.objects), len(bpy.data.cameras)
    stored = stored_settings.stored_settings(bpy.context.scene)
    _rendered(balls, tmp_path / "out", "--samples", 1, "--engine", "eevee", *OPTIONS["flat"])
    assert (sorted(item.name for item in bpy.data.objects), len(bpy.data.cameras)) == before
    assert stored_settings.stored_settings(bpy.context.scene) == stored
