"""The extension builds, validates, and installs from its zip into a clean profile."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent

INSTALL = """
import json, sys
import bpy
bpy.ops.extensions.package_install_files(
    filepath=sys.argv[1], repo="user_default", enable_on_install=True
)
name = "bl_ext.user_default.underwater_spectral"
import addon_utils
found = {
    "enabled": list(addon_utils.check(name)),
    "settings": bpy.context.scene.underwater.water,
    "heavy": sorted({"colour", "jerlov", "nodebpy", "OpenImageIO"} & set(sys.modules)),
}
addon_utils.disable(name)
found["gone"] = not hasattr(bpy.types.Scene, "underwater")
print("FOUND " + json.dumps(found))
"""


@pytest.fixture(scope="module")
def built_zip(tmp_path_factory) -> Path:
    spec = importlib.util.spec_from_file_location("build", ROOT / "tools" / "build_extension.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.build(tmp_path_factory.mktemp("dist"))


def test_zip_holds_what_is_needed_and_no_more(built_zip):
    names = zipfile.ZipFile(built_zip).namelist()
    tops = {name.split("/")[0] for name in names}
    assert {"blender_manifest.toml", "__init__.py", "uw_spectral", "node_groups", "data"} <= tops
    assert not tops & {"tests", "examples", "benchmarks", "docs", "dev.py", "out", "tools", ".venv"}
    assert sum(name.endswith(".whl") for name in names) == 3


def test_installs_and_enables_in_a_clean_profile(built_zip, tmp_path):
    script = tmp_path / "install.py"
    script.write_text(INSTALL)
    environment = {**os.environ, "BLENDER_USER_RESOURCES": str(tmp_path / "profile")}
    result = subprocess.run(
        [sys.executable, str(script), str(built_zip)],
        env=environment,
        capture_output=True,
        text=True,
    )
    lines = [line for line in result.stdout.splitlines() if line.startswith("FOUND ")]
    assert lines, result.stdout + result.stderr
    found = json.loads(lines[0].removeprefix("FOUND "))
    assert found == {
        "enabled": [True, True],
        "settings": "jerlov:IB",
        "heavy": [],
        "gone": True,
    }
    packages = tmp_path / "profile" / "extensions" / ".local" / "lib" / "python3.13"
    installed = {path.name for path in (packages / "site-packages").iterdir()}
    assert {"colour", "jerlov", "nodebpy"} <= installed
