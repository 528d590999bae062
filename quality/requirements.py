"""What a scene requires: the cheapest water whose colours are right enough, and why.

All combinations of :mod:`.combinations` are looked at, from the cheapest on. Ranges, bounces and
samples follow from how far light and its scattering reach.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.errors import InputError
from .combinations import BandChoice, Combination, ErrorEstimate, Workload
from .costs import Costs, read_costs
from .light_reach import (
    BOUNCES,
    FROXELS,
    CyclesSample,
    cycles_sample,
    first_within,
    lost_beyond,
    shaft_range,
    visible_distance,
)
from .methods import REFERENCE
from .picture import Optics, single_scattering
from .seen_points import SeenPoints
from .terms import LIGHTS, SHAFTS, TERMS, Options, Term, with_and_without

SAFETY = 0.95
"""Fraction of the target that the estimate may use up; chosen on the benchmark's tuning cases."""

_MINOR = 0.1  # fraction of the target that what is not searched may add
_DENOISED = 2.4  # ΔE of the noise over that after denoising; docs/measured/denoising.md
# EEVEE's samples smooth edges, which no ΔE of the water sees: few from this target on.
_FEW_SAMPLES, _MANY_SAMPLES, _COARSE = 16, 64, 2.0


@dataclass(frozen=True)
class Decision:
    """One choice, in numbers and in a line.

    ``effect_delta_e`` is the estimated mean ΔE2000 (:attr:`.SeenPoints.weight`) that the object is
    worth: of leaving it out, or that the choice leaves. ``cost_ratio`` is the cost of the picture
    with the object to that without, or with the choice to that with the best one.
    """

    name: str
    value: str
    effect_delta_e: float
    cost_ratio: float
    reason: str

    def __str__(self) -> str:
        """Return the line that explains the choice."""
        return (
            f"{self.name}: {self.value}; {self.reason} "
            f"(ΔE {self.effect_delta_e:.2f}, cost × {self.cost_ratio:.2f})"
        )


@dataclass(frozen=True, eq=False)
class Requirements:
    """What was decided.

    ``options`` are what the water has. ``delta_e`` is the estimated mean ΔE2000
    (:attr:`.SeenPoints.weight`) of bands and options, against everything with many bands; ``cost``
    is per sample, against the scene without water; ``seconds`` the CPU time of all frames on the
    machine of the cost table.
    """

    bands: BandChoice
    options: Options
    samples: int
    bounces: int
    froxels: int
    delta_e: float
    cost: float
    seconds: float
    decisions: tuple[Decision, ...]


def decide(
    seen: Sequence[SeenPoints],
    reference: Optics,
    choices: Sequence[BandChoice],
    *,
    target: float,
    budget: float | None = None,
    workload: Workload | None = None,
    keep: Collection[str] = (),
    off: Collection[str] = (),
) -> Requirements:
    """Choose bands, options, samples and ranges.

    ``seen`` are views along the camera's path, ``reference`` everything the scene has, on many
    bands, ``choices`` bands to choose from, elastic. ``target`` is the mean ΔE2000 of what is seen:
    objects, floor and open water count equally. ``budget`` is CPU time of all frames in s, on the
    machine of the cost table, and goes before the target; ``keep`` and ``off`` name those of
    :data:`.TERMS` that must stay so. Raises InputError if the target or the budget is not positive,
    or nothing is given to choose from.
    """
    for name, value in (("target ΔE", target), ("time budget", budget)):
        if value is not None and not value > 0:
            raise InputError(f"{name} must be positive, got {value:g}")
    workload, estimate = workload or Workload(), ErrorEstimate(seen, reference, choices)
    sample = None
    if workload.method.traced:
        depth = float(np.mean([view.depth for view in estimate.seen]))
        sample = cycles_sample(replace(reference.view, depth=depth))
    costs = _costs(sample)
    samples, noise = _samples(sample, workload, target)

    def seconds(c: Combination) -> float:
        method = workload.method
        each = costs.sample_seconds(method, c.bands.passes(method), c.options)
        return workload.megapixels * workload.frames * each

    combinations = estimate.combinations(workload, costs, keep, off)
    if budget is not None:
        # Bands and options get the budget at the fewest samples; what is left buys samples.
        fewest = workload.samples or min(samples, _FEW_SAMPLES)
        affordable = [c for c in combinations if seconds(c) * fewest <= budget]
        combinations = affordable or combinations[:1]
    chosen, delta_e = estimate.search(combinations, SAFETY * target)
    if budget is not None and workload.samples is None:
        affords = int(budget / seconds(chosen))
        noise *= math.sqrt(samples / max(min(samples, affords), 1))
        samples = max(min(samples, affords), 1)
    about = _About(estimate, chosen, workload, costs, target, frozenset({*keep, *off}))
    bounces, froxels, ranges = about.ranges()
    decisions = (
        about.bands(delta_e),
        *about.terms(),
        *about.lights(),
        *ranges,
        about.samples(samples, noise),
    )
    return Requirements(
        chosen.bands,
        chosen.options,
        samples,
        bounces,
        froxels,
        delta_e,
        chosen.cost,
        seconds(chosen) * samples,
        decisions,
    )


@dataclass(frozen=True, eq=False)
class _About:
    """Puts what was chosen into words."""

    estimate: ErrorEstimate
    chosen: Combination
    workload: Workload
    costs: Costs
    target: float
    keep: frozenset[str]

    def _cost(self, bands: BandChoice, options: Options) -> float:
        method = self.workload.method
        return self.costs.sample(method, bands.passes(method), options)

    def bands(self, delta_e: float) -> Decision:
        e, chosen = self.estimate, self.chosen
        most = max(e.choices, key=lambda c: c.count)
        alone = float(e.errors([e.rgb(chosen.bands, e.everything)])[0])
        passes = chosen.bands.passes(self.workload.method)
        packed = "in one pass" if passes == 1 else f"in {passes} passes"
        verdict = "within" if delta_e <= SAFETY * self.target else "nothing affordable reaches"
        return Decision(
            "bands",
            f"{chosen.bands.name} {packed}",
            alone,
            chosen.cost / self._cost(most, chosen.options),
            f"all choices together ΔE {delta_e:.2f}, {verdict} {self.target:g}; "
            f"an equal mean of {_seen_kinds(e.seen)}",
        )

    def terms(self) -> Iterator[Decision]:
        e, chosen = self.estimate, self.chosen
        for term in TERMS:
            if term.is_part and self.workload.method.traced:
                continue
            effect, cost = 0.0, 1.0
            if term.name in e.everything:
                effect, cost = self._worth(term)
            elif not term.is_switch:
                continue
            state = "on" if term.name in chosen.options else "off"
            state += ", as given" if term.name in self.keep else ""
            yield Decision(term.label, state, effect, cost, term.purpose(e.seen))

    def _worth(self, term: Term) -> tuple[float, float]:
        """Effect and cost ratio of a term."""
        e, chosen = self.estimate, self.chosen
        pictures = [e.rgb(None, options) for options in with_and_without(term, e.everything)]
        more, less = e.errors(pictures)
        dear, cheap = (
            self._cost(chosen.bands, options) for options in with_and_without(term, chosen.options)
        )
        return float(less - more), dear / cheap

    def lights(self) -> Iterator[Decision]:
        for light in LIGHTS:
            if not light.needs or light.needs in self.chosen.options:
                effect = self.estimate.light_effect(light.name)
                yield Decision(light.name, "on", effect, 1.0, f"{light.purpose}; always computed")

    def ranges(self) -> tuple[int, int, list[Decision]]:
        """Bounces, froxels and the decisions about them and about what is out of sight."""
        e, allowed = self.estimate, self.target / 2
        depth = float(np.mean([view.depth for view in e.seen]))
        view = replace(e.reference.view, depth=depth)
        far = visible_distance(view, allowed)
        farthest = max(float(v.distance[np.isfinite(v.distance)].max(initial=0)) for v in e.seen)
        decisions = [
            Decision(
                "visibility",
                f"{far:.0f} m" if math.isfinite(far) else "over 500 m",
                allowed,
                1.0,
                f"what lies beyond can be left out; the farthest seen is at {farthest:.1f} m",
            )
        ]
        froxels = FROXELS[-1]
        if SHAFTS in self.chosen.options and not self.workload.method.traced:
            end, enough = self.workload.shaft_end, shaft_range(view, allowed)
            errors = self._froxel_errors(end)
            froxels, error = first_within(FROXELS, errors, self.target * _MINOR)
            reason = f"half a step is missing of every shaft; they matter up to {enough:.1f} m"
            value = f"{froxels} steps over {end:.1f} m"
            decisions.append(Decision("froxels", value, error, 1.0, reason))
        bounces = BOUNCES[-1]
        if self.workload.method.traced:
            lost = lost_beyond(view)
            rgb = e.full.without()
            errors = e.errors([rgb * (1.0 - fraction) for fraction in lost])
            bounces, error = first_within(BOUNCES, errors, self.target * _MINOR)
            fraction = lost[BOUNCES.index(bounces)]
            reason = f"at most {fraction:.2%} of the light is scattered more often"
            decisions.append(Decision("bounces", str(bounces), error, 1.0, reason))
        return bounces, froxels, decisions

    def _froxel_errors(self, end: float) -> NDArray[np.float64]:
        e = self.estimate
        rgb = e.full.without()
        steps = end / np.array(FROXELS) / 2
        short = []
        for view in e.seen:
            P = np.minimum(view.distance, end)[:, None]
            nearer = np.hstack([P, np.maximum(P - steps, 0.0)])
            single = single_scattering(e.reference, view, nearer)
            short.append(single[:, :1] - single[:, 1:])
        return e.errors([rgb - part for part in np.swapaxes(np.vstack(short), 0, 1)])

    def samples(self, samples: int, noise: float) -> Decision:
        if self.workload.method.traced:
            reason = f"noise of a pixel about ΔE {noise:.1f}, which ends in grain, not in colour"
            return Decision("samples", str(samples), noise, 1.0, reason)
        return Decision("samples", str(samples), 0.0, 1.0, "for edges; the water has no noise")


def _costs(sample: CyclesSample | None) -> Costs:
    """Return the measured costs; those of Cycles depend on the water."""
    costs = read_costs()
    if sample is None:
        return costs
    return replace(costs, passes={**costs.passes, REFERENCE.name: sample.seconds / costs.seconds})


def _samples(sample: CyclesSample | None, workload: Workload, target: float) -> tuple[int, float]:
    """Samples per pixel, and the ΔE2000 of their noise in Cycles."""
    if sample is None:
        return workload.samples or (_FEW_SAMPLES if target >= _COARSE else _MANY_SAMPLES), 0.0
    one = sample.delta_e / (_DENOISED if workload.denoise else 1.0)
    count = workload.samples or int(np.clip((one / target) ** 2, 16, 4096))
    return count, one / math.sqrt(count)


def _seen_kinds(seen: Sequence[SeenPoints]) -> str:
    """Name what counts, and its fraction of the pictures."""
    fractions = [
        np.mean([view.pixels[view.kind == kind].sum() for view in seen]) for kind in (2, 1, 0)
    ]
    names = ("objects", "floor", "open water")
    return ", ".join(
        f"{name} ({fraction:.0%} of the picture)"
        for name, fraction in zip(names, fractions, strict=True)
        if fraction
    )
