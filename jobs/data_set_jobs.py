"""The jobs of a data set on disk: what is left, what it takes, and the files of what is there."""

from __future__ import annotations

import functools
import json
import shutil
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ..datasets.exporting import export_set
from ..datasets.formats import FORMATS
from ..datasets.index import Index, IndexedView
from ..datasets.set_files import Development, RenderedView, Shape
from ..datasets.specification import DataSetSpec
from ..scene.readers.mesh_shapes import mesh_shape
from ..scene.readers.silhouettes import silhouettes
from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.colour_rendering import luminance, response_matrix
from . import job_status
from .frame_plans import FramePlans
from .manifest import Manifest, View
from .manifest_files import read_manifest
from .picture_files import files_of, is_developed
from .tasks import Part, Task, done

_GB = 1e9
_PIXEL_BYTES = 150  # of pictures, depth and layers
_SMALLER = 0.4  # what compression leaves, about


@dataclass(frozen=True)
class SetJobs:
    """A data set, and the manifests of its jobs by their names."""

    index: Index
    manifests: Mapping[str, Manifest]

    def missing_views(self, name: str) -> dict[View, list[Task]]:
        """Return the views of a job that the set needs and that have no pictures, with passes."""
        manifest, frames = self.manifests[name], tuple(self.index.frames(name))
        found: dict[View, list[Task]] = {}
        for task in Part(frames=frames).tasks(manifest) if frames else ():
            found.setdefault(task.view, []).append(task)
        return {view: found[view] for view in found if not is_developed(manifest, view)}

    def rendered(self, name: str) -> list[View]:
        """Return the views of a job that are rendered and have no pictures."""
        return [
            view
            for view, tasks in self.missing_views(name).items()
            if all(done(self.manifests[name], task, thorough=False) for task in tasks)
        ]

    def status(self) -> tuple[str, str]:
        """Return how far a set is, in lines and as JSON."""
        found = {name: job_status.status_of(job) for name, job in self.manifests.items()}
        lines = [f"{name}: {of_job.text().splitlines()[0]}" for name, of_job in found.items()]
        content = {name: of_job.record() for name, of_job in found.items()}
        return "\n".join(lines), json.dumps(content)

    def require_room(self, spec: DataSetSpec) -> None:
        """Refuse a set that the disk cannot hold."""
        folder, needed = self.index.folder, 0.0
        of_formats = sum(FORMATS[name].pixel_bytes for name in spec.outputs.formats)
        for name, manifest in self.manifests.items():
            width, height = manifest.output.size
            pixel = _PIXEL_BYTES + of_formats + 8 * len(manifest.bands_nm)
            needed += len(self.missing_views(name)) * _SMALLER * width * height * pixel
        free = shutil.disk_usage(folder).free
        if needed > free:
            raise InputError(
                f"the set takes about {needed / _GB:.3g} GB, and {folder} has {free / _GB:.3g} GB "
                "free; make room, choose another --out, or shorten the specification"
            )


def read_jobs(index: Index) -> SetJobs:
    """Return the jobs of a set; raise InputError if a manifest cannot be read."""
    return SetJobs(index, {name: read_manifest(index.manifest(name)) for name in index.jobs})


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
