"""Turns the finished passes of a view into its picture, spectral image and record."""

from __future__ import annotations

import contextlib
import importlib.metadata
import json
import platform
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any

import bpy

from ..datasets.files import relative, write_text
from ..scene import view_transform
from ..scene.terms import particles
from ..uw_spectral.spectra.spectral_image import (
    LINEAR_REC709,
    read_exr,
    write_rgb_exr,
    write_spectral_exr,
)
from . import rounds
from .band_passes import gather
from .frame_plans import FramePlans
from .manifest import Manifest, View
from .picture_layers import write_picture_layers
from .raw_pictures import write_raw_picture
from .receptor_pictures import write_receptor_pictures
from .tasks import Rendered
from .view_passes import ViewPasses, Written

_DENOISED = {
    True: "OpenImageDenoise, the developed picture, guided by albedo and normal",
    False: "OpenImageDenoise, the developed picture, without guides",
}
_UNGUIDED = (
    "denoised without guides, which these passes do not have: edges may be soft; render them again "
    "for guides"
)
_PARTICLES = (
    "denoised: faint particles may have been taken for noise; --no-denoise keeps them, and the "
    "noise"
)
_SOFTWARE = "Underwater Spectral"
_RECORDED_PACKAGES = ("numpy", "colour-science", "jerlov", "OpenImageIO")


def develop(
    manifest: Manifest, view: View, rendered: Sequence[Rendered], plans: FramePlans
) -> list[str]:
    """Write the pictures of a view, and its record last.

    Spectra, layers and truth are as rendered; a manifest may have the picture denoised.
    ``rendered`` are all passes of the view, in order. Returns what could not be done, a line each,
    which the record has too; raises InputError if a pass is damaged, or a file cannot be written.
    """
    passes = ViewPasses(manifest, view, rendered, plans.of(view.frame))
    passes.require_own()
    for path in passes.files.all():  # of a job that wrote more
        with contextlib.suppress(OSError):  # of which writing tells
            path.unlink()
    record, said = _record_of(passes), list[str]()
    for write in _WRITERS:
        facts, notes = write(passes)
        record |= facts
        said += notes
    record["notes"] += said
    passes.require_own()  # still
    write_text(passes.files.record, json.dumps(record, indent=1, default=str) + "\n")
    return said


def _record_of(passes: ViewPasses) -> dict[str, Any]:
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


def _versions() -> dict[str, str]:
    found = {"blender": bpy.app.version_string, "python": platform.python_version()}
    for name in _RECORDED_PACKAGES:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            found[name] = "bundled with Blender"
    return found


def _noise(passes: ViewPasses) -> Written:
    if not passes.manifest.noise:
        return {}, []
    found = rounds.reached(passes.manifest, passes.view, passes.rendered)
    return {"noise": found.record()}, [str(found)]


def _denoising(passes: ViewPasses) -> Written:
    if passes.manifest.method.draws_colours or not passes.output.denoise:
        return {"denoised": ""}, []
    notes = [_UNGUIDED] if passes.guides is None else []
    if particles.particles_of(passes.plan.settings, passes.plan.column).clouds:
        notes.append(_PARTICLES)
    return {"denoised": _DENOISED[passes.guides is not None]}, notes


def _write_spectra(passes: ViewPasses) -> Written:
    plan, output = passes.plan, passes.output
    if not passes.manifest.method.draws_colours:
        bands = gather([item.file for item in passes.whole])
        header = {
            "frame": passes.view.frame,
            "illuminant": plan.illuminant.name,
            "water": "; ".join(dict.fromkeys(water.name for water in plan.waters.layers)),
        }
        image = output.framed(output.cut(bands))
        write_spectral_exr(passes.files.spectra, image, plan.bands, header, plan.radiance_units)
    return {}, []


def _write_picture(passes: ViewPasses) -> Written:
    """Write the picture, linear and as it is shown."""
    view, files, chosen = passes.view, passes.files, passes.plan.settings
    header = {"Camera": view.camera, "Frame": f"{view.frame:03d}", "Software": _SOFTWARE}
    write_rgb_exr(files.picture, passes.picture, {**LINEAR_REC709, **header})
    shown = read_exr(files.picture)[0]
    view_transform.write_shown(files.shown, shown, chosen.tone, chosen.contrast)
    return {}, []


def _parts(passes: ViewPasses) -> Written:
    """Say how far the parts of each pass lie apart."""
    manifest, found = passes.manifest, []
    for item in passes.whole:
        if item.variance is not None:
            found.append(
                {
                    "file": relative(item.file.path, manifest.out),
                    "bands_nm": [manifest.bands_nm[i] for i in item.file.bands],
                    "samples": [manifest.passes[x.task.number].samples for x in item.parts],
                    "variance_of_the_mean": item.variance.tolist(),
                }
            )
    return ({"parts": found} if found else {}), []


_WRITERS: tuple[Callable[[ViewPasses], Written], ...] = (
    _noise,
    _denoising,
    _write_spectra,
    write_receptor_pictures,
    _write_picture,
    write_raw_picture,
    write_picture_layers,
    _parts,
)
"""All that is made of the passes of a view; the layers' truth is that of the picture."""
