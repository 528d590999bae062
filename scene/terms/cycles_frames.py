"""Water of Cycles for the frames of a job: put into a scene once, and brought to each of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from ...settings.render_plan import RenderPlan
from ..readers import cameras, mirrored_eye, moving_surface
from ..readers.lamps import plan_lamps
from ..water import continued_seabed, cycles_water, scene_water
from ..water.cycles_phase import cycles_phases
from ..water.occlusion import Cache
from ..water.pass_values import PassValues
from ..water.term import Eye, SceneFrame
from ..water.water_body import WaterExtent
from . import limits
from .all_terms import TERMS


@dataclass(eq=False)
class CyclesFrames:
    """The water of a camera's job in a scene."""

    scene: bpy.types.Scene
    camera: bpy.types.Object
    extent: WaterExtent
    eyes: Sequence[tuple[float, ...]]  #: Where the camera is at the frames of the job.
    cache: Cache
    continues: bool = False  #: A floor may continue the scene's own seabed.

    def add(self, plan: RenderPlan) -> list[str]:
        """Put the water in; returns what is not treated, or not drawn right, one line each."""
        scene, chosen = self.scene, plan.settings
        self.continues = continued_seabed.may_continue(scene, plan)
        self._look(plan)  # before the water is there
        options = cycles_water.Options(
            above=self.above(plan), dry=mirrored_eye.may_rise(scene, len(self.eyes)),
            indices_in_water=chosen.indices_in_water, own_seabed=self.continues,
            raised=chosen.raised_waves, foam=chosen.whitecaps,
        )  # fmt: skip
        phases = cycles_phases(plan)
        notes = cycles_water.add_water(
            scene, plan.column, phases, self.extent, plan_lamps(scene, plan), options
        )
        notes += [note for phase in phases for note in phase.notes]
        notes += [note for term in TERMS for note in term.add_to_cycles(self._frame(plan))]
        return notes + limits.of_cycles(scene, self.camera, plan, self.cache, self.eyes)

    def remove(self) -> None:
        """Take the water out."""
        scene_water.remove(self.scene)

    def above(self, plan: RenderPlan) -> bool:
        """Whether the camera may have air before its glass at a frame of the job."""
        return moving_surface.may_be_over(self.camera, plan.settings, self.eyes)

    def bring(self, now: RenderPlan) -> PassValues:
        """Bring the water to the current frame; returns what differs by band."""
        self._look(now)
        scene, ground = self.scene, self.cache.ground if self.continues else None
        seabed = continued_seabed.depth_of(ground) if self.continues else None
        cycles_water.place(scene, now.column, seabed)
        now = continued_seabed.over(now, ground)
        values, frame = PassValues.of_plan(now, scene), self._frame(now)
        for term in TERMS:
            values = values.with_values(term.bring_to_cycles(frame))
        return values

    def _frame(self, now: RenderPlan) -> SceneFrame:
        depth = -cameras.eye_of(self.camera)[2]
        eye = Eye(self.camera, depth, self.eyes)
        return SceneFrame(self.scene, now, eye, self.cache, now, extent=self.extent)

    def _look(self, now: RenderPlan) -> None:
        """Look for the ground that a floor may continue."""
        if self.continues:
            self.cache.look(self.scene, self.camera, now.column, self.eyes)
