"""Waves at the current frame, which bend, gather and mirror light, and leave foam."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, override

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups import realtime_waves
from ...node_groups.realtime_raised import RaisedShape
from ...node_groups.realtime_values import Numbers
from ...node_groups.shape import TermShape
from ...settings.render_plan import RenderPlan
from ...uw_spectral.surface.wave_patterns import WavePatterns, least_pattern
from ...uw_spectral.transfer.foam_light import foam_light
from ...uw_spectral.transfer.radiance_table import TABLE_STREAMS
from ...uw_spectral.transfer.sunlit_water import SunlitWater
from .. import marks
from ..readers import moving_surface
from ..water import cycles_surface
from ..water.frame_water import RealtimeWater
from ..water.term import SceneFrame, Term


def with_waves(scene: bpy.types.Scene, plan: RenderPlan, water: RealtimeWater) -> RealtimeWater:
    """Return real-time water with the waves of the current frame, or as it is without waves."""
    if plan.settings.surface != moving_surface.WAVES:
        return water
    now = moving_surface.patterns(scene, plan)
    column = plan.column.mixed_above(water.depth)
    lit = SunlitWater(column.solved_field(plan.phase, TABLE_STREAMS))
    contrast = plan.settings.caustics * now.contrast(lit)
    return water.with_terms(WaveTerm(now, contrast, plan.settings.caustics))


@dataclass(frozen=True, eq=False)
class WaveTerm(Term):
    """The moving surface of a frame."""

    patterns: WavePatterns
    contrast: NDArray[np.float64]  #: Of the bands, its strength included, (KNOTS, n).
    strength: float = 1.0  #: Of the caustics in the shafts; 1 is physical.

    @classmethod
    @override
    def bring_to_cycles(cls, frame: SceneFrame) -> Mapping[str, NDArray[np.float64]]:
        if frame.plan.settings.surface != moving_surface.WAVES:
            return {}
        return cycles_surface.move(frame.scene, frame.plan, frame.eye.camera)

    @override
    def shapes(self, water: RealtimeWater) -> Sequence[TermShape]:
        raised = self.patterns.raised
        shapes: list[TermShape] = [realtime_waves.WaveShape()]
        if raised is not None:
            shapes.append(RaisedShape())
            shapes += [realtime_waves.FoamShape()] if raised.foam is not None else []
        return shapes

    @override
    def projection(self) -> Mapping[str, Any]:
        return {"contrast": functools.partial(self.patterns.contrast_at, self.contrast)}

    @override
    def numbers(self, water: RealtimeWater) -> Numbers:
        column, channels, glitters = water.column, {}, self.patterns.slope_x.any()
        single = realtime_waves.numbers(self.patterns, self.strength) | {
            # Where light falls from the brightest to nothing, no band may fall below it.
            realtime_waves.LEAST_PATTERN: least_pattern(self.contrast),
            realtime_waves.GLITTER: column.glitter * bool(glitters),
            realtime_waves.GLITTER_WIDTH: self.patterns.glitter_width(column.refractive_index),
        }
        if self.patterns.raised is not None and self.patterns.raised.foam is not None:
            foam = foam_light(column)
            channels = {
                realtime_waves.FOAM_BELOW: water.channels.project(foam.below),
                realtime_waves.FOAM_IN_SUN: water.channels.project(foam.sun),
                realtime_waves.FOAM_IN_SKY: water.channels.project(foam.sky),
            }
        return Numbers(channels, single)

    @override
    def write(self, scene: bpy.types.Scene, water: RealtimeWater) -> None:
        realtime_waves.write_patterns(marks.images(scene), self.patterns)
