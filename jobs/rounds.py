"""Which passes a picture needs: all of them, or parts in rounds until its noise is what is wanted.

What a round needs follows from the parts of those before it alone, so that a job that was stopped
goes on as if it had not been.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..quality import sampling
from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.spectral_image import read_exr
from .manifest import Manifest, View
from .tasks import Rendered, Task, by_pass, done

_FIRST = 2  # parts of a pass in the first round


@dataclass(frozen=True)
class Reached:
    """The noise of a picture, and the samples of each of its passes."""

    wanted: float
    noise: sampling.PictureNoise
    samples: tuple[int, ...]

    @property
    def is_enough(self) -> bool:
        """Whether the noise is what was wanted."""
        return self.noise.delta_e <= self.wanted

    def __str__(self) -> str:
        """Say what was reached."""
        count = f"{min(self.samples)} to {max(self.samples)} samples a pass"
        text = f"noise: ΔE2000 {self.noise.delta_e:.3g} of a pixel before denoising, with {count}"
        if self.is_enough:
            return f"{text}; {self.wanted:g} was wanted"
        needed = max(self.samples) * (self.noise.delta_e / self.wanted) ** 2
        return (
            f"{text}, the most that --samples allows; {self.wanted:g} was wanted: about "
            f"--samples {needed:.2g} would do"
        )

    def record(self) -> dict[str, Any]:
        """Return what the record of a picture says."""
        return {
            "measure": sampling.MEASURE,
            "wanted_delta_e": self.wanted,
            "reached_delta_e": self.noise.delta_e,
            "of_each_pass_alone": self.noise.by_pass,
            "samples": self.samples,
        }


def require_fixed(manifest: Manifest, option: str) -> None:
    """Refuse, for an option that needs passes before, a job that decides them as it renders."""
    if manifest.noise:
        raise InputError(
            f"{option}: with --noise (in the panel: Noise), samples are decided as one process "
            "renders; set it to 0 and give --samples"
        )


def reached(manifest: Manifest, view: View, rendered: Sequence[Rendered]) -> Reached:
    """Return the noise of a picture of parts: of each pass the first ones, an even number."""
    weights = manifest.weights(view)
    parts = by_pass(manifest, rendered)
    each = manifest.passes[0].samples
    return Reached(
        manifest.noise,
        sampling.picture_noise([_halves(of_pass, weights) for of_pass in parts]),
        tuple(each * len(of_pass) for of_pass in parts),
    )


def _halves(parts: Sequence[Rendered], weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return what two halves of the parts of a pass add to the picture, shape (2, h, w, 3)."""
    bands = list(parts[0].file.bands)

    def mean(half: Sequence[Rendered]) -> NDArray[np.float64]:
        total = sum(read_exr(item.file.path)[0].astype(np.float64) for item in half)
        return np.asarray(total)[..., : len(bands)] @ weights[:, bands].T / len(half)

    return np.stack([mean(parts[0::2]), mean(parts[1::2])])


class Rounds:
    """The passes that the pictures of a job need; with a noise that is wanted, round by round.

    ``views`` are those that are meant, all if none are named.
    """

    def __init__(self, manifest: Manifest, views: Sequence[View] = ()) -> None:
        self._manifest = manifest
        self._views = views or manifest.views
        first = _FIRST if manifest.noise else manifest.parts
        counts = (first,) * (len(manifest.passes) // manifest.parts)
        self._counts = dict.fromkeys(self._views, counts)
        self._complete: set[View] = set() if manifest.noise else set(self._views)

    @property
    def total(self) -> int:
        """Passes of the job, as far as rounds are decided."""
        return sum(map(sum, self._counts.values()))

    def tasks(self) -> Iterator[Task]:
        """Yield the passes of every picture; a round is rendered before the next is asked for.

        Raises InputError if one was not: another process works at the same job.
        """
        for view in self._views:
            given: set[Task] = set()
            while left := self._left(view, given):
                given.update(left)
                yield from left

    def has_all(self, view: View, count: int) -> bool:
        """Whether so many passes are all that a picture needs; else the next round is decided."""
        if count != sum(self._counts[view]):
            return False
        self._decide(view)
        return view in self._complete and count == sum(self._counts[view])

    def rendered(self, view: View) -> tuple[list[Rendered], list[int]]:
        """Return the passes of a picture that are on disk, and the numbers of those missing."""
        self._decide(view)
        found = {task.number: done(self._manifest, task) for task in self._of(view)}
        there = [item for item in found.values() if item is not None]
        return there, [number for number, item in found.items() if item is None]

    def _left(self, view: View, given: set[Task]) -> list[Task]:
        left = [task for task in self._of(view) if task not in given]
        if left or view in self._complete:
            return left
        self._decide(view)
        left = [task for task in self._of(view) if task not in given]
        if not left and view not in self._complete:
            raise InputError(
                f"{self._manifest.out}: another process renders this job, and with --noise only "
                "one can; wait for it"
            )
        return left

    def _of(self, view: View) -> list[Task]:
        parts = self._manifest.parts
        return [
            Task(view, number * parts + part)
            for number, count in enumerate(self._counts[view])
            for part in range(count)
        ]

    def _decide(self, view: View) -> None:
        """Decide rounds for as long as those before are on disk."""
        while view not in self._complete:
            found = [done(self._manifest, task, thorough=False) for task in self._of(view)]
            there = [item for item in found if item is not None]
            if len(there) < len(found):
                return
            grown = self._grown(view, reached(self._manifest, view, there))
            if grown == self._counts[view]:
                self._complete.add(view)
            self._counts[view] = grown

    def _grown(self, view: View, now: Reached) -> tuple[int, ...]:
        """Return the parts of each pass in the next round; the same if there is none."""
        counts, most = self._counts[view], self._manifest.parts
        if now.is_enough:
            return counts
        each = self._manifest.passes[0].samples
        wanted = sampling.allot(now.noise, now.samples, now.wanted)
        pairs = [int(np.ceil(samples / (2 * each))) for samples in wanted]
        grown = tuple(
            min(max(2 * pair, count), most) for pair, count in zip(pairs, counts, strict=True)
        )
        if grown != counts:
            return grown
        open_ = [n for n, count in enumerate(counts) if count < most]
        if not open_:
            return counts
        worst = max(open_, key=lambda n: now.noise.by_pass[n])
        return tuple(count + 2 * (n == worst) for n, count in enumerate(counts))
