"""A scene, its water and its camera: drawn by both engines, compared, and put into a sheet."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..quality.seen_points import SeenPoints
from ..scene.engines import engines
from ..scene.readers import view_tracing
from ..scene.water import metering, water_body
from ..settings import render_plan
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images
from . import grey_scene
from ._drawing import drawing
from ._scenery import depth_of, new_file, sized
from .runner import pyplot

WIDTH, HEIGHT = 48, 27
BANDS = 3

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Place:
    """A scene and its water.

    ``build`` fills an empty file and returns the camera; ``water`` is a Jerlov type; ``sun`` the
    zenith angle in air, degrees; ``samples`` and ``drawn`` are those of Cycles, and of EEVEE;
    ``settings`` others that its water has; ``size`` is that of the pictures, pixels.
    """

    name: str
    build: Callable[[], bpy.types.Object]
    water: str = "IB"
    sun: float = 30.0
    samples: int = 256
    settings: Mapping[str, object] = field(default_factory=dict)
    size: tuple[int, int] = (WIDTH, HEIGHT)
    drawn: int = 16

    def plan(self, samples: int, **changes: object) -> render_plan.RenderPlan:
        """Resolve it; ``changes`` are other settings."""
        chosen = SceneSettings(
            water=f"jerlov:{self.water}", bands=BANDS, surface="flat", sky="clear",
            sun_zenith=self.sun, sun_azimuth=60.0, samples=samples,
        )  # fmt: skip
        return render_plan.make_plan(replace(chosen, **self.settings, **changes))

    def open(self) -> bpy.types.Object:
        """Build it in an empty file; return the camera."""
        new_file()
        camera = self.build()
        sized(self.size).camera = camera
        bpy.context.view_layer.update()
        return camera

    def by_cycles(self, camera: bpy.types.Object, seeds: Sequence[int] = (1, 2)) -> Array:
        """Band radiances of seeds, shape (seeds, h, w, n)."""
        return grey_scene.cycles_images(self.plan(self.samples), camera, self.samples, seeds)

    def by_eevee(self, camera: bpy.types.Object, **changes: object) -> Array:
        """Band radiances, shape (h, w, n)."""
        return self.timed(camera, **changes)[0]

    def timed(
        self, camera: bpy.types.Object, clock: Callable[[], float] | None = None, **changes: object
    ) -> tuple[Array, float]:
        """Band radiances, and what a clock says of a second picture, the shaders compiled."""
        plan, depth = self.plan(self.drawn, **changes), depth_of(camera)
        extent = water_body.water_extent(bpy.context.scene, plan.column, depth)
        with engines.eevee_bands(bpy.context.scene, camera, plan, extent, depth) as engine:
            image = grey_scene.band_image(engine, plan, depth)
            if clock is None:
                return image, 0.0
            start = clock()
            grey_scene.band_image(engine, plan, depth)
            return image, clock() - start

    def in_real_time(self) -> Array:
        """Linear RGB of EEVEE's real-time mode, shape (h, w, 3)."""
        return realtime(self.plan(self.drawn))

    def compared(
        self, camera: bpy.types.Object, block: int, kept: Callable[..., Array], *,
        forms: Mapping[str, Mapping[str, object]] | None = None, fast: bool = True,
        clock: Callable[[], float] | None = None,
    ) -> Compared:  # fmt: skip
        """Render by Cycles, unless that is kept, and by EEVEE.

        ``forms`` are other settings by name, by default none as *bands*; ``fast``: *real time*
        as well; ``clock`` as of :meth:`timed`.
        """
        develop = self.develop(camera)
        halves = kept(f"{self.name} {self.samples}", lambda: self.by_cycles(camera))
        drawn = {
            name: self.timed(camera, clock, **changes)
            for name, changes in (forms or {"bands": {}}).items()
        }
        found = {name: develop(image) for name, (image, _) in drawn.items()}
        if fast:
            found["real time"] = self.in_real_time()
        seconds = {name: taken for name, (_, taken) in drawn.items()}
        return Compared(develop(halves), found, block, seconds)

    def develop(self, camera: bpy.types.Object) -> Callable[[Array], Array]:
        """Return what makes linear RGB of band radiances; the exposure knows of lamps."""
        plan = self.plan(1)
        lit = metering.lamplight(bpy.context.scene, camera, plan)
        return plan.reduction(depth_of(camera), lit).apply

    def distance(self, camera: bpy.types.Object) -> Array:
        """Distance of what pixels show, m, shape (h, w); infinite of open water."""
        return self._seen(camera).distance.reshape(self.size[::-1])

    def occluded(self, camera: bpy.types.Object) -> NDArray[np.bool_]:
        """Which pixels show an object that the sun does not reach, shape (h, w)."""
        seen = self._seen(camera)
        return (np.isfinite(seen.distance) & ~seen.sunlit).reshape(self.size[::-1])

    def _seen(self, camera: bpy.types.Object) -> SeenPoints:
        plan = self.plan(1)
        return view_tracing.trace_view(
            bpy.context.scene, camera, plan.column, plan.viewpoint(0.0).field,
            rays=self.size[0] * self.size[1],
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Compared:
    """Linear RGB of a place: two pictures of Cycles, EEVEE's by name, and its seconds."""

    halves: Array
    pictures: Mapping[str, Array]
    block: int
    seconds: Mapping[str, float] = field(default_factory=dict)

    @property
    def reference(self) -> Array:
        """Mean of Cycles' pictures."""
        return self.halves.mean(axis=0)

    def delta_e(self, name: str) -> Array:
        """ΔE2000 of blocks of pixels of a picture; the noise of the reference is in it."""
        return delta_e(self.pictures[name], self.reference, self.block)

    @property
    def noise(self) -> Array:
        """What ΔE2000 the reference's own noise makes, by block."""
        return delta_e(*self.halves, self.block) / 2.0


def delta_e(one: Array, other: Array, block: int) -> Array:
    """ΔE2000 of blocks of pixels of linear RGB, as a display shows it."""
    blocks = (grey_scene.blocks(np.clip(x, 0.0, 1.0), block) for x in (one, other))
    return delta_e_CIE2000_images(*blocks)


def realtime(plan: render_plan.RenderPlan) -> Array:
    """Draw the open scene in real time, linear RGB, shape (h, w, 3)."""
    with drawing(plan.settings) as drawn:
        return drawn.image(plan.settings.samples)


def sheet(
    path: Path, rows: Mapping[str, Sequence[Array]], titles: Sequence[str], *, size: float = 1.6,
    across: int = 1,
) -> None:  # fmt: skip
    """Draw rows of pictures of 0 to 1, beneath titles, so many rows beside one another."""
    plt = pyplot()
    down, columns = -(-len(rows) // across), len(titles)
    height, width = next(iter(rows.values()))[0].shape[:2]
    figure, axes = plt.subplots(
        down, across * columns, squeeze=False,
        figsize=(size * columns * across, (size * height / width + 0.15) * down),
    )  # fmt: skip
    for axis in axes.flat:
        axis.set(xticks=[], yticks=[], frame_on=False)
    for number, (label, images) in enumerate(rows.items()):
        row, part = divmod(number, across)
        shown = axes[row, part * columns : (part + 1) * columns]
        shown[0].set_ylabel(label.replace(", ", ",\n"), fontsize=6)
        for axis, image, title in zip(shown, images, titles, strict=True):
            axis.imshow(np.clip(image, 0.0, 1.0), interpolation="nearest")
            if row == 0:
                axis.set_title(title, fontsize=7)
    figure.tight_layout(pad=0.3)
    figure.savefig(path, dpi=80, pil_kwargs={"quality": 80} if path.suffix == ".jpg" else None)
    plt.close(figure)
