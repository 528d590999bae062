"""Files of another machine: the rules by which a render farm moves paths, and their use."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path, PurePath, PurePosixPath, PureWindowsPath
from typing import Any

import bpy

from ..scene.readers.lamp_files import lamp_files
from ..scene.stored_materials import fluorophore_files
from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.spectrum import split_location
from .manifest import Manifest, tables

_VERSION = "pathmapping-1.0"
_FORMATS: dict[str, type[PurePath]] = {"POSIX": PurePosixPath, "WINDOWS": PureWindowsPath}


@dataclass(frozen=True)
class PathRule:
    """What lies below ``source`` on the machine of the artist lies below ``destination`` here."""

    source: PurePath
    destination: Path

    def apply(self, path: str) -> str | None:
        """Return the path here; None if the rule does not speak of it."""
        try:
            below = type(self.source)(path).relative_to(self.source)
        except ValueError:
            return None
        return str(self.destination.joinpath(*below.parts))


@dataclass(frozen=True)
class PathMapping:
    r"""Rules of which the first that fits applies.

    Examples
    --------
    >>> rule = PathRule(PureWindowsPath("P:/reef"), Path("/mnt/reef"))
    >>> PathMapping((rule,)).apply(r"p:\reef\sand.png")
    '/mnt/reef/sand.png'
    >>> PathMapping((rule,)).apply("//sand.png")
    '//sand.png'
    """

    rules: tuple[PathRule, ...] = ()

    def apply(self, path: str) -> str:
        """Return a path as it is here; as it was where no rule fits."""
        found = (rule.apply(path) for rule in self.rules)
        return next((mapped for mapped in found if mapped is not None), path)

    def apply_to_manifest(self, manifest: Manifest) -> Manifest:
        """Return a manifest whose scene, results and tables are those of this machine.

        The files of the scene stay named as the .blend has them.
        """
        if not self.rules:
            return manifest
        return replace(
            manifest,
            scene=self._placed(manifest.scene) if manifest.scene is not None else None,
            out=self._placed(manifest.out),
            rendered_in=self._placed(manifest.rendered_in) if manifest.rendered_in else None,
            settings=self._settings(manifest.settings),
            changes={frame: self._settings(some) for frame, some in manifest.changes.items()},
            stage=manifest.stage.moved(self.apply) if manifest.stage is not None else None,
            files=tuple(
                replace(item, path=self.apply(item.path)) if item.setting else item
                for item in manifest.files
            ),
        )

    def _settings(self, settings: Mapping[str, Any]) -> dict[str, Any]:
        found = dict(settings)
        for name, location in tables(settings).items():
            path, part = split_location(location)
            found[name] = f"file:{self.apply(str(path))}{f'#{part}' if part else ''}"
        return found

    def _placed(self, path: Path) -> Path:
        return Path(self.apply(str(path)))


def read_path_mapping(path: Path) -> PathMapping:
    """Read the rules that Open Job Description gives a session (``pathmapping-1.0``), as JSON.

    Without rules, the file holds ``{}``. Raises InputError if there is none, or it holds something
    else.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        if content and content["version"] != _VERSION:
            raise ValueError(f"version {content['version']!r}")
        rules = content.get("path_mapping_rules", [])
        return PathMapping(
            tuple(
                PathRule(
                    _FORMATS[rule["source_path_format"]](rule["source_path"]),
                    Path(rule["destination_path"]),
                )
                for rule in rules
                if rule["source_path_format"] in _FORMATS
            )
        )
    except OSError as error:
        raise InputError(
            f"--path-mapping: cannot read {path}: {error.strerror}; check the path"
        ) from error
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(
            f"--path-mapping: {path} holds no rules of {_VERSION} ({error}); the farm writes it"
        ) from error


def apply_to_scene(mapping: PathMapping) -> None:
    """Let libraries, textures, caches and lamps' tables come from where they lie here."""
    if not mapping.rules:
        return

    def mapped(_: bpy.types.ID, path: str, __: object) -> str | None:
        moved = mapping.apply(path)
        return moved if moved != path else None

    before = {library: library.filepath for library in bpy.data.libraries}
    flags = {"SKIP_PACKED", "SKIP_WEAK_REFERENCES", "RELOAD_EDITED"}
    bpy.data.file_path_foreach(mapped, flags=flags)
    for library in [library for library, path in before.items() if library.filepath != path]:
        library.reload()
    for file in (*lamp_files(), *fluorophore_files()):
        path = mapping.apply(file.path)
        if path != file.path:
            file.move(path)
