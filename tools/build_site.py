"""Build the documentation site into out/site: python3 dev.py site; --check only reads it.

Needs the packages of docs.lock. Pages are copied beside generated ones for each module of the
optics, so that the source tree stays clean; their relative links stay right.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
_PAGES = ("CHANGELOG.md", "CONTRIBUTING.md", "data/SOURCES.md", "examples/README.md")
_LINK = re.compile(r"\]\(([^)#\s]+)")
_INDEX = '<!doctype html><meta http-equiv="refresh" content="0; url=docs/index.html">\n'


def main() -> None:
    """Copy the pages, list the modules, and build; or see that all can be read and links lead."""
    only_check = "--check" in sys.argv[1:]
    out = ROOT / "out" / ("site_check" if only_check else "site")
    source = ROOT / "out" / f"{out.name}_source"
    for folder in (out, source):
        shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(ROOT / "docs", source / "docs")
    for page in _PAGES:
        _copy(Path(page), source)
    for page in list(source.rglob("*.md")):
        _copy_linked(page, source)
    docs = source / "docs"
    (docs / "checkout.txt").write_text(str(ROOT), encoding="utf-8")
    apidoc = ("-q", "--module-first", "--no-toc", "--separate", "--maxdepth", "2", "-o")
    _sphinx("sphinx.ext.apidoc", *apidoc, docs / "api", ROOT / "uw_spectral")
    builder = "dummy" if only_check else "html"  # pages take ten times as long to write
    _sphinx("sphinx", "-b", builder, "-q", "-W", "--keep-going", "-c", docs, source, out)
    if only_check:
        return
    (out / "index.html").write_text(_INDEX, encoding="utf-8")
    print(f"site: {(out / 'index.html').relative_to(ROOT)}")  # noqa: T201


def _copy(page: Path, source: Path) -> None:
    (source / page).parent.mkdir(parents=True, exist_ok=True)
    shutil.copy(ROOT / page, source / page)


def _copy_linked(page: Path, source: Path) -> None:
    """Copy files that a page links to and that are no pages."""
    for link in _LINK.findall(page.read_text(encoding="utf-8")):
        target = (page.parent / link).resolve()
        if link.startswith("http") or not target.is_relative_to(source) or target.exists():
            continue
        found = ROOT / target.relative_to(source)
        if found.is_file():
            _copy(found.relative_to(ROOT), source)


def _sphinx(module: str, *arguments: str | Path) -> None:
    command = [sys.executable, "-m", module, *map(str, arguments)]
    if status := subprocess.call(command, cwd=ROOT):
        sys.exit(status)


if __name__ == "__main__":
    main()
