"""The figures and tables of the papers that this implements, made again."""

from __future__ import annotations

import functools
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
from PIL import Image

from ..examples.scenes import build_scene
from ..settings.render_plan import RenderPlan, make_plan
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.spectra.colour_rendering import srgb_encode
from ..uw_spectral.spectra.sensor import list_sensors, parse_sensor
from ..uw_spectral.water.bio_optics import Constituents
from ..uw_spectral.water.inelastic_processes import RAMAN_LINES, largest_cdom_yield
from ..uw_spectral.water.named import parse_uniform_water
from ..validation.colour_errors import srgb_rmse
from ..validation.monzon import TABLE2, path_radiance_Monzon2024
from . import baselines, grey_scene
from ._drawing import drawing
from ._places import Array, Place, delta_e, sheet
from ._scenery import depth_of, new_file
from .realtime_accuracy import HEIGHT, OVERSAMPLING, WIDTH
from .runner import Ask, Page, Target, pyplot, table

_SIZE, _FLOOR, _DETAIL, _SAMPLES = (96, 54), 7.0, "draft", 8
_DEPTHS = (4.0, 10.0, 20.0)  # of the reef's floor, m
_TYPES = ("I", "IA", "IB", "II", "III", "1C", "3C", "5C", "7C", "9C")
_STOPS = "1.5"  # of all pictures of the types, so that the dark ones are dark
_SENSORS = ("Canon PowerShot S90", "ARRI D21")
_SWAPPED = ("I", "IB", "II", "1C", "3C", "5C")
_TRACED = (("IB", "Canon EOS 600D"), ("II", "Canon Digital Rebel XTi"))
_BANDS, _COUNTS, _BLOCK = 8, (3, 8, 32), 9


def _reef(water: str, floor: float, bands: int = _BANDS) -> Place:
    """The example reef, its sand at a depth."""

    def build() -> bpy.types.Object:
        build_scene("reef", detail=_DETAIL)
        for item in bpy.context.scene.objects:
            if item.parent is None:
                item.location.z -= floor - _FLOOR
        return bpy.context.scene.camera

    settings = {"bands": bands, "floor_depth": floor, "floor_reflectance": "0.3"}
    return Place(f"reef {water} {floor:g}", build, water, 30.0, 128, settings, _SIZE, _SAMPLES)


def _coefficients(path: Path) -> None:
    """Draw a, b, c and Kd of the ten types."""
    plt = pyplot()
    figure, axes = plt.subplots(2, 5, figsize=(7.5, 3.2), sharex=True, sharey="row")
    for axis, name in zip(axes.flat, _TYPES, strict=True):
        water = parse_uniform_water(f"jerlov:{name}")
        nm = water.absorption.wavelengths
        for label, values in (
            ("a", water.a(nm)), ("b", water.b(nm)), ("c", water.a(nm) + water.b(nm)),
            ("Kd", water.Kd(nm)),
        ):  # fmt: skip
            axis.plot(nm, values, label=label, lw=1.0, ls="--" if label == "Kd" else "-")
        axis.set_title(name, fontsize=7)
        axis.tick_params(labelsize=6)
    axes[0, 0].legend(fontsize=6)
    axes[1, 2].set_xlabel("nm; 1/m", fontsize=6)
    figure.tight_layout(pad=0.4)
    figure.savefig(path, dpi=80, metadata={"Software": None})
    plt.close(figure)


def _types(floor: float) -> Array:
    """The reef in all types in real time, at one exposure, sRGB (types, h, w, 3)."""
    _reef("I", floor).open()

    def settings(water: str) -> SceneSettings:
        return replace(_reef(water, floor).plan(_SAMPLES).settings, exposure=_STOPS)

    found = []
    with drawing(settings("I")) as drawn:
        for water in _TYPES:
            drawn.change(settings(water))
            found.append(srgb_encode(np.clip(drawn.image(_SAMPLES), 0.0, 1.0)))
    return np.stack(found)


def _sensed(plan: RenderPlan, depth: float, sensor: str, image: Array) -> Array:
    """Channels of a sensor as they are, exposed as RGB is."""
    return baselines.sensed(plan, depth, image, parse_sensor(sensor).response_in(plan.bands))


def _swapped(ask: Ask) -> dict[str, dict[str, Array]]:
    """The reef by sensor and water, sRGB."""
    found: dict[str, dict[str, Array]] = {sensor: {} for sensor in _SENSORS}
    for water in (*_SWAPPED, "IA"):
        place = _reef(water, 10.0)
        camera = place.open()
        image = ask.kept(f"{place.name} bands", lambda p=place, c=camera: p.by_eevee(c))
        for sensor, pictures in found.items():
            seen = _sensed(place.plan(1), depth_of(camera), sensor, image)
            pictures[water] = srgb_encode(np.clip(seen, 0.0, 1.0))
    return found


def _film(path: Path, pictures: Sequence[Array]) -> None:
    """Write a film that turns from each picture to the next, a GIF."""
    frames = [
        (1.0 - part) * one + part * other
        for one, other in zip(pictures, [*pictures[1:], pictures[0]], strict=True)
        for part in (0.0, 0.0, 0.0, 0.5)
    ]
    first, *others = (Image.fromarray(np.round(255 * x).astype(np.uint8)) for x in frames)
    first.save(path, save_all=True, append_images=others, duration=250, loop=0)


def _three(sensor: str) -> list[float]:
    """Wavelengths at which the channels of a sensor see most, red first."""
    spectrum = parse_sensor(sensor).sensitivity
    return [float(spectrum.wavelengths[k]) for k in spectrum.values.argmax(axis=0)]


def _peaks(sensors: Sequence[str]) -> list[float]:
    return sorted({nm for sensor in sensors for nm in _three(sensor)})


def _by_three(plan: RenderPlan, depth: float, sensor: str, image: Array) -> Array:
    """A sensor's picture by one wavelength a channel, of an image at many."""
    chosen = np.subtract.outer(_three(sensor), plan.bands.centres)
    return baselines.sensed(plan, depth, image, (abs(chosen) < 0.01).astype(float))


def _traced(ask: Ask) -> dict[str, list[Array]]:
    """The reef by Cycles, by EEVEE and by three wavelengths, by water and sensor."""
    found = {}
    for water, sensor in _TRACED:
        place = _reef(water, 10.0)
        camera = place.open()
        depth, plan = depth_of(camera), place.plan(1)
        words = ",".join(map(str, _peaks([sensor])))
        few = place.plan(1, wavelengths=words)
        traced = ask.kept(f"{place.name} cycles", functools.partial(place.by_cycles, camera))
        by_eevee = functools.partial(place.by_eevee, camera)
        bands = ask.kept(f"{place.name} bands", by_eevee)
        three = ask.kept(f"{place.name} three", functools.partial(by_eevee, wavelengths=words))
        found[f"{water}, {sensor}"] = [
            _sensed(plan, depth, sensor, traced.mean(axis=0)),
            _sensed(plan, depth, sensor, bands),
            _by_three(few, depth, sensor, three),
        ]
    return found


def _errors(ask: Ask, sensors: Sequence[str]) -> Iterator[tuple[tuple[str, float], Array]]:
    """RMSE and ΔE2000 of the grey scene by combination, (methods, 2, sensors).

    Methods are EEVEE's bands, three wavelengths, the formula as printed, and half of what two
    pictures of Cycles differ.
    """
    words = ",".join(map(str, _peaks(sensors)))
    for water, depth in grey_scene.COMBINATIONS[: ask.cases]:
        new_file()
        camera = grey_scene.build_scene(depth, WIDTH, HEIGHT)
        plan = grey_scene.plan_for(water, depth, _BANDS)
        many = make_plan(replace(plan.settings, wavelengths=words))
        name = f"grey {water} {depth:g}"
        traced = functools.partial(grey_scene.cycles_images, plan, camera, ask.samples)
        halves = ask.kept(f"{name} cycles", traced)
        ours, three = (
            ask.kept(f"{name} {len(p.bands.centres)}",
                     functools.partial(grey_scene.eevee_image, p, camera))
            for p in (plan, many)
        )  # fmt: skip
        hits = grey_scene.trace(plan.column.sun_direction, WIDTH, HEIGHT, OVERSAMPLING)
        printed = grey_scene.blocks(
            baselines.paper_image(plan, hits, depth, path_radiance_Monzon2024), OVERSAMPLING
        )
        errors = np.empty((4, 2, len(sensors)))
        for k, sensor in enumerate(sensors):
            one, other = (_sensed(plan, depth, sensor, x) for x in halves)
            mean = (one + other) / 2.0
            pairs = (
                (_sensed(plan, depth, sensor, ours), mean, 1.0),
                (_by_three(many, depth, sensor, three), mean, 1.0),
                (_sensed(plan, depth, sensor, printed), mean, 1.0),
                (one, other, 0.5),
            )
            for method, (a, b, part) in enumerate(pairs):
                squares = [grey_scene.blocks(x, 3) for x in (a, b)]
                errors[method, :, k] = (
                    part * srgb_rmse(*squares), part * delta_e(a, b, _BLOCK).mean()
                )  # fmt: skip
        yield (water, depth), errors


def _costs() -> list[list[str]]:
    """CPU time of a frame of the reef by the number of bands, over three bands in real time."""
    seconds: dict[int, tuple[float, float]] = {}
    for count in _COUNTS:
        place = _reef("IB", 10.0, count)
        place.open()
        with drawing(place.plan(_SAMPLES).settings) as drawn:
            _, frame = (drawn.seconds(_SAMPLES) for _ in range(2))  # the first compiles
        bands = place.timed(place.open(), time.process_time)[1]
        seconds[count] = frame, bands
    least = seconds[_COUNTS[0]][0]
    return [
        [f"{count}", f"{frame / least:.2f}", f"{bands / least:.2f}"]
        for count, (frame, bands) in seconds.items()
    ]


def _constants() -> list[tuple[str, str, str]]:
    """What Table 5 of Gutierrez et al. (2008) has of the model's parameters, and what is here."""
    sea = Constituents()
    raman = [" ".join(f"{x:g}" for x in column) for column in RAMAN_LINES.T]
    return [
        ("slope of CDOM, 1/nm", "0.014", f"{sea.cdom_slope:g}"),
        ("slope of detritus, 1/nm", "0.011", f"{sea.detritus_slope:g}"),
        ("yield of chlorophyll", "0.1", f"{sea.chlorophyll_yield:g}"),
        ("yield of CDOM", "0.025", f"{largest_cdom_yield():.2g}"),
        ("Raman: A", "0.41 0.39 0.1 0.1", raman[0]),
        ("Raman: shift, 1/cm", "3250 3425 3530 3625", raman[1]),
        ("Raman: width, 1/cm", "210 175 140 140", raman[2]),
    ]


def measure(ask: Ask) -> Mapping[str, object]:
    """Draw and compare."""
    _coefficients(ask.shown("papers_coefficients.png"))
    types = {
        f"{floor:g} m": list(ask.kept(f"types {floor:g}", lambda f=floor: _types(f)))
        for floor in _DEPTHS
    }
    for name, chosen in (("open", slice(0, 5)), ("coastal", slice(5, 10))):
        rows = {label: images[chosen] for label, images in types.items()}
        sheet(ask.shown(f"papers_{name}.jpg"), rows, _TYPES[chosen])
    swapped = _swapped(ask)
    sensors = {sensor: [pictures[w] for w in _SWAPPED] for sensor, pictures in swapped.items()}
    sheet(ask.shown("papers_sensors.jpg"), sensors, _SWAPPED)
    sheet(
        ask.shown("papers_two_sensors.jpg"), {"IA": [x["IA"] for x in swapped.values()]}, _SENSORS,
        size=2.4,
    )  # fmt: skip
    _film(ask.shown("papers_swap.gif"), [x for images in sensors.values() for x in images])
    traced = _traced(ask)
    shown = {k: [srgb_encode(np.clip(x, 0.0, 1.0)) for x in v] for k, v in traced.items()}
    sheet(ask.shown("papers_traced.jpg"), shown, ("Cycles", "EEVEE", "three wavelengths"), size=2.4)
    cameras = list_sensors("camera")
    rows, ours, theirs = [], [], []
    for (water, depth), errors in _errors(ask, cameras):
        rmse, off = errors.mean(axis=-1).T
        worst = errors[:2, 1].max(axis=-1)
        rows.append([f"{water} {depth:g} m", *(f"{x:.3f}" for x in rmse),
                     f"{TABLE2[water, depth]:.3f}", *(f"{x:.2f}" for x in off),
                     *(f"{x:.2f}" for x in worst)])  # fmt: skip
        ours.append(rmse[0])
        theirs.append(TABLE2[water, depth])
    pairs = {
        name: [delta_e(images[0], x, 6).mean() for x in images[1:]]
        for name, images in traced.items()
    }
    return {
        "constants": table(("", "Table 5", "here, by default"), _constants()),
        "errors": table(
            ("", "EEVEE, RMSE", "three λ", "printed", "noise", "their own", "EEVEE, ΔE2000",
             "three λ", "printed", "noise", "EEVEE, worst", "three λ, worst"), rows
        ),
        "costs": table(("bands", "real time", "bands mode"), _costs()),
        "traced": ", ".join(f"{k} {a:.1f}, {b:.1f}" for k, (a, b) in pairs.items()),
        "cameras": len(cameras),
        "over": float(np.mean(ours) / np.mean(theirs)),
    }  # fmt: skip


PAGE = Page(
    "The papers' figures, made again",
    """
Gutierrez et al. (2008), Monzon et al. (2022) and Monzon et al. (2024), by number. Their scenes,
and some of their sensors, are not published: here it is the example reef (draft), {width} ×
{height}, clear sky, sun at 30°.

## Monzon et al. 2024
**Figure 2**, the types of Solonenko & Mobley (2015): same tables, with what is misprinted in them
mended ([validation](../validation.md)).

![a, b, c and Kd of ten types](papers_coefficients.png)

**Figure 7**, one sensor against another in IA. No sensitivity of the Canon A2200 could be found
that may be shipped: the PowerShot S90 stands for it. Channels as they are, without a matrix.

![IA by two sensors](papers_two_sensors.jpg)

**Figures 8 and 10**, types by depth of the sand; real time, one exposure ({stops} stops). The types
that the paper leaves out for low visibility are here. No shafts.

![oceanic types](papers_open.jpg)

![coastal types](papers_coastal.jpg)

**Figure 12 and the time of a frame**: CPU time on a software rasteriser over that of three bands in
real time, the shaders compiled. The paper's time grows by 0.056 ms a band (of 16 ms at 8, on a GTX
1660); here real time draws the sensor's channels and does not grow; a pass of *bands* takes three.

{costs}

**Figure 13**: Cycles, EEVEE and one wavelength for each channel, where the sensor sees most;
channels as they are. Mean ΔE2000 of EEVEE and of three wavelengths: {traced}.

![path traced, EEVEE, three wavelengths](papers_traced.jpg)

**Figure 14 and Table 2**: the grey scene ([realtime_accuracy](realtime_accuracy.md)) at the paper's
six waters and depths, {bands} bands, by {cameras} cameras (28 there), against Cycles of {samples}
samples: means over the cameras of sRGB RMSE (squares of 3 × 3 pixels) and ΔE2000 (blocks of 9 × 9).
*Printed*: the paper's formula with its Kd; *noise*: of Cycles alone; *their own*: Table 2, of their
scenes and reference (HG of 0.8).

{errors}

RMSE is {over:.2f} of theirs in the mean. What differs: the light field is solved, not e^(-Kd y)
with an isotropic phase function ([physics](../physics.md)).

## Monzon et al. 2022
**Figure 1 and its film**: sensors by waters, sand at 10 m; [the swap as a film](papers_swap.gif).

![waters by sensors](papers_sensors.jpg)

## Gutierrez et al. 2008
**Figures 2, 3, 4**: [swatches](bio_optics.md#colours). **Table 5**: slopes and yields can be set in
`bio:` ([sources](../researcher.md)).

{constants}

A0 to B2 of CDOM's fluorescence are those of sample FA7 (Hawes 1992) by excitation, not two numbers.
""",
    (Target("RMSE over that of Table 2, mean", "over", 1.0),),
    {"samples": 64, "cases": 99, "width": _SIZE[0], "height": _SIZE[1], "bands": _BANDS,
     "stops": _STOPS},
)  # fmt: skip
