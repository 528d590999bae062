"""The files that an open scene reads besides its own: libraries, textures, caches, lamps'."""

from __future__ import annotations

from collections.abc import Iterator, Set
from dataclasses import dataclass
from pathlib import Path

import bpy

from ..session import PICTURE
from ..stored_materials import fluorophore_files
from .lamp_files import lamp_files

# What a render can do without, should it be missing.
_DISPENSABLE = {"sound", "text", "screen", "brush", "palette"}
_LAMP, _FLUOROPHORE = "lamp", "fluorophore"
_FLAGS = {"SKIP_PACKED", "SKIP_WEAK_REFERENCES"}
# Tiles and numbered pictures come one by one.
_EXPANDED = {*_FLAGS, "EXPAND_TOKENS", "EXPAND_SEQUENCES", "EXPAND_CACHES"}


@dataclass(frozen=True)
class ExternalFiles:
    """Files and folders that are there, and what is named but missing: owner and path."""

    files: tuple[Path, ...]
    folders: tuple[Path, ...]
    missing: tuple[tuple[str, Path], ...]


@dataclass(frozen=True)
class NamedFile:
    """A file that a data-block names; ``owner`` says whose it is, such as ``image 'sand'``."""

    block: bpy.types.ID
    owner: str
    path: Path

    @property
    def is_needed(self) -> bool:
        """Whether a render cannot do without."""
        kind = self.owner.partition(" ")[0]
        # A folder is one of a simulation, which fills it once it is baked.
        return kind in {_LAMP, _FLUOROPHORE} or (
            bool(self.path.suffix) and not is_dispensable(kind)
        )


def is_dispensable(kind: str) -> bool:
    """Whether renders can do without the files of a kind of data-block, in small letters."""
    return kind in _DISPENSABLE


def external_files() -> ExternalFiles:
    """Return what the open file reads besides itself and Blender's own files."""
    own = Path(bpy.utils.resource_path("LOCAL")).resolve()
    found: dict[str, set[Path]] = {}
    for file in named_files(_EXPANDED):
        found.setdefault(file.owner, set()).add(file.path)
    present = {path for paths in found.values() for path in paths if path.exists()}
    present = {path for path in present if not path.resolve().is_relative_to(own)}
    missing = [
        (file.owner, file.path)
        for file in named_files()
        if file.is_needed and not any(item.exists() for item in found.get(file.owner, ()))
    ]
    missing += [
        (file.owner, file.path)
        for file in named_files(_EXPANDED)
        if file.is_needed and not file.path.exists()
    ]
    return ExternalFiles(
        tuple(sorted(path for path in present if path.is_file())),
        tuple(sorted(path for path in present if path.is_dir())),
        tuple(sorted(set(missing))),
    )


def is_read(library: bpy.types.Library) -> bool:
    """Whether the open file needs a library's own file; what was packed into it does not."""
    packed = library.is_archive or library.packed_file is not None
    return not packed and bool(library.users_id)


def is_shown_only(block: bpy.types.ID) -> bool:
    """Whether it is a finished picture of ours that an editor shows, and nothing renders."""
    if not isinstance(block, bpy.types.Image) or PICTURE not in block:
        return False
    return all(isinstance(x, bpy.types.Screen) for x in bpy.data.user_map(subset=[block])[block])


def named_files(flags: Set[str] = frozenset(_FLAGS)) -> Iterator[NamedFile]:
    """Yield each file that a data-block names and that is not packed into it."""
    for file in lamp_files():
        yield NamedFile(file.light, f"{_LAMP} {file.light.name!r}", file.whole)
    for file in fluorophore_files():
        yield NamedFile(file.material, f"{_FLUOROPHORE} {file.material.name!r}", file.whole)
    visited: list[NamedFile] = []

    def visit(block: bpy.types.ID, path: str, _: object) -> None:
        if isinstance(block, bpy.types.Library) and not is_read(block):
            return
        if is_shown_only(block):
            return
        if path and not path.startswith("<"):
            absolute = bpy.path.abspath(path, library=block.library)
            owner = f"{block.id_type.lower()} {block.name!r}"
            visited.append(NamedFile(block, owner, Path(absolute)))

    bpy.data.file_path_foreach(visit, flags=set(flags))
    yield from visited
