"""F1 on a setting or a button: its page, written when it is first asked for.

The page holds what the tooltips say, all of them, so that it needs no network and cannot be of
another version.
"""

from __future__ import annotations

import html
import tempfile
from collections.abc import Iterator
from pathlib import Path

import bpy

from ..scene import stored_clouds, stored_lamps, stored_materials, stored_settings
from . import operators, panel_job
from .preferences import ADDON

_FILE = "help.html"
_STYLE = "body{font-family:sans-serif;max-width:46em;margin:2em auto;line-height:1.5}"


def entries() -> Iterator[tuple[str, str, str]]:
    """Yield what Blender calls a property or operator, its name and its words."""
    groups = (
        ("UnderwaterProperties", bpy.types.Scene, stored_settings.PROPERTY),
        ("UnderwaterPanelProperties", bpy.types.Scene, panel_job.PROPERTY),
        ("UnderwaterLamp", bpy.types.Light, stored_lamps.PROPERTY),
        ("UnderwaterCloud", bpy.types.Object, stored_clouds.PROPERTY),
        ("UnderwaterMaterial", bpy.types.Material, stored_materials.PROPERTY),
    )
    for kind, owner, name in groups:
        pointer = owner.bl_rna.properties[name]
        for item in pointer.fixed_type.properties:
            if item.identifier not in ("rna_type", "name"):
                yield f"bpy.types.{kind}.{item.identifier}", item.name, item.description
    for cls in operators.CLASSES:
        yield f"bpy.ops.{cls.bl_idname}", cls.bl_label, getattr(cls, "bl_description", "")


def page() -> str:
    """Return the page, an anchor for each entry."""
    rows = "".join(
        f'<h3 id="{html.escape(key.lower())}">{html.escape(name)}</h3>'
        f"<p>{html.escape(text)}.</p><p><code>{html.escape(key)}</code></p>"
        for key, name, text in entries()
    )
    title = "Underwater Spectral: settings and buttons"
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{title}</title>'
        f"<style>{_STYLE}</style><h1>{title}</h1>{rows}</html>"
    )


def _folder() -> Path:
    if ADDON.startswith("bl_ext."):
        return Path(bpy.utils.extension_path_user(ADDON, create=True))
    return Path(tempfile.gettempdir())


def manual_map() -> tuple[str, tuple[tuple[str, str], ...]]:
    """Return where Blender finds help; the page is written anew."""
    path = _folder() / _FILE
    path.write_text(page(), encoding="utf-8")
    return path.as_uri(), tuple((f"{key.lower()}", f"#{key.lower()}") for key, _, _ in entries())


def register() -> None:
    """Tell Blender where help is."""
    bpy.utils.register_manual_map(manual_map)


def unregister() -> None:
    """Take it back."""
    bpy.utils.unregister_manual_map(manual_map)
