"""Turns the finished passes of a view into its picture, spectral image and record."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..datasets.files import relative
from ..datasets.layer_file import read_layers
from ..scene import view_transform
from ..scene.engines import transparent_film
from ..scene.terms import particles
from ..settings.render_plan import RenderPlan
from ..uw_spectral.errors import InputError
from ..uw_spectral.imaging.matte import without_open_water
from ..uw_spectral.spectra.spectral_image import (
    LINEAR_REC709,
    read_exr,
    write_rgb_exr,
    write_spectral_exr,
)
from . import (
    band_passes,
    development,
    picture_layers,
    raw_pictures,
    receptor_pictures,
    rounds,
    work,
)
from .band_passes import RenderedPass
from .frame_plans import FramePlans
from .guides import read_guides
from .manifest import Manifest, Output, View
from .picture_files import files_of
from .picture_record import record_of, write_json
from .work import Rendered

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


def develop(
    manifest: Manifest, view: View, rendered: Sequence[Rendered], plans: FramePlans
) -> list[str]:
    """Write the pictures of a view, and its record last.

    Spectra, layers and truth are as rendered; a manifest may have the picture denoised.
    ``rendered`` are all passes of the view, in order. Returns what could not be done, a line each,
    which the record has too; raises InputError if a pass is damaged, or a file cannot be written.
    """
    plan, files, output = plans.of(view.frame), files_of(manifest, view), manifest.output
    _require_own(manifest, rendered)
    for path in files.all():  # of a job that wrote more
        with contextlib.suppress(OSError):  # of which writing tells
            path.unlink()
    whole, variances = _means(manifest, rendered)
    denoised, said, receptors = "", [], {}
    noise = rounds.reached(manifest, view, rendered) if manifest.noise else None
    said += [str(noise)] if noise else []
    if manifest.method.draws_colours:
        linear = output.cut(np.sum([read_exr(item.path)[0] for item in whole], axis=0))
    else:
        _write_spectra(manifest, view, whole, plan)
        paths, bands = [item.path for item in whole], [item.bands for item in whole]
        denoise = output.denoise
        guides = read_guides(manifest, view, rendered) if denoise else None
        developed = functools.partial(
            development.develop, paths, passes=bands, guides=guides, region=output.region
        )
        linear = developed(manifest.weights(view), denoise=denoise)
        receptors = receptor_pictures.write_receptor_pictures(manifest, view, plan, developed)
        if denoise:
            denoised = _DENOISED[guides is not None]
            said += [_UNGUIDED] if guides is None else []
            there = particles.particles_of(plan.settings, plan.column).clouds
            said += [_PARTICLES] if there else []
    header = {"Camera": view.camera, "Frame": f"{view.frame:03d}", "Software": _SOFTWARE}
    write_rgb_exr(files.picture, _with_alpha(output, linear, rendered), {**LINEAR_REC709, **header})
    chosen = plan.settings
    shown = read_exr(files.picture)[0]
    view_transform.write_shown(files.shown, shown, chosen.tone, chosen.contrast)
    raw = raw_pictures.write_raw_picture(manifest, view, plan, output.framed(linear))
    said += picture_layers.develop_layers(manifest, view, rendered, plan)
    record = record_of(manifest, view, rendered, plan)
    record["notes"] += said
    record["denoised"] = denoised
    if noise is not None:
        record["noise"] = noise.record()
    if raw:
        record["raw"] = raw
    if receptors:
        record["receptors"] = receptors
    if variances:
        record["parts"] = variances
    _require_own(manifest, rendered)  # still
    write_json(files.record, record)
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
                "file": relative(path, manifest.out),
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
    write_spectral_exr(
        files_of(manifest, view).spectra,
        manifest.output.framed(manifest.output.cut(band_passes.gather(whole))),
        plan.bands,
        {
            "frame": view.frame,
            "illuminant": plan.illuminant.name,
            "water": "; ".join(dict.fromkeys(water.name for water in plan.waters.layers)),
        },
        plan.radiance_units,
    )
