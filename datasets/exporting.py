"""Writes a data set: what was rendered of each view becomes files that other software reads."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.spectral_image import read_exr, write_codes, write_jpeg, write_png
from .card import DataCard, Source, write_card
from .depth_maps import PLANAR, RANGE, write_depth_exr, write_depth_png
from .files import make_folder, place_file, read_codes
from .formats import FORMATS, conventions
from .index import Index, IndexedView, SceneObject
from .instance_maps import write_instance_map
from .layer_file import FrameLayers, camera_of, read_layers
from .outputs import Outputs
from .raw_files import write_raw
from .set_files import RenderedView, SetFiles, Shapes, no_note, no_shapes
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
    shapes: Shapes = no_shapes,
    report_note: Callable[[str], None] = no_note,
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
    objects = {
        scene_object.name: (number, scene_object)
        for number, scene_object in enumerate(index.objects, 1)
    }
    views = [_view(folder, spec, view, found[view.name], objects, silhouettes) for view in there]
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


def _view(
    folder: Path,
    spec: DataSetSpec,
    view: IndexedView,
    files: RenderedView,
    objects: Mapping[str, tuple[int, SceneObject]],
    silhouettes: Silhouettes,
) -> DataSetView:
    """Write the files of one view."""
    outputs, name = spec.outputs, view.name
    layers = read_layers(files.layers)
    camera, pose = view.camera, view.camera_to_world
    housing = layers.header.get("housing")
    if housing is not None:  # the one in water that the port makes of it
        camera, pose = camera_of(layers.header)
    image = _file(folder, "images", name, outputs.picture)
    rgb = read_exr(files.picture)[0]
    if outputs.picture == "jpg":
        write_jpeg(image, rgb)
    else:
        write_png(image, rgb)
    if outputs.linear:
        place_file(files.picture, _file(folder, "linear", name, "exr"))
    if outputs.layers:
        place_file(files.layers, _file(folder, "layers", name, "exr"))
    if files.truth.is_file():
        place_file(files.truth, _file(folder, "truth", name, "json"))
    depth = _file(folder, "depth", name, "png")
    write_depth_png(depth, layers[PLANAR].astype(np.float64))
    if outputs.depth_exr:
        write_depth_exr(depth.with_suffix(".exr"), layers[RANGE], camera)
    numbers = _file(folder, "instances", name, "png")
    instances = _instances(numbers, view, outputs, layers, objects)
    if any(FORMATS[each].silhouettes for each in outputs.formats):
        instances = _with_silhouettes(folder, view, instances, numbers, silhouettes)
    metadata: dict[str, Any] = {
        "water": view.record["settings"]["water"],
        "lowered_m": view.lowered,
        "pose": view.record["pose"],
        "camera": view.record["camera"]["name"],
        "group": view.group,
        **{k: view.record[k] for k in _LATER if k in view.record},
        **({"housing": housing} if housing is not None else {}),
        "settings": view.record["settings"],
        "rig": view.record["rig"],
    }
    if spec.raw is not None:
        raw = _file(folder, "raw", name, spec.raw.file)
        metadata["raw"] = write_raw(
            raw, view, spec.raw, layers[IMAGE], files.development().to_rec709
        )
    return DataSetView(
        name, image, camera, pose, view.split,
        depth=depth, instance_map=numbers, instances=tuple(instances.values()), metadata=metadata,
    )  # fmt: skip


def _instances(
    path: Path,
    view: IndexedView,
    outputs: Outputs,
    layers: FrameLayers,
    objects: Mapping[str, tuple[int, SceneObject]],
) -> dict[str, SeenInstance]:
    """Write the numbers of the objects that a view sees, and return these by name."""
    rendered = np.asarray(layers[INSTANCE]).astype(np.int64)
    numbers, found = np.zeros_like(rendered), {}
    for shown in np.unique(rendered).tolist():
        name = layers.instances.get(shown, "")
        if name not in objects or objects[name][1].category in outputs.leave_out:
            continue
        number, scene_object = objects[name]
        numbers[rendered == shown] = number
        pose = np.array(scene_object.object_to_world)
        pose[2, 3] -= view.lowered
        found[name] = SeenInstance(
            number,
            scene_object.category,
            pose,
            scene_object.model,
            category_id=scene_object.category_id,
        )
    write_instance_map(path, numbers)
    return found


def _with_silhouettes(
    folder: Path,
    view: IndexedView,
    instances: Mapping[str, SeenInstance],
    numbers: Path,
    silhouettes: Silhouettes,
) -> dict[str, SeenInstance]:
    """Write all of what a view sees a part of, what hides it left out."""
    seen, wholes, found = read_codes(numbers), silhouettes(view, list(instances)), {}
    for name, item in instances.items():
        path = _file(folder, "silhouettes", f"{view.name}_{item.number:05d}", "png")
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


def _file(folder: Path, kind: str, name: str, suffix: str) -> Path:
    return make_folder(folder / kind) / f"{name}.{suffix}"
