"""What particles in the water cost, and how they look. Costs are ratios within one run."""

from __future__ import annotations

import functools
import math
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..scene.engines import engines
from ..scene.engines.band_engine import BandEngine
from ..scene.terms.particles import particles_of
from ..scene.water import lamp_rigs, metering, water_body
from ..settings import render_plan
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.spectra.colour_rendering import luminance, metered_stops, srgb_encode
from ..uw_spectral.spectra.spectral_image import read_exr
from ..uw_spectral.spectra.tone import camera_curve
from ..uw_spectral.water import Water, parse_water
from ..uw_spectral.water.particles import (
    KINDS,
    SLOPES,
    number_of_scattering,
    particle_scattering,
    scattering_fraction,
)
from ._denoised import denoised
from ._places import sheet
from ._scenery import ball, camera_at, new_file
from .runner import Ask, Page, table

DEPTH, _FLOOR = 8.0, 9.4
_ASPECT = 16 / 9
_MORE, _REPEATS, _SMALL = 6, 2, 50  # samples, times, % of the size at which costs are measured
_CYCLES = 4  # samples of Cycles over those of EEVEE
TONE = "nikon-d7000"
_WATERS = ("jerlov:I", "jerlov:IB", "jerlov:II", "jerlov:1C", "jerlov:3C", "jerlov:5C")


@dataclass(frozen=True)
class Look:
    """A picture: its title, engine, and what differs from the usual settings."""

    title: str
    engine: str
    night: bool
    changes: Mapping[str, float | str]

    def plan(self, samples: int) -> render_plan.RenderPlan:
        """Return what is rendered."""
        typical: dict[str, Any] = {
            "water": "jerlov:II", "bands": 3 if self.night else 6, "phase": "hg:0.9",
            "surface": "flat", "floor_depth": _FLOOR, "diffuse_shadows": False,
            "particle_slope": 4.0,
            "samples": samples * (1 if self.engine == "realtime" else _CYCLES),
        }  # fmt: skip
        return render_plan.make_plan(SceneSettings(**{**typical, **self.changes}))


_DAY: dict[str, float | str] = {"snow_of_water": 4.0, "plankton": 10.0}
_NIGHT: dict[str, float | str] = {"sunlight": 0.0, "snow_of_water": 1.0, "silt": 300.0}
LOOKS = (
    Look("real time, by day: snow and plankton before a dark rock", "realtime", False, _DAY),
    Look("real time, at night: silt in the light of a torch", "realtime", True, _NIGHT),
    Look("Cycles, by day, denoised", "bands", False, _DAY),
)


def build(*, night: bool, width: int) -> bpy.types.Object:
    """Fill an empty file with boulders on the sea's floor, a torch at night; return the camera."""
    scene = new_file()
    scene.render.resolution_x, scene.render.resolution_y = width, round(width / _ASPECT)
    scene.render.resolution_percentage = 100
    paint = (0.5, 0.45, 0.35) if night else (0.02, 0.02, 0.02)
    stones = ((-1.2, 3.2, 0.6), (1.3, 4.0, 0.9), (0.0, 6.0, 1.5))
    for x, y, radius in stones if night else ((0.5, 2.8, 1.8),):
        ball((x, y, 0.4 * radius - _FLOOR), radius, paint)
    camera = camera_at((0.0, 0.0, -DEPTH), (math.radians(87.0), 0.0, 0.0), 1.0)
    camera.data.lens = 28.0 if night else 60.0
    camera.data.dof.use_dof = True
    camera.data.dof.focus_distance = 2.0 if night else 0.7
    camera.data.dof.aperture_fstop = 4.0 if night else 8.0
    if night:
        for item in lamp_rigs.add_rig(scene, "torch", camera):
            item.data.spot_size = math.radians(50.0)
    bpy.context.view_layer.update()
    return camera


def _looked(look: Look, samples: int, width: int) -> NDArray[np.float64]:
    """Picture of a look; how many particles, and CPU seconds of a sample without and with them."""
    camera = build(night=look.night, width=width)
    scene, plan = bpy.context.scene, look.plan(samples)
    none = dict.fromkeys((*KINDS, "snow_of_water"), 0.0)
    bare = replace(look, changes={**look.changes, **none}).plan(samples)
    extent = water_body.water_extent(scene, plan.column, DEPTH)
    weights = plan.reduction(DEPTH, metering.lamplight(scene, camera, plan), 0.0).weights
    if look.engine == "realtime":
        opened = engines.eevee_realtime(scene, camera, plan, extent, DEPTH)
    else:
        opened = engines.cycles_bands(scene, camera, plan, extent, seed=0, guides=True)
    with opened as engine, tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.exr"

        def seconds(now: render_plan.RenderPlan, count: int) -> float:
            if look.engine == "realtime":
                scene.eevee.taa_render_samples = count
            else:
                scene.cycles.samples = count
            render = engine.frame(now, DEPTH, weights)
            start = time.process_time()
            render(engine.passes[0], path)
            return time.process_time() - start

        picture = _picture(engine, plan, weights, path, realtime=look.engine == "realtime")
        scene.render.resolution_percentage = _SMALL
        # In turn, for other work on the machine changes what a second is worth.
        times: dict[tuple[bool, int], float] = {}
        for _ in range(_REPEATS):
            for full in (False, True):
                for count in (1, 1 + _MORE):
                    taken = seconds(plan if full else bare, count)
                    times[full, count] = min(taken, times.get((full, count), math.inf))
        plain, full = ((times[full, 1 + _MORE] - times[full, 1]) / _MORE for full in (False, True))
        count = sum(cloud.count for cloud in particles_of(plan.settings, plan.column).clouds)
        return np.array([*picture.ravel(), count, plain, full])


def _picture(
    engine: BandEngine, plan: render_plan.RenderPlan, weights: NDArray[np.float64], path: Path,
    *, realtime: bool,
) -> NDArray[np.float64]:  # fmt: skip
    """Return the display values of a frame, exposed by what is in it."""
    if realtime:
        render = engine.frame(plan, DEPTH, weights)
        render(engine.passes[0], path)
        image = read_exr(path)[0].astype(np.float64)
    else:
        image = denoised(engine, plan, DEPTH, weights)
    Y = np.maximum(luminance(image), 0.0).ravel()
    gain = 2.0 ** metered_stops(Y, np.full(len(Y), 1.0 / len(Y)))
    return srgb_encode(camera_curve(TONE)(np.maximum(gain * image, 0.0)))


def _waters() -> list[list[str]]:
    """Particles per litre of some waters, by slopes."""
    wavelengths, rows = np.array([500.0, 550.0, 600.0]), []
    for name in _WATERS:
        water = parse_water(name)
        assert isinstance(water, Water), "they have b"
        b_p = particle_scattering(wavelengths, water.b(wavelengths))
        numbers = [number_of_scattering(b_p, slope) for slope in (4.0, 3.6, SLOPES[0])]
        large = numbers[1] * 5.0 ** (1.0 - 3.6)
        rows.append([name, f"{b_p:.3f}", *(f"{n:.0f}" for n in numbers), f"{large:.2f}"])
    return rows


def measure(ask: Ask) -> Mapping[str, object]:
    """Render and time the looks."""
    pictures, costs = {}, []
    for number, look in list(enumerate(LOOKS))[: ask.looks]:
        kept = ask.kept(str(number), functools.partial(_looked, look, ask.samples, ask.width))
        count, plain, full = kept[-3:].tolist()
        pictures[look.title] = [kept[:-3].reshape(-1, ask.width, 3)]
        costs.append([look.title, int(count), f"{full / plain:.2f}"])
    sheet(ask.shown("particles.jpg"), pictures, ("",), size=4.0)
    fractions = (f"{100 * scattering_fraction(x):.2g} % for {x:g}" for x in (4.0, 3.6, SLOPES[0]))
    kinds = [
        [kind.name, f"{1e3 * kind.smallest:g} to {1e3 * kind.largest:g}",
         f"{kind.reflectance[1]:g}", f"{1e3 * float(kind.rise(5e-4)):+.3g}"]
        for kind in KINDS.values()
    ]  # fmt: skip
    heads = ("water", "particles' b at 550 nm, 1/m", "slope 4", "slope 3.6", "slope 3",
             "above 0.5 mm, slope 3.6")  # fmt: skip
    return {
        "shares": ", ".join(fractions),
        "waters": table(heads, _waters()),
        "kinds": table(("kind", "diameter, mm", "reflectance", "rise at 0.5 mm, mm/s"), kinds),
        "costs": table(("", "particles around the camera", "ratio"), costs),
    }


PAGE = Page(
    "Particles: snow, plankton, bubbles, silt",
    """
![Snow by day, silt in the light of a torch, and snow by day in Cycles](particles.jpg)

From above: real time, by day: snow and plankton before a dark rock; real time, at night: silt in
the light of a torch; Cycles, by day, denoised. 320 × 180 pixels, 16 samples (64 in Cycles), slope
4, through a lens that is open.

By day snow is seen mostly before dark objects, as in nature; the denoiser of Cycles takes faint
specks for noise, so **do not denoise particles by day**: without it they are as bright as in EEVEE,
within 6 %. How to use them: [for artists](../artist.md#particles).

## How many
The numbers fall with the power of the diameter `--particle-slope`, 3.6: measured were 3.6 ± 0.33 in
168 samples of the Arctic (Runyan et al. 2020), 3.5 in some 5500 of coasts (Reynolds et al. 2010), 3
to 3.6 in a bloom (Jackson et al. 1997); 4 by Sheldon et al. (1972). With one law from 1 µm to 1 cm
those above 0.1 mm carry {shares} of the scattering. Per litre:

{waters}

Divers count 1 to 10 flocs above 0.5 mm in a litre, seldom more than 100 (Alldredge & Silver 1988,
quoted from memory): with 3.6 about as many are drawn, with 4 fewer.

## Kinds

{kinds}

Speeds: Alldredge & Gotschalk (1988), Ferguson & Church (2004). Reflectances, shapes and ways are
plausible, not measured. Bubbles are mirrors where water reflects totally; they do not refract.

## What they cost
CPU time of a sample, with particles over without, at half the size of the pictures:

{costs}

With more than 200000 of a kind the smallest angle grows, and the record says so.

What is left out: [limits](../limits.md#particles).
""",
    settings={"samples": 16, "width": 320, "looks": 99},
)
