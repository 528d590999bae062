"""Load the repository root as the package that Blender sees."""

from __future__ import annotations

import runpy
from pathlib import Path

_ROOT = Path(__file__).resolve().parent.parent
runpy.run_path(str(_ROOT / "render_bands.py"))["extension"]()
