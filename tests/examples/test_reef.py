"""The example reef: what it contains, that it is whole, and that a seed fixes it."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
from underwater_spectral.examples import build_scene as script
from underwater_spectral.examples.parts.shapes import Shape, box, icosphere, tube
from underwater_spectral.examples.reef.color_checker import linear_rec709, reflectances
from underwater_spectral.examples.scenes import build_scene, count_triangles
from underwater_spectral.tests.examples.built import (
    assert_materials_end_in_an_output,
    fresh,
    unread,
    world_vertices,
)

CAMERAS = {"Reef", "Up", "ColorChecker"}


@pytest.fixture(scope="module")
def reef() -> bpy.types.Scene:
    return fresh("reef", 1)


def signed_volume(shape: Shape) -> float:
    a, b, c = (shape.vertices[shape.triangles[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def test_solids_are_closed_and_face_outwards() -> None:
    assert signed_volume(box((1, 2, 3), (5, 0, 0))) == pytest.approx(6)
    assert signed_volume(icosphere(4)) == pytest.approx(4 / 3 * np.pi, rel=0.01)
    assert signed_volume(tube([(0, 0, 0), (0, 0, 1), (0, 0, 2)], 0.1, 64)) > 0


def test_size_of_the_draft(reef) -> None:
    rendered, stored = count_triangles()
    assert 25_000 < rendered < 60_000
    assert stored < rendered
    # Thickets and schools share their meshes.
    assert len(bpy.data.meshes) < 60 < 150 < len(reef.objects)


def test_no_light_no_water(reef) -> None:
    assert reef.world is None
    assert {item.type for item in reef.objects} == {"MESH", "CAMERA"}


@pytest.mark.usefixtures("reef")
def test_the_fish_school() -> None:
    fish = list(bpy.data.collections["Fish"].objects)
    assert 40 <= len(fish) <= 80
    assert all(-7 < item.matrix_world.translation.z < 0 for item in fish)


def test_cameras_are_under_water_and_above_the_sand(reef) -> None:
    assert {item.name for item in reef.objects if item.type == "CAMERA"} == CAMERAS
    assert reef.camera.name == "Reef"
    assert 4 <= -reef.camera.matrix_world.translation.z <= 5.2
    for name in CAMERAS:
        eye = bpy.data.objects[name].matrix_world.translation
        hit, point, *_ = reef.ray_cast(bpy.context.evaluated_depsgraph_get(), eye, (0, 0, -1))
        assert hit
        assert point.z < eye.z < 0


@pytest.mark.usefixtures("reef")
def test_the_floor_is_flat_at_its_rim() -> None:
    floor = world_vertices()["Seafloor"]
    x, y, z = floor.T
    rim = (np.abs(x) > 35.9) | (np.abs(y - 10) > 35.9)
    assert rim.any()
    assert z[rim] == pytest.approx(-7.0)
    assert np.ptp(x) == pytest.approx(72, rel=1e-5)
    assert z.max() < -5


@pytest.mark.usefixtures("reef")
def test_nothing_reaches_the_surface() -> None:
    assert max(points[:, 2].max() for points in world_vertices().values()) < -2


@pytest.mark.usefixtures("reef")
def test_materials_end_in_an_output() -> None:
    kinds = set()
    assert_materials_end_in_an_output()
    for material in bpy.data.materials:
        shader = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
        kinds |= {
            name
            for name in ("Metallic", "Transmission Weight", "Emission Strength")
            if shader.inputs[name].default_value > 0
        }
    assert kinds == {"Metallic", "Transmission Weight", "Emission Strength"}


@pytest.mark.usefixtures("reef")
def test_every_attribute_a_material_reads_is_on_its_meshes() -> None:
    assert unread() == []


@pytest.mark.usefixtures("reef")
def test_images_are_packed_srgb() -> None:
    images = [image for image in bpy.data.images if image.type == "IMAGE"]
    assert len(images) == 2
    assert all(image.packed_file for image in images)
    assert {image.colorspace_settings.name for image in images} == {"sRGB"}


@pytest.mark.usefixtures("reef")
def test_the_checker_carries_its_spectra() -> None:
    patches = [m for m in bpy.data.materials if "uw_reflectance" in m]
    assert len(patches) == 24
    wavelengths, spectra = reflectances()
    assert (wavelengths[0], wavelengths[-1]) == (380, 730)
    for name, spectrum in spectra.items():
        material = bpy.data.materials[f"ColorChecker {name}"]
        assert list(material["uw_reflectance_wavelengths_nm"]) == list(wavelengths)
        assert list(material["uw_reflectance"]) == list(spectrum)
        shader = material.node_tree.nodes["Principled BSDF"]
        assert shader.inputs["Roughness"].default_value == 1
        assert shader.inputs["Specular IOR Level"].default_value == 0
        color = shader.inputs["Base Color"].default_value[:3]
        assert color == pytest.approx(linear_rec709(wavelengths, spectrum), abs=1e-6)


def test_checker_colours_are_the_published_ones() -> None:
    """Neutral 5 reflects as grey, and a flat spectrum comes back as itself."""
    wavelengths, spectra = reflectances()
    flat = linear_rec709(wavelengths, np.full_like(wavelengths, 0.5))
    assert flat == pytest.approx([0.5] * 3, abs=1e-3)
    grey = linear_rec709(wavelengths, spectra["neutral 5 (.70 D)"])
    # L* = 50.9 in the chart's specification.
    assert grey == pytest.approx([0.19] * 3, abs=0.01)


def test_the_checker_camera_sees_the_whole_board(reef) -> None:
    from bpy_extras.object_utils import world_to_camera_view

    eye, board = bpy.data.objects["ColorChecker"], bpy.data.objects["ColorChecker board"]
    patches = [face.center for face in board.data.polygons if face.material_index > 1]
    assert len(patches) == 24 * 12
    seen = np.array([world_to_camera_view(reef, eye, board.matrix_world @ p) for p in patches])
    assert ((seen[:, :2] > 0) & (seen[:, :2] < 1)).all()
    assert np.ptp(seen[:, 1]) > 0.6


def test_unknown_detail_and_negative_seed() -> None:
    with pytest.raises(ValueError, match="unknown detail 'fine'; known: draft, panel, full"):
        build_scene("reef", 1, "fine")
    with pytest.raises(ValueError, match="must not be negative"):
        build_scene("reef", -1, "draft")


def test_script_saves_a_whole_file(tmp_path, capsys) -> None:
    target = tmp_path / "new" / "reef.blend"
    script.main(["reef", str(target), "--detail", "draft", "--seed", "1"])
    assert [path.name for path in target.parent.iterdir()] == ["reef.blend"]
    first = world_vertices()
    assert "triangles rendered" in capsys.readouterr().out
    bpy.ops.wm.open_mainfile(filepath=str(target))
    again = world_vertices()
    assert first.keys() == again.keys()
    assert all(np.array_equal(first[name], again[name]) for name in first)


@pytest.mark.slow
def test_a_seed_fixes_the_scene() -> None:
    fresh("reef", 3)
    first = world_vertices()
    fresh("reef", 3)
    again = world_vertices()
    assert first.keys() == again.keys()
    assert all(np.array_equal(first[name], again[name]) for name in first)
    fresh("reef", 4)
    assert not np.array_equal(first["Bommie distant"], world_vertices()["Bommie distant"])


def test_unknown_scene() -> None:
    with pytest.raises(ValueError, match="unknown scene 'lake'; known: reef, wreck, cave"):
        build_scene("lake")
