"""Exports a rendered data set: finds what its jobs made, and has the files written."""

from __future__ import annotations

import functools
from collections.abc import Callable, Collection, Mapping, Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from ..datasets.exporting import export_set
from ..datasets.index import IndexedView
from ..datasets.set_files import Development, RenderedView, Shape
from ..datasets.specification import DataSetSpec
from ..scene.readers.mesh_shapes import mesh_shape
from ..scene.readers.silhouettes import silhouettes
from ..uw_spectral.spectra.colour_rendering import luminance, response_matrix
from .data_set_jobs import SetJobs
from .frame_plans import FramePlans
from .picture_files import files_of, is_developed


def export(
    jobs: SetJobs,
    spec: DataSetSpec,
    scene: Callable[[], bpy.types.Scene],
    report_note: Callable[[str], None],
) -> str:
    """Write the files of a set, and return a line that says how many.

    ``scene`` opens the scene, where silhouettes are needed; ``report_note`` receives what a format
    could not hold. Raises InputError if nothing is rendered, or a file cannot be read or written.
    """
    index, manifests = jobs.index, jobs.manifests
    plans = {name: FramePlans(manifest) for name, manifest in manifests.items()}

    def rendered(view: IndexedView) -> RenderedView:
        manifest = manifests[view.job]
        shown = next(item for item in manifest.views if item.frame == view.frame)
        files = files_of(manifest, shown)
        is_done = is_developed(manifest, shown)

        def development() -> Development:
            plan = plans[view.job].of(view.frame)
            weights = manifest.weights(shown)
            white = luminance(weights @ plan.illuminant.total_in(plan.bands))
            return Development(response_matrix(weights, plan.response(shown.depth)), float(white))

        return RenderedView(
            files.picture, files.layers, files.record if is_done else None, files.truth, development
        )

    @functools.cache
    def opened() -> bpy.types.Scene:
        found = scene()
        found.frame_set(int(index.rendered["held"]))
        return found

    def alone(view: IndexedView, names: Sequence[str]) -> Mapping[str, NDArray[np.bool_]]:
        # The scene is as it was before it was lowered with its camera.
        pose = view.camera_to_world.copy()
        pose[2, 3] += view.lowered
        return silhouettes(opened(), names, view.camera, pose)

    def shapes(models: Collection[int]) -> Mapping[int, Shape]:
        first = {scene_object.model: scene_object.name for scene_object in reversed(index.objects)}
        made = {model: mesh_shape(opened(), first[model]) for model in models}
        return {model: shape for model, shape in made.items() if shape is not None}

    versions = manifests[index.jobs[0]].versions
    views = export_set(index, spec, rendered, versions, alone, shapes, report_note)
    left = len(index.views) - len(views)
    return f"exported: {len(views)} view(s)" + (f", {left} not rendered yet" if left else "")
