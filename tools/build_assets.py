# ruff: noqa: ANN401 - data-blocks of any kind
"""Build the asset library that the extension ships: one file, and the list of its catalogues.

    python3 dev.py run tools/build_assets.py        into assets/

`python3 dev.py build` does it too. The node groups are those of the extension's own builders, the
looks and waters its presets, so the file is never edited and not kept in the repository.
"""

from __future__ import annotations

import json
import runpy
import sys
import uuid
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import OpenImageIO
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "assets"
FILE, CATALOGUES = "underwater_spectral.blend", "blender_assets.cats.txt"
AUTHOR, LICENCE = "Underwater Spectral developers", "GPL-3.0-or-later"
SIZE = 96
_SPACE = uuid.UUID("5f0b8d0c-6c1e-4d5e-8a57-0d9d3e3b7c11")  # of the catalogues' numbers
_DEPTH = 5.0
_KINDS = ("Looks", "Waters", "Shaders", "Compositor", "Lamps", "Particles")
_BANDS, _SENSOR = 9, "ARRI D21"
_WAVES = {"surface": "waves", "wave_resolution": 128, "wave_tile": 5.0, "wind_speed": 4.0}


def catalogue(kind: str) -> str:
    """Return the number of a catalogue."""
    return str(uuid.uuid5(_SPACE, kind))


def mark(block: Any, kind: str, text: str, picture: NDArray[np.float64]) -> Any:
    """Make a data-block an asset, with a description and a picture, shape (h, w, 3), top first."""
    block.asset_mark()
    about = block.asset_data
    about.description, about.author, about.license = text, AUTHOR, LICENCE
    about.catalog_id = catalogue(kind)
    about.tags.new("underwater")
    preview = block.preview_ensure()
    height, width = picture.shape[:2]
    preview.image_size = (width, height)
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :3] = np.clip(picture[::-1], 0.0, 1.0)
    preview.image_pixels_float.foreach_set(pixels.ravel())
    return block


def looks() -> Iterable[Any]:
    """Yield the looks and waters as worlds that carry their settings."""
    from underwater_spectral.ui import dropped_assets, presets

    for kind, title in (("look", "Looks"), ("water", "Waters")):
        for name, path in presets.names(kind).items():
            if not path.is_relative_to(ROOT):
                continue
            scene = bpy.context.scene
            for setting in bpy.context.scene.underwater.bl_rna.properties.keys():  # noqa: SIM118
                scene.underwater.property_unset(setting)
            presets.apply(kind, name)
            given = {n: getattr(scene.underwater, n) for n in presets.KINDS[kind].settings}
            rows = _open_water()
            world = bpy.data.worlds.new(name)
            background = world.node_tree.nodes["Background"]
            background.inputs["Color"].default_value = (*_linear(rows[len(rows) // 2]), 1.0)
            world[dropped_assets.SETTINGS] = json.dumps(given, sort_keys=True)
            thumbnail = ROOT / "ui" / "thumbnails" / kind / f"{path.stem}.png"
            picture = _read(thumbnail) if thumbnail.is_file() else _rows(rows)
            text = _first_line(path)
            yield mark(world, title, f"{text} Drop it into the viewport", picture)


def shaders() -> Iterable[Any]:
    """Yield the groups for shaders."""
    from underwater_spectral.node_groups import realtime_waves
    from underwater_spectral.scene.terms import eevee_water, waves
    from underwater_spectral.scene.water.term import Eye
    from underwater_spectral.tools import asset_groups, closed_form_group
    from underwater_spectral.uw_spectral.water import JERLOV_TYPES

    distances = np.linspace(0.0, 20.0, SIZE)
    tree = asset_groups.build_transmittance("Transmittance")
    faded = np.exp(-distances[:, None] * np.array((0.4, 0.1, 0.08)))
    yield mark(tree, "Shaders", tree.description, _columns(faded))
    colours = []
    for name in JERLOV_TYPES:
        plan = representative_bands(f"jerlov:{name}")
        bands = ", ".join(f"{x:.0f}" for x in asset_groups.WAVELENGTHS)
        text = (
            f"What a way through water of Jerlov type {name} does to light at {bands} nm, which "
            "stand for red, green and blue: transmittance, and the sunlight scattered into it"
        )
        tree = closed_form_group.build_water(f"Water Jerlov {name}", text, plan.column, plan.phase)
        path = plan.viewpoint(_DEPTH).seen_level(np.zeros(3), distances[:, None])[:, ::-1]
        yield mark(tree, "Shaders", text, _columns(_shown(path / path.max())))
        colours.append(_linear(_open_water(water=f"jerlov:{name}")[0]))
    tree = asset_groups.build_jerlov_colour("Jerlov Colour", colours)
    picture = _shown(np.repeat(np.array(colours), SIZE // len(colours) + 1, axis=0)[:SIZE])
    yield mark(tree, "Shaders", tree.description, _columns(picture))
    yield closed_form()
    plan = representative_bands("jerlov:IB", **_WAVES)
    water = eevee_water.eevee_water(plan, bpy.context.scene, Eye(None, _DEPTH), np.eye(3))
    water = waves.with_waves(bpy.context.scene, plan, water)
    moving = water.term(waves.WaveTerm)
    assert moving is not None
    images = realtime_waves.new_images()
    tree = asset_groups.build_caustics("Caustic Light", water.shape, water.numbers, images)
    realtime_waves.write_patterns(images, moving.patterns)
    # Writing may have put another image in the place of the first.
    next(n.image for n in tree.nodes if n.bl_idname == "ShaderNodeTexImage").pack()
    pattern = moving.patterns.caustics_image()[: SIZE - 1, : SIZE - 1, 1]
    yield mark(tree, "Shaders", tree.description, _shown(_grey(pattern / pattern.max())))


def closed_form() -> Any:
    """Return the group of the closed form, with a picture of open water by its view's turn."""
    from underwater_spectral.tools import closed_form_group
    from underwater_spectral.validation.closed_form import (
        PlainLight,
        TwoStreamWater,
        plain_water,
    )

    tree = closed_form_group.build("Closed Form Water")
    given = {s.name: s.default_value for s in tree.interface.items_tree if s.in_out == "INPUT"}
    number = {name: np.array(value, np.float64) for name, value in given.items()}
    band = {name: value[:3] for name, value in number.items() if value.ndim}
    water = plain_water(
        TwoStreamWater(
            band[closed_form_group.ABSORPTION], band[closed_form_group.SCATTERING],
            band[closed_form_group.ASYMMETRY], band[closed_form_group.SECOND_MOMENT],
        ),
        PlainLight(
            band[closed_form_group.SUN_IRRADIANCE], band[closed_form_group.SKY_RADIANCE],
            band[closed_form_group.SUN_DIRECTION].tolist(),
        ),
        y_o=_DEPTH,
        y_f=number[closed_form_group.FLOOR_DEPTH], r=band[closed_form_group.FLOOR_REFLECTANCE],
        index=number[closed_form_group.INDEX],
    )  # fmt: skip
    up = np.sin(np.radians(np.linspace(60.0, -60.0, SIZE)))[:, None]
    seen = water.open_water(_DEPTH, (np.zeros_like(up), np.sqrt(1.0 - up**2), up)).total
    picture = np.repeat(_shown(seen / seen.max())[:, None], SIZE, axis=1)
    return mark(tree, "Shaders", tree.description, picture)


def representative_bands(water: str, **changes: Any) -> Any:
    """Return the plan of the three bands, blue first."""
    from underwater_spectral.settings import render_plan
    from underwater_spectral.settings.scene_settings import SceneSettings
    from underwater_spectral.tools.asset_groups import WAVELENGTHS

    return render_plan.plan_of(
        SceneSettings(
            water=water,
            phase="hg:0.9",
            wavelengths=",".join(f"{x:g}" for x in sorted(WAVELENGTHS)),
            diffuse_shadows=False,
            scene_floor=False,
            **changes,
        )
    )


def compositor() -> Iterable[Any]:
    """Yield the group that turns band images into colours."""
    from underwater_spectral.node_groups import sensor_reduction
    from underwater_spectral.settings import render_plan
    from underwater_spectral.settings.scene_settings import SceneSettings

    plan = render_plan.plan_of(SceneSettings(bands=_BANDS, sensor=_SENSOR))
    weights, passes = plan.reduction(_DEPTH).weights, plan.bands.packed(3)
    tree = sensor_reduction.build(weights, passes)
    tree.name = f"Sensor {_SENSOR}"
    centres = plan.bands.centres
    for item, bands in zip(tree.interface.items_tree, passes, strict=False):
        item.description = (
            f"Image of the bands at {', '.join(f'{centres[i]:.0f}' for i in bands)} nm"
        )
    tree.description = (
        f"Nine bands of 400 to 700 nm, three a pass image, through an {_SENSOR} at {_DEPTH:g} m "
        "in daylight: linear Rec.709"
    )
    picture = _columns(_shown(np.repeat(weights.T / weights.max(), SIZE // _BANDS + 1, 0)[:SIZE]))
    yield mark(tree, "Compositor", tree.description, picture)


def lamps() -> Iterable[Any]:
    """Yield the rigs as collections: an empty, and lamps that hang on it."""
    from underwater_spectral.scene.water import lamp_rigs
    from underwater_spectral.ui import dropped_assets

    scene = bpy.context.scene
    for name, rig in lamp_rigs.RIGS.items():
        collection = bpy.data.collections.new(rig.label)
        holder = bpy.data.objects.new(f"{rig.label} Rig", None)
        collection.objects.link(holder)
        for item in lamp_rigs.add_rig(scene, name, holder):
            scene.collection.objects.unlink(item)
            collection.objects.link(item)
        text = (
            f"{len(rig.places)} × {rig.lumens:.0f} lm; parent the empty to a camera, which it fits "
            "at its origin, looking along -z"
        )
        collection[dropped_assets.RIG] = name
        yield mark(collection, "Lamps", text, _beams(rig))


def floating() -> Iterable[Any]:
    """Yield the particles as objects with geometry nodes, and the nodes of a size."""
    from underwater_spectral.node_groups import particles as geometry
    from underwater_spectral.scene.terms import particles
    from underwater_spectral.uw_spectral.water.particles import (
        BUBBLES,
        KINDS,
        ParticleCloud,
        particle_cloud,
    )

    grains, bubbles = geometry.grain_material(), geometry.bubble_material()
    for number, kind in enumerate(KINDS.values()):
        cloud: ParticleCloud = particle_cloud(kind, 40.0, reach=20.0)
        material = bubbles if kind.name == BUBBLES else grains
        tree = geometry.build(kind.name.capitalize(), cloud, material)
        geometry.write(tree, cloud, (0.02, 0.0, 0.0), 1e4, number)
        item = bpy.data.objects.new(tree.name, bpy.data.meshes.new(tree.name))
        particles.dress(item, tree, material)
        text = (
            f"{kind.name.capitalize()} around the active camera, 40 larger than 0.1 mm per litre, "
            "drifting with the scene's clock; Times in its modifier makes them more or fewer"
        )
        yield mark(item, "Particles", text, _specks(cloud, number))
    one = next(g for g in bpy.data.node_groups if g.name.startswith(geometry.CLASS_NAME))
    one.name = "Particles of a Size"
    text = "Particles of a size class in a box around the active camera, for sets of your own"
    yield mark(one, "Particles", text, _specks(particle_cloud(KINDS["snow"], 15.0), 9))


def build(folder: Path = FOLDER) -> list[Any]:
    """Build the library into a folder; return the assets, which stay in the open file."""
    made = [*looks(), *shaders(), *compositor(), *lamps(), *floating()]
    _unmark()
    folder.mkdir(parents=True, exist_ok=True)
    _check_names(made)
    bpy.data.libraries.write(str(folder / FILE), set(made), fake_user=True, compress=True)
    lines = ["VERSION 1", *(f"{catalogue(kind)}:{kind}:{kind}" for kind in _KINDS)]
    (folder / CATALOGUES).write_text("\n".join(lines) + "\n", encoding="utf-8")
    return made


def _check_names(made: list[Any]) -> None:
    taken = [b.name for b in made if b.name[-4:-3] == "."]
    if taken:
        raise ValueError(f"assets of the same name: {', '.join(taken)}")


def _unmark() -> None:
    """Take the marks of the extension's own off, by which it removes what it has made."""
    from underwater_spectral.node_groups.node_mathematics import MARK

    trees = [*bpy.data.node_groups, *(m.node_tree for m in bpy.data.materials)]
    nodes = [node for tree in trees if tree is not None for node in tree.nodes]
    for block in (*bpy.data.node_groups, *bpy.data.materials, *bpy.data.images, *nodes):
        if MARK in block:
            del block[MARK]


def _first_line(path: Path) -> str:
    return path.read_text(encoding="utf-8").partition('"""')[2].partition('"""')[0].strip()


def _open_water(**changes: Any) -> list[NDArray[np.float64]]:
    """Display colours of the open water, looking level, from 1 to 12 m deep."""
    from dataclasses import replace

    from underwater_spectral.scene import stored_settings
    from underwater_spectral.settings import render_plan
    from underwater_spectral.uw_spectral.imaging.water_colour import water_swatch

    chosen = stored_settings.stored_settings(bpy.context.scene)
    chosen = replace(chosen, floor_depth=0.0, exposure="auto", **changes)
    plan = render_plan.plan_of(chosen)
    return [np.asarray(water_swatch(plan.viewpoint(depth))) for depth in (5.0, 1.0, 12.0)][:3]


def _linear(shown: NDArray[np.float64]) -> list[float]:
    return np.where(shown > 0.04045, ((shown + 0.055) / 1.055) ** 2.4, shown / 12.92).tolist()


def _shown(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    from underwater_spectral.uw_spectral.spectra.colour_rendering import srgb_encode

    return srgb_encode(np.clip(linear, 0.0, 1.0))


def _rows(rows: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    place = np.linspace(0.0, 1.0, SIZE)
    middle, shallow, deep = rows
    knots = np.array([shallow, middle, deep])
    found = np.stack([np.interp(place, [0.0, 0.5, 1.0], knots[:, c]) for c in range(3)], -1)
    return np.repeat(found[:, None], SIZE, axis=1)


def _columns(columns: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.repeat(columns[None], SIZE, axis=0)


def _grey(values: NDArray[np.float32]) -> NDArray[np.float64]:
    return np.repeat(values[..., None], 3, axis=-1).astype(np.float64)


def _beams(rig: Any) -> NDArray[np.float64]:
    """Draw the lamps of a rig from above: each a fan of light that falls with the distance."""
    y, x = np.mgrid[0:SIZE, 0:SIZE] * (3.0 / SIZE)
    light = np.zeros((SIZE, SIZE))
    for place in rig.places:
        across, ahead = x - 1.5 - place[0], 2.9 - y
        cosine = ahead / np.maximum(np.hypot(across, ahead), 1e-6)
        inside = cosine > np.cos(np.radians(min(rig.cone, 150.0) / 2.0))
        light += inside / (0.15 + across**2 + ahead**2)
    return _shown(light[..., None] / light.max() * np.array((0.75, 1.0, 0.95)) + 0.01)


def _specks(cloud: Any, seed: int) -> NDArray[np.float64]:
    """Draw discs of the sizes of a cloud as they would look through a lens."""
    chance = np.random.default_rng(seed)
    y, x = np.mgrid[0:SIZE, 0:SIZE]
    light = np.full((SIZE, SIZE, 3), (0.004, 0.03, 0.05))
    for _ in range(60):
        radius = 0.8 + 6.0 * chance.random() ** 4
        at = chance.random(2) * SIZE
        disc = np.hypot(x - at[0], y - at[1]) < radius
        light[disc] += np.array(cloud.kind.reflectance) / radius
    return _shown(light)


def _read(path: Path) -> NDArray[np.float64]:
    pixels = OpenImageIO.ImageBuf(str(path)).get_pixels(OpenImageIO.FLOAT)
    return np.asarray(pixels[..., :3], dtype=np.float64)


def start(load: Callable[[], Any]) -> None:
    """Register the extension in an empty file."""
    package = load()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if not hasattr(bpy.types.Scene, "underwater"):
        package.register()


if __name__ == "__main__":
    start(runpy.run_path(str(ROOT / "tools" / "load_checkout.py"))["load"])
    assets = build()
    size = (FOLDER / FILE).stat().st_size
    sys.stdout.write(f"{len(assets)} assets, {size / 1e3:.0f} kB: {FOLDER / FILE}\n")
