"""Layers of a picture by Cycles: what its passes tell apart."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..datasets.layer_file import FrameLayers, LayerImage, bands_name, joined
from ..uw_spectral.imaging.layer_sums import drawn_for
from ..uw_spectral.imaging.layers import layer
from ..uw_spectral.spectra.spectral_image import band_labels
from . import geometry_layers, scene_water
from .layer_passes import render_passes, rendered_layer, switched_on
from .render_plan import RenderPlan
from .temporary import render_settings

UNTOUCHED = "untouched"
"""Light that no water has scattered on its way from things to the camera."""
UNTOUCHED_BANDS = bands_name(UNTOUCHED)
_LIGHT = {"B_single": "Volume Direct", "B_multiple": "Volume Indirect", "albedo": "Diffuse Color"}
_SWITCHES = {
    "B_single": "cycles.use_pass_volume_direct",
    "B_multiple": "cycles.use_pass_volume_indirect",
    "albedo": "use_pass_diffuse_color",
}
_NOTES = {
    "I": "exact but for noise",
    "B_single": "direct light in the water, of sun, sky and lamps: exact but for noise",
    "B_multiple": "exact but for noise; what is scattered forward from things is in it",
    "albedo": "diffuse reflectance",
}


@dataclass(frozen=True)
class CyclesLayers:
    """What is written beside the passes of a job.

    Parameters
    ----------
    wanted : tuple of str
        Layers that were asked for.
    plan : RenderPlan
    """

    wanted: tuple[str, ...]
    plan: RenderPlan

    @property
    def drawn(self) -> tuple[str, ...]:
        """Layers that passes are rendered for."""
        needed = set(drawn_for(self.wanted))
        if not needed.isdisjoint(("J", "D", "F", "T")):
            needed |= {"B_single", "B_multiple"}
        return tuple(name for name in _LIGHT if name in needed)

    def render(
        self,
        scene: bpy.types.Scene,
        camera: bpy.types.Object,
        path: Path,
        indices: Sequence[int],
        *,
        is_first: bool,
    ) -> tuple[NDArray[np.float32], FrameLayers]:
        """Render a pass.

        Parameters
        ----------
        scene, camera
        path : Path
            Beside it files are written for the moment.
        indices : sequence of int
            Bands of the pass.
        is_first : bool
            Whether what is the same for all passes of a frame is rendered with this one.

        Returns
        -------
        image, shape (height, width, 3); layers
        """
        switches = [_SWITCHES[name] for name in self.drawn]
        ranks = is_first and "cryptomatte" in self.wanted
        if ranks:
            switches += geometry_layers.CRYPTOMATTE_SWITCHES
        with switched_on(rendered_layer(scene), switches):
            passes = render_passes(scene, path)
        image = passes["Combined"][..., :3]
        light = {"I": image} | {name: passes[_LIGHT[name]] for name in self.drawn}
        if {"B_single", "B_multiple"} <= set(self.drawn):
            light[UNTOUCHED] = image - light["B_single"] - light["B_multiple"]
        labels = band_labels(self.plan.bands)
        channels = tuple(labels[i] for i in indices)
        found = [
            FrameLayers(
                {
                    bands_name(name): LayerImage(
                        values[..., : len(indices)], channels, text=_text(name), whole=True
                    )
                    for name, values in light.items()
                }
            )
        ]
        if is_first and ranks:
            found.append(geometry_layers.cryptomatte_layers(scene, passes))
        if is_first:
            found.append(
                geometry_layers.geometry_layers(
                    scene, camera, self.plan, self.wanted, lambda: _one_sample(scene), path
                )
            )
        return image, joined(found)


def _text(name: str) -> str:
    return UNTOUCHED if name == UNTOUCHED else f"{layer(name).text}; {_NOTES[name]}"


@contextlib.contextmanager
def _one_sample(scene: bpy.types.Scene) -> Iterator[object]:
    """Render one sample a pixel, of things alone: a ray that the water scatters finds none."""
    bodies = [item for item in scene_water.bodies(scene) if not item.hide_render]
    settings = [
        (scene.cycles, "samples", 1),
        (scene.cycles, "pixel_filter_type", "BOX"),
        (scene.cycles, "filter_width", 0.01),
        *((item, "hide_render", True) for item in bodies),
    ]
    with render_settings(scene, settings) as found:
        yield found
