"""The extension as a zip that Blender installs, for machines that lack it."""

from __future__ import annotations

import runpy
import zipfile
from pathlib import Path

from ...uw_spectral.errors import InputError

_ROOT = Path(__file__).resolve().parents[2]
_BUILDER = _ROOT / "tools" / "build_extension.py"
_CACHES = "__pycache__"


def write_extension(path: Path) -> None:
    """Write the extension that runs here as a zip.

    A checkout is built. What is installed is packed as it is, with the wheels that Blender keeps
    beside it. Raises InputError if a checkout lacks what it has to bring.
    """
    if _BUILDER.is_file():
        try:
            runpy.run_path(str(_BUILDER))["pack"](path)
        except ConnectionError as error:
            raise InputError(f"a bundle brings the extension: {error}") from error
        return
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(_ROOT.rglob("*")):
            inside = file.relative_to(_ROOT)
            if file.is_file() and _CACHES not in inside.parts:
                archive.write(file, inside.as_posix())
