"""Formats that the jobs of a data set could not fill, refused before anything is rendered."""

from __future__ import annotations

from ..datasets.cameras_and_rigs import DataSetCamera
from ..datasets.formats import FORMATS
from ..datasets.specification import DataSetSpec
from ..settings.render_plan import plan_of
from ..uw_spectral.errors import InputError
from ..uw_spectral.housing.description import NONE
from .manifest import Manifest
from .picture_layers import missing_layers


def require_formats(spec: DataSetSpec, camera: DataSetCamera, manifest: Manifest) -> None:
    """Refuse formats that could not be written of a job in the end."""
    settings = manifest.settings_of(manifest.frames[0])
    of_scene = settings.housing != NONE or (settings.lens and not camera.coefficients)
    for name in spec.outputs.formats if of_scene else ():
        FORMATS[name].require_lens(name, camera.name, 5)
    plan = plan_of(settings)
    for name in spec.outputs.formats:
        missing = missing_layers(plan, FORMATS[name].layers, traced=manifest.method.traced)
        if missing:
            raise InputError(
                f"{name} is made of the layer {', '.join(missing)}, which Cycles gives in water "
                "that is the same at every depth only; render with engine = 'eevee', or leave "
                f"{name} out"
            )
