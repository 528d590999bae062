"""Objects in the water: how bright EEVEE draws them, over Cycles.

Balls, cubes and plates, black, grey and white, seen level, from below and from above. Of each
water, angular radius and distance one is drawn; what varies beside takes turns. A black object
shows nothing but the water before it, and what is scattered forward past it or blocked by it.
"""

from __future__ import annotations

import itertools
import math
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from ._places import HEIGHT, WIDTH, Place
from ._rays import view_rays
from ._scenery import look_at, matt
from .runner import Ask, Page, Target, spread, table

_WATERS, _ANGLES, _DISTANCES = ("I", "IB", "II", "3C"), (1.0, 3.0, 10.0, 30.0), (2.0, 4.0, 8.0)
_SHAPES = ("ball", "cube", "plate")
_GREYS = {"black": 0.0, "grey": 0.2, "white": 0.8}
_VIEWS = {"level": (0.0, 1.0, 0.0), "up": (0.0, 0.05, 1.0), "down": (0.0, 0.05, -1.0)}
_DEPTHS = {"level": 5.0, "up": 13.0, "down": 3.0}
_FLOORS = {"level": 14.0, "up": 14.0, "down": 18.0}
_FLOOR = 0.3
_INNER = 0.8  # of the object's angular radius


@dataclass(frozen=True)
class LitObject:
    """What is drawn, and from where.

    ``angle`` is its angular radius in degrees, of cubes that of the face that is seen;
    ``distance`` is that of its middle, m.
    """

    water: str
    angle: float
    distance: float
    shape: str
    grey: str
    view: str

    def __str__(self) -> str:
        where = f"{self.water} {self.angle:g}° {self.distance:g} m"
        return f"{where} {self.shape} {self.grey} {self.view}"

    @property
    def half(self) -> float:
        """Half of its size, m."""
        tangent = math.tan(math.radians(self.angle))
        return self.distance * {
            "ball": math.sin(math.radians(self.angle)),
            "cube": tangent / (1.0 + tangent),
            "plate": tangent,
        }[self.shape]  # fmt: skip

    @property
    def towards(self) -> NDArray[np.float64]:
        """Direction from the camera, z up."""
        way = np.array(_VIEWS[self.view])
        return way / np.linalg.norm(way)

    @property
    def depth(self) -> float:
        """Of the camera, m."""
        return _DEPTHS[self.view]

    def place(self, samples: int) -> Place:
        """Return where it stands."""

        def build() -> bpy.types.Object:
            at = np.array([0.0, 0.0, -self.depth])
            camera = look_at(at, at + self.towards, self._width)
            self._add(camera.matrix_world.to_3x3().to_4x4(), at + self.distance * self.towards)
            return camera

        floor = {"floor_depth": _FLOORS[self.view], "floor_reflectance": str(_FLOOR)}
        return Place(str(self), build, self.water, samples=samples, settings=floor)

    def inner(self) -> NDArray[np.bool_]:
        """Pixels well inside it, shape (h, w)."""
        x, y, z = np.moveaxis(view_rays(WIDTH, HEIGHT, self._width, 0.0), -1, 0)
        return np.hypot(x, z) / y < _INNER * math.tan(math.radians(self.angle))

    @property
    def _width(self) -> float:
        return min(5.0 * math.radians(self.angle), math.radians(100.0))

    def _add(self, turned: Matrix, at: NDArray[np.float64]) -> None:
        if self.shape == "ball":
            bpy.ops.mesh.primitive_uv_sphere_add(radius=self.half, location=at)
            bpy.ops.object.shade_smooth()
        else:
            thick = 1.0 if self.shape == "cube" else 0.01
            bpy.ops.mesh.primitive_cube_add(size=2.0 * self.half)
            size = Matrix.Diagonal((1.0, 1.0, thick, 1.0))
            bpy.context.object.matrix_world = Matrix.Translation(at.tolist()) @ turned @ size
        bpy.context.object.data.materials.append(matt([_GREYS[self.grey]] * 3))


def _objects() -> Iterator[LitObject]:
    """Return each of water, angle and distance, with what takes turns."""
    for (i, water), (j, angle), (k, distance) in itertools.product(
        enumerate(_WATERS), enumerate(_ANGLES), enumerate(_DISTANCES)
    ):
        yield LitObject(
            water, angle, distance,
            _SHAPES[(i + j + k) % 3], list(_GREYS)[(i + 2 * j) % 3],
            list(_VIEWS)[(2 * i + j // 2 + k) % 3],
        )  # fmt: skip


def measure(ask: Ask) -> Mapping[str, object]:
    """Draw the objects: |EEVEE over Cycles - 1| of the pixels well inside them, by band."""
    groups: dict[tuple[str, str], list[NDArray[np.float64]]] = defaultdict(list)
    objects = list(_objects())[: ask.objects]
    for item in objects:
        place, inner = item.place(ask.samples), item.inner()
        camera = place.open()
        cycles = ask.kept(str(item), lambda p=place, c=camera: p.by_cycles(c, [1]))[0]
        eevee = place.by_eevee(camera)
        off = np.abs(eevee[inner].mean(axis=0) / cycles[inner].mean(axis=0) - 1.0)
        groups["all", ""].append(off)
        for name in ("view", "water", "angle", "distance"):
            groups[name, str(getattr(item, name))].append(off)
    found = {key: 100 * np.concatenate(off) for key, off in sorted(groups.items())}
    rows = [[*key, *spread(off, ".1f").split("/")] for key, off in found.items()]
    median, most = np.quantile(found["all", ""], (0.5, 0.95))
    return {"rows": table(("objects", "", "median, %", "95 %", "worst"), rows),
            "count": len(objects), "median": float(median), "most": float(most)}  # fmt: skip


PAGE = Page(
    "Objects in the light",
    """
{count} balls, cubes and plates (albedo 0, .2, .8) in Jerlov waters, sun at 30°, clear sky, three
bands: the light of the pixels well inside them, EEVEE over Cycles of {samples} samples. Missed for
objects of 30° and for those seen from below.

{rows}

## What differs
- Objects of 30° seen from below keep the sun off the camera: within its shadow, which has the
  grid's cells for an edge, a few hundredths of the light around the sun are left. Blue and green
  are 1.0 to 1.4 × too bright there; red, of which a thousandth of the blue is there, 1.5 to 6 ×.
- A large black plate 8 m away in 3C is up to 1.4 × too bright: no grid is made for it.
""",
    (Target("median, %", "median", 3.0), Target("95 %, %", "most", 15.0)),
    {"samples": 192, "objects": 99},
)
