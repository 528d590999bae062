"""Load this checkout as the package ``underwater_spectral``, whatever folder it lies in.

For tests, examples, benchmarks and ``render_bands.py``; not part of the
extension, whose package Blender imports.
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType

_PACKAGE = "underwater_spectral"
_ROOT = Path(__file__).resolve().parent.parent


class _Finder:
    """Finds the package at the root of the checkout; what lies in it is found as usual."""

    @staticmethod
    def find_spec(name: str, *_: object) -> ModuleSpec | None:
        if name != _PACKAGE:
            return None
        return importlib.util.spec_from_file_location(name, _ROOT / "__init__.py")


def load() -> ModuleType:
    """Return the package of this checkout."""
    if _PACKAGE not in sys.modules:
        sys.meta_path.insert(0, _Finder)
    return importlib.import_module(_PACKAGE)
