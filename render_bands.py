"""Render the spectral bands of an underwater scene and develop them into a picture.

    blender -b scene.blend -P render_bands.py -- OPTIONS
    python render_bands.py scene.blend OPTIONS

``--help`` lists the options. The work is done by the extension: the enabled one, else the
checkout that this file lies in, else an installed one. Where it is enabled, the same is
``blender --command underwater scene.blend OPTIONS``.
"""

from __future__ import annotations

import importlib
import runpy
import sys
from pathlib import Path

_EXTENSION = "underwater_spectral"
_PROGRAM = Path(__file__).name
_INSTALL = f"""\
{_PROGRAM}: the extension Underwater Spectral is not installed in this Blender. Install its zip:
    blender --command extension install-file -r user_default -e {_EXTENSION}-VERSION.zip
or in Preferences, Get Extensions, Install from Disk. A checkout of the source needs no zip"""


def find_extension() -> str | None:
    """Return the name of the extension's package; None if there is none."""
    import bpy

    for name in bpy.context.preferences.addons.keys():  # noqa: SIM118 - not a dict
        if name.rpartition(".")[2] == _EXTENSION:
            return name
    checkout = Path(__file__).resolve().parent / "tools" / "load_checkout.py"
    if checkout.is_file():
        return runpy.run_path(str(checkout))["load"]().__name__
    for repository in bpy.context.preferences.extensions.repos:
        entry = Path(repository.directory, _EXTENSION, "__init__.py")
        if repository.enabled and entry.is_file():
            return f"bl_ext.{repository.module}.{_EXTENSION}"
    return None


def main() -> int:
    """Run the batch; return the exit status."""
    inside_blender = Path(sys.argv[0]).resolve() != Path(__file__).resolve()
    if inside_blender:
        arguments = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
    else:
        arguments = sys.argv[1:]
    try:
        name = find_extension()
        if name is None:
            print(_INSTALL, file=sys.stderr)
            return 2
        batch = importlib.import_module(f"{name}.jobs.batch")
    except ModuleNotFoundError as error:
        print(
            f"{_PROGRAM}: the Python package {error.name!r} is missing. In Blender, install and "
            "enable the extension, which brings it; in a checkout run: "
            f"python3 dev.py run {_PROGRAM} scene.blend",
            file=sys.stderr,
        )
        return 2
    return batch.main(arguments, program=_PROGRAM, inside_blender=inside_blender)


if __name__ == "__main__":
    sys.exit(main())
