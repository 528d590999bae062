"""What lamps excite in the water of Cycles: a volume that emits it, rendered by itself.

Light adds up. What is emitted differs from place to place, which makes all water that it lies in
many times as slow: so it is hidden but in a render of its own, in which nothing else shines. There
Cycles steps through the water; without steps it would take the lamp's surroundings, brighter by
orders of magnitude than the rest, for matter as dense.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups import excited_volume
from ...settings.render_plan import RenderPlan
from ...uw_spectral.lamps.excited_power import excited_power
from ...uw_spectral.lamps.lamp import Lamp
from ...uw_spectral.lamps.lamp_projection import with_soft_shadow
from ...uw_spectral.table import Table
from .. import marks
from ..readers.lamps import lamp_excitations
from ..temporary import held
from . import scene_water
from .pass_values import PassValues
from .term import SceneFrame
from .water_body import WaterExtent, box

_EXCITED = "uw_excited"
"""Mark of the volume: how far the nearest of its lamps is from the camera, m."""
# What is emitted beyond a sphere about a lamp counts for less than e to the power of minus this of
# what is emitted within, wherever in it the camera is.
_FADED, _FARTHEST = 4.0, 200.0
_APART = 0.02  # m, from the faces of the water, or Cycles would count both as one
# Steps: in lengths of extinction, and in distances of the nearest lamp, of which longer ones lose
# an eighth in clear water.
_STEP, _OF_NEAREST, _SHORTEST = 1.0, 0.5, 0.05
_FEWER = 4  # samples, of what is smooth and seldom much of a picture
_OF_SIZE = 0.1  # a step, of the mean size of a volume, at a rate of 1


def bring(frame: SceneFrame, lamps: Sequence[Lamp]) -> dict[str, NDArray[np.float64]]:
    """Put what the lamps of a frame excite into its water, in place of what was there.

    Returns where the bands of passes are in its images, by view-layer property.
    """
    scene, plan = frame.scene, frame.plan
    for item in volumes(scene):
        _remove(item)
    pairs = zip(lamps, lamp_excitations(scene, plan), strict=True)
    excited = [(lamp, x) for lamp, x in pairs if x.matrices.any() and not lamp.shines_in]
    if not excited:
        return {}
    assert frame.extent is not None, "there is water"
    water = plan.lamp_water(frame.eye.depth)
    fading = min(x.water.a.min() for _, x in excited) + plan.column.absorption.min()
    reach = _FADED / max(float(fading), _FADED / _FARTHEST)
    emitted, spheres, distances = [], [], []
    for lamp, x in excited:
        place = np.array(lamp.position, np.float64)
        distances.append(float(np.linalg.norm(place - np.array(frame.eye.place))))
        far = reach + distances[-1]
        spheres.append((place - far, place + far))
        power = excited_power(x, lamp.profile, far)
        emitted.append((with_soft_shadow(_shadowed(lamp), water), power))
    item = _box(np.array(spheres), frame.extent)
    item.data.materials.append(excited_volume.build(emitted, plan.passes))
    item.hide_render = item.hide_viewport = True
    item[_EXCITED] = min(distances)
    scene_water.link(scene, item)
    return excited_volume.values(plan.passes)


def volumes(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Volumes that a scene's lamps excite: one, if they excite anything."""
    return [item for item in marks.objects(scene) if _EXCITED in item]


@contextlib.contextmanager
def alone(
    scene: bpy.types.Scene,
    layer: bpy.types.ViewLayer,
    values: PassValues,
    plan: RenderPlan,
    bands: tuple[int, ...],
) -> Iterator[None]:
    """Let nothing shine in renders of some bands but what lamps excite, while the block runs."""
    values.dark().apply(layer, bands)
    values.refresh(scene)
    made = marks.objects(scene)
    longest = _STEP / float(plan.column.attenuation[list(bands)].max())
    settings = [(item, "hide_render", True) for item in made if item.type == "LIGHT"]
    settings += [(scene.cycles, "volume_biased", True), (scene.cycles, "volume_step_rate", 1.0)]
    settings += [(scene.cycles, "samples", -(-scene.cycles.samples // _FEWER))]
    for item in volumes(scene):
        step = min(longest, max(_OF_NEAREST * item[_EXCITED], _SHORTEST))
        whole = _OF_SIZE * float(np.mean(item.dimensions))
        settings += [(item, "hide_render", False)]
        settings += [(item.data.materials[0].cycles, "volume_step_rate", step / whole)]
    with held(settings):
        yield


def _box(spheres: NDArray[np.float64], extent: WaterExtent) -> bpy.types.Object:
    """Make a box about spheres, (k, lowest and highest, 3), within the water."""
    low, high = spheres[:, 0].min(axis=0), spheres[:, 1].max(axis=0)
    edge = extent.half_width - _APART
    low, high = np.clip((low, high), (-edge, -edge, _APART - extent.bottom), (edge, edge, -_APART))
    half = float((high - low)[:2].max()) / 2.0
    item = box(excited_volume.NAME, WaterExtent(half, float(-low[2])), float(-high[2]))
    item.location.xy = (low + high)[:2] / 2.0
    return item


def _shadowed(lamp: Lamp) -> Lamp:
    """Return a lamp without its map if that shows nothing: it would take as long as the rest."""
    shadow = lamp.shadow
    seen = isinstance(shadow, Table) and bool((shadow.values > 0.0).any())
    return lamp if seen else replace(lamp, shadow=None)


def _remove(item: bpy.types.Object) -> None:
    """Delete a volume, and all that was made for it."""
    material = item.data.materials[0]
    nodes = material.node_tree.nodes
    images = {node.image for node in nodes if node.bl_idname == "ShaderNodeTexImage"}
    bpy.data.batch_remove([item, item.data, material, *images])
