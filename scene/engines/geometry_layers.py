"""Layers of where objects are: one more render, of one sample at the centre of every pixel."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...datasets import cryptomatte
from ...datasets.depth_maps import PLANAR, RANGE, euclidean_range, world_positions
from ...datasets.layer_file import FrameLayers, LayerImage
from ...datasets.truth import lamp_record
from ...node_groups.node_mathematics import MARK
from ...settings.render_plan import RenderPlan
from ...uw_spectral.imaging.layers import layer
from .. import contents, marks
from ..readers import lamp_records, lamps
from ..readers.pinhole import pinhole_of, pose_of
from ..rendered import rendered_layer
from ..temporary import render_settings
from .exr_output import Passes, render_passes, switched_on

CRYPTOMATTE = ("CryptoObject", "CryptoMaterial")
"""Names of Blender's passes."""
CRYPTOMATTE_SWITCHES = ("use_pass_cryptomatte_object", "use_pass_cryptomatte_material")
_SWITCHES = {
    "normal": ("use_pass_normal",),
    "motion": ("use_pass_vector",),
    "instance": ("use_pass_cryptomatte_object",),
    "material": ("use_pass_cryptomatte_material",),
}
_UNSEEN = {"ARMATURE", "CAMERA", "EMPTY", "LATTICE", "LIGHT", "LIGHT_PROBE", "SPEAKER"}
_NOTHING = 1e9  # m; Blender writes 1e10 where nothing is seen

OneSample = contextlib.AbstractContextManager[object]
"""Settings of an engine under which a render has one sample at every pixel's centre."""


def sharp(scene: bpy.types.Scene) -> list[tuple[Any, str, Any]]:
    """Settings under which objects are where they are at the frame, and in focus."""
    settings: list[tuple[Any, str, Any]] = [(scene.render, "use_motion_blur", False)]
    if scene.camera is not None:
        settings.append((scene.camera.data.dof, "use_dof", False))
    return settings


@contextlib.contextmanager
def without_water(
    scene: bpy.types.Scene, wanted: Sequence[tuple[Any, str, Any]]
) -> Iterator[object]:
    """Leave the water's surface and volume out of renders while the block runs, with settings."""
    bodies = [item for item in marks.bodies(scene) if not item.hide_render]
    # Data that are kept have no motion.
    settings = [*wanted, (scene.render, "use_persistent_data", False)]
    settings += [(item, "hide_render", True) for item in bodies]
    with render_settings(scene, settings) as found:
        yield found


def geometry_layers(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    plan: RenderPlan,
    wanted: Sequence[str],
    one_sample: OneSample,
    beside: Path,
) -> FrameLayers:
    """Render the layers of where objects are, and note the camera and what is numbered.

    Range, and what needs it, is always among them.
    """
    view, pose, shining = pinhole_of(scene, camera), pose_of(camera), lamps.plan_lamps(scene, plan)
    switches = {"use_pass_z"}.union(*(_SWITCHES.get(name, ()) for name in wanted))
    with one_sample, switched_on(rendered_layer(scene), sorted(switches)):
        passes = render_passes(scene, beside)
    depth = _depth(passes)
    distances = euclidean_range(depth, view)
    found: dict[str, NDArray[Any]] = {RANGE: distances, PLANAR: depth}
    header: dict[str, Any] = {
        "camera": {
            "name": camera.name,
            "width": view.width,
            "height": view.height,
            "K": view.K.tolist(),
            "distortion": list(view.distortion),
            "camera_to_world": pose.tolist(),
        },
        "lamps": [
            {**lamp_record(lamp), **lamp_records.record(item)}
            for item, lamp in zip(shining.shown, shining.lamps, strict=True)
        ],
    }
    if "position" in wanted:
        found["position"] = world_positions(distances, view, pose)
    for name, source in (("normal", "Normal"), ("motion", "Vector")):
        if name in wanted:
            found[name] = passes[source]
    for name, source, names in _numbered(scene):
        if name in wanted:
            found[name] = cryptomatte.numbers(passes[f"{source}00"][..., 0], names)
            header[f"{name}s"] = {str(n): text for n, text in enumerate(names, start=1)}
    layers = {name: as_layer(name, found[name]) for name in (RANGE, *wanted) if name in found}
    return FrameLayers(layers, header)


def depth_map(scene: bpy.types.Scene, one_sample: OneSample, beside: Path) -> NDArray[np.float64]:
    """Render planar depth, m, infinite where nothing is seen."""
    with one_sample, switched_on(rendered_layer(scene), ["use_pass_z"]):
        return _depth(render_passes(scene, beside))


def _depth(passes: Passes) -> NDArray[np.float64]:
    depth = passes["Depth"][..., 0].astype(np.float64)
    depth[depth > _NOTHING] = np.inf
    return depth


def cryptomatte_layers(scene: bpy.types.Scene, passes: Passes) -> FrameLayers:
    """Return the ranks of Cryptomatte of a render, and their attributes."""
    layers, attributes = {}, {}
    about = layer("cryptomatte")
    for typename, (_, _, names) in zip(CRYPTOMATTE, _numbered(scene), strict=True):
        for name in sorted(passes):
            if name.startswith(typename):
                layers[name] = LayerImage(
                    passes[name], tuple("RGBA"), about.units, about.text, whole=True
                )
        attributes |= cryptomatte.attributes(typename, names)
    return FrameLayers(layers, {}, attributes)


def as_layer(name: str, values: NDArray[Any]) -> LayerImage:
    """Return a map as a layer."""
    about = layer(name)
    image = values if values.ndim == 3 else values[..., None]
    return LayerImage(image, about.channels, about.units, about.text, about.whole)


def _numbered(scene: bpy.types.Scene) -> list[tuple[str, str, list[str]]]:
    """Layer of numbers, pass, and the names that are numbered, those of the water last."""
    items = contents.objects(scene)
    objects = {item.name: MARK in item for item in items if item.type not in _UNSEEN}
    materials = {found.name: MARK in found for found in contents.materials(scene)}
    rows = zip(("instance", "material"), CRYPTOMATTE, (objects, materials), strict=True)
    return [
        (name, source, sorted(names, key=lambda n, own=names: (own[n], n)))
        for name, source, names in rows
    ]
