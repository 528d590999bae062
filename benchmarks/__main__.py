"""Measure pages of docs/measured, or run another tool of this folder.

    python3 dev.py measure [PAGE …] [NAME=VALUE …]   measure pages, by default all, and write them
    python3 dev.py measure --stale [PAGE …]          pages whose code or data changed since
    python3 dev.py measure --write [PAGE …]          write pages of what was measured, no more
    python3 dev.py measure --accept [PAGE …]         targets that are missed now are no failures
    python3 dev.py measure --stamp PAGE …            a page written by hand is up to date
    python3 dev.py run -m benchmarks TOOL [ARGS]     frozen, digests, gpu_check, …

Measuring fails where a target that was met no longer is. With settings other than its own a page
is printed and not written.
"""

from __future__ import annotations

import importlib
import runpy
import subprocess
import sys
import warnings
from dataclasses import replace
from pathlib import Path
from types import ModuleType

_HERE = Path(__file__).resolve().parent
_WORDS = ("--stale", "--write", "--accept", "--stamp")


def main() -> None:
    """Load the extension as Blender would, and run what is named."""
    package = runpy.run_path(str(_HERE.parent / "tools" / "load_checkout.py"))["load"]()
    errors = importlib.import_module(f"{package.__name__}.uw_spectral.errors")
    warnings.simplefilter("ignore", errors.DataWarning)
    name, *arguments = sys.argv[1:] or [""]
    if name == "measure":
        of = f"{package.__name__}.benchmarks"
        modules = (importlib.import_module(f"{of}.{part}") for part in ("pages", "runner"))
        sys.exit(_measure(arguments, *modules))
    tools = sorted(p.stem for p in _HERE.glob("*.py") if _is_tool(p))
    if name not in tools:
        sys.exit(f"{__doc__}\nTools: {', '.join(tools)}")
    importlib.import_module(f"{package.__name__}.benchmarks.{name}").main(arguments)


def _is_tool(path: Path) -> bool:
    return path.stem != "__main__" and "\ndef main(" in path.read_text(encoding="utf-8")


def _measure(arguments: list[str], pages: ModuleType, runner: ModuleType) -> int:
    chosen = [word for word in arguments if word in _WORDS]
    changed = dict(word.split("=", 1) for word in arguments if "=" in word)
    names = [word for word in arguments if word not in chosen and "=" not in word]
    rows = {row.name: row for row in pages.PAGES}
    unknown = set(names) - set(rows)
    if unknown:
        sys.exit(f"no pages: {', '.join(sorted(unknown))}; there are {', '.join(rows)}")
    wanted = [rows[name] for name in names or rows]
    if "--stale" in chosen:
        return _stale(wanted, runner)
    if "--stamp" in chosen:
        for row in wanted if names else ():
            record = runner.Record.read(row.name) or runner.Record({})
            replace(record, inputs=row.digest()).write(row.name, None)
        return 0
    if "--write" in chosen or "--accept" in chosen:
        for row in (row for row in wanted if row.module):
            (page, _), record = row.load(), runner.Record.read(row.name)
            if "--accept" in chosen:
                record = replace(record, met=runner.judged(page, record.values, None, "")[0].met)
            record.write(row.name, page)
        pages.write_index()
        return 0
    if len(wanted) > 1:  # each in a process of its own
        run = [sys.executable, "-m", "benchmarks", "measure"]
        failed = [row.name for row in wanted if row.module
                  and subprocess.call([*run, row.name], cwd=_HERE.parent)]  # fmt: skip
        print(f"failed: {', '.join(failed)}" if failed else "all measured")
        return bool(failed)
    return _one(wanted[0], changed, runner)


def _stale(rows: list, runner: ModuleType) -> int:
    for row in rows:
        record = runner.Record.read(row.name)
        if record is None or record.inputs != row.digest():
            said = "" if record and record.inputs else ", never stamped"
            print(f"{row.name}: {'measured' if row.module else 'written by hand'}{said}")
    return 0


def _register() -> None:
    """Give scenes, lamps and materials what the extension stores, where Blender is loaded."""
    if "bpy" in sys.modules:
        from underwater_spectral.scene import stored_settings

        if not hasattr(sys.modules["bpy"].types.Scene, stored_settings.PROPERTY):
            stored_settings.register()


def _one(row: object, changed: dict[str, str], runner: ModuleType) -> int:
    if not row.module:
        sys.exit(f"{row.name}.md is written by hand, of {', '.join(row.by_hand)}")
    page, module = row.load()
    digest = row.digest()
    ask = runner.Ask(row.name, page, changed, digest)
    _register()
    values = runner.plain({**ask.settings, **module.measure(ask)})
    print(page.written(row.name, values))
    if ask.trial:
        return 0
    record, lost = runner.judged(page, values, runner.Record.read(row.name), digest)
    record.write(row.name, page)
    for words in lost:
        print(f"{row.name}: {words}: was met and no longer is", file=sys.stderr)
    return bool(lost)


if __name__ == "__main__":
    main()
