"""Develops the layers of a picture: one file of all of them, and the truth of its colours."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..datasets.layer_file import (
    SENSOR,
    FrameLayers,
    LayerImage,
    bands_name,
    camera_of,
    is_of_bands,
    read_layers,
    side_by_side,
    write_layers,
)
from ..datasets.truth import extinction_to, image_truth, transmittance, write_truth
from ..datasets.view import DataSetView
from ..scene.engines.cycles_layers import UNTOUCHED_BANDS as UNTOUCHED
from ..scene.water.cycles_phase import cycles_phases
from ..settings.render_plan import RenderPlan
from ..uw_spectral.errors import InputError
from ..uw_spectral.imaging.layer_sums import backscatter, transmittance_ratio, unscattered
from ..uw_spectral.imaging.layers import BACKSCATTER, LAYERS, layer, parse_layers
from ..uw_spectral.spectra.spectral_image import band_labels
from .band_passes import layers_path
from .render_region import Region
from .view_passes import ViewPasses, Written

_FROM_BANDS = "sum over bands by the responses of the sensor"
_SENSOR = "response of {sensor} to {units}, before white balance and exposure"


OF_ONE_WATER = ("J", "D", "F", "T")
"""Layers that :func:`_unscattered` makes."""


def missing_layers(plan: RenderPlan, wanted: Sequence[str], *, traced: bool) -> tuple[str, ...]:
    """Return those of some layers that there are none of: what Cycles takes apart by one c."""
    if not (traced and plan.column.below):
        return ()
    return tuple(name for name in wanted if name in OF_ONE_WATER)


def write_picture_layers(passes: ViewPasses) -> Written:
    """Write the layers of a view, if any are wanted, and the truth of its colours.

    Raises InputError if layers of a pass are missing or damaged, or a file cannot be written.
    """
    manifest, view, plan, output = passes.manifest, passes.view, passes.plan, passes.output
    wanted = parse_layers(manifest.settings_of(view.frame).layers)
    if not wanted:
        return {}, []
    parts = [[read_layers(layers_path(x.file.path)) for x in item.parts] for item in passes.whole]
    found = side_by_side(list(map(_mean, parts)))
    camera = found.header["camera"]
    if output.region is not None:
        found = _cut(found, output.region)
        camera = found.header["camera"] if output.crop else camera
    together = dict(found.layers)
    seen = _seen(passes, found.header)
    way = _way(together["range"], found.header)
    if UNTOUCHED in together:
        together |= _unscattered(plan, seen, together, way)
    elif "T" in wanted and not manifest.method.draws_colours:
        together[bands_name("T")] = _transmittance(plan, seen, way)
    together |= _of_sensor(together, plan, plan.response(view.depth))
    together |= _derived(together)
    header = {
        "frame": view.frame,
        "engine": output.engine,
        "mode": output.mode,
        "bands_nm": list(manifest.bands_nm),
        "sensor": plan.sensor.name,
        **found.header,
        "camera": camera,
    }
    chosen = {
        name: replace(image, values=output.framed(image.values))
        for name, image in _chosen(together, wanted).items()
    }
    write_layers(passes.files.layers, FrameLayers(chosen, header, found.attributes))
    missing, notes = missing_layers(plan, wanted, traced=manifest.method.traced), []
    if missing:
        notes = [
            f"layers {', '.join(missing)} were not written: Cycles gives them in water that is the "
            "same at every depth only"
        ]
    return {}, notes + _write_truth(passes, _seen(passes, header), found.header["lamps"])


def _cut(found: FrameLayers, region: Region) -> FrameLayers:
    """Return the layers of a region, and its camera."""
    layers = {
        name: replace(image, values=region.cut(image.values))
        for name, image in found.layers.items()
    }
    camera, K = found.header["camera"], np.array(found.header["camera"]["K"])
    K[0, 2] -= region.left
    K[1, 2] -= region.top
    size = {"width": region.right - region.left, "height": region.bottom - region.top}
    header = {**found.header, "camera": {**camera, **size, "K": K.tolist()}}
    return replace(found, layers=layers, header=header)


def _mean(parts: Sequence[FrameLayers]) -> FrameLayers:
    """Average renders of the same pass."""
    if len(parts) == 1:
        return parts[0]
    layers = {
        name: replace(image, values=np.mean([p.layers[name].values for p in parts], axis=0))
        for name, image in parts[0].layers.items()
        if is_of_bands(name)
    }
    return replace(parts[0], layers={**parts[0].layers, **layers})


def _of_sensor(
    found: dict[str, LayerImage], plan: RenderPlan, response: NDArray[np.float64]
) -> dict[str, LayerImage]:
    """Name the units, and reduce bands to the channels of the sensor."""
    made = {}
    units_of = {"radiance": plan.radiance_units, "irradiance": plan.irradiance_units}
    for about in LAYERS:
        if about.kind not in units_of:
            continue
        name, units = about.name, units_of[about.kind]
        bands, image = found.get(bands_name(name)), found.get(name)
        if bands is not None:
            made[bands_name(name)] = replace(bands, units=units)
            sensor = bands.values.astype(np.float64) @ response.T
            image = LayerImage(sensor, SENSOR, "", f"{bands.text}; {_FROM_BANDS}")
        if image is not None:
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
        fraction = transmittance_ratio(found["D"].values, found["J"].values)
        made["T"] = LayerImage(fraction, SENSOR, layer("T").units, f"{layer('T').text}: D / J")
    return made


def _chosen(found: dict[str, LayerImage], wanted: Sequence[str]) -> dict[str, LayerImage]:
    chosen = {}
    for name in wanted:
        names = [n for n in found if n.startswith("Crypto")] if name == "cryptomatte" else [name]
        for key in (*names, bands_name(name)):
            if key in found:
                chosen[key] = replace(found[key], whole=layer(name).whole)
    return chosen


def _way(distances: LayerImage, header: Mapping[str, Any]) -> NDArray[Any]:
    """Return the ways in the water, m, which begins at the port if there is one."""
    before = header.get("housing", {}).get("water_begins_m", 0.0)
    return np.maximum(distances.values[..., 0] - before, 0.0)


def _transmittance(plan: RenderPlan, seen: DataSetView, way: NDArray[Any]) -> LayerImage:
    about = layer("T")
    fraction = transmittance(plan, seen.camera, seen.camera_to_world, way)
    text = f"{about.text}; at the centre of the pixel"
    return LayerImage(fraction, tuple(band_labels(plan.bands)), about.units, text)


def _unscattered(
    plan: RenderPlan, seen: DataSetView, found: Mapping[str, LayerImage], distances: NDArray[Any]
) -> dict[str, LayerImage]:
    """Take apart what Cycles drew without the forward peak; of one layer of water only."""
    if plan.column.below:
        return {}
    drawn = found[UNTOUCHED]
    c, way = extinction_to(plan, seen.camera, seen.camera_to_world, distances)
    fractions = np.sum(cycles_phases(plan)[0].fractions, axis=0)
    parts = unscattered(drawn.values, c, c - plan.column.scattering * (1.0 - fractions), way)
    notes = (
        "unscattered light over exp(-c' z), c' as Cycles draws it: exact but for noise and for "
        "edges, where a pixel has several ranges",
        "J T",
        "of the bounded forward peak, as if objects filled their surroundings; the rest is in "
        "B_multiple",
        "at the centre of the pixel",
    )
    return {
        bands_name(name): replace(drawn, values=values, units=layer(name).units,
                                  text=f"{layer(name).text}; {note}")
        for name, values, note in zip(("J", "D", "F", "T"), parts, notes, strict=True)
    }  # fmt: skip


def _seen(passes: ViewPasses, header: Mapping[str, Any]) -> DataSetView:
    """Return the picture and its camera."""
    picture = passes.files.picture
    pinhole, pose = camera_of(header)
    name = picture.relative_to(passes.manifest.out).with_suffix("").as_posix()
    return DataSetView(name, picture, pinhole, pose)


def _write_truth(
    passes: ViewPasses, seen: DataSetView, lamps: Sequence[Mapping[str, Any]]
) -> list[str]:
    plan, view = passes.plan, passes.view
    weights = passes.manifest.weights(view)
    stops = plan.viewpoint(view.depth, 0.0).reduction.stops_to(weights)
    try:
        truth = image_truth(plan, seen, lamps, stops=stops)
    except InputError as error:
        return [f"the truth of the picture was not written: {error}"]
    write_truth(passes.files.truth, truth)
    return []
