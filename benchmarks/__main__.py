"""Run one benchmark: python3 dev.py run -m benchmarks NAME [ARGS]."""

from __future__ import annotations

import importlib
import runpy
import sys
from pathlib import Path

_HERE = Path(__file__).resolve().parent


def main() -> None:
    """Load the extension as Blender would and run the named benchmark."""
    names = sorted(p.stem for p in _HERE.glob("*.py") if not p.stem.startswith("_"))
    if len(sys.argv) < 2 or sys.argv[1] not in names:
        sys.exit(f"name a benchmark: {', '.join(names)}")
    package = runpy.run_path(str(_HERE.parent / "tools" / "load_checkout.py"))["load"]()
    module = importlib.import_module(f"{package.__name__}.benchmarks.{sys.argv[1]}")
    module.main(sys.argv[2:])


if __name__ == "__main__":
    main()
