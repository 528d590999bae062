"""What the real-time water costs over plain fog, in one run on one machine.

    python3 dev.py run -m benchmarks water_cost [--scene materials PATH.blend ...]
        [--bands 6 30 80] [--terms alone occlusion ...] [--against "fog kept"] [--repeats N]

CPU time per sample (the difference of two counts of samples), CPU time of the first frame, and
peak memory: of a scene without water, of fog, and of water of so many bands, alone and with
occlusion of objects, lamps, waves and shafts. Each case has a process of its own with an empty
shader cache; cases are repeated in turn and the least counts. A table of each scene, as ratios to
fog, and which targets are met; Ctrl-C ends a scene with what is known. Without a GPU EEVEE runs on
the CPU: read the ratios.

Fog is what artists use: the light of each surface times e^(-c P), plus a colour. *fog* takes the
light by Shader to RGB, *fog kept* mixes the shader with an emission and so keeps its closures. Both
are lit by one sun with the water's shadow maps; *with lamps* two spots shine as well.

A scene is a .blend with a camera below z = 0, or ``materials``: fifty of them over a seabed;
``measure foreign_scenes`` builds some of other people's models.
"""

from __future__ import annotations

import argparse
import json
import resource
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import bpy

from ..settings.scene_settings import SceneSettings
from ..uw_spectral.errors import InputError
from . import _many_materials
from ._drawing import drawing, hang_lamps, said_by_process
from ._fog import add_fog, add_kept_fog
from ._scenery import new_file, sized
from .runner import markdown, table

_MATERIALS = "materials"
_FOG, _FOG_KEPT = "fog", "fog kept"
_TERMS = {
    "alone": (),
    "occlusion": ("occlusion",),
    "lamps": ("lamps",),
    "waves": ("waves",),
    "shafts": ("shafts",),
    "occlusion, lamps, waves": ("occlusion", "lamps", "waves"),
    "all": ("occlusion", "lamps", "waves", "shafts"),
}
_LAMPS = "strobes"  # two spots
_SHADOW = 0.01  # m, of the sun's shadow, as in the water

# Over fog: a sample without and with terms, a first frame, memory; and many bands over few.
_PLAIN_SAMPLE, _SAMPLE, _FIRST, _MEMORY, _BANDS = 1.1, 1.25, 1.25, 1.2, 1.03


@dataclass(frozen=True)
class _Case:
    """What is measured: a plain scene, fog, or water of some bands."""

    name: str
    bands: int = 0
    terms: tuple[str, ...] = ()

    @property
    def settings(self) -> SceneSettings | None:
        """Its water, if there is any."""
        if not self.bands:
            return None
        return SceneSettings(
            bands=self.bands,
            surface="waves" if "waves" in self.terms else "flat",
            diffuse_shadows="occlusion" in self.terms,
            shafts="shafts" in self.terms,
            samples=1,
        )


@dataclass(frozen=True)
class _Cost:
    """CPU seconds of a sample, the first frame, what goes before it, other values; peak MB."""

    sample: float
    first: float
    before: float
    change: float
    memory: float

    def least(self, other: _Cost) -> _Cost:
        """Return the least of both."""
        return _Cost(*map(min, zip(asdict(self).values(), asdict(other).values(), strict=True)))


def main(arguments: Sequence[str]) -> None:
    """Measure each case in a process of its own, and print a table of each scene."""
    parser = argparse.ArgumentParser(prog="water_cost", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--scene", nargs="+", default=[_MATERIALS], metavar="PATH")
    parser.add_argument("--bands", type=int, nargs="+", default=[6, 30, 80])
    parser.add_argument("--terms", nargs="+", choices=list(_TERMS), default=list(_TERMS))
    parser.add_argument("--against", choices=(_FOG, _FOG_KEPT), default=_FOG)
    parser.add_argument("--samples", type=int, default=8)
    parser.add_argument("--repeats", type=int, default=2)
    parser.add_argument("--resolution", type=int, nargs=2, default=(480, 270))
    parser.add_argument("--case", help="one case as JSON, measured in this process")
    options = parser.parse_args(arguments)
    for scene in options.scene:
        if scene != _MATERIALS and not Path(scene).is_file():
            parser.error(f"--scene: there is no {scene}")
    if min(options.samples, options.repeats, *options.bands) < 1:
        parser.error("samples, repeats and bands must be 1 or more")
    if options.case:
        given = json.loads(options.case)
        case = _Case(**{**given, "terms": tuple(given["terms"])})
        print(json.dumps(asdict(_measure(case, options))))
        return
    for scene in options.scene:
        _report(scene, _costs(scene, options), options)


def _cases(options: argparse.Namespace) -> list[_Case]:
    cases = [_Case("plain"), _Case(_FOG), _Case(_FOG_KEPT)]
    if any("lamps" in _TERMS[name] for name in options.terms):
        cases += [_Case(f"{name}, with lamps", terms=("lamps",)) for name in (_FOG, _FOG_KEPT)]
    return cases + [
        _Case(f"{bands} bands" + ("" if name == "alone" else f", {name}"), bands, _TERMS[name])
        for name in options.terms
        for bands in options.bands
    ]


def _costs(scene: str, options: argparse.Namespace) -> dict[_Case, _Cost]:
    found: dict[_Case, _Cost] = {}
    arguments = ["--scene", scene if scene == _MATERIALS else str(Path(scene).resolve())]
    arguments += ["--samples", str(options.samples)]
    arguments += ["--resolution", *map(str, options.resolution), "--case"]
    for case in _cases(options) * options.repeats:
        try:
            said = said_by_process(Path(__file__).stem, *arguments, json.dumps(asdict(case)))
        except KeyboardInterrupt:  # the table of what is known already
            break
        except InputError as error:
            print(f"{scene}, {case.name}: {error}", file=sys.stderr)
            continue
        cost = _Cost(**json.loads(said))
        print(f"{scene}, {case.name}: {cost}", file=sys.stderr, flush=True)
        found[case] = cost.least(found.get(case, cost))
    return found


def _report(scene: str, found: dict[_Case, _Cost], options: argparse.Namespace) -> None:
    """Print the table of a scene, and the targets."""
    by_name = {case.name: cost for case, cost in found.items()}
    if options.against not in by_name:
        sys.exit(f"{scene}: {options.against} could not be measured")
    fog, other = by_name[options.against], _FOG if options.against == _FOG_KEPT else _FOG_KEPT
    print(f"\n## {Path(scene).stem}\n\nRatios to *{options.against}*; CPU seconds.\n")
    heads = ("case", "sample", "ratio", f"to {other}", "first frame", "ratio", "before it",
             "other values", "peak MB", "ratio")  # fmt: skip
    rows = [
        (name, f"{cost.sample:.3f}", f"{cost.sample / fog.sample:.2f}",
         f"{cost.sample / by_name[other].sample:.2f}" if other in by_name else "-",
         f"{cost.first:.1f}", f"{cost.first / fog.first:.2f}", f"{cost.before:.1f}",
         f"{cost.change:.2f}", f"{cost.memory:.0f}", f"{cost.memory / fog.memory:.2f}")
        for name, cost in by_name.items()
    ]  # fmt: skip
    targets = [
        (f"{words} ≤ {limit:g}", name, f"{ratio:.2f}", "yes" if ratio <= limit else "**no**")
        for words, name, ratio, limit in _targets(found, fog)
    ]
    print(markdown(table(heads, rows)))
    print(f"\n{markdown(table(('target', 'case', 'measured', 'met'), targets))}")


def _targets(found: dict[_Case, _Cost], fog: _Cost) -> list[tuple[str, str, float, float]]:
    """Words, case, ratio and limit of each target."""
    waters = {case: cost for case, cost in found.items() if case.bands}
    targets = []
    for case, cost in waters.items():
        if "shafts" not in case.terms:  # they have a volume, which fog has not
            limit = _SAMPLE if case.terms else _PLAIN_SAMPLE
            targets.append(("sample", case.name, cost.sample / fog.sample, limit))
            targets.append(("first frame", case.name, cost.first / fog.first, _FIRST))
            targets.append(("memory", case.name, cost.memory / fog.memory, _MEMORY))
    for case, cost in waters.items():
        alike = [other for other in waters if other.terms == case.terms]
        few = min(alike, key=lambda other: other.bands)
        if case is max(alike, key=lambda other: other.bands) and case is not few:
            words = f"sample over that of {few.bands} bands"
            targets.append((words, case.name, cost.sample / waters[few].sample, _BANDS))
    return targets


def _measure(case: _Case, options: argparse.Namespace) -> _Cost:
    """Measure a case in this process."""
    path = options.scene[0]
    new_file()
    if path == _MATERIALS:
        _many_materials.build()
    else:
        bpy.ops.wm.open_mainfile(filepath=path, load_ui=False, use_scripts=False)
    scene = sized(options.resolution)
    if scene.camera is None:
        sys.exit(f"{path} has no camera")
    if "lamps" in case.terms:
        hang_lamps(_LAMPS)
    if not case.bands:
        _sun(scene)
    if case.name.startswith(_FOG):
        fog = add_kept_fog if case.name.startswith(_FOG_KEPT) else add_fog
        for material in bpy.data.materials:
            fog(material)
    times = _times(case, options.samples)
    return _Cost(*times, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)


def _times(case: _Case, samples: int) -> tuple[float, float, float, float]:
    began = time.process_time()
    rendering: list[float] = []

    def note(*_: object) -> None:
        rendering.append(time.process_time())

    bpy.app.handlers.render_pre.append(note)
    with drawing(case.settings) as drawn:
        drawn.picture(1)
        # Shafts are rendered once, small, before the first picture.
        before, first = rendering[0] - began, time.process_time() - rendering[0]
        few, many = (min(drawn.seconds(count) for _ in range(2)) for count in (1, 1 + samples))
        change = 0.0
        settings = case.settings
        if settings is not None:
            start = time.process_time()
            drawn.change(replace(settings, scattering_factor=2.0))
            change = time.process_time() - start
    return (many - few) / samples, first, before, change


def _sun(scene: bpy.types.Scene) -> None:
    """Light a scene that has no sun of its own."""
    if any(item.type == "LIGHT" and item.data.type == "SUN" for item in scene.objects):
        return
    lamp = bpy.data.lights.new("Sun", "SUN")
    lamp.energy, lamp.shadow_maximum_resolution = 3.0, _SHADOW
    scene.collection.objects.link(bpy.data.objects.new("Sun", lamp))
