"""The files that a job depends on, and the programs that render it: what they hold, by digest."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import bpy

from ..scene import sources
from ..scene.readers.external_files import is_dispensable, is_read, is_shown_only
from ..scene.readers.lamp_files import lamp_files
from ..scene.stored_materials import fluorophore_files
from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.spectrum import split_location
from .manifest import ExternalFile, table_name, tables

_TILES = re.compile("<UDIM>|<UVTILE>")
_KINDS = {"Library": "linked library", "Image": "texture"}


def versions() -> dict[str, str]:
    """Return the versions that decide about the bits of a picture."""
    return {
        "Blender": bpy.app.version_string,
        "the extension": sources.extension_version(),
        "the source of the extension": sources.source_digest(),
    }


def setting_files(settings: Mapping[str, Any]) -> tuple[ExternalFile, ...]:
    """Return the tables that settings name."""
    found = {name: split_location(location)[0] for name, location in tables(settings).items()}
    return tuple(
        ExternalFile(table_name(path, name), str(path), digest_of(path), name)
        for name, path in found.items()
    )


def scene_files() -> tuple[ExternalFile, ...]:
    """Return what the open .blend reads: textures, linked libraries, caches, tables of lamps."""
    found: dict[str, ExternalFile] = {}
    for kind, path, whole in _references():
        if path not in found:
            found[path] = ExternalFile(f"the {kind} {path}", path, digest_of(whole))
    return tuple(sorted(found.values(), key=lambda item: item.path))


def _references() -> Iterator[tuple[str, str, Path]]:
    """Yield kind, path as the .blend has it, and full path."""
    libraries = {library.filepath for library in bpy.data.libraries}
    for item, paths in bpy.data.file_path_map(include_libraries=True).items():
        kind = _KINDS.get(item.bl_rna.identifier, str(item.bl_rna.name).lower())
        is_library = isinstance(item, bpy.types.Library)
        if (is_library and not is_read(item)) or is_shown_only(item):
            continue
        if is_dispensable(item.id_type.lower()):
            continue
        owner = getattr(item, "parent", None) if is_library else item.library
        for path in paths:
            if is_library or path not in libraries:
                yield kind, path, _whole_path(item, path, owner)
    for file in lamp_files():
        yield f"{file.setting} of lamp {file.light.name!r},", file.path, file.whole
    for file in fluorophore_files():
        yield f"fluorophore of material {file.material.name!r},", file.path, file.whole


def _whole_path(item: bpy.types.ID, path: str, owner: bpy.types.Library | None) -> Path:
    whole = Path(bpy.path.abspath(path, library=owner))
    if isinstance(item, bpy.types.Image) and item.source == "SEQUENCE":
        return whole.with_name(re.sub(r"\d+(?=\D*$)", "<FRAME>", whole.name))
    return whole


def digest_of(path: Path) -> str:
    """Return a digest of a file's content; empty if there is none.

    Folders, and sequences of images, count by names and sizes.
    """
    name = path.name
    try:
        if "<FRAME>" in name:
            before, after = (re.escape(part) for part in name.split("<FRAME>", 1))
            pattern = re.compile(rf"{before}\d+{after}")
            return _listing(p for p in path.parent.iterdir() if pattern.fullmatch(p.name))
        if _TILES.search(name):
            tiles = path.parent.glob(_TILES.sub("*", name))
            digests = [f"{tile.name} {_sha256(tile)}" for tile in sorted(tiles)]
            return hashlib.sha256("\n".join(digests).encode()).hexdigest() if digests else ""
        if path.is_dir():
            return _listing(path.rglob("*"))
        return _sha256(path)
    except OSError:
        return ""


def _listing(paths: Iterable[Path]) -> str:
    rows = sorted(f"{path.name} {path.stat().st_size}" for path in paths if path.is_file())
    return hashlib.sha256("\n".join(rows).encode()).hexdigest() if rows else ""


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def scene_digest(blend: Path | None) -> str:
    """Return a digest of a .blend; ``"unsaved"`` without one."""
    return (digest_of(blend) if blend is not None else "") or "unsaved"


def open_blend() -> Path | None:
    """Return the .blend that is open; None if it was never saved."""
    return Path(bpy.data.filepath) if bpy.data.filepath else None


def require_all(files: Iterable[ExternalFile]) -> None:
    """Refuse files that are missing: other machines could not render what this one does."""
    missing = [item.what for item in files if not item.sha256]
    if missing:
        raise InputError(
            f"{', '.join(missing)}: missing; put it back, pack it into the .blend, or remove it "
            "from the scene, and plan again"
        )
