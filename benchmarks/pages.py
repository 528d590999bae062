"""The pages of docs/measured: what each is, and what measures or backs it."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from dataclasses import dataclass
from types import ModuleType

from .runner import DOCS, Page, digest, inputs


@dataclass(frozen=True)
class Row:
    """A page: its file, a line of the index, the module that measures it, or what backs it.

    ``by_hand`` are files and folders whose change makes a page stale that no module writes.
    """

    name: str
    said: str
    module: str = ""
    by_hand: Sequence[str] = ()

    def load(self) -> tuple[Page, ModuleType]:
        """Import what measures it."""
        module = importlib.import_module(f"{__package__}.{self.module}")
        return module.PAGES[self.name] if hasattr(module, "PAGES") else module.PAGE, module

    def digest(self) -> str:
        """Digest of its inputs."""
        if not self.module:
            return digest(inputs(self.by_hand))
        return digest(inputs([f"benchmarks/{self.module}.py", *self.load()[0].reads]))


PAGES = (
    Row("outside", "others' measurements and computations; most met", "outside"),
    Row("materials", "65 kinds in EEVEE; mean ΔE 1.75, worst 6.7 (fur)", "materials"),
    Row("mitsuba", "equal within the noise", "mitsuba_reference"),
    Row("mitsuba_materials", "the same under water; EEVEE to some percent", "mitsuba_materials"),
    Row("monte_carlo", "Monte Carlo met; closed form in part", "monte_carlo_table"),
    Row("caustics", "two campaigns at sea in part; photon traces met", "caustics_statistics"),
    Row("bio_optics", "constituents, Kd inverted", "gutierrez_figures"),
    Row("papers", "figures and tables of the three papers", "papers"),
    Row("realtime_accuracy", "in part; the papers' errors are several times larger",
        "realtime_accuracy"),
    Row("solved_accuracy", "within the noise in open water", "solved_accuracy"),
    Row("snell_window", "Cycles a little dark beside the window", "snell_window"),
    Row("world_sky", "direct and diffuse light within .6 %; EEVEE met", "world_sky"),
    Row("inelastic_scenes", "met in four of six; lamps in view missed", "inelastic_scenes"),
    Row("planar_reflection", "met", "surface_views"),
    Row("planar_refraction", "met", "surface_views"),
    Row("waterline", "met", "surface_views"),
    Row("objects_in_light", "met but for large ones seen from below", "objects_in_light"),
    Row("occlusion", "eleven of thirteen views met", "occlusion"),
    Row("enclosed_places", "ΔE 2.8 to 6; all missed", "enclosed_places"),
    Row("lamps", "met in clear water", "lamps_in_scenes"),
    Row("moving_lamps", "median met, worst block missed", "moving_lamps"),
    Row("lamp_light", "errors by case", "lamp_light"),
    Row("clouds", "silt; met by day, by torch at night missed in part", "clouds"),
    Row("bubbles", "met by day; by torch 4.6; 10 to 20 % too dim beyond an optical depth of 3",
        "bubbles"),
    Row("layered_water", "good but for thin clear layers", "layered_water"),
    Row("moving_surface", "correlations near 1",
        by_hand=("tests/scene/test_raised_waves.py", "tests/scene/test_whitecaps.py",
                 "examples/render_caustics.py")),
    Row("rough_surface", "mostly within a percent", "rough_surface"),
    Row("foreign_scenes", "met, mean ΔE .82", "foreign_pictures"),
    Row("eevee_details", "a percent or less, rough metals more",
        by_hand=("tests/uw_spectral/transfer/test_channel_tables.py",
                 "tests/scene/test_mirrors.py")),
    Row("path_radiance", "good median, long tail", "path_radiance_table"),
    Row("solved_field", "met", "solved_field"),
    Row("refractive_index", "below a percent", "refractive_index"),
    Row("housing_pictures", "met", "housing_pictures"),
    Row("housing", "far below .1 pixel", "housing"),
    Row("layers", "they add up", "layers"),
    Row("data_sets", "tenths of a pixel, percents",
        by_hand=("tests/datasets", "tests/scene/test_data_sets.py")),
    Row("tank_photographs", "two of three waters", "tank_photographs"),
    Row("applied_pictures", "met in the open", "applied_pictures"),
    Row("auto_choice", "Auto keeps its target", "auto_choice"),
    Row("optimised_bands", "half the bands or less in deep water", "optimised_bands"),
    Row("colorchecker", "met with many", "colorchecker_bands"),
    Row("realtime_cost", "samples met, first frames missed",
        by_hand=("benchmarks/water_cost.py", "benchmarks/panel_update.py")),
    Row("reference_cost", "shared passes are the best default", "reference_cost"),
    Row("denoising", "a half to a third of the error; dark regions shift by a few percent",
        by_hand=("jobs/development.py", "tests/scene/test_noise.py")),
    Row("split_jobs", "equal bit by bit", "split_jobs"),
    Row("farm_simulation", "a thousand workers are of use", "farm_simulation"),
    Row("stress", "none fails", by_hand=("tests/stress",)),
    Row("particles", "plausible numbers, and their cost", "particles"),
    Row("dive", "even steps", by_hand=("examples/render_dive.py",)),
    Row("new_user", "clicks and seconds of a new user",
        by_hand=("tests/scene/test_first_settings.py", "ui")),
    Row("gpu", "not run yet", by_hand=("benchmarks/gpu_check.py",)),
)  # fmt: skip

_INDEX = """# What was measured

`python3 dev.py measure NAME` measures a page again, `python3 dev.py measure --stale` lists those
whose code or data have changed since. Numbers stand beside targets, those that were missed too.
Summaries: [validation](../validation.md), [accuracy](../accuracy.md),
[performance](../performance.md).

{lines}

```{{toctree}}
:hidden:

{names}
```
"""


def write_index() -> None:
    """Write docs/measured/index.md."""
    lines = "\n".join(f"- [{row.name}]({row.name}.md): {row.said}" for row in PAGES)
    names = "\n".join(row.name for row in PAGES)
    (DOCS / "index.md").write_text(_INDEX.format(lines=lines, names=names), encoding="utf-8")
