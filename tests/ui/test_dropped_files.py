"""Measured files dropped into the viewport."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace

import bpy
import pytest
from underwater_spectral.tests.scene import scenes
from underwater_spectral.ui import dropped_files

_TABLES = {
    "sea.csv": "wavelength_nm,a,b\n300,0.1,0.2\n850,0.5,0.2\n",
    "layers.csv": "depth_m,wavelength_nm,a,b\n0,300,0.1,0.2\n0,850,0.5,0.2\n"
    "5,300,0.2,0.2\n5,850,0.6,0.2\n",
    "kd.txt": "wavelength_nm,Kd\n400,0.1\n700,0.7\n",
    "camera.csv": "wavelength_nm,R,G,B\n380,0,0.1,1\n780,1,0.1,0\n",
    "sand.csv": "wavelength_nm,reflectance\n300,0.3\n850,0.5\n",
    "sky.csv": "wavelength_nm,irradiance\n300,1\n850,1\n",
    "warm.csv": "wavelength_nm,power\n300,1\n830,3\n",
    "beam.csv": "angle_deg,intensity\n0,1\n30,0.5\n60,0\n",
    "torch.ies": "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 3 1 1 2 0 0 0\n1 1 20\n0 45 90\n0\n"
    "100 50 0\n",
    "both.csv": "wavelength_nm,a,b,reflectance\n300,0.1,0.2,0.3\n850,0.5,0.2,0.4\n",
    "half.csv": "wavelength_nm,a,b,reflectance\n300,0.1,0.2,30\n850,0.5,0.2,40\n",
    "bad.csv": "wavelength_nm,a,b\n300,-0.1,0.2\n850,0.5,0.2\n",
    "notes.csv": "name,size\n1,2\n",
    "short.ies": "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 3 1 1\n",
}
_SEABASS = Path(__file__).parents[1] / "uw_spectral" / "water" / "Water_Absorption.sb"
_SETTINGS = ("water", "sensor", "floor_reflectance", "illuminant")


@pytest.fixture
def files(tmp_path) -> Path:
    for name, text in _TABLES.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def _drop(folder: Path, *names: str, **more: object) -> set[str]:
    return bpy.ops.underwater.use_files(
        directory=str(folder), files=[{"name": name} for name in names], **more
    )


def _settings() -> dict[str, str]:
    return {name: getattr(bpy.context.scene.underwater, name) for name in _SETTINGS}


def _lamp(kind: str = "SPOT") -> bpy.types.Object:
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", kind))
    bpy.context.scene.collection.objects.link(lamp)
    bpy.context.view_layer.objects.active = lamp
    lamp.select_set(True)
    return lamp


@pytest.mark.parametrize(
    ("name", "setting"),
    [
        ("sea.csv", "water"),
        ("layers.csv", "water"),
        ("kd.txt", "water"),
        ("camera.csv", "sensor"),
        ("sand.csv", "floor_reflectance"),
        ("sky.csv", "illuminant"),
    ],
)
def test_a_table_goes_where_its_header_says(files, name, setting):
    before = _settings()
    assert _drop(files, name) == {"FINISHED"}
    assert _settings() == {**before, setting: f"file:{files / name}"}


def test_one_path_is_enough(files):
    bpy.ops.underwater.use_files(filepath=str(files / "sea.csv"))
    assert _settings()["water"] == f"file:{files / 'sea.csv'}"


@pytest.mark.parametrize("suffix", [".txt", ".env", ".csv"])
def test_seabass_is_known_by_its_header(tmp_path, suffix):
    lines = "/begin_header\n/fields=wavelength,a,b\n/units=nm,1/m,1/m\n/delimiter=comma\n"
    path = tmp_path / f"station{suffix}"
    path.write_text(f"{lines}/missing=-9999\n/end_header\n300,0.1,0.2\n850,0.5,0.2\n")
    assert _drop(tmp_path, path.name) == {"FINISHED"}
    assert _settings()["water"] == f"file:{path}"


def test_several_at_once(files):
    _drop(files, "sea.csv", "camera.csv", "torch.ies", "warm.csv")
    found = _settings()
    assert found["water"] == f"file:{files / 'sea.csv'}"
    assert found["sensor"] == f"file:{files / 'camera.csv'}"
    own = bpy.data.lights["torch"].underwater
    assert (own.profile, own.spectrum) == (
        str(files / "torch.ies"),
        f"file:{files / 'warm.csv'}",
    )


def test_a_photometric_file_makes_the_lamp_it_was_measured_of(files):
    assert _drop(files, "torch.ies", place=(1.0, 2.0, -3.0)) == {"FINISHED"}
    lamp = bpy.data.objects["torch"]
    assert tuple(lamp.location) == (1.0, 2.0, -3.0)
    assert lamp.data.underwater.unit == "lm"
    # 100, 50 and 0 cd at 0, 45 and 90°, linear in the cosine between them: trapezia.
    flux = 2 * math.pi * (75.0 * (1 - math.sqrt(0.5)) + 25.0 * math.sqrt(0.5))
    assert lamp.data.energy == pytest.approx(flux, rel=1e-4)


@pytest.mark.parametrize("kind", ["POINT", "SPOT", "AREA"])
@pytest.mark.parametrize("name", ["torch.ies", "beam.csv"])
def test_the_active_lamp_takes_a_profile_and_keeps_its_power(files, kind, name):
    lamp = _lamp(kind)
    power = lamp.data.energy
    _drop(files, name)
    assert list(bpy.data.lights) == [lamp.data]
    assert (lamp.data.underwater.profile, lamp.data.energy) == (str(files / name), power)


@pytest.mark.parametrize("change", ["not selected", "a sun", "a mesh"])
def test_what_is_no_lamp_of_the_water_takes_none(files, change):
    lamp = _lamp("SUN" if change == "a sun" else "POINT")
    if change == "not selected":
        lamp.select_set(False)
    if change == "a mesh":
        box = scenes._cube("box", (0.0, 0.0, -5.0))
        bpy.context.view_layer.objects.active = box
    _drop(files, "torch.ies")
    assert lamp.data.underwater.profile == ""
    assert len(bpy.data.lights) == 2
    lights = len(bpy.data.lights)
    with pytest.raises(RuntimeError, match="spectrum of a lamp"):
        _drop(files, "warm.csv")
    assert len(bpy.data.lights) == lights


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (["bad.csv"], "negative"),
        (["notes.csv"], "tell nothing"),
        (["short.ies"], "ends after"),
        (["gone.csv"], "cannot read"),
        (["both.csv"], "can be used as water, floor; say"),
        (["sea.csv", "kd.txt"], "are both for 'Water'"),
        (["sea.csv", "bad.csv"], "negative"),
        (["camera.csv", "sea.csv", "short.ies"], "ends after"),
        ([], "no file was named"),
    ],
)
def test_what_cannot_be_used_changes_nothing(files, names, message):
    before, lights = _settings(), len(bpy.data.lights)
    with pytest.raises(RuntimeError, match=message):
        _drop(files, *names)
    assert (_settings(), len(bpy.data.lights)) == (before, lights)


def test_what_can_be_two_things_is_asked(files):
    _drop(files, "both.csv", use_as="floor")
    assert _settings()["floor_reflectance"] == f"file:{files / 'both.csv'}"
    with pytest.raises(RuntimeError, match="can be used as water, floor"):
        _drop(files, "both.csv", use_as="sensor")
    # Its reflectance is in percent, which the floor's reader refuses: only the water is left.
    _drop(files, "half.csv")
    assert _settings()["water"] == f"file:{files / 'half.csv'}"


def test_the_choice_is_for_the_file_that_needs_it(files):
    _drop(files, "both.csv", "camera.csv", use_as="water")
    assert _settings()["water"] == f"file:{files / 'both.csv'}"
    assert _settings()["sensor"] == f"file:{files / 'camera.csv'}"


def test_the_menu_offers_what_the_file_can_be(files, monkeypatch):
    shown = []
    operator = SimpleNamespace(
        bl_idname="underwater.use_files", filepath="", directory=str(files), use_as="",
        files=[SimpleNamespace(name="both.csv")], place=(0.0, 0.0, 0.0),
    )  # fmt: skip
    used = dropped_files.UseFiles
    operator._paths = lambda: used._paths(operator)
    choices = used._choices(operator)
    layout = SimpleNamespace(operator=lambda _, text: shown.append(text) or _Again())
    manager = SimpleNamespace(
        popup_menu=lambda draw, **_: draw(SimpleNamespace(layout=layout), None)
    )
    used._ask(operator, SimpleNamespace(window_manager=manager), choices)
    assert shown == ["Water", "Reflectance of the Floor"]


def test_one_undo_takes_dropped_files_back(files):
    bpy.context.preferences.edit.use_global_undo = True
    before = _settings()
    bpy.ops.ed.undo_push(message="start")
    names = [{"name": name} for name in ("sea.csv", "camera.csv", "torch.ies")]
    bpy.ops.underwater.use_files("EXEC_DEFAULT", True, directory=str(files), files=names)
    assert _settings() != before
    bpy.ops.ed.undo()
    assert (_settings(), len(bpy.data.lights)) == (before, 0)


class _Again:
    def __init__(self) -> None:
        self.files = SimpleNamespace(add=SimpleNamespace)


def test_the_file_handler_comes_and_goes(registered):
    handler = dropped_files.UNDERWATER_FH_measured
    operator = bpy.ops.underwater.use_files.get_rna_type()
    assert {"filepath", "directory", "files"} <= set(operator.properties.keys())
    assert handler.is_registered
    assert {".sb", ".csv", ".ies"} <= set(handler.bl_file_extensions.split(";"))
    for area, mode, taken in (
        ("VIEW_3D", "OBJECT", True),
        ("VIEW_3D", "EDIT_MESH", False),
        ("TEXT_EDITOR", "OBJECT", False),
    ):
        context = SimpleNamespace(area=SimpleNamespace(type=area), mode=mode)
        assert handler.poll_drop(context) is taken
    dropped_files.unregister()
    assert not handler.is_registered
    dropped_files.register()
