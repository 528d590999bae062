"""Cycles settings under which it is a reference: no clamping, no bias, enough bounces."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

import bpy

from ...quality.methods import Device
from ...uw_spectral.errors import InputError
from .. import contents
from ..temporary import render_settings

# White water with an inner reflecting surface needs them: 32 lose a percent, 64 do not.
MOST_BOUNCES = 64
_SURFACE_BOUNCES = 32
# In the order in which they are tried; the faster first.
_GPU_KINDS = ("OPTIX", "CUDA", "HIP", "METAL", "ONEAPI")


@contextlib.contextmanager
def reference_settings(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    *,
    samples: int,
    seed: int,
    bounces: int = MOST_BOUNCES,
    device: Device = "cpu",
) -> Iterator[bpy.types.ViewLayer]:
    """Render settings of the reference while the block runs, the scene's own afterwards.

    The camera's near clip is moved close, since water before it is not integrated. A path has at
    most ``bounces`` scattering events. Yields the one layer that is rendered; InputError if Cycles
    finds no such device.
    """
    render, cycles = scene.render, scene.cycles
    wanted: list[tuple[Any, str, Any]] = [
        (scene, "camera", camera),
        (scene, "compositing_node_group", None),
        (camera.data, "clip_start", 1e-5),
        (camera.data, "clip_end", max(camera.data.clip_end, 1e5)),
        (render, "engine", "CYCLES"),
        (render, "film_transparent", False),
        (render, "use_persistent_data", True),
        (render, "use_border", render.use_border),  # not in every frame
        (render, "use_sequencer", False),
        (render, "use_stamp", False),
        (cycles, "device", device.upper()),
        (cycles, "samples", samples),
        (cycles, "seed", seed),
        (cycles, "use_animated_seed", False),
        (cycles, "use_adaptive_sampling", False),
        (cycles, "use_denoising", False),
        (cycles, "time_limit", 0.0),
        (cycles, "max_bounces", bounces),
        (cycles, "volume_bounces", bounces),
        (cycles, "diffuse_bounces", _SURFACE_BOUNCES),
        (cycles, "glossy_bounces", _SURFACE_BOUNCES),
        (cycles, "transmission_bounces", _SURFACE_BOUNCES),
        (cycles, "transparent_max_bounces", _SURFACE_BOUNCES),
        (cycles, "min_light_bounces", 0),
        (cycles, "min_transparent_bounces", 0),
        (cycles, "caustics_reflective", True),
        (cycles, "caustics_refractive", True),
        (cycles, "blur_glossy", 0.0),
        (cycles, "sample_clamp_direct", 0.0),
        (cycles, "sample_clamp_indirect", 0.0),
        (cycles, "light_sampling_threshold", 0.0),
        (cycles, "direct_light_sampling_type", "MULTIPLE_IMPORTANCE_SAMPLING"),
        # The same to the last bit with one light, and a tenth slower.
        (cycles, "use_light_tree", _samples_more_than_the_sun(scene)),
        (cycles, "film_exposure", 1.0),
        (cycles, "use_fast_gi", False),
        # With it, water that does not scatter as Henyey-Greenstein is up to 20 % too bright; of
        # surfaces alone it gains in clear water only (docs/measured/reference_cost.md).
        (cycles, "use_guiding", False),
        (cycles, "volume_biased", False),
        (cycles, "use_sample_subset", False),
        (cycles, "auto_scrambling_distance", False),
        (cycles, "scrambling_distance", 1.0),
    ]
    with _devices(device), render_settings(scene, wanted) as layer:
        yield layer


def _samples_more_than_the_sun(scene: bpy.types.Scene) -> bool:
    """Whether the sky is sampled, or a material of the file may emit."""
    if scene.world is None or scene.world.cycles.sampling_method != "NONE":
        return True
    trees = {material.node_tree for material in bpy.data.materials} - {None}
    trees |= contents.inner_groups(trees)
    return any(_may_emit(node) for tree in trees for node in tree.nodes)


def _may_emit(node: bpy.types.Node) -> bool:
    if node.type in {"EMISSION", "SCRIPT"}:
        return True
    strength = node.inputs.get("Emission Strength")
    return strength is not None and (strength.is_linked or strength.default_value > 0.0)


def device_of(scene: bpy.types.Scene) -> Device:
    """Return what a scene renders on here: the GPU only if Cycles has been given one."""
    enabled = any(item.use and item.type != "CPU" for item in _preferences().devices)
    return "gpu" if scene.cycles.device == "GPU" and enabled else "cpu"


@contextlib.contextmanager
def _devices(device: Device) -> Iterator[None]:
    """Enable every GPU of the first kind that is here, unless some are enabled already."""
    if device == "cpu":
        yield
        return
    preferences = _preferences()
    before = preferences.compute_device_type
    if before == "NONE":
        for kind in _GPU_KINDS:
            try:
                preferences.compute_device_type = kind
            except TypeError:  # not in this build of Blender
                continue
            preferences.refresh_devices()
            if _gpus(preferences):
                break
    try:
        found = _gpus(preferences)
        if not found:
            raise InputError(
                "--device gpu: Cycles finds no GPU here; install its driver, or use --device cpu"
            )
        if not any(item.use for item in found):
            for item in found:
                item.use = True
        yield
    finally:
        preferences.compute_device_type = before


def _preferences() -> bpy.types.AddonPreferences:
    return bpy.context.preferences.addons["cycles"].preferences


def _gpus(preferences: bpy.types.AddonPreferences) -> list[bpy.types.PropertyGroup]:
    kind = preferences.compute_device_type
    return [item for item in preferences.devices if item.type == kind and kind != "NONE"]
