"""Which build of the extension this is."""

from __future__ import annotations

import functools
import hashlib
import tomllib
from pathlib import Path

_ROOT = Path(__file__).resolve().parent.parent
_SOURCES = ("uw_spectral", "quality", "datasets", "node_groups", "scene", "data")
_SUFFIXES = {".py", ".csv"}


@functools.cache
def extension_version() -> str:
    """Return the version of the extension."""
    text = (_ROOT / "blender_manifest.toml").read_text(encoding="utf-8")
    return str(tomllib.loads(text)["version"])


@functools.cache
def source_digest() -> str:
    """Return what differs from build to build that may draw another picture."""
    files = sorted(
        path for name in _SOURCES for path in (_ROOT / name).rglob("*") if path.suffix in _SUFFIXES
    )
    digest = hashlib.sha256()
    for path in files:
        digest.update(path.relative_to(_ROOT).as_posix().encode())
        # A checkout may have other ends of lines than the zip.
        digest.update(path.read_bytes().replace(b"\r\n", b"\n"))
    return digest.hexdigest()[:16]


def notes(built: str | None) -> list[str]:
    """Say by which build live water was put in, if that is not this one; old builds told none."""
    if built == source_digest():
        return []
    return [
        "the water was put in by another build of the extension, and may be drawn otherwise than "
        "now: press Refresh Water"
    ]
