"""A sphere over a floor: pictures by the formulas against Cycles'."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from underwater_spectral.benchmarks import _places, grey_scene
from underwater_spectral.benchmarks.grey_scene import CLEAR, PAPERS
from underwater_spectral.validation.colour_errors import srgb_rmse

SIZE, BLOCK = (36, 27), 9

# The coefficients of types I and IA are doubted by their source, which is no fault of a picture.
pytestmark = pytest.mark.filterwarnings(
    "ignore::underwater_spectral.uw_spectral.errors.DataWarning"
)


def _compared(water, depth, light):
    """Noise of Cycles; sRGB RMSE without it, ΔE2000 and radiance off, of tables and closed form."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    camera = grey_scene.build_scene(depth, *SIZE)
    plan = grey_scene.plan_for(water, depth, 8, light)
    halves = [grey_scene.cycles_image(plan, camera, 128, seed) for seed in (1, 2)]
    develop = plan.reduction(depth).apply
    first, second = map(develop, halves)
    reference, noise = (first + second) / 2, srgb_rmse(first, second) / 2
    truth = grey_scene.blocks(np.mean(halves, axis=0), BLOCK)
    found = []
    for drawn in (grey_scene.solved_image, grey_scene.closed_form_image):
        image = drawn(plan.column, plan.phase, depth, SIZE)
        rmse = srgb_rmse(develop(image), reference)
        # Blocks beat the noise down before a relative error is taken.
        radiance = np.median(np.abs(grey_scene.blocks(image, BLOCK) / truth - 1), axis=(0, 1))
        delta_e = _places.delta_e(develop(image), reference, BLOCK).mean()
        found.append((math.sqrt(max(rmse**2 - noise**2, 0.0)), delta_e, radiance.max()))
    return (noise, _places.delta_e(first, second, BLOCK).mean() / 2), *found


@pytest.mark.parametrize(
    ("water", "depth"),
    [
        pytest.param("IB", 5.0, marks=pytest.mark.slow),
        pytest.param("I", 5.0, marks=pytest.mark.slow),
        pytest.param("IA", 9.0, marks=pytest.mark.slow),
        pytest.param("II", 3.0, marks=pytest.mark.slow),
    ],
)
def test_closed_form_picture_against_cycles(water, depth):
    (noise, delta_e_noise), _, (rmse, delta_e, radiance) = _compared(water, depth, PAPERS)
    assert noise < 0.03
    assert delta_e_noise < 0.5
    assert rmse <= 0.02
    assert delta_e <= 2.0
    assert radiance <= 0.10


@pytest.mark.parametrize(
    ("water", "depth"), [("I", 5.0), pytest.param("IA", 9.0, marks=pytest.mark.slow)]
)
def test_default_phase_function_under_a_clear_sky(water, depth):
    """The difference in colour of tables to Cycles is not seen: ΔE2000 0.8, ISO/TR 28642:2016."""
    (noise, delta_e_noise), tables, closed_form = _compared(water, depth, CLEAR)
    assert noise < 0.01
    rmse, delta_e, radiance = tables
    assert delta_e + 2 * delta_e_noise < 0.8
    assert rmse <= 0.02
    assert radiance <= 0.03
    rmse, _, radiance = closed_form
    assert rmse <= 0.02
    assert radiance <= 0.10
