"""What the documents name is there, and their examples run."""

from __future__ import annotations

import importlib.util
import itertools
import re
import runpy
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import underwater_spectral
from underwater_spectral.benchmarks import pages
from underwater_spectral.jobs import command_line
from underwater_spectral.settings.descriptions import description_of
from underwater_spectral.settings.scene_settings import SETTINGS, SceneSettings
from underwater_spectral.settings.water_settings import WORLD
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.imaging import resolve

ROOT = Path(__file__).resolve().parent.parent
_OTHERS = (ROOT / "data" / "SOURCES.md", ROOT / "examples" / "README.md")
DOCUMENTS = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *_OTHERS])
PACKAGES = (
    "uw_spectral", "reference", "quality", "settings", "datasets", "node_groups", "scene", "jobs",
    "ui",
)  # fmt: skip
_PIPELINE, _RESEARCHER = ROOT / "docs" / "pipeline.md", ROOT / "docs" / "researcher.md"
_LISTING = ROOT / "docs" / "listing" / "listing.md"
_WRONG = (InputError, AssertionError, OSError, SystemExit)
_JOBS = ("example", "test", "check", "build", "run", "measure", "site", "lock")
_MEASURE = ("--stale", "--write", "--accept", "--stamp")
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
    version = tomllib.loads((ROOT / "blender_manifest.toml").read_text())["version"]
    (zipped,) = re.findall(r"underwater_spectral-([\d.]+)\.zip", _PIPELINE.read_text())
    wheels = re.findall(r"underwater_spectral-([\d.]+)-py3", _RESEARCHER.read_text())
    headings = re.findall(
        r"^## (\d[\d.]*)(?: - \d{4}-\d\d-\d\d)?$",
        (ROOT / "CHANGELOG.md").read_text(),
        re.MULTILINE,
    )
    last = headings[0]
    assert len({version, zipped, last, *wheels}) == 1


def test_the_listing_counts_the_settings_that_can_be_keyframed():
    (count,) = re.findall(r"(\d+) settings can be keyframed", _LISTING.read_text())
    assert int(count) == sum(setting.animatable for setting in SETTINGS.values())


def test_the_examples_of_the_notebook_run_without_blender():
    section = _RESEARCHER.read_text().split("\n## ")[0]
    code = "\n".join(re.findall(r"```python\n(.*?)```", section, re.DOTALL))
    assert "import" in code
    load = 'import runpy\nrunpy.run_path("tools/load_checkout.py")["load"]()'
    code = f"import sys\nsys.modules['bpy'] = None\n{load}\n{code}"
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)


def _commands(document: Path) -> list[list[str]]:
    """The commands of a page: lines of its bash blocks, and whole commands in its text."""
    text = document.read_text()
    blocks = "\n".join(re.findall(r"```(?:bash|sh)\n(.*?)```", text, re.DOTALL))
    lines = blocks.replace("\\\n", " ").splitlines()
    lines += re.findall(r"`(python3 dev\.py [^`]+)`", _without_code(document))
    found = [shlex.split(line, comments=True) for line in lines]
    return [words for words in found if words and not {"NAME", "OPTIONS", "…"} & set(words)]


def _check(words: list[str]) -> None:
    """Parse a command as its program would; nothing is run."""
    program = next((i for i, word in enumerate(words) if word.endswith("dev.py")), None)
    if program is not None:
        job, *rest = words[program + 1 :]
        assert job in _JOBS, f"dev.py has no {job!r}"
        if job == "run":
            _check(rest)
        elif job == "test":
            assert all((ROOT / word).exists() for word in rest if "/" in word)
        elif job == "measure":
            assert set(rest) <= {*_MEASURE, *(row.name for row in pages.PAGES)}, rest
    elif words[:2] == ["-m", "benchmarks"]:
        tool = ROOT / "benchmarks" / f"{(*words, '')[2]}.py"
        assert len(words) == 2 or "\ndef main(" in tool.read_text(), words
    elif words[:2] == ["blender", "--command"] and words[2] == "underwater":
        _check_batch(words[3:])
    elif "render_bands.py" in words:
        start = words.index("--" if "--" in words else "render_bands.py")
        _check_batch(words[start + 1 :])
    elif words[0].endswith(".py"):
        assert (ROOT / words[0]).is_file(), words
        if words[0] == "examples/build_scene.py":
            runpy.run_path(str(ROOT / words[0]))["parser"]().parse_args(words[1:])


def _check_batch(arguments: list[str]) -> None:
    options = command_line.parse(arguments)
    command_line.job(options), command_line.split(options), command_line.auto(options)
    for path in (options.blend, options.dataset):
        # A scene that is not in the repository is the reader's own, or made by an earlier line.
        assert path is None or path.parts[0] != "examples" or (ROOT / path).exists(), path
    of_others = ("file:", WORLD)  # files and scenes that are the reader's own
    if not any(str(value).startswith(of_others) for value in vars(options).values()):
        resolve(description_of(command_line.merge(SceneSettings(), options)))


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_commands_are_ones(document):
    for words in _commands(document):
        try:
            _check(words)
        except _WRONG as error:
            pytest.fail(f"{shlex.join(words)}: {error}")


def test_the_options_of_the_table_are_those_of_the_parser():
    """Settings have a page of their own."""
    table = _PIPELINE.read_text().split("## Options\n")[1].split("\n## ")[0]
    known = {name for action in command_line.parser()._actions for name in action.option_strings}
    assert set(re.findall(r"--[a-z][a-z-]*", table)) - known == set()


@pytest.mark.parametrize(
    "line",
    [
        "python3 dev.py cook",
        "python3 dev.py run render_bands.py a.blend --no-such-option",
        "python3 dev.py run render_bands.py a.blend --engine luxury",
        "python3 dev.py run render_bands.py a.blend --water jerlov:XX",
        "python3 dev.py run render_bands.py examples/missing.blend",
        "python3 dev.py run examples/missing.py",
        "python3 dev.py run examples/build_scene.py moon out/moon.blend",
        "python3 dev.py run -m benchmarks missing",
        "python3 dev.py run -m benchmarks occlusion",
        "python3 dev.py measure missing",
        "blender --command underwater a.blend --bnads 8",
        "blender -b a.blend -P render_bands.py -- --quality best",
    ],
)
def test_wrong_commands_are_found(line):
    with pytest.raises(_WRONG):
        _check(shlex.split(line))


def test_the_reference_of_settings_is_that_of_their_table():
    """Written by python3 dev.py run tools/settings_page.py."""
    spec = importlib.util.spec_from_file_location("page", ROOT / "tools" / "settings_page.py")
    page = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(page)
    assert page.PAGE.read_text(encoding="utf-8") == page.page()


def _rows_of_the_review() -> list[list[str]]:
    lines = (ROOT / "docs" / "listing" / "review.md").read_text().splitlines()
    first = lines.index("| rule | how it is met | check |") + 2
    rows = itertools.takewhile(lambda line: line.startswith("|"), lines[first:])
    return [[cell.strip() for cell in row.strip("|").split("|")] for row in rows]


@pytest.mark.parametrize("row", _rows_of_the_review(), ids=lambda row: row[0])
def test_each_rule_of_a_review_has_the_checks_that_it_names(row):
    *_, check = row
    if check == "reading":
        return
    named = 0
    for part in check.split(";"):
        paths = re.findall(r"`(tests/[\w/.]+)`", part) or ["tests/test_extension.py"]
        assert "Zip" in part or "tests/" in part
        there = re.findall(r"(?m)^def (test_\w+)\(", (ROOT / paths[0]).read_text())
        names = re.findall(r"`(test_\w+)`", part)
        assert set(names) <= set(there), paths[0]
        named += len(names)
    assert named
