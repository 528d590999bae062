"""The record of a picture: all that it was made of, and by what."""

from __future__ import annotations

import importlib.metadata
import json
import platform
from dataclasses import asdict
from pathlib import Path
from typing import Any

import bpy

from ..datasets.files import relative, write_text
from ..scene.terms import particles
from .view_passes import ViewPasses

_RECORDED_PACKAGES = ("numpy", "colour-science", "jerlov", "OpenImageIO")


def record_of(passes: ViewPasses) -> dict[str, Any]:
    """Return what is known of a picture beforehand, as JSON holds it."""
    manifest, view, plan, output = passes.manifest, passes.view, passes.plan, passes.output
    chosen = manifest.developments[view.development]
    return {
        "key": manifest.view_key(view),
        "frame": view.frame,
        "camera_depth_m": view.depth,
        "settings": manifest.settings_of(view.frame).in_effect(output.engine),
        "job": {
            "engine": output.engine,
            "mode": output.mode,
            "device": output.device,
            "frames": manifest.frames,
            "resolution": output.size,
            **({"region": asdict(output.region), "crop": output.crop} if output.region else {}),
            "seed": output.seed,
            "parts": manifest.parts,
            "denoise": output.denoise,
            "froxels": output.froxels,
            "decisions": output.decisions,
            "out": str(manifest.out),
            "blend": str(manifest.scene or ""),
            "camera": view.camera,
            "water_extent_m": output.extent,
        },
        "notes": [
            *plan.notes,
            *dict.fromkeys(note for item in passes.rendered for note in item.notes),
        ],
        **plan.record(),
        **particles.record(plan.settings, plan.column),
        "versions": _versions(),
        "development": {
            "description": chosen.description,
            "weights": chosen.weights,
            "tone": plan.settings.tone,
            "contrast": plan.settings.contrast,
        },
        **({"lamps": shining} if (shining := manifest.lamps_of(view.frame)) else {}),
        **({"clouds": floating} if (floating := manifest.clouds_of(view.frame)) else {}),
        "passes": [
            {
                "file": relative(item.file.path, manifest.out),
                "bands_nm": [manifest.bands_nm[i] for i in item.file.bands],
                "seconds": item.file.seconds,
            }
            for item in passes.rendered
        ],
    }


def write_json(path: Path, value: dict[str, Any]) -> None:
    """Write a JSON file; whole under its name, or not at all."""
    write_text(path, json.dumps(value, indent=1, default=str) + "\n")


def _versions() -> dict[str, str]:
    found = {"blender": bpy.app.version_string, "python": platform.python_version()}
    return found | {name: _version(name) for name in _RECORDED_PACKAGES}


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "bundled with Blender"
