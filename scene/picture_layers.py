"""Develops the layers of a picture: one file of all of them, and the truth of its colours."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..datasets.camera import PinholeCamera
from ..datasets.layer_file import (
    SENSOR,
    FrameLayers,
    LayerImage,
    bands_name,
    read_layers,
    write_layers,
)
from ..datasets.truth import image_truth, write_truth
from ..datasets.view import View as TruthView
from ..uw_spectral.errors import InputError
from ..uw_spectral.imaging.layer_sums import backscatter, share_left
from ..uw_spectral.imaging.layers import BACKSCATTER, layer, of_light, parse_layers
from . import band_passes
from .manifest import Manifest, View
from .render_plan import RenderPlan

_FROM_BANDS = "sum over bands by the responses of the sensor"
_SENSOR = "response of {sensor} to {units}, before white balance and exposure"


def layers_path(picture: Path) -> Path:
    """Return the file of the layers of a picture."""
    return picture.with_name(f"{picture.stem}_layers.exr")


def truth_path(picture: Path) -> Path:
    """Return the file of the truth of a picture."""
    return picture.with_name(f"{picture.stem}_truth.json")


def develop_layers(
    manifest: Manifest, view: View, passes: Sequence[Path], plan: RenderPlan, picture: Path
) -> list[str]:
    """Write the layers of a view, if any are wanted, and the truth of its colours.

    Parameters
    ----------
    manifest : Manifest
    view : View
    passes : sequence of Path
        Of the view, in order; their layers lie beside them.
    plan : RenderPlan
        Of the frame.
    picture : Path

    Returns
    -------
    list of str
        What could not be done, one line each.

    Raises
    ------
    InputError
        If layers of a pass are missing or damaged, or a file cannot be written.
    """
    wanted = parse_layers(manifest.settings_of(view.frame).layers)
    if not wanted:
        return []
    parts = [read_layers(band_passes.layers_path(path)) for path in passes]
    first = parts[:: manifest.parts]
    together = _together(parts, manifest.parts)
    together |= _of_sensor(together, plan, plan.response(view.depth))
    together |= _derived(together)
    header = {
        "frame": view.frame,
        "engine": manifest.output.engine,
        "mode": manifest.output.mode,
        "bands_nm": list(manifest.bands_nm),
        "sensor": plan.sensor.name,
        **first[0].header,
    }
    chosen = _chosen(together, wanted)
    write_layers(layers_path(picture), FrameLayers(chosen, header, first[0].attributes))
    return _write_truth(manifest, view, plan, picture, first[0].header)


def _together(parts: Sequence[FrameLayers], repeats: int) -> dict[str, LayerImage]:
    """Join the layers of passes: bands side by side, channels summed, renders averaged."""
    joined: dict[str, LayerImage] = {}
    for first in range(0, len(parts), repeats):
        same = parts[first : first + repeats]
        for name, image in same[0].layers.items():
            there = [part.layers[name].values for part in same]
            mean = np.mean(there, axis=0) if len(there) > 1 else there[0]
            channels, before = image.channels, joined.get(name)
            if before is not None and channels == before.channels:
                mean = mean + before.values
            elif before is not None:
                mean = np.concatenate([before.values, mean], axis=-1)
                channels = (*before.channels, *channels)
            joined[name] = LayerImage(mean, channels, image.units, image.text)
    return joined


def _of_sensor(
    found: dict[str, LayerImage], plan: RenderPlan, response: NDArray[np.float64]
) -> dict[str, LayerImage]:
    """Name the units, and reduce bands to the channels of the sensor."""
    made = {}
    for name in of_light(parse_layers("all")):
        about, bands = layer(name), found.get(bands_name(name))
        units = plan.radiance_units if about.kind == "radiance" else plan.irradiance_units
        if bands is not None and about.kind != "share":
            text = bands.text
            made[bands_name(name)] = LayerImage(bands.values, bands.channels, units, text)
            sensor = bands.values.astype(np.float64) @ response.T
            made[name] = LayerImage(sensor, SENSOR, "", f"{text}; {_FROM_BANDS}")
        if about.kind != "share" and (name in made or name in found):
            image = made.get(name) or found[name]
            units = _SENSOR.format(sensor=plan.sensor.name, units=units)
            made[name] = LayerImage(image.values, SENSOR, units, image.text)
    return made


def _derived(found: dict[str, LayerImage]) -> dict[str, LayerImage]:
    """Make the layers that others add up to."""
    made = {}
    for name_of in (str, bands_name):
        parts = {n: found[name_of(n)] for n in BACKSCATTER if name_of(n) in found}
        if parts:
            one = next(iter(parts.values()))
            total = backscatter({name: image.values for name, image in parts.items()})
            text = f"{layer('B').text}: {' + '.join(parts)}"
            made[name_of("B")] = LayerImage(total, one.channels, one.units, text)
    if "D" in found and "J" in found:
        share = share_left(found["D"].values, found["J"].values)
        made["T"] = LayerImage(share, SENSOR, layer("T").units, f"{layer('T').text}: D / J")
    return made


def _chosen(found: dict[str, LayerImage], wanted: Sequence[str]) -> dict[str, LayerImage]:
    chosen = {}
    for name in wanted:
        about = layer(name)
        names = [n for n in found if n.startswith("Crypto")] if name == "cryptomatte" else [name]
        for key in (*names, bands_name(name)):
            if key in found:
                image = found[key]
                chosen[key] = LayerImage(
                    image.values, image.channels, image.units, image.text, about.whole
                )
    return chosen


def _write_truth(
    manifest: Manifest,
    view: View,
    plan: RenderPlan,
    picture: Path,
    header: Any,  # noqa: ANN401
) -> list[str]:
    camera = header["camera"]
    K = np.array(camera["K"])
    pinhole = PinholeCamera(
        camera["width"], camera["height"], K[0, 0], K[1, 1], K[0, 2], K[1, 2],
        tuple(camera["distortion"]),
    )  # fmt: skip
    name = picture.relative_to(manifest.out).with_suffix("").as_posix()
    seen = TruthView(name, picture, pinhole, np.array(camera["camera_to_world"]))
    weights = np.array(manifest.developments[view.development].weights)
    stops = plan.viewpoint(view.depth, 0.0).reduction.stops_to(weights)
    try:
        truth = image_truth(plan, seen, header["lamps"], stops=stops)
    except InputError as error:
        return [f"the truth of the picture was not written: {error}"]
    write_truth(truth_path(picture), truth)
    return []
