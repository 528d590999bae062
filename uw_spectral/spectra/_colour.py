"""The one place that imports colour-science: on first use, without its warnings."""

from __future__ import annotations

import functools
import importlib
import warnings
from types import ModuleType

import numpy as np


@functools.cache
def colour_science() -> ModuleType:
    """Return the ``colour`` package.

    Importing it takes a second and warns about optional packages (matplotlib,
    scipy) that nothing here needs, so it loads when first asked for and those
    warnings stay inside. So does its change of numpy's print options.
    """
    with warnings.catch_warnings(), np.printoptions():
        warnings.simplefilter("ignore")
        return importlib.import_module("colour")
