"""Water of Cycles for the frames of a job: put into a scene once, and brought to each of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from ...settings.render_plan import RenderPlan
from .. import contents
from ..materials import band_colors, fluorescence
from ..readers import cameras, mirrored_eye
from ..readers.lamps import plan_lamps
from ..readers.surroundings import Ground
from . import (
    cloud_volumes,
    continued_seabed,
    cycles_water,
    deep_cameras,
    inelastic_layers,
    moving_surface,
    particles,
    volume_stack,
)
from .cycles_phase import cycles_phases
from .occlusion import Cache
from .pass_values import PassValues
from .water_body import WaterExtent


@dataclass(eq=False)
class CyclesFrames:
    """The water of a camera's job in a scene; :func:`.scene_water.remove` takes it out."""

    scene: bpy.types.Scene
    camera: bpy.types.Object
    extent: WaterExtent
    eyes: Sequence[tuple[float, ...]]  #: Where the camera is at the frames of the job.
    cache: Cache
    continues: bool = False  #: A floor may continue the scene's own seabed.

    def add(self, plan: RenderPlan) -> list[str]:
        """Put the water in; returns what is not treated, or not drawn right, one line each."""
        scene, chosen, above = self.scene, plan.settings, self.above(plan)
        self.continues = continued_seabed.may_continue(scene, plan)
        self._ground(plan)  # before the water is there
        notes = cycles_water.add_water(
            scene, plan.column, cycles_phases(plan), self.extent, plan_lamps(scene, plan),
            above=above, dry=mirrored_eye.may_rise(scene, len(self.eyes)),
            own_seabed=self.continues, indices_in_water=chosen.indices_in_water,
            raised=chosen.raised_waves, foam=chosen.whitecaps,
        )  # fmt: skip
        notes += [note for phase in cycles_phases(plan) for note in phase.notes]
        notes += cloud_volumes.add_clouds(scene, plan)
        notes += fluorescence.unseen(contents.materials(scene), "Cycles")
        notes += [*continued_seabed.notes(plan, self.cache.looked), *self.cache.notes]
        notes += moving_surface.limits(self.camera, chosen, self.eyes, eevee=False)
        more = inelastic_layers.MOST_ABOVE if chosen.inelastic else 0
        places = [cameras.eye_of(self.camera), *self.eyes]
        notes += volume_stack.notes(scene, places, more)
        return notes + deep_cameras.notes(plan.column, [-place[2] for place in places])

    def above(self, plan: RenderPlan) -> bool:
        """Whether the camera may have air before its glass at a frame of the job."""
        return moving_surface.may_be_over(self.camera, plan.settings, self.eyes)

    def bring(self, now: RenderPlan) -> PassValues:
        """Bring the water to the current frame; returns what differs by band."""
        scene, ground = self.scene, self._ground(now)
        seabed = continued_seabed.depth_of(ground) if self.continues else None
        cycles_water.place(scene, now.column, seabed)
        cycles_water.shape_lamps(scene, plan_lamps(scene, now))
        now = continued_seabed.over(now, ground)
        eye = cameras.eye_of(self.camera)
        moving_surface.move_surface(scene, now, eye)
        floating = particles.particles_of(now.settings, now.column)
        particles.bring(scene, floating, lambda material: band_colors.insert([material]))
        layers = inelastic_layers.bring(
            scene, now.emission(), now.column.floor_depth, self.extent, -eye[2]
        )
        return PassValues.of_plan(now, scene).with_values(cloud_volumes.values(scene, now) | layers)

    def _ground(self, now: RenderPlan) -> Ground | None:
        if not self.continues:
            return None
        return self.cache.look(self.scene, self.camera, now.column, self.eyes).ground
