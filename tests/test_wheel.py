"""The wheel of optics and data sets: what is in it; it and the notebooks work without Blender."""

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
from email.parser import Parser
from pathlib import Path

import nbclient
import nbformat
import pytest
from underwater_spectral.uw_spectral.water import Water

ROOT = Path(__file__).resolve().parent.parent
NOTEBOOKS = sorted(ROOT.glob("examples/notebooks/*.ipynb"))

USE = """
import importlib, json, pkgutil, sys
sys.modules["bpy"] = None
import underwater_spectral
prefix = underwater_spectral.__name__ + "."
names = [m.name for m in pkgutil.walk_packages(underwater_spectral.__path__, prefix)]
for name in names:
    importlib.import_module(name)
heavy = {"colour", "jerlov", "OpenImageIO"} & set(sys.modules)
from underwater_spectral.uw_spectral.water import Water
kd = Water.jerlov("IB").Kd([450.0, 550.0]).tolist()
print(json.dumps([len(names), sorted(heavy), kd, underwater_spectral.__file__]))
"""

SHORT_NAME = """
import importlib, pkgutil, uw_spectral.water.named
from uw_spectral.water import Water
import underwater_spectral.uw_spectral as optics
from underwater_spectral.uw_spectral import water
assert uw_spectral is optics and Water is water.Water
for name in [m.name for m in pkgutil.walk_packages(uw_spectral.__path__, "uw_spectral.")]:
    module = importlib.import_module(name)
    assert module is importlib.import_module("underwater_spectral." + name), name
    assert module.__spec__.name == module.__name__ == "underwater_spectral." + name
try:
    import uw_spectral.air
except ModuleNotFoundError as error:
    assert error.name == "uw_spectral.air"
"""


@pytest.fixture(scope="module")
def tool():
    spec = importlib.util.spec_from_file_location("wheel", ROOT / "tools" / "build_wheel.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def wheel(tool, tmp_path_factory) -> Path:
    return tool.build_twice(tmp_path_factory.mktemp("wheel"))


@pytest.mark.parametrize("page", ["", "https://example.org/sea"])
def test_the_website_of_the_manifest_is_that_of_the_wheel(tmp_path, page):
    for name in ("pyproject.toml", "LICENSE", "__init__.py", "tools/wheel_metadata.py"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    for name in ("uw_spectral", "datasets", "data"):
        (tmp_path / name).mkdir()
    manifest = (ROOT / "blender_manifest.toml").read_text()
    assert "\n# website = " in manifest
    if page:
        manifest = re.sub(r"(?m)^# website = .*", f'website = "{page}"', manifest)
    (tmp_path / "blender_manifest.toml").write_text(manifest)
    command = [sys.executable, "-m", "hatchling", "metadata", "urls"]
    found = subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, text=True)
    assert json.loads(found.stdout) == ({"Homepage": page} if page else {})


@pytest.fixture(scope="module")
def unpacked(wheel, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("unpacked")
    zipfile.ZipFile(wheel).extractall(folder)
    return folder


def _files(*folders: str) -> set[str]:
    paths = [path for folder in folders for path in (ROOT / folder).rglob("*") if path.is_file()]
    return {path.relative_to(ROOT).as_posix() for path in paths if "__pycache__" not in path.parts}


def test_the_wheel_holds_optics_data_sets_and_their_data_alone(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    files = {n for n in names if ".dist-info/" not in n} - {"uw_spectral/__init__.py"}
    assert all(n.startswith("underwater_spectral/") for n in files)
    held = {n.removeprefix("underwater_spectral/") for n in files}
    of_rendering = {"data/costs.csv", "data/cycles_noise.csv"}
    assert held == (_files("uw_spectral", "datasets", "data") - of_rendering) | {"__init__.py"}
    assert {"uw_spectral/py.typed", "data/SOURCES.md"} <= held


def test_the_wheel_is_described_in_one_place(wheel):
    archive = zipfile.ZipFile(wheel)
    (name,) = (n for n in archive.namelist() if n.endswith("/METADATA"))
    found = Parser().parsestr(archive.read(name).decode())
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text())
    assert found["Version"] == manifest["version"]
    assert manifest["license"] == [f"SPDX:{found['License-Expression']}"]
    assert found["Requires-Python"] == ">=3.11"
    assert not any("bpy" in need for need in found.get_all("Requires-Dist"))
    assert any(n.endswith("/licenses/LICENSE") for n in archive.namelist())
    (name,) = (n for n in archive.namelist() if n.endswith("/entry_points.txt"))
    command = "uw-spectral = underwater_spectral.datasets.command_line:main"
    assert command in archive.read(name).decode().splitlines()


def test_the_wheel_works_without_blender(unpacked, tmp_path):
    result = subprocess.run(
        [sys.executable, "-P", "-c", USE],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(unpacked)},
        stdout=subprocess.PIPE,
        check=True,
    )
    count, heavy, kd, place = json.loads(result.stdout)
    assert Path(place).is_relative_to(unpacked)
    assert count > 150
    assert heavy == []
    assert kd == Water.jerlov("IB").Kd([450.0, 550.0]).tolist()


def test_the_short_name_is_the_same_package(unpacked, tmp_path):
    command = [sys.executable, "-P", "-W", "error", "-c", SHORT_NAME]
    env = {**os.environ, "PYTHONPATH": str(unpacked)}
    subprocess.run(command, cwd=tmp_path, env=env, check=True)


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_run_with_the_wheel(unpacked, path, tmp_path):
    """Each asserts what it compares; it is kept without outputs."""
    book = nbformat.read(path, as_version=4)
    nbformat.validate(book)
    code = [cell for cell in book.cells if cell.cell_type == "code"]
    assert not any(cell.outputs or cell.execution_count for cell in code)
    assert any("assert" in cell.source for cell in code)
    assert path.stat().st_size < 50_000
    client = nbclient.NotebookClient(book, timeout=120, resources={"metadata": {"path": tmp_path}})
    client.execute(env={**os.environ, "PYTHONPATH": str(unpacked), "PYTHONSAFEPATH": "1"})


@pytest.mark.slow
def test_the_wheel_installs_in_a_new_environment(tool, wheel):
    """By pip, with what it needs, which takes a network; then all of tools/try_wheel.py."""
    assert "examples pass" in tool.try_in_new_environment(wheel, sys.executable)
