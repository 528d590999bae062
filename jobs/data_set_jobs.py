"""The jobs of a data set on disk: what is left of them, how far they are, what they take."""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from dataclasses import dataclass

from ..datasets.formats import FORMATS
from ..datasets.index import Index
from ..datasets.specification import DataSetSpec
from ..uw_spectral.errors import InputError
from . import job_status
from .manifest import Manifest, View
from .manifest_files import read_manifest
from .picture_files import is_developed
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
