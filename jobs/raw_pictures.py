"""Raw pictures of a job: what the camera's detector would have counted, with its noise."""

from __future__ import annotations

import hashlib

import numpy as np

from ..datasets.outputs import RawOutputs
from ..datasets.raw_files import write_counts
from ..settings.render_plan import RenderPlan
from ..settings.scene_settings import NO_RAW
from ..uw_spectral.detector import Detector, capture
from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.colour_rendering import response_matrix
from .manifest import Manifest, View
from .view_passes import ViewPasses, Written

_MOSAIC = "RGGB"
_WHITE = 0.5  # of the counts' range


def require_raw(plan: RenderPlan) -> None:
    """Refuse a mosaic of what has none: a DNG of an observer or a film."""
    sensor = plan.sensor
    if plan.settings.raw == "dng" and sensor.kind != "camera":
        raise InputError(
            f"--raw dng: the {sensor.kind} {sensor.name} has no mosaic; give a camera such as "
            "--sensor 'Nikon D7000' (--list-sensors), or --raw tiff"
        )


def write_raw_picture(passes: ViewPasses) -> Written:
    """Write the raw picture of a view, if one is wanted, and return how it was taken."""
    manifest, view, plan, chosen = passes.manifest, passes.view, passes.plan, passes.plan.settings
    if chosen.raw == NO_RAW:
        return {}, []
    to_rec709 = response_matrix(manifest.weights(view), plan.response(view.depth))
    detector = Detector(full_well=chosen.full_well, read_noise=chosen.read_noise)
    pattern = _MOSAIC if chosen.raw == "dng" else None
    raw = RawOutputs(detector, _WHITE, iso=chosen.iso, pattern=pattern, file=chosen.raw)
    taken = raw.settings(to_rec709, _seed(manifest, view))
    counts = capture(passes.output.framed(passes.linear) @ np.linalg.inv(to_rec709).T, taken)
    path = passes.files.raw(chosen.raw)
    write_counts(path, taken, counts, to_rec709, plan.sensor.name, raw.file)
    return {"raw": {**taken.record(), "to_linear_rec709": to_rec709.tolist()}}, []


def _seed(manifest: Manifest, view: View) -> int:
    """Return a seed of the noise, which no other picture of the job has."""
    text = f"{manifest.output.seed} {view.camera} {view.frame}"
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:4], "big")
