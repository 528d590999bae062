"""The files that lamps read: spectra and profiles, of which Blender itself knows nothing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import bpy

from ..stored_lamps import PROPERTY, ROV, stored_lamp

KINDS = ("POINT", "SPOT", "AREA")
"""Types of Blender's lights that light the water; the sun is the water's own."""
SPECTRUM, PROFILE = "spectrum", "profile"
_SCHEME = "file:"


@dataclass(frozen=True)
class LampFile:
    """A file that a lamp names: as its spectrum or its profile, and the path as it is stored."""

    light: bpy.types.Light
    setting: str
    path: str

    @property
    def whole(self) -> Path:
        """The full path; a relative one is seen from the .blend of the lamp."""
        return Path(bpy.path.abspath(self.path, library=self.light.library))

    def move(self, path: str) -> None:
        """Let the lamp read another file."""
        text = f"{_SCHEME}{path}" if self.setting == SPECTRUM else path
        setattr(getattr(self.light, PROPERTY), self.setting, text)


def files_of(light: bpy.types.Light) -> dict[str, LampFile]:
    """Return the files that a lamp names, by what for."""
    chosen, found = stored_lamp(light), {}
    if chosen.spectrum.startswith(_SCHEME):
        found[SPECTRUM] = chosen.spectrum.removeprefix(_SCHEME)
    if chosen.profile not in ("", ROV):
        found[PROFILE] = chosen.profile
    return {setting: LampFile(light, setting, path) for setting, path in found.items()}


def lamp_files() -> Iterator[LampFile]:
    """Yield the files of all lamps of the open .blend that may light its water."""
    for light in bpy.data.lights:
        if light.users and light.type in KINDS and stored_lamp(light).in_water:
            yield from files_of(light).values()
