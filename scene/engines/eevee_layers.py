"""Layers of a picture by EEVEE: what its shaders shall write, and how that is read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...datasets.layer_file import SENSOR, FrameLayers, LayerImage, bands_name, joined
from ...node_groups import realtime_layers
from ...settings.render_plan import RenderPlan
from ...uw_spectral.errors import InputError
from ...uw_spectral.imaging.layer_sums import drawn_for, remaining_single, scattered_again
from ...uw_spectral.imaging.layers import layer, parse_layers
from ...uw_spectral.spectra.spectral_image import band_labels
from ..readers import lamps, moving_surface, waterline
from ..rendered import rendered_layer
from ..temporary import render_settings
from . import geometry_layers
from .exr_output import Passes, render_passes, switched_on

_SHAFTS = "what the froxel volume drew: I less the other layers, with its errors of some percent"
_BY_SHADER = "drawn by the shader, to the 11 bits of EEVEE's passes"


@dataclass(frozen=True)
class EeveeLayers:
    """What is written beside the pictures of a job."""

    wanted: tuple[str, ...]  #: Layers that were asked for.
    plan: RenderPlan
    by_band: bool  #: The passes hold bands.
    shafts: bool  #: The volume draws what is scattered once.
    lamps: bool

    @property
    def subtracts(self) -> bool:
        """Whether a layer is what the others leave of the image."""
        return self.shafts and not {"B_single", "B_multiple"}.isdisjoint(drawn_for(self.wanted))

    @property
    def drawn(self) -> tuple[str, ...]:
        """Layers that the shaders write, of :mod:`.realtime_layers`."""
        needed = set(drawn_for(self.wanted))
        if not {"B_single", "B_multiple"}.isdisjoint(needed):
            needed |= {"B_water", "B_single"}
        if self.subtracts:
            needed |= {"D", "F", "B_lamps"}
        if not self.lamps:
            needed.discard("B_lamps")
        if self.by_band or self.shafts:
            needed.discard("I")
        if self.by_band and "albedo" in needed:
            needed.add("reflectance")
        known = (*realtime_layers.LIGHT, *realtime_layers.COLOURS, *realtime_layers.NUMBERS)
        return tuple(name for name in known if name in needed)

    def render(
        self,
        scene: bpy.types.Scene,
        camera: bpy.types.Object,
        path: Path,
        indices: Sequence[int],
        scale: ArrayLike,
        to_sensor: ArrayLike,
        *,
        is_first: bool,
    ) -> tuple[NDArray[np.float32], FrameLayers]:
        """Render a pass of bands, what all passes of a frame share with the first; files lie beside
        a path.

        The shaders' layers are to be multiplied by ``scale``, shape (3,); ``to_sensor``, shape (3,
        3), leads from the picture to what they are in. Returns the image as it was drawn, and
        layers.
        """
        switches = ()
        if is_first and "cryptomatte" in self.wanted:
            switches = geometry_layers.CRYPTOMATTE_SWITCHES
        outputs = realtime_layers.output_names(self.drawn)
        with switched_on(rendered_layer(scene), switches, outputs):
            passes = render_passes(scene, path)
        image = passes["Combined"][..., :3]
        seen = image @ np.asarray(to_sensor, np.float64).T
        found = [self._of_light(passes, seen, indices, np.asarray(scale))]
        if is_first:
            found.append(self._of_points(passes))
            if switches:
                found.append(geometry_layers.cryptomatte_layers(scene, passes))
            found.append(
                geometry_layers.geometry_layers(
                    scene, camera, self.plan, self.wanted, _one_sample(scene), path
                )
            )
        return image, joined(found)

    def _of_light(
        self,
        passes: Passes,
        image: NDArray[np.float64],
        indices: Sequence[int],
        scale: NDArray[np.float64],
    ) -> FrameLayers:
        count = len(indices) if self.by_band else 3
        channels = (
            tuple(band_labels(self.plan.bands)[i] for i in indices) if self.by_band else SENSOR
        )
        drawn = {
            held[0]: passes[output][..., :3] * scale
            for output, held in realtime_layers.output_names(self.drawn).items()
            if held[0] in realtime_layers.LIGHT
        }
        drawn.setdefault("I", image)
        if "reflectance" in drawn:
            drawn["albedo"] = drawn.pop("reflectance")
        notes = dict.fromkeys(drawn, _BY_SHADER)
        if "B_water" in drawn:
            water = drawn.pop("B_water")
            drawn["B_multiple"] = scattered_again(water, drawn["B_single"])
            notes["B_multiple"] = _BY_SHADER
        if self.subtracts:
            others = [drawn[n] for n in ("D", "B_multiple", "B_lamps", "F") if n in drawn]
            drawn["B_single"], notes["B_single"] = remaining_single(drawn["I"], others), _SHAFTS
        name_of = bands_name if self.by_band else str
        return FrameLayers(
            {
                name_of(name): LayerImage(
                    values[..., :count], channels, layer(name).units,
                    f"{layer(name).text}; {notes[name]}", whole=True,
                )
                for name, values in drawn.items()
            }
        )  # fmt: skip

    def _of_points(self, passes: Passes) -> FrameLayers:
        found = {}
        for output, held in realtime_layers.output_names(self.drawn).items():
            for place, name in enumerate(held):
                if name in realtime_layers.LIGHT:
                    continue
                is_colour = name in realtime_layers.COLOURS
                image = passes[output][..., :3] if is_colour else passes[output][..., [place]]
                channels = SENSOR if is_colour else layer(name).channels
                text = f"{layer(name).text}; {_BY_SHADER}"
                found[name] = LayerImage(image, channels, layer(name).units, text)
        return FrameLayers(found)


def layers_of(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    plan: RenderPlan,
    eyes: Sequence[tuple[float, ...]],
    *,
    by_band: bool,
) -> EeveeLayers | None:
    """Return what writes layers of a job, if any are wanted; InputError from above the water."""
    wanted = parse_layers(plan.settings.layers)
    if not wanted:
        return None
    if moving_surface.may_be_over(camera, plan.settings, eyes):
        raise InputError(waterline.NO_LAYERS)
    lit = bool(lamps.plan_lamps(scene, plan).lamps)
    return EeveeLayers(wanted, plan, by_band, plan.draws_shafts, lit)


def depth_map(scene: bpy.types.Scene, path: Path) -> NDArray[np.float64]:
    """Render planar depth, m, infinite in open water; beside a file one is written for it."""
    return geometry_layers.depth_map(scene, _one_sample(scene), path)


def _one_sample(scene: bpy.types.Scene) -> geometry_layers.OneSample:
    settings = [
        *geometry_layers.sharp(scene),
        (scene.eevee, "taa_render_samples", 1),
        (scene.render, "filter_size", 0.0),
    ]
    return render_settings(scene, settings)
