"""Render the spectral bands of an underwater scene and develop them into a picture.

    blender -b scene.blend -P render_bands.py -- OPTIONS
    python render_bands.py scene.blend OPTIONS

``--help`` lists the options.
"""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

_PACKAGE = "underwater_spectral"


def extension() -> ModuleType:
    """Return the extension this file is part of, loading it if Blender has not."""
    entry = Path(__file__).resolve().with_name("__init__.py")
    for module in list(sys.modules.values()):
        file = getattr(module, "__file__", None)
        if file and Path(file).resolve() == entry:
            return module
    spec = importlib.util.spec_from_file_location(
        _PACKAGE, entry, submodule_search_locations=[str(entry.parent)]
    )
    module = importlib.util.module_from_spec(spec)
    sys.modules[_PACKAGE] = module
    spec.loader.exec_module(module)
    return module


def main() -> int:
    """Run the batch; return the exit status."""
    inside_blender = Path(sys.argv[0]).resolve() != Path(__file__).resolve()
    if inside_blender:
        arguments = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
    else:
        arguments = sys.argv[1:]
    name = extension().__name__
    try:
        batch = importlib.import_module(f"{name}.scene.batch")
    except ModuleNotFoundError as error:
        print(
            f"render_bands.py: the Python package {error.name!r} is missing. In Blender, install "
            "and enable the extension (Preferences, Get Extensions, Install from Disk); outside, "
            "run: python3 dev.py run render_bands.py scene.blend",
            file=sys.stderr,
        )
        return 2
    return batch.main(arguments, inside_blender=inside_blender)


if __name__ == "__main__":
    sys.exit(main())
