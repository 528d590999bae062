"""Pages of docs/measured: written from what is kept, judged against it, and known to be stale."""

from __future__ import annotations

import importlib
import re

import pytest
from underwater_spectral.benchmarks import pages, runner
from underwater_spectral.benchmarks.runner import Ask, Page, Record, Target, judged, table

# The name of the module, not of what runpy makes of it.
command = importlib.import_module("underwater_spectral.benchmarks.__main__")

PAGE = Page(
    "A page",
    "Some words about {count} objects, {off:.1f} off.\n\n{rows}\n\n- an item\n",
    (Target("off", "off", 2.0), Target("also", "more", 1.0)),
    {"samples": 4},
)
VALUES = {"count": 3, "off": 1.25, "more": 0.5, "rows": table(("a", "b"), [(1, ""), (2, 3)])}


@pytest.fixture
def docs(tmp_path, monkeypatch):
    """A folder instead of docs/measured, with one page in it, and what it will measure."""
    found = {"values": VALUES}
    module = type("module", (), {"measure": staticmethod(lambda _: found["values"])})
    row = pages.Row("page", "said", "module")
    monkeypatch.setattr(pages.Row, "load", lambda _: (PAGE, module))
    monkeypatch.setattr(pages.Row, "digest", lambda _: found.get("digest", "one"))
    monkeypatch.setattr(pages, "PAGES", (row,))
    for of in (pages, runner):
        monkeypatch.setattr(of, "DOCS", tmp_path)
    monkeypatch.setattr(runner, "ROOT", tmp_path)
    monkeypatch.setattr(command, "_register", lambda: None)
    return tmp_path, found


def _measure(*words):
    return command._measure(list(words), pages, runner)


@pytest.mark.parametrize("row", pages.PAGES, ids=lambda row: row.name)
def test_pages_are_what_is_kept_of_them(row):
    """python3 dev.py measure --write writes them all."""
    text = (runner.DOCS / f"{row.name}.md").read_text(encoding="utf-8")
    if row.module:
        page, record = row.load()[0], Record.read(row.name)
        assert text == page.written(row.name, record.values)
        for file, each in page.also.items():
            assert (runner.DOCS / file).read_text(encoding="utf-8") == each.written(
                row.name, record.values
            )
        met = {target.words for target in page.targets if target.met(record.values)}
        assert met <= set(record.met)
    else:
        assert all((runner.ROOT / name).exists() for name in row.by_hand)
    assert text.startswith("# ")


def test_the_index_and_the_folder_have_the_same_pages():
    names = {row.name for row in pages.PAGES}
    files = {path.stem for path in runner.DOCS.glob("*.md")} - {"index"}
    records = {path.stem for path in runner.DOCS.glob("*.json")}
    assert files == names
    assert records <= names
    index = (runner.DOCS / "index.md").read_text(encoding="utf-8")
    assert set(re.findall(r"^- \[(\w+)\]\(\1\.md\): .", index, re.MULTILINE)) == names


def test_a_page_has_its_values_tables_and_verdicts():
    text = PAGE.written("page", VALUES)
    assert text.startswith(
        "# A page\n\nSome words about 3 objects, 1.2 off.\n\n| a | b |\n|---|---|\n"
    )
    assert "| 1 | |\n| 2 | 3 |\n\n- an item\n" in text
    assert "| off | 2 | 1.25 | met |\n| also | 1 | 0.5 | met |" in text
    assert "| off | 2 | 3 | **missed** |" in PAGE.written("page", {**VALUES, "off": 3.0})


def test_measuring_writes_the_same_page_each_time(docs):
    folder, _ = docs
    assert _measure("page") == 0
    page, record = ((folder / f"page.{ext}").read_text() for ext in ("md", "json"))
    assert _measure("page") == 0
    assert _measure("--write") == 0
    assert (folder / "page.md").read_text() == page
    assert (folder / "page.json").read_text() == record
    assert "page" in (folder / "index.md").read_text()


def test_a_target_that_was_met_and_is_missed_fails_until_it_is_accepted(docs, capsys):
    folder, found = docs
    assert _measure("page") == 0
    found["values"] = {**VALUES, "off": 2.5}
    for _ in range(2):
        assert _measure("page") == 1
        said = capsys.readouterr().err
        assert "page: off: was met and no longer is" in said
        assert "also" not in said
        assert "**missed**" in (folder / "page.md").read_text()
    _measure("--accept", "page")
    assert _measure("page") == 0


def test_a_target_that_was_never_met_is_no_failure():
    values = {**VALUES, "off": float("nan")}
    record, lost = judged(PAGE, values, None, "digest")
    assert (record.met, lost) == (["also"], [])
    gone = Record(VALUES, "", ["a target of before"])
    assert judged(PAGE, VALUES, gone, "digest")[1] == []


def test_stale_pages_are_those_of_other_inputs(docs, capsys):
    _, found = docs
    _measure("--stale")
    assert "page: measured, never stamped" in capsys.readouterr().out
    _measure("page")
    capsys.readouterr()
    _measure("--stale")
    assert capsys.readouterr().out == ""
    found["digest"] = "another"
    _measure("--stale")
    assert capsys.readouterr().out == "page: measured\n"
    _measure("--stamp", "page")
    _measure("--stale")
    assert capsys.readouterr().out == ""


def test_a_trial_is_printed_and_not_written(docs, capsys):
    folder, _ = docs
    assert _measure("page", "samples=2") == 0
    assert "# A page" in capsys.readouterr().out
    assert not (folder / "page.md").exists()
    with pytest.raises(SystemExit, match="page has no smaples"):
        _measure("page", "smaples=2")
    with pytest.raises(SystemExit, match="no pages: missing"):
        _measure("missing")


def test_what_was_made_before_a_stop_is_made_no_more(docs):
    asked = []
    for _ in range(2):
        ask = Ask("page", PAGE, {}, "digest")
        assert ask.kept("a b", lambda: asked.append(1) or [1.0, 2.0]).tolist() == [1.0, 2.0]
    Ask("page", PAGE, {}, "other inputs").kept("a b", lambda: asked.append(1) or 1.0)
    assert len(asked) == 2


@pytest.mark.parametrize(
    ("file", "text", "changes"),
    [
        ("used.py", "X = 2\n", True),
        ("used.py", '"""Says."""\n# words\nX = (\n    1\n)\n', False),
        ("benchmarks/page.py", 'from ..used import X\n\nPAGE = "other"\n', False),
        ("benchmarks/page.py", 'from ..used import X\n\nPAGE = "one"\nY = 1\n', True),
        ("unused.py", "X = 2\n", False),
        ("read/table.csv", "2\n", True),
        ("data/table.csv", "2\n", False),
    ],
)
def test_inputs_are_what_a_module_imports_and_reads(file, text, changes, tmp_path, monkeypatch):
    monkeypatch.setattr(runner, "ROOT", tmp_path)
    files = {
        "used.py": "X = 1\n", "unused.py": "X = 1\n", "read/table.csv": "1\n",
        "data/table.csv": "1\n", "benchmarks/page.py": 'from ..used import X\n\nPAGE = "one"\n',
    }  # fmt: skip

    def digest():
        for of in (runner._imported, runner._hash):
            of.cache_clear()
        return runner.digest(runner.inputs(["benchmarks/page.py", "read/table.csv"]))

    for name, content in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(content)
    before = digest()
    (tmp_path / file).write_text(text)
    assert (digest() != before) is changes


@pytest.mark.slow
def test_a_page_of_pictures_depends_on_the_engines_and_the_data():
    row = next(row for row in pages.PAGES if row.name == "planar_reflection")
    found = runner.inputs([f"benchmarks/{row.module}.py"])
    names = {str(path.relative_to(runner.ROOT)) for path in found}
    assert {"scene/engines/cycles_engine.py", "uw_spectral/spectra/bands.py"} <= names
    assert any(name.startswith("data/") for name in names)
    assert not any(name.startswith(("tests/", "ui/")) for name in names)


def test_values_are_kept_as_numbers_of_six_digits():
    assert runner.plain({"a": 1.23456789, "b": 2, "c": "d", "e": ["f"]}) == {
        "a": 1.23457, "b": 2, "c": "d", "e": ["f"],
    }  # fmt: skip
