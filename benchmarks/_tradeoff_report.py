"""Errors and costs of what :mod:`.tradeoff` has measured, as tables, plot and pictures."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images, srgb_encode
from ..uw_spectral.spectra.spectral_image import replacing
from ..validation.colour_errors import srgb_rmse
from ._tradeoff_scenes import (
    FOG,
    PLAIN,
    REFERENCE,
    SETTINGS,
    TERM_NAMES,
    USUAL,
    Configuration,
    Setting,
    TestScene,
)
from .grey_scene import blocks

FRAME_SAMPLES = 16
"""Samples of a frame of EEVEE, for its cost beside that of Cycles."""
TARGETS = (1.0, 2.0, 5.0)
_LARGEST_BLOCK = 6
_ERRORS = ("srgb_rmse", "delta_e", "delta_e_raw", "delta_e_95", "spectral_angle_deg")
_COSTS = ("cpu_per_frame", "wall_ms", "cost", "share")
# Numbers of numpy formulas cost nothing here; in shaders they cost at most this.
_COST_OF = {
    "fog, RGB": "fog",
    "paper corrected, RGB": "real time, 3 bands",
    "paper corrected, 8 bands": "real time, 8 bands",
    "paper printed, 8 bands": "real time, 8 bands",
    f"{USUAL}, no surface": USUAL,
    f"{USUAL}, no inelastic light": USUAL,
}
# Colour and marker.
_FAMILIES = {
    "equal bands": ("tab:blue", "o"),
    "optimised bands": ("tab:green", "D"),
    "terms on or off": ("tab:cyan", "^"),
    "band passes": ("tab:purple", "v"),
    "fog, paper": ("tab:red", "x"),
    "Cycles": ("black", "s"),
}


@dataclass(frozen=True, eq=False)
class Measurement:
    """Error and cost of a setting in one configuration; NaN where there is none.

    ``srgb_rmse`` and ``delta_e`` have the noise of the reference taken off
    their square; ``delta_e_raw`` has not. ΔE2000 is over blocks of pixels.
    ``cost`` is the CPU time of a frame over that of the plain scene,
    ``share`` over that of the reference. ``wall_ms`` is the time of one sample
    of EEVEE, which is what a viewport draws as a frame, or of a whole render
    of Cycles.
    """

    scene: str
    configuration: str
    setting: str
    srgb_rmse: float
    delta_e: float
    delta_e_raw: float
    delta_e_95: float
    spectral_angle_deg: float
    cpu_per_frame: float
    wall_ms: float
    cost: float
    share: float


@dataclass(frozen=True, eq=False)
class Results:
    """Every measurement, and the noise of the reference by scene and configuration."""

    measurements: tuple[Measurement, ...]
    noise: Mapping[tuple[str, str], tuple[float, float]]
    pictures: Mapping[tuple[str, str], Mapping[str, NDArray[np.float64]]]
    reference_cpu: Mapping[tuple[str, str], float]


def collect(
    configurations: Iterable[tuple[TestScene, Configuration]],
    path_of: Callable[[TestScene, Configuration, Setting], Path],
) -> Results:
    """Read what is kept and compute errors and cost ratios."""
    configurations = list(configurations)
    measurements, noise, pictures, reference_cpu = [], {}, {}, {}
    costs = _read_costs(configurations, path_of)
    for scene, configuration in configurations:
        key = (scene.name, configuration.name)

        def read(
            setting: Setting, where: tuple[TestScene, Configuration] = (scene, configuration)
        ) -> dict[str, NDArray[Any]] | None:
            return _read(path_of(*where, setting))

        reference = read(REFERENCE)
        found = {name: data for name in scene.settings if (data := read(SETTINGS[name]))}
        if reference:
            halves = [half @ reference["weights"].T for half in reference["bands"]]
            size = block_size(halves[0].shape)
            mean = (halves[0] + halves[1]) / 2
            noise[key] = (
                srgb_rmse(*map(_clip, halves)) / 2,
                float(_delta_e(*halves, size).mean()) / 2,
            )
            pictures[key] = {"reference": mean}
            reference_cpu[key] = float(reference["cpu"])
        for name, data in found.items():
            picture = data["picture"] if "picture" in data else _developed(data)
            errors = (math.nan,) * 5
            if reference:
                pictures[key][name] = picture
                errors = (
                    *_errors(picture, mean, noise[key], size),
                    _spectral_angle(data, reference, size),
                )
            measurements.append(
                Measurement(
                    *key,
                    name,
                    *errors,
                    **_cost_columns(
                        costs.get(_COST_OF.get(name, name), {}) | _own_costs(data),
                        costs.get(PLAIN.name, {}),
                        reference,
                    ),
                )
            )
    return Results(tuple(measurements), noise, pictures, reference_cpu)


def block_size(shape: Sequence[int]) -> int:
    """Side of the squares over which pictures are averaged before colours are compared."""
    common = math.gcd(shape[0], shape[1])
    return max(n for n in range(1, _LARGEST_BLOCK + 1) if common % n == 0)


def _clip(picture: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.clip(np.asarray(picture, dtype=np.float64), 0.0, 1.0)


def _delta_e(
    picture: NDArray[np.float64], reference: NDArray[np.float64], size: int
) -> NDArray[np.float64]:
    """ΔE2000 of blocks; they are clipped as a whole, for clipped noise is darker."""
    return delta_e_CIE2000_images(*(_clip(blocks(image, size)) for image in (picture, reference)))


def _developed(data: Mapping[str, NDArray[Any]]) -> NDArray[np.float64]:
    return data["bands"].mean(axis=0) @ data["weights"].T


def _errors(
    picture: NDArray[np.float64],
    reference: NDArray[np.float64],
    noise: tuple[float, float],
    size: int,
) -> tuple[float, float, float, float]:
    """RMSE and mean ΔE without the reference's noise; mean and 95 % ΔE with it."""
    rmse = srgb_rmse(_clip(picture), _clip(reference))
    delta_e = _delta_e(picture, reference, size)
    mean = float(delta_e.mean())
    return (
        math.sqrt(max(rmse**2 - noise[0] ** 2, 0.0)),
        math.sqrt(max(mean**2 - noise[1] ** 2, 0.0)),
        mean,
        float(np.quantile(delta_e, 0.95)),
    )


def _spectral_angle(
    data: Mapping[str, NDArray[Any]], reference: Mapping[str, NDArray[Any]], size: int
) -> float:
    """Mean angle between spectra of blocks, degrees, where there are spectra to compare."""
    if "bands" not in data or reference["bands"].shape[-1] % data["bands"].shape[-1]:
        return math.nan
    spectra = blocks(data["bands"].mean(axis=0).astype(np.float64), size)
    fine = blocks(reference["bands"].mean(axis=0).astype(np.float64), size)
    coarse = fine.reshape(*fine.shape[:2], spectra.shape[-1], -1).mean(axis=-1)
    lengths = np.linalg.norm(spectra, axis=-1) * np.linalg.norm(coarse, axis=-1)
    cosine = np.sum(spectra * coarse, axis=-1)[lengths > 0] / lengths[lengths > 0]
    return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))).mean())


def _read(path: Path) -> dict[str, NDArray[Any]] | None:
    if not path.exists():
        return None
    with np.load(path) as kept:
        return {name: kept[name] for name in kept.files}


def _read_costs(
    configurations: Iterable[tuple[TestScene, Configuration]],
    path_of: Callable[[TestScene, Configuration, Setting], Path],
) -> dict[str, dict[str, float]]:
    """Costs by setting, from the first of the scenes that measure them."""
    found: dict[str, dict[str, float]] = {}
    for scene, configuration in configurations:
        for name in (PLAIN.name, FOG.name, *scene.settings):
            setting = {PLAIN.name: PLAIN, FOG.name: FOG}.get(name) or SETTINGS[name]
            data = _read(path_of(scene, configuration, setting)) if scene.costed else None
            if data is not None and "cpu_per_sample" in data:
                found.setdefault(name, _own_costs(data))
    return found


def _own_costs(data: Mapping[str, NDArray[Any]]) -> dict[str, float]:
    """Every number of a measurement."""
    return {name: float(value) for name, value in data.items() if value.ndim == 0}


def _cost_columns(
    data: Mapping[str, float],
    plain: Mapping[str, float],
    reference: Mapping[str, NDArray[Any]] | None,
) -> dict[str, float]:
    if "cpu" in data:
        frame, wall = data["cpu"], data["wall"]
    else:
        frame = FRAME_SAMPLES * data.get("cpu_per_sample", math.nan)
        wall = data.get("wall_per_sample", math.nan)
    return {
        "cpu_per_frame": frame,
        # On a busy machine the difference that this is may be negative: it is not known then.
        "wall_ms": 1e3 * wall if wall > 0 else math.nan,
        "cost": frame / (FRAME_SAMPLES * plain.get("cpu_per_sample", math.nan)),
        "share": frame / float(reference["cpu"]) if reference else math.nan,
    }


def cheapest(measurements: Iterable[Measurement], error: str, target: float) -> Measurement | None:
    """Return the cheapest measurement one of whose errors meets a target."""
    meeting = [m for m in measurements if getattr(m, error) <= target and not math.isnan(m.cost)]
    return min(meeting, key=lambda m: m.cost, default=None)


def _cheapest_settings(results: Results) -> list[str]:
    """Table of what is cheapest in each configuration and over all of them."""
    head = " | ".join(f"ΔE ≤ {target:g}" for target in TARGETS)
    lines = [f"| scene | {head} |", "|---|" + "---|" * len(TARGETS)]
    for key in results.noise:
        here = [m for m in results.measurements if (m.scene, m.configuration) == key]
        cells = [_choice(cheapest(here, "delta_e", target)) for target in TARGETS]
        lines.append(f"| {key[0]}, {key[1].split(',')[0]} | {' | '.join(cells)} |")
    for error, scale in (("delta_e", 1.0), ("srgb_rmse", 100.0)):
        every = _everywhere(results)
        cells = [_choice(cheapest(every, error, target / scale)) for target in TARGETS]
        name = "all" if error == "delta_e" else "all, RMSE ≤ 0.01, 0.02, 0.05"
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return lines


def write(results: Results, docs: Path, reference_samples: int) -> None:
    """Write table, plot, pictures and summary into the folder of documents.

    Raises
    ------
    InputError
        If the scene that gives the costs is missing.
    """
    if all(math.isnan(m.cost) for m in _everywhere(results)):
        raise InputError("trade-off: the costs are those of the grey scene; add it to --scenes")
    _write_csv(results, docs / "tradeoff.csv")
    _plot(results, docs / "tradeoff.png")
    _sheet(results, docs / "tradeoff_pictures.jpg")
    with replacing(docs / "tradeoff.md") as temporary:
        temporary.write_text(_summary(results, reference_samples), encoding="utf-8")


def _write_csv(results: Results, path: Path) -> None:
    names = [f.name for f in fields(Measurement)]
    with replacing(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        for m in results.measurements:
            values = [getattr(m, name) for name in names]
            writer.writerow([_cell(value) for value in values])


def _cell(value: str | float) -> str:
    if isinstance(value, str):
        return value
    return "" if math.isnan(value) else f"{value:.4g}"


def _summary(results: Results, reference_samples: int) -> str:
    bands = REFERENCE.changes["bands"]
    lines = [
        "# Speed against accuracy",
        "",
        f"Each setting against Cycles with {bands} bands, two times {reference_samples} samples,",
        "sun at 30°: mean ΔE2000 of blocks of pixels, the noise of the reference taken off its",
        "square. *Cost*: CPU time of a frame over that of EEVEE's grey scene without water, in the",
        f"same run; EEVEE's frame is {FRAME_SAMPLES} samples without shadow maps, Cycles' all its",
        "passes; the paper's formula is drawn in numpy, at the cost of real time. Every number:",
        "[tradeoff.csv](tradeoff.csv); compile times: [realtime_cost.md](realtime_cost.md).",
        "",
        "![Error and cost of every setting](tradeoff.png)",
        "",
        "## The cheapest setting for a colour error",
        "",
        *_cheapest_settings(results),
    ]
    lines += ["", *_by_setting(results), "", "## Terms switched off", "", *_terms(results), ""]
    lines += ["![Pictures and differences](tradeoff_pictures.jpg)", ""]
    lines += ["Repeat: `python3 dev.py run -m benchmarks tradeoff`", ""]
    return "\n".join(lines)


def _choice(found: Measurement | None) -> str:
    if found is None:
        return "none"
    return f"{found.setting}, {found.cost:.1f}"


def _everywhere(results: Results) -> list[Measurement]:
    """Means over the plotted configurations of each setting that all of them have."""
    plotted = [m for m in results.measurements if m.scene not in _extra_scenes(results)]
    keys = {(m.scene, m.configuration) for m in plotted}
    found = []
    for name in SETTINGS:
        here = [m for m in plotted if m.setting == name]
        if {(m.scene, m.configuration) for m in here} == keys:
            costs = {f: _geometric([getattr(m, f) for m in here]) for f in _COSTS}
            errors = {f: float(np.mean([getattr(m, f) for m in here])) for f in _ERRORS}
            found.append(Measurement("all", "", name, **errors, **costs))
    return found


def _by_setting(results: Results) -> list[str]:
    lines = [
        "## Every setting, over all scenes",
        "",
        "| setting | ΔE mean | worst scene | sRGB RMSE | cost |",
        "|---|---|---|---|---|",
    ]
    extra = _extra_scenes(results)
    for mean in _everywhere(results):
        worst = max(
            m.delta_e
            for m in results.measurements
            if m.setting == mean.setting and m.scene not in extra
        )
        lines.append(
            f"| {mean.setting} | {mean.delta_e:.2f} | {worst:.2f} | {mean.srgb_rmse:.4f} "
            f"| {mean.cost:.1f} |"
        )
    return lines


def _geometric(values: Sequence[float]) -> float:
    return float(np.exp(np.mean(np.log(values))))


def _terms(results: Results) -> list[str]:
    """Error and cost of the settings that differ from real time as it comes in one term."""
    base = {(m.scene, m.configuration): m for m in results.measurements if m.setting == USUAL}
    lines = [
        "Against real time as it comes in the same scenes, range of ΔE means.",
        "",
        "| setting | ΔE mean | with the term | cost over it |",
        "|---|---|---|---|",
    ]
    for name in sorted(TERM_NAMES):
        if name.endswith(("64 froxels", "128 froxels")):
            continue
        found = [
            (m, base[m.scene, m.configuration])
            for m in results.measurements
            if m.setting == name != USUAL and (m.scene, m.configuration) in base
        ]
        if not found:
            continue
        ranges = [[pair[i].delta_e for pair in found] for i in range(2)]
        cells = " | ".join(f"{min(x):.2f}…{max(x):.2f}" for x in ranges)
        ratio = _geometric([m.cost / full.cost for m, full in found])
        lines.append(f"| {name.removeprefix(f'{USUAL}, ')} | {cells} | {ratio:.1f} |")
    return lines


def _extra_scenes(results: Results) -> set[str]:
    """Scenes with one configuration for one term, which the means leave out."""
    settings = {name: set() for name, _ in results.noise}
    for m in results.measurements:
        settings.setdefault(m.scene, set()).add(m.setting)
    return {name for name, found in settings.items() if "fog, RGB" not in found}


def _family(setting: str) -> str:
    if setting.startswith("Cycles"):
        return "Cycles"
    if setting.startswith(("fog", "paper")):
        return "fog, paper"
    if "optimised" in setting:
        return "optimised bands"
    if setting.startswith("band passes"):
        return "band passes"
    return "terms on or off" if setting in TERM_NAMES else "equal bands"


def _plot(results: Results, path: Path) -> None:
    """Draw error over cost, a panel per scene, with the Pareto front."""
    import matplotlib as mpl

    mpl.use("agg")
    import matplotlib.pyplot as plt
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    extra = _extra_scenes(results)
    scenes = [s for s in dict.fromkeys(m.scene for m in results.measurements) if s not in extra]
    size = (3.0 * max(len(scenes), 2), 3.4)
    figure, axes = plt.subplots(1, len(scenes), figsize=size, squeeze=False, layout="constrained")
    for axis, scene in zip(axes[0], scenes, strict=True):
        points = _means(results, scene)
        for family, (colour, marker) in _FAMILIES.items():
            chosen = [(c, e) for name, (c, e) in points.items() if _family(name) == family]
            if chosen:
                axis.plot(*zip(*chosen, strict=True), marker, color=colour, ms=4, label=family)
        front = pareto_front(points.values())
        axis.step(*zip(*front, strict=True), where="post", color="0.6", lw=1, zorder=0)
        axis.set(xscale="log", yscale="log", title=scene, xlabel="cost, × plain scene")
        for scale in (axis.xaxis, axis.yaxis):
            scale.set_major_locator(LogLocator(subs=(1.0, 3.0)))
            scale.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            scale.set_minor_formatter(NullFormatter())
        for target in TARGETS:
            axis.axhline(target, color="0.85", lw=0.6, zorder=0)
    axes[0][0].set_ylabel("mean ΔE2000")
    labels = {
        label: handle
        for axis in axes[0]
        for handle, label in zip(*axis.get_legend_handles_labels(), strict=True)
    }
    columns = 2 + len(scenes)
    figure.legend(
        labels.values(), labels.keys(), loc="outside lower center", ncol=columns, fontsize=8
    )
    figure.savefig(path, dpi=80)


def _means(results: Results, scene: str) -> dict[str, tuple[float, float]]:
    """Cost (geometric mean) and ΔE of the settings of a scene over its configurations."""
    found: dict[str, list[Measurement]] = {}
    for m in results.measurements:
        if m.scene == scene and not (math.isnan(m.cost) or math.isnan(m.delta_e)):
            found.setdefault(m.setting, []).append(m)
    most = max((len(x) for x in found.values()), default=0)
    return {
        name: (_geometric([m.cost for m in x]), float(np.mean([m.delta_e for m in x])))
        for name, x in found.items()
        if len(x) == most
    }


def pareto_front(points: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return the points that no other beats in both cost and error, by rising cost.

    Examples
    --------
    >>> pareto_front([(1, 5), (2, 6), (3, 1)])
    [(1, 5), (3, 1)]
    """
    front: list[tuple[float, float]] = []
    for cost, error in sorted(points):
        if not front or error < front[-1][1]:
            front.append((cost, error))
    return front


_SHOWN = ("fog, RGB", "paper corrected, 8 bands", "real time, 3 bands", USUAL,
          "Cycles, 8 bands, 16 samples")  # fmt: skip


def _sheet(results: Results, path: Path) -> None:
    """Draw reference, pictures and their ΔE2000, one configuration per scene."""
    import matplotlib as mpl

    mpl.use("agg")
    import matplotlib.pyplot as plt

    extra = _extra_scenes(results)
    first = {scene: key for key in reversed(results.pictures) if (scene := key[0]) not in extra}
    rows = [results.pictures[key] for key in reversed(first.values())]
    names = [key[0] for key in reversed(first.values())]
    columns = 1 + 2 * len(_SHOWN)
    figure, axes = plt.subplots(
        len(rows), columns, figsize=(1.35 * columns, 0.85 * len(rows) + 0.3), squeeze=False,
        layout="constrained",
    )  # fmt: skip
    for row, name, pictures in zip(axes, names, rows, strict=True):
        reference = pictures["reference"]
        row[0].imshow(srgb_encode(_clip(reference)))
        row[0].set_ylabel(name, fontsize=7)
        size = block_size(reference.shape)
        for index, setting in enumerate(_SHOWN):
            if setting not in pictures:
                continue
            picture = pictures[setting]
            row[1 + 2 * index].imshow(srgb_encode(_clip(picture)))
            delta_e = _delta_e(picture, reference, size)
            shown = row[2 + 2 * index].imshow(delta_e, cmap="magma", vmin=0, vmax=10)
    titles = ["reference", *(t for name in _SHOWN for t in (name, "ΔE2000, 0 to 10"))]
    for axis, title in zip(axes[0], titles, strict=True):
        axis.set_title(title.replace(", ", ",\n", 1), fontsize=6)
    for axis in axes.flat:
        axis.set(xticks=[], yticks=[])
    figure.colorbar(shown, ax=axes[:, -1])
    figure.savefig(path, dpi=75, pil_kwargs={"quality": 85})
