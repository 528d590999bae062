"""What the documents name is there, and their examples run."""

from __future__ import annotations

import importlib
import re
import subprocess
import sys
from pathlib import Path

import pytest
import underwater_spectral

ROOT = Path(__file__).resolve().parent.parent
DOCUMENTS = [*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), ROOT / "data" / "SOURCES.md"]
PACKAGES = ("uw_spectral", "quality", "datasets", "node_groups", "scene", "ui")
_FOLDERS = (*PACKAGES, "data", "tests", "tools", "examples", "presets")
# scene.underwater is a property of Blender's, scene.blend a file.
_NAME = re.compile(rf"(?<![\w.])(?!scene\.(?:underwater|blend))(?:{'|'.join(PACKAGES)})(?:\.\w+)+")
_PATH = re.compile(rf"(?<![\w./])(?:{'|'.join(_FOLDERS)})/[\w./]*\w")


def _is_there(name: str) -> bool:
    found = importlib.import_module(underwater_spectral.__name__)
    for part in name.split("."):
        if not hasattr(found, part):
            try:
                importlib.import_module(f"{found.__name__}.{part}")
            except (ImportError, AttributeError):
                return False
        found = getattr(found, part)
    return True


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_modules_functions_and_files_exist(document):
    text = document.read_text()
    names = {name for quoted in re.findall(r"`([^`\n]+)`", text) for name in _NAME.findall(quoted)}
    missing = [name for name in names if not _is_there(name)]
    missing += [path for path in _PATH.findall(text) if not (ROOT / path).exists()]
    assert not missing


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_relative_links_lead_somewhere(document):
    links = re.findall(r"\]\(([^)#\s]+)[^)]*\)", document.read_text())
    ours = [link for link in links if not link.startswith("http")]
    assert [link for link in ours if not (document.parent / link).exists()] == []


def test_the_example_of_the_readme_runs_without_blender():
    (code,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    code = f"import sys\nsys.modules['bpy'] = None\n{code}"
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)
