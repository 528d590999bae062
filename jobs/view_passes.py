"""The passes of a view, as its pictures are made of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..datasets.files import make_folder
from ..datasets.layer_file import read_layers
from ..scene.engines import transparent_film
from ..scene.engines.denoising_guides import ALBEDO, NORMAL
from ..settings.render_plan import RenderPlan
from ..uw_spectral.errors import InputError
from ..uw_spectral.imaging.matte import without_open_water
from ..uw_spectral.spectra.spectral_image import read_exr, write_rgb_exr
from . import band_passes, development
from .band_passes import RenderedPass
from .development import Guides
from .manifest import Manifest, Output, View
from .picture_files import PictureFiles, files_of
from .tasks import Rendered, by_pass, done

Written = tuple[dict[str, Any], list[str]]
"""What a file adds to the record of a view, and what could not be done, a line each."""


@dataclass(frozen=True, eq=False)
class WholePass:
    """A pass, its parts averaged, and how far these lie apart: nothing for a single one."""

    file: RenderedPass
    parts: tuple[Rendered, ...]
    variance: NDArray[np.float64] | None = None  #: Of the mean, by band.


@dataclass(frozen=True, eq=False)
class ViewPasses:
    """All passes of a view, in order, and the plan of its frame."""

    manifest: Manifest
    view: View
    rendered: Sequence[Rendered]
    plan: RenderPlan

    @property
    def files(self) -> PictureFiles:
        """The files of the view."""
        return files_of(self.manifest, self.view)

    @property
    def output(self) -> Output:
        """What is rendered besides the water."""
        return self.manifest.output

    def require_own(self) -> None:
        """Refuse passes that another job has overwritten since they were rendered."""
        for item in self.rendered:
            if done(self.manifest, item.task, thorough=False) is None:
                raise InputError(
                    f"{item.file.path} is no longer the pass that was rendered: another job writes "
                    "into this folder, or it is damaged; give each job an --out of its own"
                )

    @cached_property
    def whole(self) -> list[WholePass]:
        """The passes, parts averaged into files of their own."""
        return [self._mean(parts) for parts in by_pass(self.manifest, self.rendered)]

    def _mean(self, parts: list[Rendered]) -> WholePass:
        if self.manifest.parts == 1:
            return WholePass(parts[0].file, tuple(parts))
        samples = [self.manifest.passes[item.task.number].samples for item in parts]
        images = np.stack([read_exr(item.file.path)[0].astype(np.float64) for item in parts])
        mean, variance = mean_of_parts(images, np.array(samples, dtype=np.float64))
        path, bands = self.manifest.mean_path(self.view, parts[0].task.number), parts[0].file.bands
        make_folder(path.parent)
        write_rgb_exr(path, mean)
        seconds = [item.file.seconds for item in parts if item.file.seconds is not None]
        file = RenderedPass(path, bands, sum(seconds) if seconds else None)
        return WholePass(file, tuple(parts), variance.mean(axis=(0, 1))[: len(bands)])

    @cached_property
    def guides(self) -> Guides | None:
        """What the denoiser is guided by; None unless every pass has its own."""
        found = []
        for item in self.rendered:
            path = band_passes.layers_path(item.file.path)
            key = self.manifest.key(self.view, item.task.number)
            if band_passes.look_at(path, key, self.output.size)[0] is not band_passes.State.DONE:
                return None
            layers = read_layers(path)
            if ALBEDO not in layers or NORMAL not in layers:
                return None
            samples = self.manifest.passes[item.task.number].samples
            found.append((layers, item.file.bands, samples))
        return development.mean_guides(found, self.manifest.weights(self.view))

    def developed(self, weights: NDArray[np.float64], *, denoise: bool) -> NDArray[np.float32]:
        """Return the bands through weights, shape (3, n) to (height, width, 3) of the region."""
        return development.develop(
            [item.file.path for item in self.whole],
            weights,
            [item.file.bands for item in self.whole],
            denoise=denoise,
            guides=self.guides if denoise else None,
            region=self.output.region,
        )

    @cached_property
    def linear(self) -> NDArray[np.float32]:
        """The picture in linear Rec.709, of the region, shape (height, width, 3)."""
        if self.manifest.method.draws_colours:
            return self.output.cut(np.sum([read_exr(x.file.path)[0] for x in self.whole], axis=0))
        return self.developed(self.manifest.weights(self.view), denoise=self.output.denoise)

    @property
    def picture(self) -> NDArray[np.float32]:
        """The picture as its file has it: where something is left out, with alpha."""
        output, linear = self.output, self.linear
        if output.transparent:
            first = next(item.file.path for item in self.rendered if item.task.number == 0)
            alpha = read_layers(band_passes.layers_path(first))[transparent_film.ALPHA]
            linear = without_open_water(linear, output.cut(alpha))
        elif output.region is not None and not output.crop:
            linear = np.pad(linear, ((0, 0), (0, 0), (0, 1)), constant_values=1.0)
        return output.framed(linear)


def mean_of_parts(
    images: NDArray[np.float64], samples: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the mean of renders of different noise, and its variance, by pixel.

    ``images`` have the shape (parts, h, w, k). A render counts by its ``samples``, shape (parts,),
    and its variance is taken to fall with them.
    """
    fraction = (samples / samples.sum()).reshape(-1, 1, 1, 1)
    mean = (images * fraction).sum(axis=0)
    apart = (fraction * (images - mean) ** 2).sum(axis=0)
    return mean, apart / (len(samples) - 1)
