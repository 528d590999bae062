"""Layers of a picture by Cycles: what its passes tell apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ...datasets.layer_file import FrameLayers, LayerImage, bands_name, joined
from ...settings.render_plan import RenderPlan
from ...uw_spectral.errors import InputError
from ...uw_spectral.imaging.layer_sums import drawn_for
from ...uw_spectral.imaging.layers import layer, parse_layers
from ...uw_spectral.spectra.spectral_image import band_labels
from ..readers import waterline
from ..rendered import rendered_layer
from . import denoising_guides, geometry_layers
from .exr_output import Passes, render_passes, switched_on

UNTOUCHED = "untouched"
"""Light that no water has scattered on its way from objects to the camera."""
UNTOUCHED_BANDS = bands_name(UNTOUCHED)
_LIGHT = {"B_single": "Volume Direct", "B_multiple": "Volume Indirect"}
_SWITCHES = {
    "B_single": "cycles.use_pass_volume_direct",
    "B_multiple": "cycles.use_pass_volume_indirect",
}
_DRY_SAMPLES = 16
_NOTES = {
    "I": "exact but for noise",
    "B_single": "of sun, sky and lamps, what the bounded forward peak turns not counted: exact but "
    "for noise",
    "B_multiple": "exact but for noise; what is scattered forward from objects is in it",
    "albedo": "diffuse reflectance, without water",
}


def wanted_of(plan: RenderPlan, *, above: bool) -> tuple[str, ...]:
    """Return the layers that are wanted; InputError if they are, from above the water."""
    wanted = parse_layers(plan.settings.layers)
    if above and wanted:
        raise InputError(waterline.NO_LAYERS)
    return wanted


@dataclass(frozen=True)
class CyclesLayers:
    """What is written beside the passes of a job: layers asked for, and guides for a denoiser."""

    wanted: tuple[str, ...]
    plan: RenderPlan
    guides: bool = False

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
        more: NDArray[np.float32] | float = 0.0,
        *,
        is_first: bool,
    ) -> tuple[NDArray[np.float32], FrameLayers]:
        """Render a pass of bands, what all passes of a frame share with the first; files lie beside
        a path. ``more`` is light that was rendered already.

        Returns the image, shape (height, width, 3), and layers.
        """
        switches = [_SWITCHES[name] for name in self.drawn]
        switches += denoising_guides.SWITCHES if self.guides else ()
        with switched_on(rendered_layer(scene), switches):
            passes = render_passes(scene, path)
        image = passes["Combined"][..., :3]
        labels = band_labels(self.plan.bands)
        channels = tuple(labels[i] for i in indices)
        found = [denoising_guides.guides_of(passes, channels)] if self.guides else []
        if not self.wanted:
            return image + more, joined(found)
        light = {"I": image + more} | {name: passes[_LIGHT[name]] for name in self.drawn}
        if {"B_single", "B_multiple"} <= set(self.drawn):
            light[UNTOUCHED] = image - light["B_single"] - light["B_multiple"]
        ranks = is_first and "cryptomatte" in self.wanted
        dry = self._dry(scene, path, ranks=ranks)
        if "albedo" in self.wanted:
            light["albedo"] = dry["Diffuse Color"]
        found.append(
            FrameLayers(
                {
                    bands_name(name): LayerImage(
                        values[..., : len(indices)], channels, _units(name), _text(name), True
                    )
                    for name, values in light.items()
                }
            )
        )
        if ranks:
            found.append(geometry_layers.cryptomatte_layers(scene, dry))
        if is_first:
            found.append(
                geometry_layers.geometry_layers(
                    scene, camera, self.plan, self.wanted, _one_sample(scene), path
                )
            )
        return image + more, joined(found)

    def _dry(self, scene: bpy.types.Scene, path: Path, *, ranks: bool) -> Passes:
        """Render objects without water, which would keep rays from them, if that is needed."""
        switches = ["use_pass_diffuse_color"] if "albedo" in self.wanted else []
        if ranks:
            switches += geometry_layers.CRYPTOMATTE_SWITCHES
        if not switches:
            return {}
        layer = rendered_layer(scene)
        samples = [(scene.cycles, "samples", _DRY_SAMPLES)]
        with geometry_layers.without_water(scene, samples), switched_on(layer, switches):
            return render_passes(scene, path)


def _units(name: str) -> str:
    return "" if name == UNTOUCHED else layer(name).units


def _text(name: str) -> str:
    return UNTOUCHED if name == UNTOUCHED else f"{layer(name).text}; {_NOTES[name]}"


def depth_map(scene: bpy.types.Scene, path: Path) -> NDArray[np.float64]:
    """Render planar depth, m, infinite in open water; beside a file one is written for it."""
    return geometry_layers.depth_map(scene, _one_sample(scene), path)


def _one_sample(scene: bpy.types.Scene) -> geometry_layers.OneSample:
    settings = [("samples", 1), ("pixel_filter_type", "BOX"), ("filter_width", 0.01)]
    wanted = [(scene.cycles, name, value) for name, value in settings]
    return geometry_layers.without_water(scene, [*geometry_layers.sharp(scene), *wanted])
