"""What a scene requires: the cheapest water whose colours are right enough, and why.

A few rays of the camera are coloured by the closed form once with everything,
and once without each thing that can be left out; every choice of bands is
coloured with everything elastic. These differences of colour are added, ray
by ray and with their signs, for every combination of options, so that the
error of a combination is one ΔE2000 per ray and no rule for adding up ΔE is
needed. All combinations are looked at, from the cheapest on: the first that is
right enough is the cheapest.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .colour_rendering import delta_e_CIE2000_images
from .costs import Costs, Method, Options, read_costs
from .errors import InputError
from .light_reach import (
    BOUNCES,
    FROXELS,
    cycles_noise,
    first_enough,
    lost_beyond,
    shaft_range,
    shown,
    visible_distance,
)
from .seen_points import (
    AUREOLE,
    FLOOR_LIGHT,
    INELASTIC,
    INTERNAL_REFLECTION,
    SHAFTS,
    SINGLE,
    Optics,
    Picture,
    SeenPoints,
    picture,
)
from .water_column import SURFACES

SAFETY = 0.95
"""Share of the target that the estimate may use up; chosen on the tuning cases of the benchmark."""

SURFACE, FLOOR = "surface", "floor"
SWITCHES = (AUREOLE, SHAFTS, INELASTIC, SURFACE, FLOOR)
"""What can be left out of the water."""

_RAYS = 144
_CHUNK = 48
_HARDLY, _UNSEEN = 1.02, 0.01  # factor and ΔE that are not worth a cost
_LONGEST_SHAFT = 200.0
_MINOR = 0.1  # share of the target that what is not searched may add
_DENOISED = 4.0  # samples that a denoiser is worth; a rule of thumb
_EEVEE_SAMPLES = 16
_LIGHTS = "not in view, but it lights the rest"


@dataclass(frozen=True)
class Decision:
    """One choice, in numbers and in a line.

    Parameters
    ----------
    name : str
        What is chosen.
    value : str
        The choice.
    effect_delta_e : float
        Estimated mean ΔE2000 that the thing is worth: of leaving it out, or
        that the choice leaves.
    cost_ratio : float
        Cost of the picture with the thing to that without, or with the choice
        to that with the best one.
    reason : str
        Why, in a few words.
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
class BandChoice:
    """Some bands, by name, and the elastic optics on them.

    ``settings`` are what a caller does to get them; they are handed back.
    """

    name: str
    optics: Optics
    settings: dict[str, object]

    @property
    def count(self) -> int:
        """Number of bands."""
        return len(self.optics.view.column.bands)


@dataclass(frozen=True)
class Effort:
    """What a picture takes besides its water.

    Parameters
    ----------
    method : {"realtime", "bands", "cycles"}
    bands_per_pass : int
        Of band passes.
    megapixels : float
        Of a frame.
    frames : int
    samples : int, optional
        Per pixel; None leaves them to :func:`decide`.
    """

    method: Method = "realtime"
    bands_per_pass: int = 3
    megapixels: float = 1.0
    frames: int = 1
    samples: int | None = None


@dataclass(frozen=True, eq=False)
class Requirements:
    """What was decided.

    Parameters
    ----------
    bands : BandChoice
    options : Options
        What the water has.
    floor : bool
        Whether the added floor stays.
    samples, bounces, froxels : int
    delta_e : float
        Estimated mean ΔE2000 of bands and options, against everything with many bands.
    cost : float
        Per sample, against the scene without water.
    seconds : float
        CPU time of all frames on the machine of the cost table.
    decisions : tuple of Decision
    """

    bands: BandChoice
    options: Options
    floor: bool
    samples: int
    bounces: int
    froxels: int
    delta_e: float
    cost: float
    seconds: float
    decisions: tuple[Decision, ...]


@dataclass(frozen=True, eq=False)
class Combination:
    """Bands and options with their cost."""

    bands: BandChoice
    options: Options
    floor: bool
    cost: float


class Estimate:
    """Colours of a few rays with and without everything; arguments as for :func:`decide`."""

    def __init__(
        self,
        seen: Sequence[SeenPoints],
        reference: Optics,
        choices: Sequence[BandChoice],
        rays: int = _RAYS,
    ) -> None:
        if not seen or not choices:
            raise InputError("what a scene requires: give at least one view and one set of bands")
        few = [view.some(max(rays // len(seen), 1)) for view in seen]
        self.seen, self.reference, column = few, reference, reference.view.column
        level = SURFACES.index(column.surface)
        self.surfaces = SURFACES[level::-1]
        self.floors = (True, False) if math.isfinite(column.floor_depth) else (True,)
        self._pictures = {
            (surface, floor): self._picture(reference, surface=surface, floor=floor)
            for surface in self.surfaces
            for floor in self.floors
        }
        self.full = self._pictures[column.surface, True]
        self.has = {name for name in self.full.parts if np.abs(self.full.parts[name]).max() > 0}
        # Waves change what is seen of the bands too little to be baked for each of them.
        calm = "flat" if column.surface == "waves" else column.surface
        plain = self._pictures[calm, True].without(INELASTIC, SHAFTS)
        lit = [replace(v, path_sunlit=np.ones((len(v), 1), dtype=bool)) for v in few]
        self._bands = {
            id(choice): self._picture(choice.optics, lit, surface=calm).without(INELASTIC) - plain
            for choice in choices
        }
        self.choices = choices

    def _picture(
        self, optics: Optics, seen: Sequence[SeenPoints] | None = None, **how: object
    ) -> Picture:
        found = [picture(optics, view, **how) for view in seen or self.seen]
        names = set().union(*(f.parts for f in found))
        parts = {
            name: np.vstack([f.parts.get(name, np.zeros_like(f.plain)) for f in found])
            for name in names
        }
        return Picture(np.vstack([f.plain for f in found]), parts)

    def rgb(
        self, bands: BandChoice | None, options: Options, *, floor: bool = True
    ) -> NDArray[np.float64]:
        """Colours of a combination, shape (m, 3); many bands without a choice."""
        switched = {
            AUREOLE: options.aureole,
            SHAFTS: options.shafts,
            INELASTIC: options.inelastic,
        }
        off = [name for name, on in switched.items() if not on]
        rgb = self._pictures[options.surface, floor].without(*off)
        return rgb if bands is None else rgb + self._bands[id(bands)]

    def errors(self, pictures: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
        """Mean ΔE2000 of pictures against everything with many bands."""
        truth = shown(self.full.without())
        difference = delta_e_CIE2000_images(shown(np.array(pictures)), truth[None])
        return np.asarray(difference.mean(axis=-1))

    def everything(self) -> Options:
        """Options with all that the scene has."""
        return Options(True, self.surfaces[0], INELASTIC in self.has, SHAFTS in self.has)

    def light_effect(self, name: str) -> float:
        """Mean ΔE2000 of a light that cannot be switched off by itself."""
        return float(self.errors([self._picture(self.reference, without=name).without()])[0])

    def combinations(
        self, effort: Effort, costs: Costs, keep: Collection[str] = ()
    ) -> list[Combination]:
        """Every combination, the cheapest first; of equals the one with more in it.

        What is named in ``keep`` stays on. Cycles leaves nothing out: that it
        would save time was not measured.
        """
        everything = self.everything()
        fixed = set(SWITCHES if effort.method == "cycles" else keep)
        surfaces = self.surfaces[:1] if SURFACE in fixed else self.surfaces
        aureoles, inelastics, shafts = (
            (True, False) if on and name not in fixed else (on,)
            for name, on in (
                (AUREOLE, everything.aureole),
                (INELASTIC, everything.inelastic),
                (SHAFTS, everything.shafts or SHAFTS in keep),
            )
        )
        floors = (True,) if FLOOR in fixed else self.floors
        found = []
        for choice, *switches, floor in itertools.product(
            self.choices, aureoles, surfaces, inelastics, shafts, floors
        ):
            options = Options(*switches)
            cost = costs.sample(effort.method, choice.count, effort.bands_per_pass, options)
            found.append(Combination(choice, options, floor, cost))
        return sorted(found, key=lambda c: (c.cost, -_content(c)))

    def search(
        self, combinations: Sequence[Combination], target: float
    ) -> tuple[Combination, float]:
        """Return what :func:`pick` picks, and its error."""
        errors = np.empty(0)
        for chunk in _chunks(combinations):
            found = self.errors([self.rgb(c.bands, c.options, floor=c.floor) for c in chunk])
            errors = np.append(errors, found)
            if (found <= target).any():
                break
        index = pick(errors, target)
        return combinations[index], float(errors[index])


def pick(errors: NDArray[np.float64], target: float) -> int:
    """Index of the first error within a target; without one, of the first that is hardly worse.

    Examples
    --------
    >>> errors = np.array([3.0, 1.0, 2.0, 0.99])
    >>> pick(errors, 2.5), pick(errors, 0.5)
    (1, 1)
    """
    allowed = max(target, _HARDLY * float(errors.min()) + _UNSEEN)
    return int(np.argmax(errors <= allowed))


def decide(
    seen: Sequence[SeenPoints],
    reference: Optics,
    choices: Sequence[BandChoice],
    *,
    target: float,
    budget: float | None = None,
    effort: Effort | None = None,
    keep: Collection[str] = (),
    denoise: bool = False,
    costs: Costs | None = None,
) -> Requirements:
    """Choose bands, options, samples and ranges.

    Parameters
    ----------
    seen : sequence of SeenPoints
        Views along the camera's path.
    reference : Optics
        Everything the scene has, on many bands.
    choices : sequence of BandChoice
        Bands to choose from, elastic.
    target : float
        Mean ΔE2000 over the seen pixels.
    budget : float, optional
        CPU time of all frames in s, on the machine of the cost table; goes before the target.
    effort : Effort, optional
    keep : collection of str
        Those of :data:`SWITCHES` that must stay as they are.
    denoise : bool
        Whether Cycles passes are denoised.
    costs : Costs, optional
        The measured ones by default.

    Returns
    -------
    Requirements

    Raises
    ------
    InputError
        If the target or the budget is not positive, or nothing is given to choose from.
    """
    for name, value in (("target ΔE", target), ("time budget", budget)):
        if value is not None and not value > 0:
            raise InputError(f"{name} must be positive, got {value:g}")
    effort, costs = effort or Effort(), costs or read_costs()
    estimate = Estimate(seen, reference, choices)
    samples, noise = _samples(reference, estimate, effort, target, denoise=denoise)
    unit = costs.seconds * effort.megapixels * effort.frames
    combinations = estimate.combinations(effort, costs, keep)
    if budget is not None:
        # Bands and options get the budget at the fewest samples; what is left buys samples.
        fewest = effort.samples or min(samples, _EEVEE_SAMPLES)
        affordable = [c for c in combinations if c.cost * unit * fewest <= budget]
        combinations = affordable or combinations[:1]
    chosen, delta_e = estimate.search(combinations, SAFETY * target)
    if budget is not None and effort.samples is None:
        affords = int(budget / (chosen.cost * unit))
        noise *= math.sqrt(samples / max(min(samples, affords), 1))
        samples = max(min(samples, affords), 1)
    about = _About(estimate, chosen, effort, costs, target, frozenset(keep))
    bounces, froxels, ranges = about.ranges()
    decisions = (
        about.bands(delta_e),
        *about.options(),
        *about.lights(),
        *ranges,
        about.samples(samples, noise),
    )
    return Requirements(
        chosen.bands,
        chosen.options,
        chosen.floor,
        samples,
        bounces,
        froxels,
        delta_e,
        chosen.cost,
        chosen.cost * unit * samples,
        decisions,
    )


@dataclass(frozen=True, eq=False)
class _About:
    """Puts what was chosen into words."""

    estimate: Estimate
    chosen: Combination
    effort: Effort
    costs: Costs
    target: float
    keep: frozenset[str]

    def _cost(self, bands: BandChoice, options: Options) -> float:
        effort = self.effort
        return self.costs.sample(effort.method, bands.count, effort.bands_per_pass, options)

    def _state(self, name: str, on: bool) -> str:
        return ("on" if on else "off") + (", as given" if name in self.keep else "")

    def bands(self, delta_e: float) -> Decision:
        e, chosen = self.estimate, self.chosen
        most = max(e.choices, key=lambda c: c.count)
        alone = float(e.errors([e.rgb(chosen.bands, e.everything())])[0])
        passes = math.ceil(chosen.bands.count / self.effort.bands_per_pass)
        packed = {
            "realtime": "in one pass",
            "bands": f"in {passes} passes",
            "cycles": f"in {passes} passes of {self.effort.bands_per_pass}",
        }[self.effort.method]
        verdict = "within" if delta_e <= SAFETY * self.target else "nothing affordable reaches"
        return Decision(
            "bands",
            f"{chosen.bands.name} {packed}",
            alone,
            chosen.cost / self._cost(most, chosen.options),
            f"all choices together ΔE {delta_e:.2f}, {verdict} {self.target:g}",
        )

    def options(self) -> Iterator[Decision]:
        e, chosen = self.estimate, self.chosen
        everything = e.everything()
        if self.effort.method != "cycles":
            for name, present, how in (
                (AUREOLE, True, "sunlight spread by small angles"),
                (SHAFTS, everything.shafts, _shadows(e.seen)),
                (INELASTIC, everything.inelastic, "light of changed wavelength"),
            ):
                if present:
                    yield self._option(name, how)
                elif name == SHAFTS:
                    yield Decision(name, "off", 0.0, 1.0, _shadows(e.seen))
        for more, less in itertools.pairwise(e.surfaces):
            kept = SURFACES.index(chosen.options.surface) >= SURFACES.index(more)
            what = "waves and caustics" if more == "waves" else "surface with Snell's window"
            options = [replace(everything, surface=s) for s in (more, less)]
            with_, without = e.errors([e.rgb(None, o) for o in options])
            costs = [
                self._cost(chosen.bands, replace(chosen.options, surface=s)) for s in (more, less)
            ]
            yield Decision(
                what,
                self._state(SURFACE, kept),
                float(without - with_),
                costs[0] / costs[1],
                _looking_up(e.seen),
            )
        if len(e.floors) > 1:
            effect = float(e.errors([e.rgb(None, everything, floor=False)])[0])
            distance = min((_nearest_floor(view) for view in e.seen), default=math.inf)
            yield Decision(
                FLOOR,
                self._state(FLOOR, chosen.floor),
                effect,
                1.0,
                f"nearest {distance:.1f} m" if math.isfinite(distance) else _LIGHTS,
            )

    def _option(self, name: str, how: str) -> Decision:
        e, on = self.estimate, getattr(self.chosen.options, name)
        without = replace(e.everything(), **{name: False})
        effect = float(e.errors([e.rgb(None, without)])[0])
        costs = [
            self._cost(self.chosen.bands, replace(self.chosen.options, **{name: state}))
            for state in (True, False)
        ]
        return Decision(name, self._state(name, on), effect, costs[0] / costs[1], how)

    def lights(self) -> Iterator[Decision]:
        e, column = self.estimate, self.estimate.reference.view.column
        kept = [(SINGLE, "sunlight scattered once on the way")]
        if math.isfinite(column.floor_depth) and self.chosen.floor:
            kept.append((FLOOR_LIGHT, "light that the floor sends up"))
        if self.chosen.options.surface != "none":
            kept.append((INTERNAL_REFLECTION, "water mirrored by the surface"))
        for name, how in kept:
            yield Decision(name, "on", e.light_effect(name), 1.0, f"{how}; always computed")

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
        if self.chosen.options.shafts and self.effort.method != "cycles":
            end = min(shaft_range(view, allowed), _LONGEST_SHAFT)
            errors = self._froxel_errors(end)
            froxels, error = first_enough(FROXELS, errors, self.target * _MINOR)
            text = f"{froxels} steps up to {end:.1f} m"
            decisions.append(
                Decision("froxels", text, error, 1.0, "half a step is missing of every shaft")
            )
        bounces = BOUNCES[-1]
        if self.effort.method == "cycles":
            lost = lost_beyond(view)
            rgb = e.full.without()
            errors = e.errors([rgb * (1.0 - share) for share in lost])
            bounces, error = first_enough(BOUNCES, errors, self.target * _MINOR)
            share = lost[BOUNCES.index(bounces)]
            reason = f"at most {share:.2%} of the light is scattered more often"
            decisions.append(Decision("bounces", str(bounces), error, 1.0, reason))
        return bounces, froxels, decisions

    def _froxel_errors(self, end: float) -> NDArray[np.float64]:
        e = self.estimate
        rgb = e.full.without()
        pictures = []
        for count in FROXELS:
            short = []
            for view in e.seen:
                optics = replace(e.reference.view, depth=view.depth)
                y, w = -view.origin[:, 2, None], tuple(view.direction.T[..., None])
                P = np.minimum(view.distance, end)[:, None]
                single = optics.path_radiance.single_scattering
                nearer = np.maximum(P - end / count / 2, 0.0)
                short.append(optics.reduction.apply(single(y, w, P) - single(y, w, nearer)))
            pictures.append(rgb - np.vstack(short))
        return e.errors(pictures)

    def samples(self, samples: int, noise: float) -> Decision:
        if self.effort.method == "cycles":
            reason = f"noise of a pixel about ΔE {noise:.1f}, which ends in grain, not in colour"
            return Decision("samples", str(samples), noise, 1.0, reason)
        return Decision("samples", str(samples), 0.0, 1.0, "for edges; the water has no noise")


def _samples(
    reference: Optics, estimate: Estimate, effort: Effort, target: float, *, denoise: bool
) -> tuple[int, float]:
    """Samples per pixel, and the ΔE2000 of their noise in Cycles."""
    if effort.method != "cycles":
        return effort.samples or _EEVEE_SAMPLES, 0.0
    depth = float(np.mean([view.depth for view in estimate.seen]))
    one = cycles_noise(replace(reference.view, depth=depth)) / (_DENOISED if denoise else 1.0)
    count = effort.samples or int(np.clip((one / target) ** 2, 16, 4096))
    return count, one / math.sqrt(count)


def _switch(present: bool, alone: bool) -> tuple[bool, ...]:
    return ((True,) if alone else (True, False)) if present else (False,)


def _content(combination: Combination) -> tuple:
    o = combination.options
    return combination.floor + o.aureole + o.shafts + o.inelastic + SURFACES.index(o.surface)


def _chunks(combinations: Sequence[Combination]) -> Iterator[Sequence[Combination]]:
    for first in range(0, len(combinations), _CHUNK):
        yield combinations[first : first + _CHUNK]


def _shadows(seen: Sequence[SeenPoints]) -> str:
    share = float(np.mean([view.shaded_path for view in seen]))
    return f"{share:.0%} of the seen water in shadow" if share else "no shadow in the water"


def _looking_up(seen: Sequence[SeenPoints]) -> str:
    up = [(view.direction[:, 2] > 0) & ~np.isfinite(view.distance) for view in seen]
    share = float(np.mean(np.concatenate(up)))
    return f"{share:.0%} of the rays go up to it" if share else _LIGHTS


def _nearest_floor(view: SeenPoints) -> float:
    return float(view.distance[view.on_floor].min(initial=math.inf))
