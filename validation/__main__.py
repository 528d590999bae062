"""The Monte Carlo solver's command line: python -m validation --water jerlov:II."""

from __future__ import annotations

import importlib
import runpy
import sys
from pathlib import Path


def main() -> int:
    """Load the checkout as Blender would, and run the command."""
    root = Path(__file__).resolve().parent.parent
    package = runpy.run_path(str(root / "tools" / "load_checkout.py"))["load"]()
    command = importlib.import_module(f"{package.__name__}.validation.monte_carlo.command_line")
    return command.main(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
