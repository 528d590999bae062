"""What a scene requires: looks at it through its camera and lets the optics decide.

The scene's own objects are looked at as they are in the viewport. Textures are
taken for their material's plain colour, lamps and glass for nothing special.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..quality.combinations import RAYS, BandChoice, Workload
from ..quality.picture import Optics
from ..quality.requirements import Requirements, decide
from ..quality.seen_points import SeenPoints, cone_directions, openness
from ..quality.terms import TERMS, settings_of, switched_on
from ..uw_spectral.errors import InputError
from ..uw_spectral.imaging.description import REFERENCE_BANDS
from ..uw_spectral.transfer.light_cone import LightCone, light_cone
from ..uw_spectral.transfer.water_column import WaterColumn
from . import cameras, moving_surface, scene_water
from .cameras import camera_depth
from .mean_colours import mean_colour
from .ray_casting import Meshes
from .render_plan import RenderPlan, forget_files, plan_of, quiet
from .settings import EQUAL, OPTIMISED, REALTIME, SOLVED, Job, SceneSettings

OPTIMISED_COUNTS = (3, 6, 9)
BAND_COUNTS = (3, 4, 5, 6, 7, 8, 9, 10, 12, 15, 16, 18, 21, 24, 27, 32)

_WIDTH, _HEIGHT = 48, 27  # rays of a frame; a few of them are looked at more closely
_FRAMES = 5
_STEPS = 6  # looks for shadow along a ray
_SKYWARD = 16  # looks for shadow of the light from above
_REACH = 4.0  # optical depths of the clearest band that are looked at
_FARTHEST = 500.0
_OFF_SURFACE = 1e-3
_WAVE_RESOLUTION = 64
_PLAIN = (0.5, 0.5, 0.5)
_WITHOUT_THINGS = {"diffuse_shadows": False, "scene_floor": False}


@dataclass(frozen=True, eq=False)
class Choice:
    """What was decided, and the settings that bring it about."""

    required: Requirements
    settings: dict[str, Any]

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
    others: Sequence[bpy.types.Object] = (),
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
        Mean ΔE2000 of what the camera sees: objects, floor and open water count equally.
    budget : float, optional
        CPU time in s.
    keep : set of str
        Settings that must stay as they are.
    others : sequence of Object
        Further cameras, for which the choice is made too.

    Returns
    -------
    Choice

    Raises
    ------
    InputError
        If the settings cannot be used, the camera is not under water, or it is night.
    """
    forget_files()
    before = scene.frame_current
    frames = _sampled(job.frames or (before,))
    views: list[SeenPoints] = []
    try:
        scene.frame_set(frames[0])
        chosen = settings_now()
        if chosen.sunlight == 0:
            raise InputError(
                "Auto weighs the light of sun and sky, and --sunlight is 0; choose the settings of "
                "a night by hand (Quality), or choose them by day"
            )
        with quiet():
            plan = plan_of(chosen)
            everything = _everything(scene, chosen, job.engine)
        for frame in frames:
            scene.frame_set(frame)
            for eye in (camera, *others):
                depth = camera_depth(eye, plan.column.floor_depth)
                if depth == 0.0:
                    raise InputError(
                        f"camera {eye.name!r} is {eye.matrix_world.translation.z:g} m above the "
                        "water, and Auto weighs views in it; choose the settings by hand (Quality)"
                    )
                cone = light_cone(everything.view.field, depth, plan.column.sun_direction)
                rays = RAYS // (len(frames) * (1 + len(others)))
                views.append(trace_view(scene, eye, plan.column, cone, rays=rays))
    finally:
        scene.frame_set(before)
    shaft_end = 0.0
    if job.engine == "eevee":
        shaded = replace(plan, settings=replace(chosen, shafts=True, **_WITHOUT_THINGS))
        drawn = shaded.realtime(scene, views[0].depth, np.ones((3, len(plan.bands))))
        shaft_end = drawn.shafts.end if drawn.shafts is not None else 0.0
    method = job.mode if job.engine == "eevee" else "cycles"
    render = scene.render
    pixels = render.resolution_x * render.resolution_y * (render.resolution_percentage / 100) ** 2
    workload = Workload(
        method,
        pixels / 1e6,
        max(len(job.frames), 1),
        chosen.samples if "samples" in keep else None,
        shaft_end,
    )
    given = {term.name for term in TERMS if term.setting in keep and job.engine in term.engines}
    on = given & switched_on(vars(chosen))
    with quiet():
        required = decide(
            views,
            everything,
            _choices(chosen, job.engine, method, keep),
            target=target,
            budget=budget,
            workload=workload,
            keep=on,
            off=given - on,
            denoise=job.denoise,
        )
    return Choice(required, _changes(chosen, required, job.engine, keep))


def trace_view(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    column: WaterColumn,
    cone: LightCone,
    *,
    rays: int = RAYS,
    grid: tuple[int, int] = (_WIDTH, _HEIGHT),
    skyward: int = _SKYWARD,
    steps: int = _STEPS,
) -> SeenPoints:
    """Return what a camera sees at the current frame.

    Parameters
    ----------
    scene : Scene
    camera : Object
        Perspective, orthographic or panoramic, under water.
    column : WaterColumn
        Gives the sun, the floor and how far to look for shadows.
    cone : LightCone
        Light from above, other than the direct sun.
    rays : int
        About how many to return, out of a finer picture.
    grid : (int, int)
        Rays of that picture, across and down.
    skyward : int
        Rays towards the light from above, from each place.
    steps : int
        Looks for shadow along a ray.
    """
    depsgraph = bpy.context.evaluated_depsgraph_get()
    meshes = Meshes(depsgraph, scene_water.objects(scene))
    rays_of_view = cameras.ray_arrays(scene, camera.evaluated_get(depsgraph), *grid)
    first = _first_seen(*rays_of_view, column, meshes)
    return _with_shadows(first.subsample(rays), column, cone, meshes, skyward, steps)


def trace_rays(
    scene: bpy.types.Scene,
    origin: NDArray[np.float64],
    direction: NDArray[np.float64],
    column: WaterColumn,
    cone: LightCone,
    *,
    skyward: int = _SKYWARD,
) -> SeenPoints:
    """Return what rays in the water meet at the current frame.

    Parameters
    ----------
    scene : Scene
    origin, direction : array, shape (m, 3)
        Places under water or on its surface, m; unit directions.
    column, cone, skyward
        As of :func:`trace_view`.
    """
    meshes = Meshes(bpy.context.evaluated_depsgraph_get(), scene_water.objects(scene))
    first = _first_seen(origin, direction, column, meshes)
    return _with_shadows(first, column, cone, meshes, skyward, _STEPS)


def _with_shadows(
    seen: SeenPoints,
    column: WaterColumn,
    cone: LightCone,
    meshes: Meshes,
    skyward: int,
    steps: int,
) -> SeenPoints:
    """Look for the shadows of what is seen."""
    end = np.minimum(seen.reached, _to_surface(seen.origin, seen.direction))
    along = end[:, None] * (np.arange(steps) + 0.5) / steps
    stations = seen.origin[:, None] + seen.direction[:, None] * along[..., None]
    to_sun = -np.asarray(column.sun_direction, dtype=np.float64)
    on_surface = np.isfinite(seen.distance)
    points = seen.origin + seen.direction * np.where(on_surface, seen.distance, 0.0)[:, None]
    points = points[on_surface] + seen.normal[on_surface] * _OFF_SURFACE
    upward = cone_directions(cone, skyward)
    sunlit, share = np.ones(len(seen), dtype=bool), np.ones(len(seen))
    facing = seen.normal[on_surface] @ to_sun > 0
    sunlit[on_surface] = facing & _clear(meshes, points[:, None], to_sun)[:, 0]
    share[on_surface] = openness(
        seen.normal[on_surface], upward, _clear(meshes, points[:, None], upward)
    )
    return replace(
        seen,
        sunlit=sunlit,
        path_sunlit=_clear(meshes, stations, to_sun),
        openness=share,
    )


def _first_seen(
    origin: NDArray[np.float64],
    direction: NDArray[np.float64],
    column: WaterColumn,
    meshes: Meshes,
) -> SeenPoints:
    """What rays meet, its shadows not looked for yet."""
    count = len(origin)
    hits = meshes.first(origin, direction, _to_surface(origin, direction))
    distance = np.array([hit.distance if hit else math.inf for hit in hits])
    normal = np.array([hit.normal if hit else -w for hit, w in zip(hits, direction, strict=True)])
    colour = np.array([mean_colour(hit.material) if hit else _PLAIN for hit in hits])
    to_floor = _along(origin[:, 2] + column.floor_depth, -direction[:, 2])
    on_floor = to_floor < distance
    return SeenPoints(
        origin,
        direction,
        distance=np.minimum(distance, to_floor),
        normal=np.where(on_floor[:, None], [0.0, 0.0, 1.0], normal),
        colour=colour,
        sunlit=np.ones(count, dtype=bool),
        path_sunlit=np.ones((count, 1), dtype=bool),
        reach=min(_REACH / max(float(column.attenuation.min()), 1e-6), _FARTHEST),
        on_floor=on_floor,
        openness=np.ones(count),
        pixels=np.full(count, 1.0 / count),
    )


def _clear(
    meshes: Meshes, points: NDArray[np.float64], directions: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Whether nothing stands between points, shape (m, k or 1, 3), and the surface, (m, k)."""
    points, directions = np.broadcast_arrays(points, directions)
    rays = points.reshape(-1, 3), directions.reshape(-1, 3)
    return meshes.clear(*rays, _to_surface(*rays)).reshape(points.shape[:-1])


def _to_surface(origin: NDArray[np.float64], direction: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance along rays to the water's surface, shape (m,); infinite for those that go down."""
    return _along(np.maximum(-origin[:, 2], 0.0), direction[:, 2])


def _along(distance: NDArray[np.float64], speed: NDArray[np.float64]) -> NDArray[np.float64]:
    away = speed <= 0
    return np.where(away, np.inf, distance / np.where(away, 1.0, speed))


def _sampled(frames: Sequence[int]) -> list[int]:
    """First, middle, last and a few between."""
    chosen = np.linspace(0, len(frames) - 1, min(_FRAMES, len(frames))).round().astype(int)
    return [frames[i] for i in chosen]


def _optics(plan: RenderPlan, engine: str) -> Optics:
    """The water of a plan by the light that an engine draws; the rays bring their own depth."""
    solved = engine != "eevee" or plan.settings.field == SOLVED
    return Optics(plan.viewpoint(0.0), plan.excitation, solved=solved)


def _everything(scene: bpy.types.Scene, chosen: SceneSettings, engine: str) -> Optics:
    """Everything the settings ask for, on many bands."""
    many = replace(chosen, bands=REFERENCE_BANDS, wavelengths="", band_placement=EQUAL)
    plan = plan_of(many)
    found = _optics(plan, engine)
    if chosen.surface != moving_surface.WAVES:
        return found
    coarse = replace(chosen, wave_resolution=min(chosen.wave_resolution, _WAVE_RESOLUTION))
    return replace(found, waves=moving_surface.patterns(scene, replace(plan, settings=coarse)))


def _choices(
    chosen: SceneSettings, engine: str, method: str, keep: frozenset[str]
) -> list[BandChoice]:
    """Bands to choose from; those of the settings alone if they must stay."""
    # Only the elastic light of a calm sea is compared.
    plain = replace(
        chosen,
        inelastic="",
        surface="flat" if chosen.surface == moving_surface.WAVES else chosen.surface,
    )
    if keep & {"bands", "wavelengths", "range_start", "range_end"}:
        bands = {}
        plan = plan_of(plain)
        name = f"{len(plan.bands)}, as given"
        return [BandChoice(name, _optics(plan, engine), bands, len(plan.passes))]
    most = plan_of(plain).most_bands if method == REALTIME else BAND_COUNTS[-1]
    found = []
    for placement, counts in ((EQUAL, BAND_COUNTS), (OPTIMISED, OPTIMISED_COUNTS)):
        if "band_placement" in keep and placement != chosen.band_placement:
            continue
        for count in (n for n in counts if n <= most):
            changes = {"bands": count, "wavelengths": "", "band_placement": placement}
            plan = plan_of(replace(plain, **changes))
            name = f"{count} {placement}"
            found.append(BandChoice(name, _optics(plan, engine), changes, len(plan.passes)))
    return found


def _changes(
    chosen: SceneSettings, required: Requirements, engine: str, keep: frozenset[str]
) -> dict[str, Any]:
    """Settings that differ from the ones that were given."""
    wanted = {**required.bands.settings, "samples": required.samples}
    if engine == "cycles":
        wanted["bounces"] = required.bounces
    changed = required.options ^ switched_on(vars(chosen))
    for term in TERMS:
        if term.name in changed and engine in term.engines:
            wanted[term.setting] = settings_of(required.options)[term.setting]
    return {
        name: value
        for name, value in wanted.items()
        if name not in keep and getattr(chosen, name) != value
    }
