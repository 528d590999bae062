"""What the lamps of a scene shine on, and how far into its water."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups.node_mathematics import MARK
from ...uw_spectral.lamps.lamp import Lamp, LitPart, LitParts
from ...uw_spectral.lamps.lamp_shadow import PART_SIDE, SIDE, shadow_directions, shadow_map
from ...uw_spectral.lamps.profile import LampProfile
from ...uw_spectral.lamps.virtual_point_lights import rays_of
from ...uw_spectral.table import Table
from .ray_casting import Meshes
from .scene_lamps import SceneLamps, SeenByLamp


@dataclass(frozen=True, eq=False)
class _Map:
    """What lies around a lamp."""

    seen: SeenByLamp
    shadow: Table


class LampShadowCache:
    """Maps around lamps, computed again where the lamp or an object has changed."""

    def __init__(self) -> None:
        self._objects = b""
        self._maps: dict[_Key, _Map] = {}
        self._meshes: Meshes | None = None

    def of(
        self, scene: bpy.types.Scene, found: SceneLamps, *, unchanged: bool = False
    ) -> SceneLamps:
        """Return lamps of a scene that know what they shine on at its current frame.

        Objects that may be taken for ``unchanged`` are not looked at, if each lamp is known.
        """
        shining = [lamp for lamp in found.lamps if np.any(lamp.intensity)]
        if not shining:
            self._maps = {}
            return replace(found, seen=(None,) * len(found.lamps))
        if not unchanged or any(_key(lamp) not in self._maps for lamp in shining):
            self._look(scene, shining)
        maps = [self._maps.get(_key(lamp)) for lamp in found.lamps]
        lamps = tuple(
            lamp if near is None or lamp.unblocked else replace(lamp, shadow=near.shadow)
            for lamp, near in zip(found.lamps, maps, strict=True)
        )
        return replace(found, lamps=lamps, seen=tuple(near and near.seen for near in maps))

    def of_virtual(self, found: SceneLamps) -> SceneLamps:
        """Return lamps that know how far the parts of what they light shine on other objects."""
        meshes = self._meshes
        if meshes is None:
            return found
        parts = [part for lamp in found.virtual for part in lamp.known_parts]
        shadows = iter(_around_parts(meshes, parts))

        def shadowed(lamp: Lamp) -> Lamp:
            parts = (replace(part, shadow=next(shadows)) for part in lamp.known_parts)
            return replace(lamp, parts=LitParts(parts))

        return replace(found, virtual=tuple(map(shadowed, found.virtual)))

    def _look(self, scene: bpy.types.Scene, shining: Iterable[Lamp]) -> None:
        """Bring the maps to what is there now."""
        without = [item for item in scene.objects if MARK in item]
        meshes = Meshes(bpy.context.evaluated_depsgraph_get(), without, "shadow")
        self._meshes, surfaces = meshes, _digest(meshes)
        known = self._maps if surfaces == self._objects else {}
        self._objects, self._maps = surfaces, {}
        for lamp in shining:
            key = _key(lamp)
            if key not in self._maps:
                self._maps[key] = known.get(key) or _around(meshes, lamp)


_LEVEL = 0.02  # of a ray that goes down, or over what it begins at, at least
_NO_COLOUR = 0.0, 0.0, 0.0
_OVER = 1e-3  # m, from where parts of objects are looked from

type _Key = tuple[LampProfile | float, ...]


def _key(lamp: Lamp) -> _Key:
    return (
        lamp.profile,
        float(lamp.radius),
        *(float(x) for x in (*lamp.position, *lamp.axis, *lamp.own_place)),
    )


def _digest(meshes: Meshes) -> bytes:
    """Digest of all surfaces in their places and colours."""
    digest = hashlib.blake2b(digest_size=16)
    numbers: dict[int, int] = {}
    for instance in meshes.instances:
        mesh = instance.mesh
        if id(mesh) not in numbers:
            numbers[id(mesh)] = len(numbers)
            for part in (mesh.vertices, mesh.triangles, mesh.parts):
                digest.update(np.ascontiguousarray(part).data)
        digest.update(numbers[id(mesh)].to_bytes(4, "little"))
        for part in (instance.place, instance.colours):
            digest.update(np.array(part, np.float64).tobytes())
    return digest.digest()


def _around(meshes: Meshes, lamp: Lamp) -> _Map:
    """Look around a lamp."""
    rays, radius = rays_of(lamp), float(lamp.radius)
    directions = rays.directions
    start, lit = np.full(len(directions), radius), np.ones(len(directions), bool)
    if lamp.shines_in:
        start, lit = _entered(meshes, lamp, directions)
    origin = np.asarray(lamp.position, np.float64) + directions * start[:, None]
    hits = meshes.first(origin, directions, np.where(lit, np.inf, 0.0))
    distances = start + [np.inf if hit is None else hit.distance for hit in hits]
    normals = np.array([(0.0, 0.0, 1.0) if hit is None else hit.normal for hit in hits])
    base = np.array([_NO_COLOUR if hit is None else hit.colour for hit in hits])
    shines = np.where(lit, distances, start)[: SIDE**2]
    return _Map(SeenByLamp(rays, distances, normals, base), shadow_map(shines))


def _around_parts(meshes: Meshes, parts: Sequence[LitPart]) -> list[Table]:
    """Look around parts of lit objects, from over them: their middles may be within."""
    directions = shadow_directions(PART_SIDE)
    rays, wanted = [], []
    for part in parts:
        axis = np.array(part.axis)
        origin = np.array(part.position) + (float(part.radius) + _OVER) * axis
        above = (directions @ axis > _LEVEL) & bool(np.any(part.fraction))
        wanted.append(above)
        rays += [(origin, u) for u in directions[above]]
    found = np.full((len(parts), len(directions)), np.inf)
    if rays:
        origins, ways = (np.array(x) for x in zip(*rays, strict=True))
        hits = meshes.first(origins, ways, np.full(len(rays), np.inf))
        found[np.array(wanted)] = [np.inf if hit is None else hit.distance for hit in hits]
    return [shadow_map(distances, PART_SIDE) for distances in found]


def _entered(
    meshes: Meshes, lamp: Lamp, directions: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Distances at which rays of a lamp in the air enter the water, and whether they do.

    Up to there they come straight from where the lamp is, if nothing is in their way.
    """
    falling = -directions[:, 2] > _LEVEL
    start = float(lamp.dry) / np.where(falling, -directions[:, 2], 1.0)
    places = np.asarray(lamp.position) + directions * start[:, None]
    way = places - np.asarray(lamp.own_place)
    length = np.linalg.norm(way, axis=-1)
    # What is as near as the lamp is large is its housing.
    near = np.minimum(float(lamp.radius) / length, 1.0)[:, None]
    clear = meshes.clear(
        np.asarray(lamp.own_place) + way * near,
        way / length[:, None],
        np.where(falling, length * (1.0 - near[:, 0]), 0.0),
    )
    return start, falling & clear
