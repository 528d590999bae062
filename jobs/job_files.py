"""The files and programs that a job depends on, by digest, and whether they are the same here."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import bpy

from ..scene import scripts, sources
from ..scene.readers.external_files import is_dispensable, is_read, is_shown_only
from ..scene.readers.lamp_files import lamp_files
from ..scene.session import select_scene
from ..scene.stored_materials import fluorophore_files
from ..settings.scene_settings import flag
from ..uw_spectral.errors import InputError
from .manifest import ExternalFile, Manifest, table_paths

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
    return tuple(
        ExternalFile(f"the table {path} ({flag(name)})", str(path), digest_of(path), name)
        for name, path in table_paths(settings).items()
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


def check_programs(manifest: Manifest) -> None:
    """Refuse a job that was planned by other programs, or whose tables have changed."""
    _refuse(_programs(manifest) + _tables(manifest))


def check_scene(manifest: Manifest, blend: Path | None, placed: Callable[[str], str] = str) -> None:
    """Refuse to render if anything differs from what was planned; the scene is open.

    ``blend`` is the .blend that is open; ``placed`` returns where a file of the scene lies here.
    """
    found = _programs(manifest) + _tables(manifest)
    if scene_digest(blend) != manifest.scene_sha256:
        found.append(f"the scene {blend or '(none)'} is not the file that was planned")
    if manifest.output.scene_name:
        select_scene(manifest.output.scene_name)
    bpy.context.view_layer.update()  # drivers that may not run are known once they were tried
    if scripts.scripts_run() != manifest.output.scripts:
        found.append(
            f"Python of the scene ran as it was planned, and does not here: add {scripts.TRUST}"
            if manifest.output.scripts
            else "Python of the scene runs, and did not as it was planned"
        )
    here = {item.path: item for item in scene_files()}
    planned = {item.path: item for item in manifest.files if not item.setting}
    for path, item in planned.items():
        now = here.get(placed(path))
        if now is None or now.sha256 != item.sha256:
            found.append(_changed(item.what, now.sha256 if now else ""))
    _refuse(found)


def _programs(manifest: Manifest) -> list[str]:
    return [
        f"{name} is {here}, not {manifest.versions.get(name)}"
        for name, here in versions().items()
        if manifest.versions.get(name) != here
    ]


def _tables(manifest: Manifest) -> list[str]:
    found = []
    for item in manifest.files:
        if item.setting:
            here = digest_of(Path(item.path))
            if here != item.sha256:
                found.append(_changed(item.what, here))
    return found


def _changed(what: str, digest: str) -> str:
    return f"{what} has changed" if digest else f"{what} is missing"


def _refuse(found: list[str]) -> None:
    if found:
        raise InputError(
            f"this is not the job that was planned: {'; '.join(found)}. Bring it back to what it "
            "was, or plan again with --plan and another --out; nothing was rendered or overwritten"
        )
