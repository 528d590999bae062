"""Paths of the artist's machine are found on a worker, by the rules of its session."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path

import bpy
import pytest
from underwater_spectral.jobs.manifest import ExternalFile
from underwater_spectral.jobs.path_mapping import PathMapping, apply_to_scene, read_path_mapping
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene.manifests import small_manifest
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


def test_a_plan_is_placed_and_stays_the_same_job(tmp_path):
    mapping = _rules(tmp_path, ("POSIX", "/home/me", "/mnt"))
    table = ExternalFile("the water", "/home/me/water.csv", "1", "water")
    texture = ExternalFile("the texture", "/home/me/sand.png", "2")
    settings = {"water": "file:/home/me/water.csv", "sensor": "file:/home/me/cameras.txt#D90"}
    planned = replace(
        small_manifest(Path("/home/me/out")),
        scene=Path("/home/me/reef.blend"),
        settings={**asdict(SceneSettings()), **settings},
        changes={2: {"sky_picture": "file:/home/me/out/sky.exr"}},
        files=(table, texture),
    )
    placed = mapping.apply_to_manifest(planned)
    assert (placed.scene, placed.out) == (Path("/mnt/reef.blend"), Path("/mnt/out"))
    assert placed.settings["water"] == "file:/mnt/water.csv"
    assert placed.changes == {2: {"sky_picture": "file:/mnt/out/sky.exr"}}
    assert placed.settings["sensor"] == "file:/mnt/cameras.txt#D90"
    assert [item.path for item in placed.files] == ["/mnt/water.csv", "/home/me/sand.png"]
    assert placed.key(placed.views[0], 0) == planned.key(planned.views[0], 0)
    assert PathMapping().apply_to_manifest(planned) is planned


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
