"""How far the lamps of a scene shine into its water before they meet a thing."""

from __future__ import annotations

import hashlib
from dataclasses import replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ..node_groups.node_mathematics import MARK
from ..uw_spectral.lamps.angular_spread import Grid
from ..uw_spectral.lamps.lamp import Lamp
from ..uw_spectral.lamps.lamp_shadow import shadow_directions, shadow_map
from .lamps import SceneLamps
from .ray_casting import Meshes


class KeptLampShadows:
    """Maps of the shadows of lamps, computed again where the lamp or a thing has moved."""

    def __init__(self) -> None:
        self._things = b""
        self._maps: dict[tuple[float, ...], Grid] = {}

    def of(self, scene: bpy.types.Scene, found: SceneLamps) -> SceneLamps:
        """Return lamps of a scene that know how far they shine at its current frame."""
        shining = [lamp for lamp in found.lamps if np.any(lamp.intensity)]
        if not shining:
            self._maps = {}
            return found
        without = [item for item in scene.objects if MARK in item or not item.visible_shadow]
        meshes = Meshes(bpy.context.evaluated_depsgraph_get(), without)
        things = _digest(meshes)
        known = self._maps if things == self._things else {}
        self._things, self._maps = things, {}
        for lamp in shining:
            key = _key(lamp)
            if key not in self._maps:
                self._maps[key] = known.get(key) or shadow_map(_clear(meshes, lamp))
        lamps = tuple(replace(lamp, shadow=self._maps.get(_key(lamp))) for lamp in found.lamps)
        return replace(found, lamps=lamps)


def _key(lamp: Lamp) -> tuple[float, ...]:
    return (*(float(x) for x in lamp.position), float(lamp.radius))


def _digest(meshes: Meshes) -> bytes:
    """Digest of all surfaces in their places."""
    digest = hashlib.blake2b(digest_size=16)
    numbers: dict[int, int] = {}
    for instance in meshes.instances:
        mesh = instance.mesh
        if id(mesh) not in numbers:
            numbers[id(mesh)] = len(numbers)
            for part in (mesh.vertices, mesh.triangles):
                digest.update(np.ascontiguousarray(part).data)
        digest.update(numbers[id(mesh)].to_bytes(4, "little"))
        digest.update(np.array(instance.place, np.float64).tobytes())
    return digest.digest()


def _clear(meshes: Meshes, lamp: Lamp) -> NDArray[np.float64]:
    """Distances in m to the first things, infinite without."""
    directions, radius = shadow_directions(), float(lamp.radius)
    origin = np.asarray(lamp.position, np.float64) + directions * radius
    hits = meshes.first(origin, directions, np.full(len(directions), np.inf))
    return np.array([np.inf if hit is None else hit.distance + radius for hit in hits])
