"""Draws what the surface mirrors to a camera below it, and what is seen through it in the air.

The main picture looks both up. Light that a flat surface mirrors comes as if straight from the
mirror image of the camera: one render from there, of rays that begin at the surface, is what
arrives at it from below. Objects in the air are drawn by the camera itself, where refraction puts
them, without water and sky.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups.realtime_waves import WaveShape
from ...settings.render_plan import RenderPlan
from ...uw_spectral.imaging.layers import parse_layers
from ...uw_spectral.spectra.spectral_image import read_exr
from ...uw_spectral.transfer.water_column import WAVES
from ..readers import cameras, mirrored_eye, moving_surface
from ..readers.mirrored_eye import MirroredEye
from ..terms import planar_views
from ..terms.planar_views import ReflectionTerm, WindowTerm
from ..water import realtime
from ..water.frame_water import RealtimeWater
from ..water.occlusion import Cache
from .eevee_layers import depth_map
from .exr_output import write_float_exr

# Optical depths of the clearest band, by the surface, after which nothing is looked for. What is
# seen against the sky has more contrast.
_REACH, _REACH_IN_AIR = 1.5, 3.0
_FARTHEST = 200.0  # m
_NO_PINHOLE = "the camera is no perspective one, or mirrored by a negative scale"


class PlanarPictures:
    """What the surface mirrors to a camera, and lets through to it, frame by frame of a job.

    The cache has seen the objects of the frame, if they occlude.
    """

    def __init__(self, scene: bpy.types.Scene, camera: bpy.types.Object, cache: Cache) -> None:
        self._scene, self._camera, self._cache = scene, camera, cache
        self._eyes: dict[bool, tuple[object, MirroredEye | None]] = {}
        self._near: dict[bool, tuple[MirroredEye, NDArray[np.float32]]] = {}

    def eye(self, plan: RenderPlan, *, in_air: bool = False) -> MirroredEye | None:
        """Return the mirrored eye of the current frame, if it sees objects.

        Or that which sees objects ``in_air`` through the surface, if there are any.
        """
        index = (plan.column.refractive_index,) if in_air else ()
        waves, reach = plan.settings.surface == WAVES, _reach(plan, in_air=in_air)
        asked = self._scene.frame_current_final, reach, waves, index
        known = self._eyes.get(in_air)
        if known is None or known[0] != asked:
            look = mirrored_eye.window_eye if in_air else mirrored_eye.mirrored_eye
            eye = look(self._scene, self._camera, reach, *index, waves=waves)
            sees = eye is not None and mirrored_eye.sees_objects(self._scene, eye, reach)
            known = self._eyes[in_air] = asked, eye if sees else None
        return known[1]

    def show(self, plan: RenderPlan, water: RealtimeWater) -> None:
        """Draw the pictures of the current frame into the water of the scene.

        The numbers of the water are those of the last of them afterwards.
        """
        if water.term(WindowTerm):
            self._show(plan, water, in_air=True)
        if water.term(ReflectionTerm):
            self._show(plan, water, in_air=False)

    def _show(self, plan: RenderPlan, water: RealtimeWater, *, in_air: bool) -> None:
        """Draw what an eye sees, and how near it is to the surface if there are waves."""
        scene, eye = self._scene, self.eye(plan, in_air=in_air)
        if eye is None:
            planar_views.hide(scene, in_air=in_air)
            return
        realtime.set_values(scene, water)
        with (
            mirrored_eye.looking(scene, eye, self._camera) as camera,
            tempfile.TemporaryDirectory() as folder,
        ):
            path = Path(folder, "planar.exr")
            if in_air:
                planar_views.look_into_air(scene, water, eye.view)
            else:
                planar_views.look_from_mirror(scene, water, camera, self._cache.looked)
            write_float_exr(scene, path, alpha=in_air)
            pixels, names = read_exr(path)
            picture = pixels[..., [names.index(name) for name in ("RGBA" if in_air else "RGB")]]
            nearness = self._nearness(eye, path) if WaveShape in water.shape else None
        planar_views.show(scene, eye.view, picture, nearness, in_air=in_air)

    def _nearness(self, eye: MirroredEye, path: Path) -> NDArray[np.float32]:
        kind = eye.index is None
        if kind not in self._near or self._near[kind][0] is not eye:
            self._near[kind] = eye, eye.nearness(depth_map(self._scene, path))
        return self._near[kind][1]


def may_show(
    camera: bpy.types.Object,
    plan: RenderPlan,
    eyes: Sequence[tuple[float, ...]],
    mirrored: PlanarPictures,
) -> bool:
    """Whether a job may show what the surface mirrors, at this frame or at one to come."""
    if not plan.settings.planar_reflections or _why_not(camera, plan, eyes):
        return False
    return len(eyes) > 1 or mirrored.eye(plan) is not None


def may_show_air(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    plan: RenderPlan,
    eyes: Sequence[tuple[float, ...]],
    mirrored: PlanarPictures,
) -> bool:
    """Whether a job may show objects in the air through the surface, at any of its frames."""
    if _why_not(camera, plan, eyes):
        return False
    if len(eyes) > 1:
        return mirrored_eye.may_rise(scene, len(eyes))
    return mirrored.eye(plan, in_air=True) is not None


def notes(
    camera: bpy.types.Object,
    plan: RenderPlan,
    eyes: Sequence[tuple[float, ...]],
    mirrored: PlanarPictures,
) -> list[str]:
    """Return why objects are not mirrored in a surface to a camera in the water, if they are not.

    Of a single frame, if there are any.
    """
    why = _why_not(camera, plan, eyes)
    if not (plan.settings.planar_reflections and plan.column.reflects and why):
        return []
    lowest = min(eye[2] for eye in (cameras.eye_of(camera), *eyes))
    if lowest >= 0.0 or (len(eyes) <= 1 and why != _NO_PINHOLE and mirrored.eye(plan) is None):
        return []
    return [f"objects are not seen mirrored in the water surface: {why}"]


def notes_of_air(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    plan: RenderPlan,
    eyes: Sequence[tuple[float, ...]],
) -> list[str]:
    """Return why objects in the air are not refracted to a camera in the water, if they are not."""
    lowest = min(eye[2] for eye in (cameras.eye_of(camera), *eyes))
    why = _why_not(camera, plan, eyes)
    if not (plan.column.reflects and why and lowest < 0.0):
        return []
    if not mirrored_eye.may_rise(scene, len(eyes)):
        return []
    return [f"objects above the water are seen from below as if it did not refract: {why}"]


def _why_not(camera: bpy.types.Object, plan: RenderPlan, eyes: Sequence[tuple[float, ...]]) -> str:
    if not plan.column.reflects:
        return "there is no surface"
    if moving_surface.may_be_over(camera, plan.settings, eyes):
        return "the camera is above the water or at its surface"
    if cameras.before_water(camera):
        return "the camera looks through a port"
    if camera.data.type != "PERSP" or camera.matrix_world.is_negative:
        return _NO_PINHOLE
    if moving_surface.has_heights(plan.settings):
        return "the waves have height"
    if plan.column.below:
        return "the water differs with depth"
    if parse_layers(plan.settings.layers):
        return "layers are written"
    return ""


def _reach(plan: RenderPlan, *, in_air: bool) -> float:
    clearest = float(plan.column.attenuation.min())
    return min((_REACH_IN_AIR if in_air else _REACH) / max(clearest, 1e-6), _FARTHEST)
