"""What each option of the water costs, for the choice of what a scene requires.

    python3 dev.py run -m benchmarks option_costs

writes data/costs.csv: the ratios that realtime_cost measured (docs/realtime_cost.md),
the number of shader nodes of every option, by which the costs of the options are
told apart (they are smaller than the scatter of a CPU's times), and a Cycles pass.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import bpy

from ..node_groups import realtime_background, realtime_surface
from ..scene import caustics, engines, realtime, render_plan, settings
from ..scene.water_body import water_extent
from ..uw_spectral.costs import COLUMNS
from . import grey_scene

_DEPTH = 5.0
_SURFACES = ("none", "flat", "waves")
# docs/realtime_cost.md: CPU time to that of the scene without water; and its seconds per megapixel.
_MEASURED = {(3, 1, 1, 0, 0): 2.02, (8, 1, 1, 0, 0): 2.56, (3, 1, 1, 0, 1): 5.92}
_PLAIN_SECONDS = 1.942 / (480 * 270 / 1e6)
# Bands, aureole, surface (index into _SURFACES), inelastic, shafts.
_CONFIGURATIONS = (
    *_MEASURED,
    (9, 1, 1, 0, 0),
    (15, 1, 1, 0, 0),
    (9, 0, 1, 0, 0),
    (9, 1, 0, 0, 0),
    (9, 1, 2, 0, 0),
    (3, 1, 2, 0, 0),
    (9, 1, 1, 1, 0),
)
_RESOLUTION = (192, 108)
_CYCLES_SAMPLES = 64
_HEADER = """\
# Cost of a sample of a frame against the same scene without water, by the options of the water.
# source: ratios of docs/realtime_cost.md (`python3 dev.py run -m benchmarks realtime_cost
# --samples 4 --bands 3 8`: 480 x 270, EEVEE on the software rasteriser of a two-core machine);
# nodes and Cycles by `python3 dev.py run -m benchmarks option_costs`
# nodes: shader nodes that a pixel of a surface and one of open water pass; ratio 0: not measured
# surface: 0 none, 1 flat, 2 waves. cycles 1: a pass of three bands in Cycles; bands 0: no water,
# where ratio holds its CPU time per megapixel and sample, s
# licence: GPL-3.0-or-later. status: measured, on a CPU; read the ratios
"""


def main(arguments: Sequence[str]) -> None:
    """Count, measure, and write the table."""
    argparse.ArgumentParser(prog="option_costs").parse_args(arguments)
    rows = [(0, *c, nodes(c), _MEASURED.get(c, 0)) for c in _CONFIGURATIONS]
    cycles = cycles_seconds() / _PLAIN_SECONDS
    rows += [(1, 3, 1, 1, 0, 0, 0, round(cycles, 3)), (0, 0, 0, 0, 0, 0, 0, _PLAIN_SECONDS)]
    lines = [",".join(COLUMNS), *(",".join(f"{value:.4g}" for value in row) for row in rows)]
    table = Path(__file__).resolve().parent.parent / "data" / "costs.csv"
    table.write_text(_HEADER + "\n".join(lines) + "\n", encoding="utf-8")
    print("\n".join(lines))


def _plan(configuration: Sequence[int]) -> tuple[bpy.types.Object, render_plan.RenderPlan]:
    bands, aureole, surface, inelastic, _ = configuration
    bpy.ops.wm.read_factory_settings(use_empty=True)
    camera = grey_scene.build_scene(_DEPTH, *_RESOLUTION)
    return camera, render_plan.make_plan(
        settings.SceneSettings(
            phase="hg:0.924",
            bands=bands,
            aureole="on" if aureole else "off",
            surface=_SURFACES[surface],
            inelastic="raman" if inelastic else "",
            floor_depth=_DEPTH + grey_scene.ABOVE_FLOOR,
        )
    )


def nodes(configuration: Sequence[int]) -> int:
    """Return how many nodes the groups of surface and open water hold, groups in them unfolded."""
    _, plan = _plan(configuration)
    scene = bpy.context.scene
    weights = plan.reduction(_DEPTH).weights
    water = plan.realtime(scene, _DEPTH, weights, shafts=bool(configuration[-1]))
    water = caustics.with_waves(scene, plan, water)
    realtime.add_realtime(scene, water, water_extent(scene, plan.column, _DEPTH))
    names = (realtime_surface.NAME, realtime_background.NAME)
    return sum(_unfolded(bpy.data.node_groups[name]) for name in names)


def _unfolded(tree: bpy.types.NodeTree) -> int:
    return sum(_unfolded(n.node_tree) if n.type == "GROUP" else 1 for n in tree.nodes)


def cycles_seconds() -> float:
    """Return CPU seconds per megapixel and sample of a Cycles pass of three bands."""
    camera, plan = _plan((3, 1, 1, 0, 0))
    scene = bpy.context.scene
    extent = water_extent(scene, plan.column, _DEPTH)
    with (
        engines.cycles_bands(scene, camera, plan, extent, seed=0, denoise=False) as engine,
        tempfile.TemporaryDirectory() as folder,
    ):
        times = []
        for samples in (1, 1, 1 + _CYCLES_SAMPLES):
            scene.cycles.samples = samples
            start = time.process_time()
            engine.frame(plan, _DEPTH)(engine.passes[0], Path(folder) / "a.exr")
            times.append(time.process_time() - start)
    megapixels = _RESOLUTION[0] * _RESOLUTION[1] / 1e6
    return (times[2] - times[1]) / _CYCLES_SAMPLES / megapixels
