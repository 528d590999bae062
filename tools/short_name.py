"""The optics under a short name: ``import uw_spectral`` is ``underwater_spectral.uw_spectral``.

Both names give the same modules, so that classes are equal whichever name they were got by.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import find_spec, spec_from_loader
from types import ModuleType

_LONG = "underwater_spectral."


class _SameModule(MetaPathFinder, Loader):
    """Finds modules of the short name, and loads those of the long one in their place."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        del path, target
        ours = fullname.startswith(f"{__name__}.") and find_spec(_LONG + fullname)
        return spec_from_loader(fullname, self) if ours else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        module = importlib.import_module(_LONG + spec.name)
        spec.loader_state = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        # The import gave it the spec of the short name.
        alias = module.__spec__
        assert alias is not None, "an import sets it"
        module.__spec__ = alias.loader_state


sys.meta_path.insert(0, _SameModule())
sys.modules[__name__] = importlib.import_module(_LONG + __name__)
