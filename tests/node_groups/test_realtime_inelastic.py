"""Inelastic light in the real-time groups, rendered, against numpy."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from underwater_spectral.node_groups import realtime_inelastic
from underwater_spectral.scene import realtime, scene_water
from underwater_spectral.scene.render_plan import make_plan
from underwater_spectral.scene.settings import SceneSettings
from underwater_spectral.tests import by_hand
from underwater_spectral.tests.node_groups import realtime_probe as probe
from underwater_spectral.uw_spectral.spectra.reflectance import uplift_basis
from underwater_spectral.uw_spectral.transfer.inelastic_light import reduced
from underwater_spectral.uw_spectral.transfer.radiance_field import under_surface

HALF_STEP = 2.0**-10
TOLERANCE = 2e-3


def _added(plan, light, view, where):
    """Inelastic radiance of every pixel and band."""
    w3 = view.rays()
    w = tuple(w3[..., i, None] for i in range(3))

    def background(y):
        return light.radiance(y, w, under_surface(light, w, 0.0, plan.column.refractive_index))

    turn = np.array(view.matrix.to_3x3())
    origin, first, second = (turn @ np.array(v) for v in view.square)
    normal = np.cross(first, second)
    normal /= np.linalg.norm(normal) * -np.sign(origin @ normal)
    P = np.where(where == 1, (origin @ normal) / (w3 @ normal), 1.0)[..., None]
    y = np.maximum(view.depth - w[2] * P, 0.0)
    colour = np.array(probe.COLOR) @ uplift_basis(plan.bands).T / math.pi
    lit = colour * light.surface_irradiance(y, normal[2])
    pixel = by_hand.pixel(light, view.depth, w, P, lit, background(y))
    return np.where(where[..., None] == 1, pixel, background(view.depth))


@pytest.mark.slow
def test_groups_equal_numpy(tmp_path):
    """The processes made strong, so that what is tested is most of the picture."""
    settings = SceneSettings(
        water="case:baltic", phase="hg:0.9", bands=3, surface="flat", floor_depth=9.0,
        inelastic="all",
    )  # fmt: skip
    plan, view = make_plan(settings), probe.View(5.0)
    strong = _times(plan.inelastic, 20.0)
    weights = np.eye(3) * np.pi / plan.column.light_field(plan.phase).Ed(view.depth)
    pictures = []
    for name, light in (("with", strong), ("without", None)):
        water = realtime.realtime_water(
            plan.column, plan.phase, view.depth, weights, inelastic=light
        )
        pictures.append(probe.render(water, view, tmp_path / f"{name}.exr"))
        scene_water.remove(probe.bpy.context.scene)
    elastic, where = probe.expected(plan.column, plan.phase, view, weights)
    added = _added(plan, reduced(strong), view, where) @ weights.T
    for part in (0, 1):
        assert (where == part).sum() > 50
        assert (added / elastic)[where == part].max() > 0.2
        for found, wanted in zip(pictures, (elastic + added, elastic), strict=True):
            relative = (found / wanted - 1)[where == part]
            assert np.abs(relative + HALF_STEP / 2).max() <= HALF_STEP / 2 + TOLERANCE / 2


def _times(light, factor):
    terms = tuple(
        dataclasses.replace(t, emission=factor * t.emission, E0=factor * t.E0, F=factor * t.F)
        for t in light.terms
    )
    return dataclasses.replace(light, terms=terms)


def test_names_are_those_of_the_numbers():
    light = reduced(
        make_plan(SceneSettings(water="case:baltic", bands=4, inelastic="all")).inelastic
    )
    rising = tuple(term.rising for term in light.terms)
    assert rising == (False, False, False)
    numbers = realtime_inelastic.of_light(light)
    assert list(numbers) == realtime_inelastic.band_names(rising)
    assert all(values.shape == (4,) for values in numbers.values())
