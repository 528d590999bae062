"""What a scene requires: estimates, search, ranges, and the lines that explain them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from underwater_spectral.quality.combinations import BandChoice, ErrorEstimate, Workload
from underwater_spectral.quality.costs import (
    COLUMNS,
    COSTED,
    TYPICAL,
    read_costs,
)
from underwater_spectral.quality.light_reach import (
    BOUNCES,
    clip_to_display,
    cycles_sample,
    lost_beyond,
    shaft_range,
    visible_distance,
)
from underwater_spectral.quality.methods import DRAWN, METHODS, REFERENCE
from underwater_spectral.quality.picture import Optics, picture
from underwater_spectral.quality.requirements import SAFETY, decide
from underwater_spectral.quality.seen_points import SeenPoints, openness
from underwater_spectral.quality.terms import (
    DIFFUSE_SHADOWS,
    INELASTIC,
    SHAFTS,
    SINGLE,
    SURFACE,
    TERMS,
    WAVES,
    with_and_without,
)
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.imaging.excitation import Excitation
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.spectra.colour_rendering import (
    delta_e_CIE2000_images,
    luminance,
)
from underwater_spectral.uw_spectral.spectra.illuminant import parse_illuminant
from underwater_spectral.uw_spectral.spectra.sensor import parse_sensor
from underwater_spectral.uw_spectral.spectra.spectrum import DATA_DIRECTORY, read_table
from underwater_spectral.uw_spectral.surface.wave_patterns import Sea
from underwater_spectral.uw_spectral.transfer.light_from_above import light_from_above
from underwater_spectral.uw_spectral.transfer.radiance_table import TABLE_STREAMS
from underwater_spectral.uw_spectral.water.bio_optics import Constituents
from underwater_spectral.uw_spectral.water.inelastic_processes import (
    EXCITATION,
    inelastic_processes,
)
from underwater_spectral.uw_spectral.water.optical_properties import Water
from underwater_spectral.validation.sun_beam import sun_beam
from underwater_spectral.validation.viewpoints import make_viewpoint

pytestmark = pytest.mark.filterwarnings(
    "ignore::underwater_spectral.uw_spectral.errors.DataWarning"
)

D65 = parse_illuminant("d65")
EYE = parse_sensor("cie1931")


def viewpoint(water="IB", bands=60, depth=5.0, **how):
    return viewpoint_on(water, Bands.uniform(bands), depth, **how)


def viewpoint_on(water, bands, depth=5.0, **how):
    name = Water.jerlov(water) if isinstance(water, str) else water
    return make_viewpoint(name, D65, EYE, depth, bands, **how)


def seen_points(count=24, depth=5.0, shadow=0.0, up=0.3, distance=6.0):
    random = np.random.default_rng(1)
    w = random.normal([0.0, 1.0, up], 0.3, (count, 3))
    w /= np.linalg.norm(w, axis=1, keepdims=True)
    distance = np.where(random.random(count) < 0.5, np.inf, distance)
    return SeenPoints(
        origin=np.tile([0.0, 0.0, -depth], (count, 1)),
        direction=w,
        distance=distance,
        normal=-w,
        colour=random.uniform(0.1, 0.9, (count, 3)),
        sunlit=random.random(count) < 0.7,
        path_sunlit=random.random((count, 5)) >= shadow,
        reach=30.0,
        on_floor=np.zeros(count, dtype=bool),
        openness=np.ones(count),
        path_openness=np.ones(count),
        pixels=np.full(count, 1 / count),
    )


def choices(counts=(3, 5, 6, 9, 12), **how):
    return [
        BandChoice(f"{n} equal", Optics(viewpoint(bands=n, **how)), {"bands": n}) for n in counts
    ]


@pytest.mark.parametrize("surface", ["none", "flat"])
def test_picture_of_rays_is_the_solved_field(surface):
    view = viewpoint(sky_radiance=0.05, surface=surface, floor_depth=12.0)
    field = view.column.solved_field(view.phase, TABLE_STREAMS)
    seen = seen_points(40)
    seen = replace(seen, colour=np.zeros_like(seen.colour))
    y, w, P = 5.0, tuple(seen.direction.T), seen.distance
    hit = np.isfinite(P)
    behind = field.radiance(np.clip(y - w[2] * np.where(hit, P, 0.0), 0.0, 12.0), w)
    kept = np.exp(-view.column.attenuation * np.where(hit, P, math.inf)[:, None])
    expected = view.reduction.apply(field.radiance(y, w) - kept * behind)
    rgb = picture(Optics(view), seen).without()
    assert delta_e_CIE2000_images(clip_to_display(rgb), clip_to_display(expected)).max() < 0.5


def test_inelastic_light_is_that_of_the_solved_field():
    how = {"floor_depth": 12.0, "surface": "flat"}
    view, exciting = viewpoint("I", **how), viewpoint_on("I", EXCITATION, **how)
    processes = inelastic_processes(Constituents(), EXCITATION, view.column.bands, ("raman",))
    seen, excitation = seen_points(40), Excitation(processes, exciting.column, exciting.phase)
    seen = replace(seen, distance=np.full(40, np.inf))
    emission = excitation.emission(view.column.bands)
    with_it, without = (
        view.column.solved_field(view.phase, TABLE_STREAMS, emitted).radiance(
            5.0, tuple(seen.direction.T)
        )
        for emitted in (emission, None)
    )
    found = picture(Optics(view, excitation), seen).parts[INELASTIC]
    wanted = view.reduction.apply(with_it - without)
    assert luminance(found) == pytest.approx(luminance(wanted), rel=0.02)
    deep = picture(Optics(view, excitation), seen, floor_depth=math.inf, surface="none")
    assert (luminance(deep.parts[INELASTIC]) > 0).all()


def test_full_shadow_takes_all_single_scattering_within_reach():
    view, seen = viewpoint(), seen_points()
    dark = replace(seen, path_sunlit=np.zeros((len(seen), 5), dtype=bool))
    taken = picture(Optics(view), dark).parts[SHAFTS]
    w = tuple(seen.direction.T[..., None])
    single = sun_beam(view.column, view.phase).single_scattering(5.0, w, dark.reached[:, None])
    wanted = -view.reduction.apply(single)
    # Channels are looked up in tables.
    assert (np.abs(taken - wanted) <= 1e-3 * np.abs(wanted).max(axis=0)).all()
    assert SHAFTS not in picture(Optics(view), seen).parts


def test_without_single_scattering_the_water_is_darker():
    view, seen = viewpoint(), seen_points()
    whole, less = (picture(Optics(view), seen, without=name).without() for name in ("", SINGLE))
    assert (luminance(less) <= luminance(whole)).all()
    assert luminance(less).sum() < 0.95 * luminance(whole).sum()


def test_waves_of_no_wind_are_a_flat_surface():
    view = viewpoint(surface="waves")
    sun = np.asarray(view.column.sun_direction)
    calm = Sea(0.0, resolution=32).at(0.0, sun, 1.34)
    seen = seen_points()
    waves = picture(Optics(view, waves=calm), seen).without()
    flat = picture(Optics(view), seen, surface="flat").without()
    finite = np.isfinite(seen.distance)
    assert waves[finite] == pytest.approx(flat[finite], rel=0.02)


def test_foam_is_seen_from_below():
    view = viewpoint(surface="waves", sky_radiance=0.05, slope_variance=0.04)
    sea = Sea(18.0, resolution=64, raised=True, foam=True)
    raised = sea.at(0.0, np.asarray(view.column.sun_direction), 1.34)
    seen = seen_points(200, up=1.0)
    seen = replace(seen, distance=np.full(200, np.inf))
    clean = replace(raised, raised=replace(raised.raised, foam=None))
    foamy, bare = (picture(Optics(view, waves=w), seen).plain for w in (raised, clean))
    x, y = (seen.direction[:, i] * 5.0 / np.maximum(seen.direction[:, 2], 1e-3) for i in (0, 1))
    covered = (raised.raised.foam_fraction(x, y) > 0.0) & (seen.direction[:, 2] > 0.1)
    assert 0 < covered.sum() < 100
    assert (foamy[covered] != bare[covered]).any(axis=1).all()
    assert foamy[~covered] == pytest.approx(bare[~covered])


def test_waves_change_lit_points():
    view = viewpoint(surface="waves")
    sea = Sea(8.0, resolution=64).at(0.0, np.asarray(view.column.sun_direction), 1.34)
    estimate = ErrorEstimate(
        [seen_points()], Optics(view, waves=sea), choices((6,), surface="flat")
    )
    everything = estimate.everything
    assert everything == {SHAFTS, WAVES, SURFACE}
    flat = estimate.rgb(None, everything - {WAVES})
    assert estimate.errors([flat])[0] > 0.1
    assert estimate.errors([estimate.rgb(None, everything)])[0] == pytest.approx(0)


def test_search_finds_the_cheapest_of_all_combinations():
    estimate = ErrorEstimate([seen_points(shadow=0.4)], Optics(viewpoint(surface="flat")),
                        choices(surface="flat"))  # fmt: skip
    costs = read_costs()
    combinations = estimate.combinations(Workload(), costs)
    assert len(combinations) == 5 * 2
    assert all(SURFACE in c.options for c in combinations)  # it is free
    errors = [estimate.errors([estimate.rgb(c.bands, c.options)])[0] for c in combinations]
    for target in (0.5, 1.0, 3.0):
        chosen, error = estimate.search(combinations, target)
        good = [c.cost for c, e in zip(combinations, errors, strict=True) if e <= target]
        assert error <= target
        assert chosen.cost == min(good)


def test_parts_add_up_as_separate_pictures_do():
    fine, few = viewpoint(surface="flat"), viewpoint(bands=9, surface="flat")
    seen = seen_points(shadow=0.4)
    estimate = ErrorEstimate([seen], Optics(fine), [BandChoice("9", Optics(few), {})])
    # Bands are known by their name, not by the object.
    guess = estimate.errors([estimate.rgb(BandChoice("9", Optics(few), {}), frozenset())])[0]
    truth = clip_to_display(picture(Optics(fine), seen).without())
    direct = clip_to_display(picture(Optics(few), seen, surface="none").without(SHAFTS))
    measured = delta_e_CIE2000_images(direct, truth).mean()
    assert guess == pytest.approx(measured, rel=0.1)


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_decisions_meet_the_target_and_explain_themselves(method):
    required = decide(
        [seen_points(shadow=0.3)],
        Optics(viewpoint()),
        choices(),
        target=1.0,
        workload=Workload(method),
    )
    assert required.delta_e <= SAFETY * 1.0
    names = [decision.name for decision in required.decisions]
    assert len(set(names)) == len(names)
    assert ("bounces" in names) == method.traced
    assert all("\n" not in str(d) and "ΔE" in str(d) for d in required.decisions)
    assert required.bounces in BOUNCES


def test_a_looser_target_never_costs_more():
    given = [seen_points(shadow=0.4)], Optics(viewpoint("3C")), choices(water="3C")
    costs = [decide(*given, target=t).cost for t in (0.5, 1.0, 2.0, 4.0, 8.0)]
    assert costs == sorted(costs, reverse=True)


def test_what_is_kept_stays():
    given = [seen_points(shadow=0.4)], Optics(viewpoint()), choices()
    assert SHAFTS not in decide(*given, target=20.0).options
    kept = decide(*given, target=20.0, keep=(SHAFTS,))
    assert kept.options >= {SHAFTS}
    assert "on, as given" in "\n".join(map(str, kept.decisions))


def test_unreachable_targets_are_said_to_be():
    required = decide([seen_points()], Optics(viewpoint()), choices((3,)), target=0.05)
    assert "nothing affordable reaches 0.05" in str(required.decisions[0])


def test_time_budget_limits_the_cost():
    given = [seen_points(shadow=0.4)], Optics(viewpoint()), choices()
    free = decide(*given, target=0.3)
    tight = decide(*given, target=0.3, budget=0.5 * free.seconds)
    assert tight.seconds <= 0.5 * free.seconds
    assert tight.delta_e >= free.delta_e


def test_budget_buys_cycles_samples():
    given = [seen_points()], Optics(viewpoint()), choices()
    workload = Workload(REFERENCE, megapixels=0.1)
    some, more = (
        decide(*given, target=1.0, budget=s, workload=workload).samples for s in (60, 600)
    )
    assert some < more


def test_shared_passes_of_cycles_cost_less():
    given = [seen_points()], Optics(viewpoint())
    workload = Workload(REFERENCE, megapixels=0.1, samples=64)
    optics = Optics(viewpoint(bands=8))
    one, shared = (
        decide(*given, [BandChoice("8", optics, {}, passes)], target=1.0, workload=workload)
        for passes in (8, 3)
    )
    assert one.seconds == pytest.approx(8 / 3 * shared.seconds)
    assert any("8 in 3 passes" in str(line) for line in shared.decisions)


def test_denoised_pictures_need_fewer_samples():
    given = [seen_points()], Optics(viewpoint()), choices((8,))
    workload = Workload(REFERENCE, megapixels=0.1)
    raw, clean = (
        decide(*given, target=1.0, workload=replace(workload, denoise=denoise)).samples
        for denoise in (False, True)
    )
    # By the measured error of pixels (docs/measured/denoising.md), squared.
    assert raw / clean == pytest.approx(2.4**2, rel=0.05)


def test_samples_of_cycles_are_dearer_where_light_scatters_more():
    """The table's scenes: noise by orders of magnitude, time by about two."""
    clear, turbid = (
        cycles_sample(viewpoint(*scene)) for scene in (("I", 60, 20.0), ("9C", 60, 0.5))
    )
    assert turbid.delta_e > 10 * clear.delta_e
    assert 1.3 * clear.seconds < turbid.seconds < 6 * clear.seconds
    workload = Workload(REFERENCE, megapixels=1.0, samples=100)
    for water, depth, sample in (("I", 20.0, clear), ("9C", 0.5, turbid)):
        optics = Optics(viewpoint(water, 9, depth))
        choice = BandChoice("9", optics, {}, 3)
        seen = [seen_points(depth=depth)]
        found = decide(seen, optics, [choice], target=1.0, workload=workload)
        assert found.seconds == pytest.approx(300 * sample.seconds, rel=0.01)


def test_nothing_lies_beyond_visibility():
    view = viewpoint("3C")
    far = visible_distance(view, 1.0)
    for reflectance in (0.0, 0.9):
        P = np.array([[1.01 * far], [3.0 * far]])
        lit = reflectance / math.pi * view.light
        transmittance = np.exp(-view.attenuation * P)
        seen = transmittance * lit + (1.0 - transmittance) * view.background
        rgb = view.reduction.apply(np.vstack([seen, view.background]))
        assert (
            delta_e_CIE2000_images(clip_to_display(rgb[:2]), clip_to_display(rgb[2:])).max() < 1.0
        )
    assert visible_distance(viewpoint("I"), 1.0) > far
    assert visible_distance(view, 4.0) < far
    clear = viewpoint("IB")
    assert shaft_range(clear, 1.0) < shaft_range(clear, 0.2) < visible_distance(clear, 0.2)


def scattered_more_than(bounces, depth, a, b, g, cosine, photons=40_000, most=60):
    """Fraction of the diffuse scalar irradiance at a depth, by photons (float weights)."""
    random = np.random.default_rng(3)
    y, mu = np.zeros(photons), np.full(photons, cosine)
    orders = np.zeros(most)
    for order in range(most):
        below = y + mu * random.exponential(1.0, photons) / (a + b)
        crossed = (y < depth) != (below < depth)
        orders[order] = (b / (a + b)) ** order * (1 / np.abs(mu[crossed])).sum()
        inside = below > 0
        y, mu = below[inside], mu[inside]
        photons = len(y)
        k = random.random(photons)
        turn = (1 + g * g - ((1 - g * g) / (1 - g + 2 * g * k)) ** 2) / (2 * g)
        around = np.cos(2 * np.pi * random.random(photons))
        mu = mu * turn + np.sqrt((1 - mu**2) * (1 - turn**2)) * around
        mu = np.where(np.abs(mu) < 1e-3, 1e-3, mu)
    return [orders[k + 1 :].sum() / orders[1:].sum() for k in bounces]


def test_bound_of_lost_light_holds_against_a_random_walk():
    bounces = (2, 4, 8, 16)
    view = viewpoint(Water.uniform(0.2, 0.3), phase="hg:0.5", depth=2.0)
    lost = lost_beyond(view, bounces)
    true = scattered_more_than(bounces, 2.0, 0.2, 0.3, 0.5, view.column.sun_cosine)
    assert (lost >= true).all()
    assert (lost[:3] <= 30 * np.array(true[:3])).all()


def test_costs_are_those_of_the_table():
    costs, columns = read_costs(), read_table(DATA_DIRECTORY / "costs.csv", COLUMNS).columns
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    water = [row for row in rows if row["method"]]
    assert len(water) == 9
    for row in water:
        options = TYPICAL | {term.name for term in COSTED if row[term.name]}
        method = list(METHODS.values())[int(row["method"]) - 1]
        assert costs.sample(method, 1, options) == pytest.approx(row["ratio"])
        assert costs.sample(method, 3, options) == pytest.approx(3 * row["ratio"])


def test_less_never_costs_more():
    costs = read_costs()
    everything = frozenset(term.name for term in TERMS)
    for term in TERMS:
        for method in DRAWN:
            more, less = (
                costs.sample(method, 1, options) for options in with_and_without(term, everything)
            )
            assert less < more if term.costs else less == more


def test_few_rays_stand_for_all_that_is_seen():
    seen = seen_points(1000)
    near = np.arange(1000) < 20
    seen = replace(
        seen,
        distance=np.where(near, 3.0, np.inf),
        on_floor=np.arange(1000) >= 700,
    )
    few = seen.subsample(60)
    assert [int((few.kind == kind).sum()) for kind in range(3)] == [20, 20, 20]
    for kind in range(3):
        fraction = [view.pixels[view.kind == kind].sum() for view in (seen, few)]
        assert fraction[0] == pytest.approx(fraction[1])
        assert few.weight[few.kind == kind].sum() == pytest.approx(1 / 3)
    assert len(seen.subsample(100)) == 100
    assert seen.subsample(1000) is seen
    assert len(seen.subsample(1)) == 3


def test_what_fills_less_than_a_percent_counts_in_proportion():
    seen = replace(seen_points(1000), distance=np.where(np.arange(1000) < 5, 3.0, np.inf))
    assert seen.weight[seen.kind == 2].sum() == pytest.approx(0.5 / 1.5)
    assert replace(seen, distance=np.full(1000, 3.0)).weight == pytest.approx(1e-3)


def test_the_error_is_the_mean_of_the_kinds():
    """One object of 50 rays in wrong colours is half of the error, not a fiftieth."""
    seen = replace(seen_points(50), distance=np.where(np.arange(50) == 7, 3.0, np.inf))
    estimate = ErrorEstimate([seen], Optics(viewpoint()), choices((3,)))
    wrong = estimate.full.without().copy()
    wrong[7] *= 0.5
    alone = delta_e_CIE2000_images(
        clip_to_display(wrong), clip_to_display(estimate.full.without())
    )[7]
    assert estimate.errors([wrong])[0] == pytest.approx(alone / 2)


def test_diffuse_shadows_are_a_part():
    view, seen = viewpoint(), seen_points(shadow=0.1)
    assert DIFFUSE_SHADOWS not in picture(Optics(view), seen).parts
    hit = np.isfinite(seen.distance)
    occluded = replace(seen, openness=np.where(hit, 0.0, 1.0))
    part = picture(Optics(view), occluded).parts[DIFFUSE_SHADOWS]
    assert (part[~hit] == 0).all()
    assert (luminance(part[hit]) < 0).all()
    lit = picture(Optics(view), replace(seen, sunlit=np.zeros(len(seen), dtype=bool)))
    dark = picture(Optics(view), replace(occluded, sunlit=np.zeros(len(seen), dtype=bool)))
    level = hit & (np.abs(seen.normal[:, 2]) < 0.3)
    half = luminance(dark.without() - lit.without()) / luminance(lit.without())
    assert half[level].max() < -0.05


def test_diffuse_shadows_are_chosen_where_they_matter():
    seen = seen_points()
    occluded = replace(seen, openness=np.where(np.isfinite(seen.distance), 0.2, 1.0))
    given = Optics(viewpoint()), choices()
    chosen, less, none, kept, without = (
        decide([view], *given, target=target, **how)
        for view, target, how in (
            (occluded, 0.3, {}),
            (occluded, 20.0, {}),
            (seen, 0.3, {}),
            (seen, 0.3, {"keep": (DIFFUSE_SHADOWS,)}),
            (occluded, 0.3, {"off": (DIFFUSE_SHADOWS,)}),
        )
    )
    assert DIFFUSE_SHADOWS in chosen.options
    assert DIFFUSE_SHADOWS not in less.options
    assert DIFFUSE_SHADOWS not in none.options
    assert DIFFUSE_SHADOWS in kept.options
    assert not {DIFFUSE_SHADOWS} & without.options
    line = {d.name: d for d in chosen.decisions}["diffuse shadows"]
    assert line.effect_delta_e > 0.3
    assert line.cost_ratio > 1
    assert "% of the light from above is kept from" in line.reason
    idle = {d.name: d for d in none.decisions}["diffuse shadows"]
    assert "nothing is in the way of light" in idle.reason
    assert "off, as given" in str({d.name: d for d in without.decisions}["diffuse shadows"])


def test_openness_is_the_fraction_of_the_cosine():
    # Under a uniform sky and no surface the light comes from everywhere above alike.
    bright = make_viewpoint(Water.uniform(1e-9, 0.0), D65, EYE, 5.0, Bands.uniform(3),
                            sky_radiance=1.0)  # fmt: skip
    w = light_from_above(bright.field, 5.0, 1000)
    assert np.linalg.norm(w, axis=1) == pytest.approx(1)
    up, down, level = (
        np.array([[0.0, 0.0, 1.0]]),
        np.array([[0.0, 0.0, -1.0]]),
        np.array([[1.0, 0, 0]]),
    )
    half = (w[:, 0] > 0)[None]
    assert openness(up, w, half)[0] == pytest.approx(0.5, abs=0.01)
    assert openness(level, w, half)[0] == pytest.approx(1)
    assert openness(level, w, ~half)[0] == pytest.approx(0)
    assert openness(down, w, half)[0] == 1
    # A roof that hides what is within 60° of the zenith.
    assert openness(up, w, (w[:, 2] < 0.5)[None])[0] == pytest.approx(0.25, abs=0.01)


def test_refusals():
    with pytest.raises(InputError, match="camera is 2 m above the water"):
        seen_points(depth=-2.0)
    with pytest.raises(InputError, match="colour has 3 rows for 24 rays"):
        replace(seen_points(), colour=np.zeros((3, 3)))
    given = [seen_points()], Optics(viewpoint())
    with pytest.raises(InputError, match="target ΔE must be positive"):
        decide(*given, choices((3,)), target=0.0)
    with pytest.raises(InputError, match="time budget must be positive"):
        decide(*given, choices((3,)), target=1.0, budget=-1.0)
    with pytest.raises(InputError, match="at least one view and one set of bands"):
        decide(*given, [], target=1.0)
    with pytest.raises(InputError, match="every set of bands a name of its own"):
        decide(*given, choices((3, 3)), target=1.0)
