"""Lamps in the water of EEVEE, drawn by its shaders, and EEVEE's own that cast their shadows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Self, override

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups import lamp_images, lamp_visibility
from ...node_groups.lamp_term import LampShape
from ...node_groups.realtime_values import Numbers
from ...node_groups.shape import TermShape
from ...uw_spectral.lamps.grouping import grouped
from ...uw_spectral.lamps.inelastic_source import LampExcitation
from ...uw_spectral.lamps.lamp_projection import project_lamps
from ...uw_spectral.spectra.bands import Bands
from .. import marks
from ..readers.lamps import lamp_excitations, plan_lamps
from ..readers.scene_lamps import SceneLamps
from ..water import cycles_lamps, excited_water, scene_water
from ..water.frame_water import RealtimeWater
from ..water.term import Follower, SceneFrame, Term

# Intensity of the lamps that cast shadows: what they add to the sun's light on an object is this
# fraction of what the lamps themselves do. Fainter ones drown in the rounding of single precision.
_FAINT_FRACTION, _FAINTEST, _BRIGHTEST = 1e-3, 2e-5, 2e-3


@dataclass(frozen=True, eq=False)
class LampTerm(Term):
    """The lamps of a frame, in their water."""

    scene: SceneLamps
    excited: tuple[LampExcitation, ...] = ()  #: What each excites in the water.

    @classmethod
    @override
    def read(cls, frame: SceneFrame) -> Self:
        plan, depth, cache = frame.plan, frame.eye.depth, frame.cache.lamp_shadows
        lamps = cache.of(frame.scene, plan_lamps(frame.scene, plan), unchanged=frame.unchanged)
        if lamps.lamps:
            lamps = lamps.in_layers(plan.column, plan.phase, depth)
            water = lamps.around or plan.lamp_water(max(depth, 0.0))
            lamps = lamps.with_virtual_lights(water, plan.bands, frame.eye.place)
            lamps = cache.of_virtual(lamps)
        excited = lamp_excitations(frame.scene, plan) if lamps.lamps else ()
        return cls(lamps.in_water(plan.column, plan.phase, depth), excited)

    @classmethod
    @override
    def add_to_cycles(cls, frame: SceneFrame) -> list[str]:
        if frame.plan.excitation is None or not plan_lamps(frame.scene, frame.plan).from_air:
            return []
        return ["inelastic light of lamps in the air is left out by Cycles; EEVEE draws it"]

    @classmethod
    @override
    def bring_to_cycles(cls, frame: SceneFrame) -> Mapping[str, NDArray[np.float64]]:
        lamps = plan_lamps(frame.scene, frame.plan)
        found = cycles_lamps.shape(frame.scene, lamps)
        if frame.plan.excitation is None or not lamps.lamps:
            return found
        cache = frame.cache.lamp_shadows
        shadowed = cache.of(frame.scene, lamps, unchanged=frame.unchanged)
        return found | excited_water.bring(frame, shadowed.lamps)

    def changed_light(self, bands: Bands) -> NDArray[np.float64]:
        """Irradiance, about, of what they excite in a metre of the water, a metre away, (n,)."""
        found = (one.matrices.sum(axis=(0, 1)) for one in self.excited)
        return sum(found, np.zeros(len(bands)))

    @override
    def shapes(self, water: RealtimeWater) -> Sequence[TermShape]:
        lamps = self.scene
        if not lamps.lamps:
            return ()
        shape = LampShape(
            len(lamps.all), len(lamps.virtual), water.phase.components, lamps.from_air,
            water.inputs.kinds.facets, len(water.excitation) > 0, water.floating > 0.0,
            len(self.excited),
        )  # fmt: skip
        return (shape,)

    @override
    def prepare(self, scene: bpy.types.Scene) -> list[str]:
        return list(self.scene.notes)

    @override
    def followers(self) -> Sequence[Follower]:
        shown = self.scene.shown
        made = lamp_visibility.shadow_lamps([lamp.light for lamp in shown])
        return list(zip(made, shown, strict=True))

    @override
    def numbers(self, water: RealtimeWater) -> Numbers:
        if not self.scene.lamps:
            return Numbers()
        column = water.column
        sun = float(np.mean(column.Ed(water.depth, water.phase)))
        brightest = max(float(np.mean(lamp.intensity)) for lamp in self.scene.lamps)
        code = 1.0
        if sun > 0:
            code = min(max(_FAINT_FRACTION * brightest / sun, _FAINTEST), _BRIGHTEST)
        sunlit = float(np.any(column.sun_irradiance > 0))
        return Numbers({}, dict(zip(lamp_visibility.NUMBERS, (sunlit, code), strict=True)))

    @override
    def write(self, scene: bpy.types.Scene, water: RealtimeWater) -> None:
        if self.scene.around is None:
            return
        lamps, shown, numbers = self.scene.lamps, self.scene.shown, water.numbers.single
        codes = lamp_visibility.CODES[int(numbers[lamp_visibility.SUNLIT]) :]
        blocked = [index for index, lamp in enumerate(lamps) if not lamp.unblocked]
        groups = grouped([lamps[index].position for index in blocked], len(codes))
        colours = [lamp_visibility.NO_SHADOW] * len(lamps)
        for index, group in zip(blocked, groups, strict=True):
            colours[index] = codes[group]
        projected = project_lamps(
            self.scene.all, self.scene.around, water.channels,
            list(water.inputs.reflectances.values()), self.scene.waters, water.excitation,
            clouds=water.floating, excited=self.excited,
        )  # fmt: skip
        images = lamp_images.images_in(marks.collection_of(scene) or {})
        assert images is not None, "lamps shine in the water"
        others = [lamp_visibility.NO_SHADOW] * (len(projected.lamps) - len(lamps))
        lamp_images.write_lamps(images, projected, colours + others)
        followers = marks.followers(scene)
        for item, lamp, own, colour in zip(followers, lamps, shown, colours, strict=True):
            scene_water.follow(item, own)
            code = numbers[lamp_visibility.CODE]
            lamp_visibility.write_shadow_lamp(item.data, lamp, colour, code)
