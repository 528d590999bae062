"""New files that begin with water."""

from pathlib import Path

import bpy
import pytest
from underwater_spectral.scene.session import is_live


@pytest.fixture
def scripts(tmp_path, monkeypatch):
    """A folder of the user's own scripts."""
    monkeypatch.setattr(
        bpy.utils, "user_resource", lambda kind, path: str(tmp_path / kind.lower() / path)
    )
    return tmp_path / "scripts" / "startup" / "bl_app_templates_user" / "Underwater"


@pytest.mark.slow
def test_a_new_file_begins_with_the_water_that_was_saved(scripts):
    bpy.ops.mesh.primitive_plane_add(size=20.0, location=(0.0, 0.0, -8.0))
    bpy.ops.object.camera_add(location=(0.0, 0.0, -4.0), rotation=(1.3, 0.0, 0.0))
    bpy.context.scene.camera = bpy.context.object
    assert bpy.ops.underwater.add_water() == {"FINISHED"}
    bpy.context.scene.underwater.water = "jerlov:3C"
    before = bpy.data.filepath
    assert bpy.ops.underwater.save_start_file() == {"FINISHED"}
    assert bpy.data.filepath == before
    assert [path.name for path in scripts.iterdir()] == ["startup.blend"]
    bpy.ops.wm.read_homefile(filepath=str(scripts / "startup.blend"), load_ui=False)
    assert bpy.data.filepath == ""
    assert is_live(bpy.context.scene)
    assert bpy.context.scene.underwater.water == "jerlov:3C"


def test_what_new_files_would_not_find_is_told_and_nothing_written(scripts, tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    image = bpy.data.images.new("own", 4, 4)
    image.filepath_raw, image.file_format = str(tmp_path / "own.png"), "PNG"
    image.save()
    image.filepath = "//own.png"
    image.use_fake_user = True
    with pytest.raises(RuntimeError, match="looked for beside this one, such as //own"):
        bpy.ops.underwater.save_start_file()
    assert not scripts.exists()
    Path(tmp_path, "scripts").write_text("in the way")
    bpy.data.images.remove(image)
    with pytest.raises(RuntimeError, match="cannot write"):
        bpy.ops.underwater.save_start_file()
