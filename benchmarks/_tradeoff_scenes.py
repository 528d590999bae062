"""What :mod:`.tradeoff` measures: scenes, their waters and cameras, and the settings."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import bpy

from ..examples.scenes import build_scene
from ..quality.methods import REALTIME
from ..settings.scene_settings import SceneSettings
from . import grey_scene
from ._shade_scenes import matt

_COMMON = {"sun_zenith": 30.0}
_ABOVE = {"illuminant": "clear-sky", "irradiance": "above", "surface": "flat"}


@dataclass(frozen=True)
class Configuration:
    """One water, depth and camera of a scene.

    ``noise`` is a factor on the samples of the reference, ``extra`` whether
    the configuration is measured only if asked for.
    """

    name: str
    depth: float
    changes: Mapping[str, Any]
    noise: int = 1
    extra: bool = False


@dataclass(frozen=True)
class TestScene:
    """A scene, how to build it, and what to look at.

    ``build`` fills the empty file and returns the camera, at depth 0 where
    the scene ``moves`` with its configurations' depths. ``floor`` is the
    height of the camera above the added floor, 0 for none. ``settings`` names
    the :data:`SETTINGS` that matter here. Costs are measured where ``costed``.
    """

    name: str
    build: Callable[[int, int], bpy.types.Object]
    configurations: tuple[Configuration, ...]
    settings: tuple[str, ...]
    changes: Mapping[str, Any] = field(default_factory=dict)
    floor: float = grey_scene.ABOVE_FLOOR
    moves: bool = True
    costed: bool = False

    def scene_settings(self, configuration: Configuration, setting: Setting) -> SceneSettings:
        """Resolve the settings of a measurement."""
        floor = {"floor_depth": configuration.depth + self.floor} if self.floor else {}
        chosen = {**_COMMON, "floor_reflectance": str(grey_scene.FLOOR_REFLECTANCE), **floor}
        return SceneSettings(
            **{**chosen, **self.changes, **configuration.changes, **setting.changes}
        )


@dataclass(frozen=True)
class Setting:
    """A way to draw a scene.

    ``kind`` is ``reference``, ``realtime``, ``bands`` (EEVEE, three bands a
    pass), ``cycles``, ``paper`` or ``fog``; ``changes`` are settings of the
    scene; ``floor_term``, ``single`` (sunlight scattered once or at small angles) and
    ``blocking`` (what things keep of light that is scattered forward) leave out what real time
    has no setting for; ``froxels`` are the steps of the shafts, None for the usual ones.
    """

    name: str
    kind: str
    changes: Mapping[str, Any]
    floor_term: bool = True
    single: bool = True
    blocking: bool = True
    froxels: int | None = None
    first_only: bool = False


def _realtime(name: str, changes: Mapping[str, Any] = {}, **switches: int) -> Setting:
    return Setting(name, "realtime", {"bands": REALTIME.usual_bands, **changes}, **switches)


USUAL = "real time"
"""Real time as it comes, with as many bands as cost nothing."""
PLAIN = Setting("plain", "plain", {})
FOG = Setting("fog", "plain", {})
"""The scene without water, and with plain fog in its materials: costs only."""
REFERENCE = Setting("reference", "reference", {"bands": 24})
_EQUAL = [_realtime(f"real time, {n} bands", {"bands": n}) for n in (3, 8)]
_OPTIMISED = [
    _realtime("real time, 6 optimised bands", {"bands": 6, "band_placement": "optimised"})
]
_NO_SHADOWS = f"{USUAL}, no diffuse shadows"
_BLIND = f"{USUAL}, nothing blocks"
_NO_FLOOR_TERM = f"{USUAL}, no floor term"
_NO_SURFACE = f"{USUAL}, no surface"
_CALM = f"{USUAL}, flat surface"
_ELASTIC = f"{USUAL}, no inelastic light"
_LIGHT = (f"{USUAL}, no single scattering",)
_SHAFTS = [
    _realtime(f"{USUAL}, shafts", {"shafts": True}),
    *(
        _realtime(f"{USUAL}, shafts of {n} froxels", {"shafts": True}, froxels=n)
        for n in (64, 128, 256)
    ),
]
_TERMS = [
    *_SHAFTS,
    _realtime(_NO_SHADOWS, {"diffuse_shadows": False}),
    _realtime(_BLIND, blocking=False),
    _realtime(_LIGHT[0], single=False),
    _realtime(_NO_FLOOR_TERM, floor_term=False),
    _realtime(_NO_SURFACE, {"surface": "none"}),
    _realtime(_CALM, {"surface": "flat"}),
    _realtime(_ELASTIC, {"inelastic": ""}),
]
TERM_NAMES = frozenset(s.name for s in _TERMS)
_CYCLES = [
    Setting(f"Cycles, 8 bands, {n} samples", "cycles", {"bands": 8, "samples": n},
            first_only=n > 64)
    for n in (4, 16, 64, 256)
]  # fmt: skip
_OUTSIDE = [
    Setting("fog, RGB", "fog", {}),
    Setting("paper corrected, RGB", "paper", {}),
    Setting("paper corrected, 8 bands", "paper", {"bands": 8}),
    Setting("paper printed, 8 bands", "paper", {"bands": 8}),
]
_USUAL = _realtime(USUAL)
_PASSES = Setting("band passes, 8 bands", "bands", {"bands": 8})
_MANY_PASSES = Setting("band passes, 32 bands", "bands", {"bands": 32}, first_only=True)
_EVERYWHERE = (*_OUTSIDE, *_EQUAL, _USUAL, *_OPTIMISED, _PASSES, *_CYCLES)
SETTINGS = {s.name: s for s in (*_EVERYWHERE, _MANY_PASSES, *_TERMS)}
_ALWAYS = tuple(s.name for s in _EVERYWHERE)
_SHADOWS = (*(s.name for s in _SHAFTS), _NO_SHADOWS, _BLIND)


def _grey(width: int, height: int) -> bpy.types.Object:
    return grey_scene.build_scene(0.0, width, height)


def _camera(pitch: float, field_of_view: float) -> Callable[[int, int], bpy.types.Object]:
    """Nothing but a camera, tilted up from straight down, degrees."""

    def build(width: int, height: int) -> bpy.types.Object:
        camera = grey_scene.build_scene(0.0, width, height)
        bpy.data.objects.remove(bpy.data.objects["sphere"])
        camera.rotation_euler = (math.radians(pitch), 0.0, 0.0)
        camera.data.angle = math.radians(field_of_view)
        return camera

    return build


def _overhang(width: int, height: int) -> bpy.types.Object:
    """Add a slab over the sphere, whose shadow the camera looks through."""
    camera = grey_scene.build_scene(0.0, width, height)
    material = bpy.data.materials["grey"]
    x, near, far, low, high = 4.0, 1.0, 6.0, 0.6, 0.9
    corners = [(i, j, k) for k in (low, high) for i, j in
               ((-x, near), (x, near), (x, far), (-x, far))]  # fmt: skip
    faces = [(3, 2, 1, 0), (4, 5, 6, 7)]
    faces += [(i, (i + 1) % 4, (i + 1) % 4 + 4, i + 4) for i in range(4)]
    mesh = bpy.data.meshes.new("slab")
    mesh.from_pydata(corners, [], faces)
    mesh.materials.append(material)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("slab", mesh))
    return camera


def _things(width: int, height: int) -> bpy.types.Object:
    """Put cubes, black, grey and white, in the place of the sphere."""
    camera = _camera(math.degrees(grey_scene.PITCH), 70.0)(width, height)
    for name, x, grey in (("black", 0.0, 0.0), ("grey", -1.9, 0.2), ("white", 1.9, 0.8)):
        bpy.ops.mesh.primitive_cube_add(size=1.2, location=(x, 3.9, -1.0))
        cube = bpy.context.object
        assert cube is not None
        cube.name = name
        cube.data.materials.append(matt((grey, grey, grey)))
    return camera


def _example(name: str) -> Callable[[int, int], bpy.types.Object]:
    """One of the example scenes, draft."""

    def build(width: int, height: int) -> bpy.types.Object:
        build_scene(name, 1, "draft")
        scene = bpy.context.scene
        scene.render.resolution_x, scene.render.resolution_y = width, height
        scene.render.resolution_percentage = 100
        scene.cycles.pixel_filter_type = "BOX"
        return scene.camera

    return build


_NOISE = {"I": 1, "IB": 2, "II": 4, "3C": 16}


def _water(name: str, depth: float, sensor: str, *, extra: bool = False) -> Configuration:
    title = f"{name}, {depth:g} m, {sensor}"
    changes = {"water": f"jerlov:{name}", "sensor": sensor}
    return Configuration(title, depth, changes, _NOISE[name], extra)


SCENES = (
    TestScene(
        "grey", _grey,
        (_water("IB", 5.0, "cie1931"), _water("II", 3.0, "Nikon D7000"),
         _water("I", 9.0, "ARRI D21", extra=True)),
        (*_ALWAYS, _MANY_PASSES.name, *_SHADOWS, *_LIGHT, _NO_FLOOR_TERM),
        costed=True,
    ),
    TestScene(
        "up", _camera(150.0, 90.0),
        (_water("IB", 4.0, "cie1931"), _water("II", 3.0, "ARRI D21", extra=True),
         _water("I", 10.0, "Nikon D7000", extra=True)),
        (*_ALWAYS, *_LIGHT, _NO_SURFACE),
        _ABOVE,
    ),
    TestScene(
        "blue", _camera(90.0, 70.0),
        (_water("I", 5.0, "ARRI D21"), _water("IB", 10.0, "cie1931", extra=True),
         _water("II", 10.0, "Nikon D7000", extra=True)),
        (*_ALWAYS, *_LIGHT), floor=0.0,
    ),
    TestScene(
        "overhang", _overhang,
        (_water("IB", 5.0, "Nikon D7000"), _water("II", 3.0, "cie1931", extra=True),
         _water("3C", 3.0, "ARRI D21", extra=True)),
        (*_ALWAYS, *_SHADOWS, _NO_FLOOR_TERM),
    ),
    TestScene(
        "things", _things,
        (_water("IB", 5.0, "cie1931"), _water("II", 3.0, "Nikon D7000", extra=True)),
        (*_ALWAYS, *_SHADOWS),
    ),
    TestScene(
        "reef", _example("reef"),
        (_water("IB", 4.95, "ARRI D21"), _water("II", 4.95, "Nikon D7000", extra=True),
         _water("I", 4.95, "cie1931", extra=True)),
        (*_ALWAYS, _NO_SHADOWS, _BLIND),
        {**_ABOVE, "sun_azimuth": 60.0, "floor_depth": 7.0}, floor=0.0, moves=False,
    ),
    TestScene(
        "cave", _example("cave"), (_water("IB", 11.2, "cie1931"),),
        (*_ALWAYS, _NO_SHADOWS, _BLIND),
        {**_ABOVE, "sky": "clear", "sun_azimuth": 60.0}, floor=0.0, moves=False,
    ),
    TestScene(
        "caustics", _grey,
        (Configuration("I, 2 m, waves", 2.0, {"water": "jerlov:I", "surface": "waves"}, 2),),
        (USUAL, _CALM),
        _ABOVE, costed=True,
    ),
    TestScene(
        "inelastic", _camera(90.0, 70.0),
        (Configuration(
            "bio:chl=1,cdom=0.1, 15 m, all", 15.0,
            {"water": "bio:chl=1,cdom=0.1", "inelastic": "all"}, 2),),
        (USUAL, _ELASTIC),
        floor=0.0,
    ),
)  # fmt: skip
