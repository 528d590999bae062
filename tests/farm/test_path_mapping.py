"""Paths of the artist's machine are found on a worker, by the rules of its session."""

from __future__ import annotations

import json
from pathlib import Path

import bpy
import pytest
from underwater_spectral.scene.path_mapping import PathMapping, apply_to_scene, read_path_mapping
from underwater_spectral.scene.settings import SceneSettings
from underwater_spectral.uw_spectral.errors import InputError


def _rules(folder: Path, *rules: tuple[str, str, str]) -> PathMapping:
    names = ("source_path_format", "source_path", "destination_path")
    listed = [dict(zip(names, rule, strict=True)) for rule in rules]
    path = folder / "rules.json"
    path.write_text(json.dumps({"version": "pathmapping-1.0", "path_mapping_rules": listed}))
    return read_path_mapping(path)


def test_the_first_rule_that_fits_applies(tmp_path):
    mapping = _rules(
        tmp_path,
        ("POSIX", "/home/me/reef/textures", "/mnt/t"),
        ("POSIX", "/home/me/reef", "/mnt/r"),
        ("WINDOWS", "P:\\reef", "/mnt/p"),
        ("URI", "s3://bucket/reef", "/mnt/u"),
    )
    assert mapping.apply("/home/me/reef/textures/a/b.png") == "/mnt/t/a/b.png"
    assert mapping.apply("/home/me/reef/a.png") == "/mnt/r/a.png"
    assert mapping.apply("/home/me/reefs/a.png") == "/home/me/reefs/a.png"
    assert mapping.apply("p:\\Reef\\a b.png") == "/mnt/p/a b.png"
    assert mapping.apply("//a.png") == "//a.png"


def test_tables_of_the_settings_are_mapped(tmp_path):
    mapping = _rules(tmp_path, ("POSIX", "/home/me", "/mnt"))
    settings = SceneSettings(
        water="file:/home/me/water.csv", sensor="file:/home/me/cameras.txt#D90", illuminant="d65"
    )
    mapped = mapping.apply_to_settings(settings)
    assert (mapped.water, mapped.illuminant) == ("file:/mnt/water.csv", "d65")
    assert mapped.sensor == "file:/mnt/cameras.txt#D90"
    assert PathMapping().apply_to_settings(settings) == settings


def test_without_rules_nothing_is_mapped(tmp_path):
    path = tmp_path / "rules.json"
    path.write_text("{}")
    assert read_path_mapping(path) == PathMapping()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("no json", "holds no rules of pathmapping-1.0"),
        ("[1]", "holds no rules of pathmapping-1.0"),
        ('{"version": "pathmapping-9"}', "version 'pathmapping-9'"),
        (None, "check the path"),
    ],
)
def test_what_holds_no_rules_is_refused(tmp_path, content, message):
    path = tmp_path / "rules.json"
    if content is not None:
        path.write_text(content)
    with pytest.raises(InputError, match=message):
        read_path_mapping(path)


def test_libraries_and_textures_come_from_where_they_lie_now(empty_blender, tmp_path):
    away, here = tmp_path / "away", tmp_path / "here"
    away.mkdir()
    mesh = bpy.data.meshes.new("coral")
    mesh.from_pydata([(0, 0, 0)], [], [])
    mesh.use_fake_user = True
    bpy.ops.wm.save_as_mainfile(filepath=str(away / "corals.blend"))
    image = bpy.data.images.new("red", 2, 2)
    image.generated_color = (1.0, 0.0, 0.0, 1.0)
    image.filepath_raw, image.file_format = str(away / "red.png"), "PNG"
    image.save()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(away / "corals.blend"), link=True) as (_, wanted):
        wanted.meshes = ["coral"]
    item = bpy.data.objects.new("coral", bpy.data.meshes["coral"])
    bpy.context.scene.collection.objects.link(item)
    bpy.data.images.load(str(away / "red.png")).use_fake_user = True
    scene = str(tmp_path / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=scene, relative_remap=False)
    away.rename(here)
    bpy.ops.wm.open_mainfile(filepath=scene)
    assert len(bpy.data.objects["coral"].data.vertices) == 0
    apply_to_scene(_rules(tmp_path, ("POSIX", str(away), str(here))))
    assert len(bpy.data.objects["coral"].data.vertices) == 1
    assert tuple(bpy.data.images["red.png"].pixels[:4]) == (1.0, 0.0, 0.0, 1.0)
