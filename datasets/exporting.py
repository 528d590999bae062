"""Writes a data set: what was rendered of each view becomes files that other software reads."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.spectral_image import read_exr, write_codes, write_jpeg, write_png
from .card import DataCard, Source, write_card
from .depth_maps import PLANAR, RANGE, write_depth_exr, write_depth_png
from .files import make_folder, place_file
from .formats import FORMATS, conventions
from .index import Index, IndexedView, SceneObject
from .instance_maps import write_instance_map
from .layer_file import FrameLayers, camera_of, read_layers
from .picture_codes import read_codes
from .raw_files import write_raw
from .set_files import RenderedView, SetFiles, Shapes
from .specification import DataSetSpec
from .view import DataSetView, SeenInstance

_LATER = ("pose_set", "repeat", "time_s", "time_ns")  # which an earlier version's index may lack

IMAGE, INSTANCE = "I", "instance"
"""Layers that are read."""


Silhouettes = Callable[[IndexedView, Sequence[str]], Mapping[str, NDArray[np.bool_]]]
"""Returns where objects of these names would be seen if nothing hid them."""


def needed_layers(spec: DataSetSpec) -> tuple[str, ...]:
    """Return the layers that have to be rendered: what is wanted, and what files are made of."""
    of_raw = (IMAGE,) if spec.raw is not None else ()
    of_formats = [name for each in spec.outputs.formats for name in FORMATS[each].layers]
    wanted = (RANGE, PLANAR, INSTANCE, *of_raw, *of_formats, *spec.outputs.layers)
    return tuple(dict.fromkeys(wanted))


def export_set(
    index: Index,
    spec: DataSetSpec,
    rendered: Callable[[IndexedView], RenderedView],
    versions: Mapping[str, str],
    silhouettes: Silhouettes,
    shapes: Shapes,
    report_note: Callable[[str], None],
) -> list[DataSetView]:
    """Write the files of the views that are rendered, and return these.

    ``rendered`` returns where the files of a view lie; ``silhouettes`` and ``shapes`` are for BOP;
    ``report_note`` receives what a format could not hold, which the data card says too. Raises
    InputError if nothing is rendered, or a file cannot be read or written.
    """
    folder, outputs = index.folder, spec.outputs
    found = {view.name: rendered(view) for view in index.views.values()}
    there = [view for view in index.views.values() if found[view.name].record is not None]
    if not there:
        raise InputError(f"{folder}: no view is rendered; render with --dataset, or --from")
    export = _Export(index, spec, silhouettes)
    views = [export.view(view, found[view.name]) for view in there]
    card = _card(spec, index, versions, [x.record for x in found.values() if x.record is not None])
    notes: list[str] = []
    files = SetFiles(
        folder, views, card, outputs.points, spec.seed, found, shapes, notes.append,
        tuple(camera.name for camera in spec.cameras), tuple(poses.name for poses in spec.poses),
    )  # fmt: skip
    for name, each in FORMATS.items():
        if name in outputs.formats:
            each.write(files)
    write_card(folder / "README.md", card, views, notes)
    for note in notes:
        report_note(note)
    return views


@dataclass(frozen=True)
class _Export:
    """What the files of each view are made by."""

    index: Index
    spec: DataSetSpec
    silhouettes: Silhouettes

    @cached_property
    def objects(self) -> dict[str, tuple[int, SceneObject]]:
        """The objects of the scene and their numbers, by their names."""
        return {item.name: (number, item) for number, item in enumerate(self.index.objects, 1)}

    def file(self, kind: str, name: str, end: str) -> Path:
        """Return a file of a view in a folder of its kind, which is made."""
        return make_folder(self.index.folder / kind) / f"{name}.{end}"

    def view(self, view: IndexedView, files: RenderedView) -> DataSetView:
        """Write the files of one view."""
        outputs, name, raw = self.spec.outputs, view.name, self.spec.raw
        layers = read_layers(files.layers)
        camera, pose = view.camera, view.camera_to_world
        housing = layers.header.get("housing")
        if housing is not None:  # the one in water that the port makes of it
            camera, pose = camera_of(layers.header)
        image = self.file("images", name, outputs.picture)
        write = write_jpeg if outputs.picture == "jpg" else write_png
        write(image, read_exr(files.picture)[0])
        for kind, source, wanted in (
            ("linear", files.picture, outputs.linear),
            ("layers", files.layers, bool(outputs.layers)),
            ("truth", files.truth, files.truth.is_file()),
        ):
            if wanted:
                place_file(source, self.file(kind, name, source.suffix[1:]))
        depth = self.file("depth", name, "png")
        write_depth_png(depth, layers[PLANAR].astype(np.float64))
        if outputs.depth_exr:
            write_depth_exr(depth.with_suffix(".exr"), layers[RANGE], camera)
        numbers = self.file("instances", name, "png")
        instances = self._instances(numbers, view, layers)
        if any(FORMATS[each].silhouettes for each in outputs.formats):
            instances = self._with_silhouettes(view, instances, numbers)
        metadata: dict[str, Any] = {
            "water": view.record["settings"]["water"],
            "lowered_m": view.lowered,
            "pose": view.record["pose"],
            "camera": view.record["camera"]["name"],
            "group": view.group,
            "frame": view.frame,
            **{k: view.record[k] for k in _LATER if k in view.record},
            **({"housing": housing} if housing is not None else {}),
            "settings": view.record["settings"],
            "rig": view.record["rig"],
        }
        if raw is not None:
            path, to_rec709 = self.file("raw", name, raw.file), files.development().to_rec709
            metadata["raw"] = write_raw(path, view, raw, layers[IMAGE], to_rec709)
        return DataSetView(
            name, image, camera, pose, view.split, depth=depth, instance_map=numbers,
            instances=tuple(instances.values()), metadata=metadata,
        )  # fmt: skip

    def _instances(
        self, path: Path, view: IndexedView, layers: FrameLayers
    ) -> dict[str, SeenInstance]:
        """Write the numbers of the objects that a view sees, and return these by name."""
        rendered = np.asarray(layers[INSTANCE]).astype(np.int64)
        numbers, found = np.zeros_like(rendered), {}
        for shown in np.unique(rendered).tolist():
            name = layers.instances.get(shown, "")
            number, item = self.objects.get(name, (0, None))
            if item is None or item.category in self.spec.outputs.leave_out:
                continue
            numbers[rendered == shown] = number
            pose = np.array(item.object_to_world)
            pose[2, 3] -= view.lowered
            kind = item.category_id
            found[name] = SeenInstance(number, item.category, pose, item.model, category_id=kind)
        write_instance_map(path, numbers)
        return found

    def _with_silhouettes(
        self, view: IndexedView, instances: Mapping[str, SeenInstance], numbers: Path
    ) -> dict[str, SeenInstance]:
        """Write all of what a view sees a part of, what hides it left out."""
        seen, wholes, found = read_codes(numbers), self.silhouettes(view, list(instances)), {}
        for name, item in instances.items():
            path = self.file("silhouettes", f"{view.name}_{item.number:05d}", "png")
            # What is seen is a part of it, whatever a ray at the edge met.
            whole = wholes[name] | (seen == item.number)
            write_codes(path, np.where(whole, 255, 0).astype(np.uint8))
            found[name] = replace(item, silhouette=path)
        return found


def _card(
    spec: DataSetSpec, index: Index, versions: Mapping[str, str], records: Sequence[Path]
) -> DataCard:
    sources = {Source(index.scene.name, "see where it comes from", f"sha256 {index.scene_sha256}")}
    for path in records:
        for what, source in json.loads(path.read_text(encoding="utf-8"))["sources"].items():
            sources.add(Source(what, "", "; ".join(source.splitlines())))
    return DataCard(
        spec.title,
        spec.licence,
        sorted(sources, key=lambda source: (source.name, source.reference)),
        versions,
        spec.outputs.version,
        spec.outputs.description,
        conventions=conventions(spec.outputs.formats),
    )
