"""The scene's own seabed, taken as endless: what lights the water is what is seen.

Beyond its border a level floor goes on, just under its lowest place, so that it is never seen
above it; light and floor have its depth and mean colour in every engine.
"""

from __future__ import annotations

import math

import bpy

from ...settings.render_plan import RenderPlan
from ..readers.surroundings import Ground, Surroundings, has_objects

_CLOSE = (
    "the scene's own seabed fills about half of what is about the camera, and is {}taken for one "
    "that goes on: widen it, add one with --floor-depth, or give --no-scene-floor if it ends"
)
_STEP = 0.1, 0.5  # of the depth, and m, from which the step at the border is told


def may_continue(scene: bpy.types.Scene, plan: RenderPlan) -> bool:
    """Whether a seabed of the scene's own, if there is one at a frame, is continued."""
    wanted = plan.settings.scene_floor and not math.isfinite(plan.column.floor_depth)
    return wanted and has_objects(scene)


def over(plan: RenderPlan, ground: Ground | None) -> RenderPlan:
    """Return a plan over a ground, see :meth:`.RenderPlan.over_ground`."""
    return plan if ground is None else plan.over_ground(ground.depth, ground.colour)


def depth_of(ground: Ground | None) -> float:
    """Depth in m of the floor that continues a ground; infinite without."""
    return math.inf if ground is None else ground.bottom


def notes(plan: RenderPlan, around: Surroundings | None) -> list[str]:
    """Say where the floor lies if it is much lower than the ground that it continues.

    And where it is a close decision whether there is such a ground.
    """
    if around is None or not plan.settings.scene_floor or math.isfinite(plan.column.floor_depth):
        return []
    ground = around.ground
    found = [_CLOSE.format("" if ground else "not ")] if around.is_close_decision else []
    if ground is not None and ground.bottom - ground.depth > max(_STEP[0] * ground.depth, _STEP[1]):
        found.append(
            f"the scene's own seabed, {ground.depth:.3g} m deep, goes on beyond its border "
            f"{ground.bottom:.3g} m deep, under its lowest place; give --no-scene-floor if it ends"
        )
    return found
