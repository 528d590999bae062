"""Turns the finished passes of a view into its picture, spectral image and record."""

from __future__ import annotations

import contextlib
import importlib.metadata
import json
import platform
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..datasets.files import relative
from ..datasets.layer_file import read_layers
from ..quality.methods import method_of
from ..scene import view_transform
from ..scene.engines import transparent_film
from ..scene.water import particles
from ..settings.render_plan import RenderPlan
from ..uw_spectral.errors import InputError, first_of
from ..uw_spectral.imaging.matte import without_open_water
from ..uw_spectral.spectra.spectral_image import (
    LINEAR_REC709,
    read_exr,
    replacing,
    write_rgb_exr,
    write_spectral_exr,
)
from . import band_passes, development, picture_layers, raw_pictures, rounds, work
from .band_passes import RenderedPass
from .frame_plans import FramePlans
from .guides import read_guides
from .manifest import Manifest, Output, View
from .work import Rendered

_RECORDED_PACKAGES = ("numpy", "colour-science", "jerlov", "OpenImageIO")
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
_HEAD = 200  # characters of a record, which hold its key


def picture_path(manifest: Manifest, view: View) -> Path:
    """Return the scene-linear picture of a view."""
    return manifest.folder(view) / f"{view.frame:04d}.exr"


def shown_path(manifest: Manifest, view: View) -> Path:
    """Return the picture of a view as it is shown."""
    return picture_path(manifest, view).with_suffix(".png")


def record_path(manifest: Manifest, view: View) -> Path:
    """Return the record of a view, which is written last."""
    return picture_path(manifest, view).with_suffix(".json")


def files(manifest: Manifest, view: View) -> list[Path]:
    """Return all files that a view may have of some job, its record first."""
    picture = picture_path(manifest, view)
    return [
        record_path(manifest, view),
        picture,
        shown_path(manifest, view),
        _spectra_path(picture),
        picture_layers.layers_path(picture),
        picture_layers.truth_path(picture),
        *raw_pictures.paths(picture),
    ]


def _spectra_path(picture: Path) -> Path:
    return picture.with_name(f"{picture.stem}_spectral.exr")


def is_developed(manifest: Manifest, view: View) -> bool:
    """Whether the pictures of a view are there, made of the passes that the manifest plans."""
    try:
        with record_path(manifest, view).open(encoding="utf-8") as file:
            head = file.read(_HEAD)
    except (OSError, UnicodeDecodeError):
        return False
    return f'"key": "{manifest.view_key(view)}"' in head


def develop(
    manifest: Manifest, view: View, rendered: Sequence[Rendered], plans: FramePlans
) -> list[str]:
    """Write the pictures of a view, and its record last.

    Spectra, layers and truth are as rendered; a manifest may have the picture denoised.
    ``rendered`` are all passes of the view, in order. Returns what could not be done, a line each,
    which the record has too; raises InputError if a pass is damaged, or a file cannot be written.
    """
    plan, picture, output = plans.of(view.frame), picture_path(manifest, view), manifest.output
    _require_own(manifest, rendered)
    for path in files(manifest, view):  # of a job that wrote more
        with contextlib.suppress(OSError):  # of which writing tells
            path.unlink()
    whole, variances = _means(manifest, rendered)
    denoised, said = "", []
    noise = rounds.reached(manifest, view, rendered) if manifest.noise else None
    said += [str(noise)] if noise else []
    if method_of(output.engine, output.mode).draws_colours:
        linear = output.cut(np.sum([read_exr(item.path)[0] for item in whole], axis=0))
    else:
        _write_spectra(manifest, view, whole, plan)
        weights = np.array(manifest.developments[view.development].weights)
        paths, bands = [item.path for item in whole], [item.bands for item in whole]
        denoise = output.denoise
        guides = read_guides(manifest, view, rendered) if denoise else None
        linear = development.develop(
            paths, weights, bands, denoise=denoise, guides=guides, region=output.region
        )
        if denoise:
            denoised = _DENOISED[guides is not None]
            said += [_UNGUIDED] if guides is None else []
            there = particles.particles_of(plan.settings, plan.column).clouds
            said += [_PARTICLES] if there else []
    header = {"Camera": view.camera, "Frame": f"{view.frame:03d}", "Software": _SOFTWARE}
    write_rgb_exr(picture, _with_alpha(output, linear, rendered), {**LINEAR_REC709, **header})
    chosen = plan.settings
    shown = shown_path(manifest, view)
    view_transform.write_shown(shown, read_exr(picture)[0], chosen.tone, chosen.contrast)
    raw = raw_pictures.write_raw_picture(manifest, view, plan, output.framed(linear), picture)
    said += picture_layers.develop_layers(manifest, view, rendered, plan, picture)
    record = _record(manifest, view, rendered, plan)
    record["notes"] += said
    record["denoised"] = denoised
    if noise is not None:
        record["noise"] = noise.record()
    if raw:
        record["raw"] = raw
    if variances:
        record["parts"] = variances
    _require_own(manifest, rendered)  # still
    write_json(record_path(manifest, view), record)
    return said


def _with_alpha(
    output: Output, linear: NDArray[np.float32], rendered: Sequence[Rendered]
) -> NDArray[np.float32]:
    """Return a picture as its file has it: where something is left out, with alpha."""
    if output.transparent:
        first = [item.file.path for item in rendered if item.task.number == 0]
        alpha = read_layers(band_passes.layers_path(first[0]))[transparent_film.ALPHA]
        linear = without_open_water(linear, output.cut(alpha))
    elif output.region is not None and not output.crop:
        linear = np.pad(linear, ((0, 0), (0, 0), (0, 1)), constant_values=1.0)
    return output.framed(linear)


def _require_own(manifest: Manifest, rendered: Sequence[Rendered]) -> None:
    """Refuse passes that another job has overwritten since they were rendered."""
    for item in rendered:
        if work.done(manifest, item.task, thorough=False) is None:
            raise InputError(
                f"{item.file.path} is no longer the pass that was rendered: another job writes "
                "into this folder, or it is damaged; give each job an --out of its own"
            )


def write_json(path: Path, value: dict[str, Any]) -> None:
    """Write a JSON file; whole under its name, or not at all."""
    with replacing(path) as temporary:
        temporary.write_text(json.dumps(value, indent=1, default=str) + "\n", encoding="utf-8")


def _means(
    manifest: Manifest, rendered: Sequence[Rendered]
) -> tuple[list[RenderedPass], list[dict[str, Any]]]:
    """Return the passes, parts averaged, and how far the parts of each lie apart."""
    parts = manifest.parts
    if parts == 1:
        return [item.file for item in rendered], []
    found, variances, by_pass = [], [], dict[int, list[Rendered]]()
    for item in rendered:
        by_pass.setdefault(item.task.number // parts, []).append(item)
    for of_pass in by_pass.values():
        files = [item.file for item in of_pass]
        samples = [manifest.passes[item.task.number].samples for item in of_pass]
        images = np.stack([read_exr(item.path)[0].astype(np.float64) for item in files])
        mean, variance = mean_of_parts(images, np.array(samples, dtype=np.float64))
        path = manifest.mean_path(of_pass[0].task.view, of_pass[0].task.number)
        band_passes.make_folder(path.parent)
        write_rgb_exr(path, mean)
        seconds = [item.seconds for item in files if item.seconds is not None]
        found.append(RenderedPass(path, files[0].bands, sum(seconds) if seconds else None))
        by_band = variance.mean(axis=(0, 1))[: len(files[0].bands)]
        variances.append(
            {
                "file": _relative(manifest, path),
                "bands_nm": [manifest.bands_nm[i] for i in files[0].bands],
                "samples": samples,
                "variance_of_the_mean": by_band.tolist(),
            }
        )
    return found, variances


def mean_of_parts(
    images: NDArray[np.float64], samples: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the mean of renders of different noise, and its variance, by pixel.

    ``images`` have the shape (parts, h, w, k). A render counts by its ``samples``, shape (parts,),
    and its variance is taken to fall with them.
    """
    fraction = (samples / samples.sum()).reshape(-1, 1, 1, 1)
    mean = (images * fraction).sum(axis=0)
    apart = (fraction * (images - mean) ** 2).sum(axis=0)
    return mean, apart / (len(samples) - 1)


def _write_spectra(
    manifest: Manifest, view: View, whole: Sequence[RenderedPass], plan: RenderPlan
) -> None:
    picture = picture_path(manifest, view)
    write_spectral_exr(
        _spectra_path(picture),
        manifest.output.framed(manifest.output.cut(band_passes.gather(whole))),
        plan.bands,
        {
            "frame": view.frame,
            "illuminant": plan.illuminant.name,
            "water": "; ".join(dict.fromkeys(water.name for water in plan.waters.layers)),
        },
        plan.radiance_units,
    )


def _record(
    manifest: Manifest, view: View, rendered: Sequence[Rendered], plan: RenderPlan
) -> dict[str, Any]:
    output = manifest.output
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
        "notes": [*plan.notes, *dict.fromkeys(note for item in rendered for note in item.notes)],
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
                "file": _relative(manifest, item.file.path),
                "bands_nm": [manifest.bands_nm[i] for i in item.file.bands],
                "seconds": item.file.seconds,
            }
            for item in rendered
        ],
    }


def _relative(manifest: Manifest, path: Path) -> str:
    return relative(path, manifest.out)


def require(missing: Sequence[str]) -> None:
    """Refuse to end well while passes are missing; name the first of them."""
    if missing:
        raise InputError(
            f"not developed, passes are missing: {first_of(missing, between='; ')}; render them "
            "with --from and --frames; the other pictures are finished"
        )


def _versions() -> dict[str, str]:
    found = {"blender": bpy.app.version_string, "python": platform.python_version()}
    return found | {name: _version(name) for name in _RECORDED_PACKAGES}


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "bundled with Blender"
