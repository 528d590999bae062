"""Pages of what was measured: how one is declared, measured, judged, kept and written.

A module that measures a page has a :class:`Page` named ``PAGE`` and a function ``measure`` that
takes an :class:`Ask` and returns values by name: numbers, words and tables (:func:`table`). They
are kept in ``docs/measured/NAME.json`` with a digest of all that the module imports, and put into
the text.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import json
import re
import textwrap
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs" / "measured"
_PACKAGE = "underwater_spectral"
_READS_DATA = ROOT / "uw_spectral" / "spectra" / "spectrum.py"
_WIDTH = 100
_AS_IT_IS = ("|", "#", "!", "    ", "```")

Values = Mapping[str, float | str | list[str]]


@dataclass(frozen=True)
class Target:
    """A bound on the value of a name; the words are those of the page."""

    words: str
    value: str
    most: float

    def met(self, values: Values) -> bool:
        """Whether it is; one that is no number is not."""
        return bool(float(values[self.value]) <= self.most)


@dataclass(frozen=True)
class Page:
    """A page."""

    #: Markdown; ``{name}`` is a value as :meth:`str.format` writes it, alone in a line a table.
    title: str
    text: str
    targets: Sequence[Target] = ()  #: Tabulated after the text.
    #: What a trial may change, by name; attributes of :class:`Ask`, and values of the text.
    settings: Mapping[str, float | str] = field(default_factory=dict)
    reads: Sequence[str] = ()  #: Files and folders that are used without being imported.
    #: Other pages of the same values, by file from docs/measured.
    also: Mapping[str, Page] = field(default_factory=dict)

    def written(self, name: str, values: Values) -> str:
        """Return the page with its values."""
        shown = {k: markdown(v) if isinstance(v, list) else v for k, v in values.items()}
        text = f"# {self.title}\n\n{self.text.strip().format(**{**self.settings, **shown})}\n"
        if self.targets:
            rows = [
                (t.words, f"{t.most:g}", f"{values[t.value]:.3g}",
                 "met" if t.met(values) else "**missed**")
                for t in self.targets
            ]  # fmt: skip
            text += f"\n{markdown(table(('target', 'at most', 'measured', ''), rows))}\n"
        return f"{_wrapped(text)}\n\nMeasured by `python3 dev.py measure {name}`.\n"


class Ask:
    """What is asked of a measurement: its settings, and where its files go."""

    def __init__(self, name: str, page: Page, changed: Mapping[str, str], digest: str) -> None:
        unknown = set(changed) - set(page.settings)
        if unknown:
            raise SystemExit(f"{name} has no {', '.join(sorted(unknown))}: {dict(page.settings)}")
        self.name = name
        self.settings = {k: type(v)(changed.get(k, v)) for k, v in page.settings.items()}
        self.trial = self.settings != dict(page.settings)
        words = "_".join(f"{k}={v}".replace("/", "-") for k, v in self.settings.items())
        self.folder = ROOT / "out" / "measure" / name / f"{digest[:12]}_{words}".rstrip("_")

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - numbers and words
        try:
            return self.settings[name]
        except KeyError:
            raise AttributeError(name) from None

    def kept(self, name: str, make: Callable[[], Any]) -> NDArray[Any]:
        """Return an array that a run that was stopped has left, else make and keep it."""
        path = self.folder / f"{name.replace(' ', '_').replace('/', '-')}.npy"
        if not path.exists():
            found = np.asarray(make())
            path.parent.mkdir(parents=True, exist_ok=True)
            np.save(path.with_suffix(".part.npy"), found)
            path.with_suffix(".part.npy").rename(path)
        return np.load(path)

    def shown(self, file: str) -> Path:
        """Return where a picture goes; that of a trial not into the documents."""
        self.folder.mkdir(parents=True, exist_ok=True)
        return (self.folder if self.trial else DOCS) / file


def plain(values: Mapping[str, Any]) -> Values:
    """Return values as they are kept: numbers of six digits."""
    return {
        k: v if isinstance(v, str | list | int) else float(f"{v:.6g}") for k, v in values.items()
    }


def least_seconds(
    work: Callable[[], object], times: int = 3, clock: Callable[[], float] = time.process_time
) -> float:
    """Return the least seconds that work takes, by default of the processors; once before."""
    work()
    taken = []
    for _ in range(times):
        start = clock()
        work()
        taken.append(clock() - start)
    return min(taken)


def table(head: Iterable[object], rows: Iterable[Iterable[object]]) -> list[str]:
    """Return a table: lines of cells, the first its head."""
    return [" | ".join(map(str, row)) for row in (head, *rows)]


def spread(values: object, form: str = ".2f", at: Sequence[float] = (0.5, 0.95, 1.0)) -> str:
    """Write quantiles of values, by default median, 95 % and worst: 1/2/3."""
    return joined(np.quantile(np.ravel(np.asarray(values)), at), form)


def joined(values: object, form: str = ".2f") -> str:
    """Write values: 1/2/3."""
    return "/".join(f"{x:{form}}" for x in np.ravel(np.asarray(values)))


def ranged(values: object, form: str = ".2f", between: str = "…") -> str:
    """Write the least and the largest of values: 1…3."""
    return f"{np.min(values):{form}}{between}{np.max(values):{form}}"


def pyplot() -> ModuleType:
    """Import what draws figures into files."""
    import matplotlib as mpl

    mpl.use("agg")
    import matplotlib.pyplot as plt

    return plt


def markdown(lines: Sequence[str]) -> str:
    """Write a table as Markdown."""
    head, *rows = (f"| {line} |".replace("|  |", "| |") for line in lines)
    return "\n".join([head, "|" + "---|" * (lines[0].count(" | ") + 1), *rows])


def _wrapped(text: str) -> str:
    blocks = re.split(r"\n\s*\n", text.strip("\n"))
    return "\n\n".join(
        block if block.startswith(_AS_IT_IS) else "\n".join(_filled(block)) for block in blocks
    )


def _filled(block: str) -> Iterable[str]:
    """Fill a paragraph, or the items of a list; headings and tables in it stay lines."""
    part: list[str] = []

    def flush() -> Iterable[str]:
        if part:
            indent = "  " if part[0].startswith("- ") else ""
            yield textwrap.fill(
                " ".join(" ".join(part).split()), _WIDTH, subsequent_indent=indent,
                break_long_words=False, break_on_hyphens=False,
            )  # fmt: skip
            part.clear()

    for line in block.splitlines():
        if line.startswith(("- ", *_AS_IT_IS)):
            yield from flush()
        if line.startswith(_AS_IT_IS):
            yield line
        else:
            part.append(line)
    yield from flush()


def inputs(names: Iterable[str]) -> set[Path]:
    """Return files and what folders hold, all that these import, and the data if it is read."""
    found: set[Path] = set()
    waiting: list[Path] = []
    for word in names:
        path = ROOT / word
        waiting += [p for p in (path.rglob("*.py") if path.is_dir() else (path,)) if p.is_file()]
    while waiting:
        path = waiting.pop()
        if path not in found:
            found.add(path)
            waiting += _imported(path) if path.suffix == ".py" else ()
    if _READS_DATA in found:
        found |= {p for p in (ROOT / "data").rglob("*") if p.is_file()}
    return found


@functools.cache
def _imported(path: Path) -> frozenset[Path]:
    """Return what a file imports itself."""
    found: set[Path] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            for alias in node.names:
                first, _, rest = alias.name.partition(".")
                found |= _files(ROOT, rest) if first == _PACKAGE else set()
        elif isinstance(node, ast.ImportFrom):
            module = node.module or ""
            base = path.parents[node.level - 1] if node.level else ROOT
            if not node.level:
                first, _, module = module.partition(".")
                if first != _PACKAGE:
                    continue
            for alias in node.names:
                found |= _files(base, f"{module}.{alias.name}" if module else alias.name)
    return frozenset(found)


def _files(base: Path, module: str) -> set[Path]:
    found, at = set(), base
    for part in module.split("."):
        at = at / part
        found |= {p for p in (at.with_suffix(".py"), at / "__init__.py") if p.is_file()}
    return found


def _only_read(line: ast.stmt) -> bool:
    """Whether a statement is a docstring, or a page's text."""
    if isinstance(line, ast.Assign):
        return getattr(line.targets[0], "id", "") == "PAGE"
    return isinstance(line, ast.Expr) and isinstance(line.value, ast.Constant)


@functools.cache
def _hash(path: Path) -> bytes:
    """Digest of what a file does: comments, docstrings, line breaks and pages do not count."""
    if path.suffix != ".py":
        return hashlib.sha256(path.read_bytes()).digest()
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            node.body = [line for line in node.body if not _only_read(line)]
    return hashlib.sha256(ast.dump(tree).encode()).digest()


def digest(files: Iterable[Path]) -> str:
    """Return a digest of files, wherever the checkout is."""
    found = hashlib.sha256()
    for path in sorted(files):
        found.update(str(path.relative_to(ROOT)).encode() + _hash(path))
    return found.hexdigest()


@dataclass(frozen=True)
class Record:
    """What is kept of a page: values, the digest of its inputs, and the targets it once met."""

    values: Values
    inputs: str = ""
    met: Sequence[str] = ()

    @classmethod
    def read(cls, name: str) -> Record | None:
        """Read it, if there is one."""
        path = DOCS / f"{name}.json"
        return cls(**json.loads(path.read_text(encoding="utf-8"))) if path.exists() else None

    def write(self, name: str, page: Page | None) -> None:
        """Write it, and the page."""
        text = json.dumps(vars(self), indent=1, ensure_ascii=False)
        (DOCS / f"{name}.json").write_text(text + "\n", encoding="utf-8")
        if page is not None:
            for file, each in {f"{name}.md": page, **page.also}.items():
                (DOCS / file).write_text(each.written(name, self.values), encoding="utf-8")


def judged(
    page: Page, values: Values, before: Record | None, digest: str
) -> tuple[Record, list[str]]:
    """Return what is to be kept, and the targets that were met and no longer are.

    Such a target stays in the record as one that was met, so that the next run fails as well.
    """
    now = [t.words for t in page.targets if t.met(values)]
    lost = [t for t in (before.met if before else ()) if t not in now]
    lost = [t for t in lost if t in {target.words for target in page.targets}]
    return Record(values, digest, [*now, *lost]), lost
