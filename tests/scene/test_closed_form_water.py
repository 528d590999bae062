"""The closed form in a scene: its bands against numpy, and what it refuses."""

from __future__ import annotations

import math
from dataclasses import replace

import bpy
import numpy as np
import pytest
from underwater_spectral.scene.engines import eevee_settings, exr_output
from underwater_spectral.scene.water import closed_form_water, scene_water, water_body
from underwater_spectral.settings.render_plan import make_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.node_groups import realtime_probe as probe
from underwater_spectral.uw_spectral.closed_form import plain_water
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.reflectance import uplift_basis
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.uw_spectral.transfer.pixel import surface_light
from underwater_spectral.uw_spectral.transfer.water_column import DeeperWater

CHOSEN = SceneSettings(
    water="jerlov:II", bands=5, phase="hg:0.9", surface="flat", floor_depth=12.0,
    shafts=False, field="closed-form",
)  # fmt: skip
VIEW = probe.View(4.0)


def _water(chosen=CHOSEN):
    plan = make_plan(chosen)
    weights = np.abs(plan.reduction(VIEW.depth).weights)
    return closed_form_water.closed_form_water(plan.column, plan.phase, weights)


def _rendered(path):
    scene = bpy.context.scene
    with eevee_settings.realtime_settings(scene, scene.camera, samples=1, water=None):
        exr_output.write_float_exr(scene, path)
    return read_exr(path)[0].astype(np.float64)


def _links():
    """Links of the square's material, with the names of their nodes."""
    links = bpy.data.materials["Square"].node_tree.links
    return sorted((x.from_node.name, x.to_node.name) for x in links)


def _expected(water):
    column, rays = water.column, VIEW.rays()
    w = tuple(np.moveaxis(rays, -1, 0)[..., None])
    light = plain_water(
        column.absorption, column.scattering, water.phase.chi1, water.phase.chi2,
        E=column.sun_irradiance, L_sky=column.sky_radiance, sun=column.sun_direction.tolist(),
        y_o=VIEW.depth, y_f=column.floor_depth, r=column.floor_reflectance,
        index=column.refractive_index,
    )  # fmt: skip
    P, normal, where = probe.square_ahead(VIEW)
    P = np.where(where > 0, P, 1.0)[..., None]
    y, cosine = np.maximum(VIEW.depth - w[2] * P, 0.0), float(-(normal @ column.sun_direction))
    patch = surface_light(light.patch_light(y, tuple(normal)), y, normal[2])
    colour = uplift_basis(column.bands) @ np.array(probe.COLOR)
    L = patch.reflected(colour / math.pi * max(cosine, 0.0), colour, cosine)
    on_it = light.surface(VIEW.depth, y, w, P, L).total
    picture = np.where(where[..., None] == 1, on_it, light.open_water(VIEW.depth, w).total)
    return picture, where


def test_bands_are_the_closed_form_and_leave_no_trace(empty_blender, tmp_path):
    scene, water = empty_blender, _water()
    probe.place(VIEW)
    before = _links()
    notes = closed_form_water.add(scene, water, water_body.WaterExtent(100.0, 100.0))
    assert notes == []
    radiance, where = _expected(water)
    seen = _rendered(tmp_path / "seen.exr")
    inside = np.isin(where, (0, 1))
    np.testing.assert_allclose(
        seen[inside], (radiance @ water.weights.T)[inside] * (1 - 2.0**-11), rtol=5e-3
    )
    # Other values: three of the bands, each a channel; the rest of the five are dark.
    few = water.of_triple((1, 2, 3), (2.0, 3.0, 4.0))
    with pytest.raises(InputError, match="2 times three bands, not 1"):
        closed_form_water.set_values(scene, few)
    closed_form_water.set_values(scene, replace(few, count=5))
    seen = _rendered(tmp_path / "few.exr")
    wanted = radiance[..., 1:4] * (2.0, 3.0, 4.0) * (1 - 2.0**-11)
    np.testing.assert_allclose(seen[inside], wanted[inside], rtol=5e-3)
    scene_water.remove(scene)
    assert not [g.name for g in bpy.data.node_groups]
    assert _links() == before


def test_it_combines_with_nothing():
    water = _water()
    closed_form_water.refuse(CHOSEN)
    for name, value in (
        ("surface", "waves"), ("shafts", True), ("inelastic", "raman"), ("layers", "E"),
    ):  # fmt: skip
        with pytest.raises(InputError, match=f"combines with nothing, .*--{name}"):
            closed_form_water.refuse(replace(CHOSEN, **{name: value}))
    with pytest.raises(InputError, match="lamps in the water, a camera in the air"):
        closed_form_water.refuse(CHOSEN, lamps=True, above=True)
    layered = replace(water.column, below=(DeeperWater(5.0, 0.2, 0.3, water.phase),))
    with pytest.raises(InputError, match=r"the closed form .* one layer only"):
        closed_form_water.closed_form_water(layered, water.phase, water.weights)


def test_what_it_leaves_out_is_said():
    notes = closed_form_water.notes(
        replace(CHOSEN, sky="overcast"), make_plan(replace(CHOSEN, phase="mixture")).phase
    )
    assert any("uniform" in note for note in notes)
    assert any("Henyey-Greenstein" in note for note in notes)
    assert len(closed_form_water.notes(CHOSEN, make_plan(CHOSEN).phase)) == 1


def test_bands_beyond_one_shader_are_refused(empty_blender):
    water = _water(replace(CHOSEN, bands=15))
    with pytest.raises(InputError, match="up to 12 bands"):
        closed_form_water.add(empty_blender, water, water_body.WaterExtent(10.0, 10.0))
