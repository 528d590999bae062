"""What a scene requires: looks at it through its camera and lets the optics decide.

The scene's own objects are looked at as they are in the viewport. Textures are
taken for their material's plain colour, lamps and glass for nothing special.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from ..uw_spectral.combinations import FLOOR, BandChoice, Effort
from ..uw_spectral.readouts import REFERENCE_BANDS
from ..uw_spectral.requirements import Requirements, decide
from ..uw_spectral.seen_points import SHAFTS, Optics, SeenPoints
from ..uw_spectral.water_column import WaterColumn
from . import caustics, shared_plans
from .cameras import camera_depth
from .realtime import MOST_BANDS
from .render_plan import RenderPlan
from .settings import EQUAL, NO_FLOOR, OPTIMISED, REALTIME, Job, SceneSettings
from .water_body import COLLECTION

OPTIMISED_COUNTS = (3, 6, 9)
BAND_COUNTS = (3, 4, 5, 6, 7, 8, 9, 10, 12, 15, 16, 18, 21, 24, 27, 32)

_WIDTH, _HEIGHT = 32, 18  # rays of all frames together
_FRAMES = 5
_STEPS = 6  # looks for shadow along a ray
_REACH = 4.0  # optical depths of the clearest band that are looked at
_FARTHEST = 500.0
_OFF_SURFACE = 1e-3
_TRANSPARENT_LAYERS = 8
_WAVE_RESOLUTION = 64
_PLAIN = (0.5, 0.5, 0.5)


@dataclass(frozen=True, eq=False)
class Choice:
    """What was decided, and the settings that bring it about."""

    required: Requirements
    settings: dict[str, Any]
    shafts: bool

    @property
    def lines(self) -> list[str]:
        """Each decision in a line."""
        return [str(decision) for decision in self.required.decisions]


def choose(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    settings_now: Callable[[], SceneSettings],
    job: Job,
    *,
    target: float,
    budget: float | None = None,
    keep: frozenset[str] = frozenset(),
) -> Choice:
    """Decide what a job needs.

    Parameters
    ----------
    scene : Scene
        Its current frame moves and comes back.
    camera : Object
    settings_now : callable
        Returns the settings at the scene's current frame; those of the
        first frame that is looked at count.
    job : Job
        Engine, mode and frames.
    target : float
        Mean ΔE2000.
    budget : float, optional
        CPU time in s.
    keep : set of str
        Settings that must stay as they are.

    Returns
    -------
    Choice

    Raises
    ------
    InputError
        If the settings cannot be used or the camera is not under water.
    """
    stays = set(keep)
    if job.shafts:
        stays.add(SHAFTS)
    if "floor_depth" in keep:
        stays.add(FLOOR)
    before = scene.frame_current
    frames = _sampled(job.frames or (before,))
    views: list[SeenPoints] = []
    try:
        scene.frame_set(frames[0])
        chosen = settings_now()
        with shared_plans.quiet():
            plan = shared_plans.plan_of(chosen)
            everything = _everything(scene, chosen)
        for frame in frames:
            scene.frame_set(frame)
            camera_depth(camera, plan.column.floor_depth)
            views.append(look(scene, camera, plan.column, share=1 / len(frames)))
    finally:
        scene.frame_set(before)
    shaft_end = 0.0
    if job.engine == "eevee":
        drawn = plan.realtime(scene, views[0].depth, np.ones((3, len(plan.bands))), shafts=True)
        shaft_end = drawn.shafts.end
    method = job.mode if job.engine == "eevee" else "cycles"
    per_pass = plan.cycles.bands_per_pass if method == "cycles" else 3
    render = scene.render
    pixels = render.resolution_x * render.resolution_y * (render.resolution_percentage / 100) ** 2
    effort = Effort(
        method,
        per_pass,
        pixels / 1e6,
        max(len(job.frames), 1),
        chosen.samples if "samples" in keep else None,
        shaft_end,
    )
    with shared_plans.quiet():
        required = decide(
            views,
            everything,
            _choices(chosen, method, keep),
            target=target,
            budget=budget,
            effort=effort,
            keep=stays,
            denoise=job.denoise,
        )
    shafts = required.options.shafts and method != "cycles"
    return Choice(required, _changes(chosen, required, method, keep), shafts)


def look(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    column: WaterColumn,
    *,
    share: float = 1.0,
) -> SeenPoints:
    """Return what a camera sees at the current frame.

    Parameters
    ----------
    scene : Scene
    camera : Object
        Perspective, orthographic or panoramic, under water.
    column : WaterColumn
        Gives the sun, the floor and how far to look for shadows.
    share : float
        Of the usual number of rays.
    """
    depsgraph = bpy.context.evaluated_depsgraph_get()
    reach = min(_REACH / max(float(column.attenuation.min()), 1e-6), _FARTHEST)
    to_sun = -Vector(column.sun_direction)
    rows = []
    for origin, direction in camera_rays(scene, camera.evaluated_get(depsgraph), share):
        to_surface = -origin.z / direction.z if direction.z > 0 else math.inf
        found = _cast(scene, depsgraph, origin, direction, to_surface)
        distance, normal, colour = found or (math.inf, -direction, _PLAIN)
        above_floor = origin.z + column.floor_depth
        to_floor = -above_floor / direction.z if direction.z < 0 else math.inf
        on_floor = to_floor < distance
        if on_floor:
            distance, normal = to_floor, Vector((0.0, 0.0, 1.0))
        end = min(distance, to_surface, reach)
        stations = [origin + direction * (end * (k + 0.5) / _STEPS) for k in range(_STEPS)]
        lit = [_sees_sun(scene, depsgraph, point, to_sun) for point in stations]
        sunlit = True
        if math.isfinite(distance):
            point = origin + direction * distance + normal * _OFF_SURFACE
            sunlit = normal.dot(to_sun) > 0 and _sees_sun(scene, depsgraph, point, to_sun)
        rows.append((origin, direction, distance, normal, colour, sunlit, lit, on_floor))
    origin, direction, distance, normal, colour, sunlit, lit, on_floor = (
        np.array([tuple(v) if isinstance(v, Vector) else v for v in values])
        for values in zip(*rows, strict=True)
    )
    return SeenPoints(origin, direction, distance, normal, colour, sunlit, lit, reach, on_floor)


def camera_rays(
    scene: bpy.types.Scene, camera: bpy.types.Object, share: float = 1.0
) -> Iterator[tuple[Vector, Vector]]:
    """Yield origin and unit direction of rays that are spread over a picture.

    A panorama's are spread over the sphere, or over the cone of a fisheye.
    """
    width, height = (max(round(side * math.sqrt(share)), 2) for side in (_WIDTH, _HEIGHT))
    place = camera.matrix_world
    turn = place.to_quaternion()
    data = camera.data
    if data.type == "PANO":
        for direction in _sphere(width * height, _panorama_angle(data)):
            yield place.translation.copy(), turn @ direction
        return
    corner, _, opposite, left = (
        Vector(c) for c in data.view_frame(scene=scene)
    )  # right top, right bottom, left bottom, left top
    for row in range(height):
        for column in range(width):
            across, down = (column + 0.5) / width, (row + 0.5) / height
            at = left + (corner - left) * across + (opposite - left) * down
            if data.type == "ORTHO":
                yield place @ Vector((at.x, at.y, 0.0)), turn @ Vector((0.0, 0.0, -1.0))
            else:
                yield place.translation.copy(), turn @ at.normalized()


def _panorama_angle(data: bpy.types.Camera) -> float:
    """Half the angle of the cone that a panorama shows."""
    if data.panorama_type.startswith("FISHEYE_EQUI"):
        return min(data.fisheye_fov / 2, math.pi)
    return math.pi


def _sphere(count: int, half_angle: float) -> Iterator[Vector]:
    """Directions spread evenly over a cone about -z (a spiral by the golden angle)."""
    golden = math.pi * (3 - math.sqrt(5))
    for i in range(count):
        z = 1 - (1 - math.cos(half_angle)) * (i + 0.5) / count
        side = math.sqrt(max(1 - z * z, 0.0))
        yield Vector((side * math.cos(golden * i), side * math.sin(golden * i), -z))


def _cast(
    scene: bpy.types.Scene,
    depsgraph: bpy.types.Depsgraph,
    origin: Vector,
    direction: Vector,
    farthest: float = math.inf,
) -> tuple[float, Vector, NDArray] | None:
    """Distance, normal towards the ray and colour of the first thing that is not water."""
    start, gone = origin, 0.0
    for _ in range(_TRANSPARENT_LAYERS):
        hit, point, normal, face, item, _ = scene.ray_cast(depsgraph, start, direction)
        if not hit:
            return None
        gone += (point - start).length
        if gone >= farthest:
            return None
        if not _is_water(item):
            facing = normal if normal.dot(direction) < 0 else -normal
            return gone, facing, _colour(item.evaluated_get(depsgraph), face)
        start, gone = point + direction * _OFF_SURFACE, gone + _OFF_SURFACE
    return None


def _sees_sun(
    scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph, point: Vector, to_sun: Vector
) -> bool:
    to_surface = max(-point.z, 0.0) / max(to_sun.z, 1e-3)
    return _cast(scene, depsgraph, point, to_sun, to_surface) is None


def _is_water(item: bpy.types.Object) -> bool:
    return any(c.name.startswith(COLLECTION) for c in item.original.users_collection)


def _colour(item: bpy.types.Object, face: int) -> tuple[float, ...]:
    """Plain colour of a face."""
    slots = item.material_slots
    if not slots:
        return _PLAIN
    index = 0
    if item.type == "MESH" and 0 <= face < len(item.data.polygons):
        index = min(item.data.polygons[face].material_index, len(slots) - 1)
    material = slots[index].material
    if material is None:
        return _PLAIN
    for node in material.node_tree.nodes if material.node_tree else ():
        socket = node.inputs.get("Base Color") or (
            node.inputs.get("Color") if node.type.startswith("BSDF") else None
        )
        if socket is not None and not socket.is_linked:
            return tuple(min(max(c, 0.0), 1.0) for c in socket.default_value[:3])
    return tuple(material.diffuse_color[:3])


def _sampled(frames: Sequence[int]) -> list[int]:
    """First, middle, last and a few between."""
    chosen = np.linspace(0, len(frames) - 1, min(_FRAMES, len(frames))).round().astype(int)
    return [frames[i] for i in chosen]


def _optics(plan: RenderPlan, depth: float) -> Optics:
    return Optics(plan.viewpoint(depth), plan.inelastic)


def _everything(scene: bpy.types.Scene, chosen: SceneSettings) -> Optics:
    """Everything the settings ask for, on many bands."""
    many = replace(chosen, bands=REFERENCE_BANDS, wavelengths="", band_placement=EQUAL)
    plan = shared_plans.plan_of(many)
    found = _optics(plan, 0.0)
    if chosen.surface != caustics.WAVES:
        return found
    coarse = replace(chosen, wave_resolution=min(chosen.wave_resolution, _WAVE_RESOLUTION))
    return replace(found, waves=caustics.patterns(scene, replace(plan, settings=coarse)))


def _choices(chosen: SceneSettings, method: str, keep: frozenset[str]) -> list[BandChoice]:
    """Bands to choose from; those of the settings alone if they must stay."""
    # Only the elastic light of a calm sea is compared.
    plain = replace(
        chosen,
        inelastic="",
        surface="flat" if chosen.surface == caustics.WAVES else chosen.surface,
    )
    if keep & {"bands", "wavelengths", "range_start", "range_end"}:
        bands = {}
        plan = shared_plans.plan_of(plain)
        return [BandChoice(f"{len(plan.bands)}, as given", _optics(plan, 0.0), bands)]
    most = MOST_BANDS if method == REALTIME else BAND_COUNTS[-1]
    found = []
    for placement, counts in ((EQUAL, BAND_COUNTS), (OPTIMISED, OPTIMISED_COUNTS)):
        if "band_placement" in keep and placement != chosen.band_placement:
            continue
        for count in (n for n in counts if n <= most):
            changes = {"bands": count, "wavelengths": "", "band_placement": placement}
            plan = shared_plans.plan_of(replace(plain, **changes))
            found.append(BandChoice(f"{count} {placement}", _optics(plan, 0.0), changes))
    return found


def _changes(
    chosen: SceneSettings, required: Requirements, method: str, keep: frozenset[str]
) -> dict[str, Any]:
    """Settings that differ from the ones that were given."""
    options = required.options
    wanted = {
        **required.bands.settings,
        "surface": options.surface,
        "samples": required.samples,
    }
    if method == "cycles":
        wanted["bounces"] = required.bounces
    else:
        wanted["aureole"] = "on" if options.aureole else "off"
    if not options.inelastic:
        wanted["inelastic"] = ""
    if not required.floor:
        wanted["floor_depth"] = NO_FLOOR
    return {
        name: value
        for name, value in wanted.items()
        if name not in keep and getattr(chosen, name) != value
    }
