"""The examples in the docstrings of every package, and what may import what."""

from __future__ import annotations

import ast
import doctest
import importlib
import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest
import underwater_spectral

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = (
    "uw_spectral", "validation", "quality", "settings", "datasets", "node_groups", "scene", "jobs",
    "ui",
)  # fmt: skip
BLENDER_FREE = ("uw_spectral", "validation", "quality", "settings", "datasets")


def _modules(*packages: str) -> list[str]:
    found = []
    for package in packages:
        paths = [str(ROOT / package)]
        found += [f"{package}.{m.name}" for m in pkgutil.walk_packages(paths) if not m.ispkg]
        for folder in (p.parent for p in (ROOT / package).glob("*/__init__.py")):
            prefix = f"{package}.{folder.name}"
            found += [prefix, *(f"{prefix}.{m.name}" for m in pkgutil.iter_modules([str(folder)]))]
    return sorted({name for name in found if not name.endswith("__main__")})


@pytest.mark.parametrize("name", _modules(*PACKAGES))
def test_examples_in_docstrings(name):
    module = importlib.import_module(f"{underwater_spectral.__name__}.{name}")
    assert doctest.testmod(module).failed == 0


def test_every_kind_of_module_has_examples():
    finder = doctest.DocTestFinder()
    examples = sum(
        len(test.examples)
        for name in _modules(*BLENDER_FREE)
        for test in finder.find(importlib.import_module(f"{underwater_spectral.__name__}.{name}"))
    )
    assert examples >= 120


def test_optics_does_not_load_blender():
    code = (
        "import importlib, sys\n"
        f"for name in {_modules('uw_spectral')!r}:\n"
        "    importlib.import_module(name)\n"
        "heavy = {'bpy', 'colour', 'OpenImageIO', 'jerlov'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)


def _imports(path: Path) -> set[str]:
    """Modules that a file imports, from the root of the extension; others by their first name."""
    package = path.relative_to(ROOT).with_suffix("").parts[:-1]
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {name.name for name in node.names}
        elif isinstance(node, ast.ImportFrom):
            home = package[: len(package) - node.level + 1] if node.level else ()
            found.add(".".join([*home, *filter(None, [node.module])]))
    return found


@pytest.mark.parametrize("folder", sorted((ROOT / "uw_spectral").glob("*/__init__.py")))
def test_no_module_has_the_name_of_what_its_package_exports(folder):
    name = f"{underwater_spectral.__name__}.uw_spectral.{folder.parent.name}"
    modules = {module.name for module in pkgutil.iter_modules([str(folder.parent)])}
    assert not modules & set(importlib.import_module(name).__all__)


# What each package may import besides itself and what everything may.
_ALLOWED = {
    "uw_spectral": set(),
    "validation": {"uw_spectral"},
    "quality": {"uw_spectral"},
    "settings": {"uw_spectral", "quality"},
    "datasets": {"uw_spectral"},
    "node_groups": {"uw_spectral"},
    "scene": {"uw_spectral", "quality", "settings", "datasets", "node_groups"},
    "jobs": {"uw_spectral", "quality", "settings", "datasets", "node_groups", "scene"},
    "ui": {"uw_spectral", "quality", "settings", "scene", "jobs"},
}
# The rooms of the scene, each above those before it.
_ROOMS = ("materials", "readers", "water", "terms", "engines", "viewport")


@pytest.mark.parametrize("package", PACKAGES)
def test_packages_import_only_what_lies_below_them(package):
    for path in (ROOT / package).rglob("*.py"):
        ours = {name.split(".")[0] for name in _imports(path)} & set(PACKAGES)
        assert ours <= {package, *_ALLOWED[package]}, path


@pytest.mark.parametrize("place", range(len(_ROOMS)))
def test_rooms_of_the_scene_import_only_what_lies_below_them(place):
    for path in (ROOT / "scene" / _ROOMS[place]).rglob("*.py"):
        rooms = {x.split(".")[1] for x in _imports(path) if x.startswith("scene.")} & set(_ROOMS)
        assert rooms <= set(_ROOMS[: place + 1]), path


@pytest.mark.parametrize("package", BLENDER_FREE)
def test_packages_without_blender_never_name_it(package):
    for path in (ROOT / package).rglob("*.py"):
        firsts = {name.split(".")[0] for name in _imports(path)}
        assert not firsts & {"bpy", "mathutils", "bmesh"}, path


@pytest.mark.parametrize("package", PACKAGES)
def test_what_a_function_imports_is_there(package):
    for path in (ROOT / package).rglob("*.py"):
        home = ".".join([underwater_spectral.__name__, *path.relative_to(ROOT).parts[:-1]])
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and node.level:
                source = importlib.import_module("." * node.level + (node.module or ""), home)
                for name in (item.name for item in node.names):
                    if not hasattr(source, name):
                        importlib.import_module(f"{source.__name__}.{name}")
