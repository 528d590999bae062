"""The examples in the docstrings of the optics, and that it never needs Blender."""

from __future__ import annotations

import doctest
import importlib
import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest
from underwater_spectral import uw_spectral

ROOT = Path(__file__).resolve().parent.parent
MODULES = sorted(module.name for module in pkgutil.iter_modules(uw_spectral.__path__))


@pytest.mark.parametrize("name", MODULES)
def test_examples_in_docstrings(name):
    module = importlib.import_module(f"{uw_spectral.__name__}.{name}")
    assert doctest.testmod(module).failed == 0


def test_every_kind_of_module_has_examples():
    finder = doctest.DocTestFinder()
    examples = sum(
        len(test.examples)
        for name in MODULES
        for test in finder.find(importlib.import_module(f"{uw_spectral.__name__}.{name}"))
    )
    assert examples >= 40


def test_optics_does_not_load_blender():
    code = (
        "import importlib, pkgutil, sys\n"
        "import uw_spectral\n"
        "for m in pkgutil.iter_modules(uw_spectral.__path__):\n"
        "    importlib.import_module('uw_spectral.' + m.name)\n"
        "heavy = {'bpy', 'nodebpy', 'colour', 'OpenImageIO', 'jerlov'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)
