"""The extension builds, validates, and installs from its zip into a clean profile."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import OpenImageIO as oiio
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
    "heavy": sorted({"colour", "jerlov", "OpenImageIO"} & set(sys.modules)),
}
addon_utils.disable(name)
found["gone"] = not hasattr(bpy.types.Scene, "underwater")
print("FOUND " + json.dumps(found))
"""


@pytest.fixture(scope="module")
def tool():
    spec = importlib.util.spec_from_file_location("build", ROOT / "tools" / "build_extension.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def built_zip(tool, tmp_path_factory) -> Path:
    return tool.build(tmp_path_factory.mktemp("dist"))


@pytest.mark.slow
def test_the_sizes_in_the_manual_are_written_by_the_build(tool, built_zip, tmp_path):
    manual = Path(shutil.copy(ROOT / "docs" / "listing" / "review.md", tmp_path))
    table = tool.size_table(built_zip)
    tool.write_manual(table, manual)
    before, after = (path.read_text() for path in (ROOT / "docs" / "listing" / "review.md", manual))
    assert f"\n\n{table}\n\n" in after
    # The same parts as in the manual, which was written so.
    parts = [re.findall(r"(?m)^\| ([\w./ -]+?) \|", text) for text in (before, after)]
    assert sorted(parts[0]) == sorted(parts[1])
    manual.write_text("no table")
    with pytest.raises(ValueError, match="holds 0 tables"):
        tool.write_manual(table, manual)


@pytest.mark.slow
def test_zip_holds_what_is_needed_and_no_more(built_zip):
    names = zipfile.ZipFile(built_zip).namelist()
    tops = {name.split("/")[0] for name in names}
    assert {"blender_manifest.toml", "__init__.py", "uw_spectral", "node_groups", "data"} <= tops
    left_out = (
        "tests benchmarks validation docs dev.py render_bands.py deadline flamenco out tools "
        "typings .venv"
    )
    assert not tops & set(left_out.split())
    examples = {name.split("/")[1] for name in names if name.startswith("examples/")}
    assert examples == {"scenes.py", "parts", "reef", "wreck", "cave", "pool"}
    assert "uw_spectral/py.typed" in names
    assert {"assets/underwater_spectral.blend", "assets/blender_assets.cats.txt"} <= set(names)
    assert sum(name.endswith(".whl") for name in names) == 2


@pytest.mark.slow
def test_the_same_files_give_the_same_bytes(tool, built_zip, tmp_path):
    """Whatever their times are: a checkout gets them anew."""
    entries = zipfile.ZipFile(built_zip).infolist()
    assert {entry.date_time for entry in entries} == {(1980, 1, 1, 0, 0, 0)}
    assert {entry.external_attr for entry in entries} == {0o644 << 16}
    names = [entry.filename for entry in entries]
    assert names == sorted(names)
    again = tmp_path / "again.zip"
    tool.pack(again)
    assert again.read_bytes() == built_zip.read_bytes()


@pytest.mark.slow
def test_zip_leaves_the_import_system_alone(built_zip):
    archive = zipfile.ZipFile(built_zip)
    scripts = [name for name in archive.namelist() if name.endswith(".py")]
    assert "jobs/batch.py" in scripts
    for name in scripts:
        text = archive.read(name)
        assert not re.search(rb"sys\.(modules|path|meta_path)\b", text), name
        assert not re.search(rb"import .*\b(numba|subprocess|socket|urllib|requests)\b", text), name
        assert not re.search(rb"import (threading|multiprocessing)", text), name
        assert b"nodebpy" not in text, name
        assert not re.search(rb"\b(eval|exec|__import__)\(", text), name


@pytest.mark.slow
def test_workers_of_the_optics_never_see_blender_and_end_with_the_call(built_zip):
    """The one pool of threads computes numpy arrays inside one call, in a package without bpy."""
    archive = zipfile.ZipFile(built_zip)
    pools = {
        name: archive.read(name).decode()
        for name in archive.namelist()
        if name.endswith(".py") and b"ThreadPoolExecutor" in archive.read(name)
    }
    assert set(pools) <= {"uw_spectral/occlusion/probe_solution.py"}
    for text in pools.values():
        made = re.findall(r".*ThreadPoolExecutor\(.*", text)
        assert made
        assert all(line.strip().startswith("with ") for line in made)


@pytest.mark.slow
def test_the_zip_has_what_a_platform_asks_for(built_zip):
    """The rules of docs/listing/review.md that a zip can show."""
    archive = zipfile.ZipFile(built_zip)
    manifest = tomllib.loads(archive.read("blender_manifest.toml").decode())
    assert manifest["license"] == ["SPDX:GPL-3.0-or-later"]
    assert manifest["copyright"]
    assert manifest["maintainer"]
    assert len(manifest["tagline"]) <= 64
    assert manifest["tagline"][-1].isalnum()
    assert set(manifest["permissions"]) == {"files"}
    assert len(manifest["permissions"]["files"]) <= 64
    assert manifest["wheels"] == [
        f"./{n}" for n in sorted(archive.namelist()) if n.endswith(".whl")
    ]
    assert all(n.endswith("-py3-none-any.whl") for n in manifest["wheels"])
    assert "LICENSE" in archive.namelist()
    for name in archive.namelist():
        if name.startswith("data/") and name.endswith(".csv"):
            header = archive.read(name).decode().split("\n", 40)
            assert any(x.startswith("# SPDX-License-Identifier: ") for x in header), name
        assert not name.endswith((".so", ".pyd", ".dll", ".exe", ".pyc", ".blend1")), name


@pytest.mark.slow
def test_the_listing_is_there(built_zip):
    folder = ROOT / "docs" / "listing"
    sizes = {}
    for path in [*folder.glob("*.png"), *folder.glob("*.jpg")]:
        spec = oiio.ImageBuf(str(path)).spec()
        sizes[path.stem] = spec.width, spec.height
    assert sizes.pop("icon") == (256, 256)
    assert len(sizes) == 10
    assert set(sizes.values()) == {(1920, 1080)}
    assert (folder / "loop.webp").stat().st_size < 1_000_000
    assert (folder / "review.md").is_file()


def test_the_pictures_of_the_repository_are_small():
    kinds = "docs/**/*.png", "docs/**/*.jpg", "docs/**/*.webp", "ui/**/*.png"
    paths = [path for kind in kinds for path in ROOT.glob(kind)]
    shown = {*ROOT.glob("docs/listing/*.jpg"), *ROOT.glob("docs/listing/*.webp")}
    others = set(paths) - shown
    assert len(others) > 20
    assert sum(path.stat().st_size for path in shown) < 4_000_000
    assert sum(path.stat().st_size for path in others) < 3_000_000


@pytest.fixture(scope="module")
def installed(built_zip, tmp_path_factory) -> tuple[Path, dict]:
    """A clean profile with the extension, and what was found while it was enabled."""
    folder = tmp_path_factory.mktemp("installed")
    result = _python(folder / "profile", "-c", INSTALL, built_zip)
    lines = [line for line in result.stdout.splitlines() if line.startswith("FOUND ")]
    assert lines, result.stdout + result.stderr
    return folder / "profile", json.loads(lines[0].removeprefix("FOUND "))


def _python(profile: Path, *arguments: object) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, *map(str, arguments)],
        env={**os.environ, "BLENDER_USER_RESOURCES": str(profile)},
        capture_output=True,
        text=True,
    )


@pytest.mark.slow
def test_installs_and_enables_in_a_clean_profile(installed):
    profile, found = installed
    assert found == {
        "enabled": [True, True],
        "settings": "jerlov:IB",
        "heavy": [],
        "gone": True,
    }
    packages = profile / "extensions" / ".local" / "lib" / "python3.13"
    wheels = {path.name for path in (packages / "site-packages").iterdir()}
    assert {"colour", "jerlov"} <= wheels


# What Blender does with -P, and says where the batch came from.
AS_BLENDER = """
import pathlib, sys, bpy
script, enable, *rest = sys.argv[1:]
if enable:
    import addon_utils
    addon_utils.enable(enable, default_set=True)
sys.argv = ["blender", "-b", "-P", script, "--", *rest]
try:
    code = compile(pathlib.Path(script).read_text(), script, "exec")
    exec(code, {"__name__": "__main__", "__file__": script})
finally:
    print("FROM " + ",".join(m for m in sys.modules if m.endswith("jobs.batch")))
"""
INSTALLED = "bl_ext.user_default.underwater_spectral"


@pytest.fixture
def lone_script(tmp_path) -> Path:
    folder = tmp_path / "lone"
    folder.mkdir()
    return Path(shutil.copy(ROOT / "render_bands.py", folder))


@pytest.mark.slow
@pytest.mark.parametrize("enable", ["", INSTALLED])
def test_a_lone_script_finds_the_installed_extension(installed, lone_script, enable):
    result = _python(installed[0], "-c", AS_BLENDER, lone_script, enable, "--list-waters")
    assert "solonenko2015: jerlov:I, jerlov:IA" in result.stdout, result.stderr
    assert f"FROM {INSTALLED}.jobs.batch" in result.stdout
    assert result.returncode == 0


def _own_files(profile: Path) -> dict[str, int]:
    """Files of the installed add-on and when they were written, what Python compiles apart."""
    folder = profile / "extensions" / "user_default" / "underwater_spectral"
    return {
        path.relative_to(folder).as_posix(): path.stat().st_mtime_ns
        for path in folder.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }


@pytest.mark.slow
def test_a_lone_script_renders_with_the_installed_extension(installed, lone_script, tmp_path):
    make = (
        "import bpy, sys; s = bpy.context.scene; s.camera.location.z = -3.0; "
        "bpy.ops.wm.save_as_mainfile(filepath=sys.argv[1])"
    )
    blend, out = tmp_path / "scene.blend", tmp_path / "out"
    _python(installed[0], "-c", make, blend)
    options = ["--bands", 3, "--resolution", 8, 8, "--samples", 1, "--phase", "hg:0.8"]
    before = _own_files(installed[0])
    result = _python(installed[0], lone_script, blend, *options, "--out", out)
    assert result.returncode == 0, result.stderr
    assert len(before) > 300
    assert _own_files(installed[0]) == before, "something was written into the add-on's folder"
    assert (out / "0001_spectral.exr").exists()


def test_a_lone_script_without_the_extension_says_how_to_install(lone_script, tmp_path):
    result = _python(tmp_path / "profile", lone_script, "scene.blend")
    assert result.returncode == 2
    assert "is not installed in this Blender" in result.stderr
    assert "extension install-file -r user_default -e underwater_spectral" in result.stderr
    assert "Traceback" not in result.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    ("enable", "source"), [("", "underwater_spectral"), (INSTALLED, INSTALLED)]
)
def test_the_script_of_a_checkout_prefers_what_is_enabled(installed, enable, source):
    script = ROOT / "render_bands.py"
    result = _python(installed[0], "-c", AS_BLENDER, script, enable, "--list-waters")
    assert f"FROM {source}.jobs.batch" in result.stdout, result.stderr
    assert result.returncode == 0
