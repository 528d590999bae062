"""What the documents name is there, and their examples run."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import pytest
import underwater_spectral

ROOT = Path(__file__).resolve().parent.parent
_OTHERS = (ROOT / "data" / "SOURCES.md", ROOT / "examples" / "README.md")
DOCUMENTS = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *_OTHERS])
PACKAGES = (
    "uw_spectral", "reference", "quality", "settings", "datasets", "node_groups", "scene", "jobs",
    "ui",
)  # fmt: skip
_BATCH = ROOT / "docs" / "batch.md"
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
    if document.name == "CHANGELOG.md":  # it tells of what was
        names = set()
    missing = [name for name in names if not _is_there(name)]
    paths = [path for path in _PATH.findall(text) if "NAME" not in path]
    missing += [path for path in paths if not (ROOT / path).exists()]
    assert not missing


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_relative_links_lead_somewhere(document):
    links = re.findall(r"\]\(([^)\s]+)[^)]*\)", _without_code(document))
    missing = []
    for link in links:
        path, _, place = link.partition("#")
        target = document.parent / path if path else document
        if not link.startswith("http") and not (target.exists() and _has_place(target, place)):
            missing.append(link)
    assert missing == []


def _without_code(document: Path) -> str:
    return re.sub(r"```.*?```", "", document.read_text(), flags=re.DOTALL)


def _has_place(target: Path, place: str) -> bool:
    """Whether a page has a heading of that name; names are those of GitHub and of the site."""
    headings = re.findall(r"^#+ (.*)$", _without_code(target), re.MULTILINE) if place else ()
    words = (re.sub(r"[^\w\- ]", "", heading.lower()) for heading in headings)
    return not place or place in {name.strip().replace(" ", "-") for name in words}


@pytest.mark.parametrize("page", sorted(ROOT.glob("docs/**/*.md")), ids=lambda path: path.name)
def test_every_page_is_reached_from_the_front_of_the_site(page):
    found, ahead = set(), [ROOT / "docs" / "index.md"]
    while ahead:
        here = ahead.pop()
        found.add(here)
        for tree in re.findall(r"```{toctree}\n(.*?)```", here.read_text(), re.DOTALL):
            names = (line for line in tree.splitlines() if line and not line.startswith(":"))
            pages = [(here.parent / f"{name}.md").resolve() for name in names]
            ahead += [p for p in pages if p.exists() and p not in found]
    assert page in found


def test_the_version_is_the_same_everywhere():
    texts = [(ROOT / name).read_text() for name in ("pyproject.toml", "blender_manifest.toml")]
    versions = [re.search(r'^version = "(.*)"$', text, re.MULTILINE)[1] for text in texts]
    (zipped,) = re.findall(r"underwater_spectral-([\d.]+)\.zip", _BATCH.read_text())
    last = re.search(r"^## (\d[\d.]*)$", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)[1]
    assert len({*versions, zipped, last}) == 1


def test_the_example_of_the_notebook_runs_without_blender():
    page = ROOT / "docs" / "notebook.md"
    (code,) = re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL)
    code = f"import sys\nsys.modules['bpy'] = None\n{code}"
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)


def test_the_reference_of_settings_is_that_of_their_table():
    """Written by python3 dev.py run tools/settings_page.py."""
    spec = importlib.util.spec_from_file_location("page", ROOT / "tools" / "settings_page.py")
    page = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(page)
    assert page.PAGE.read_text(encoding="utf-8") == page.page()
