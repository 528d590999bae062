"""Data sets from a specification: staged, planned, rendered and exported, and what bad ones say."""

from __future__ import annotations

import json
import re
import shutil
import warnings
from collections import namedtuple
from dataclasses import replace
from pathlib import Path

import bpy
import cv2
import numpy as np
import OpenImageIO as oiio
import pycolmap
import pytest
import rawpy
import trimesh
from evo.tools import file_interface
from pycocotools.coco import COCO
from rosbags.rosbag2 import Reader
from underwater_spectral.datasets.axes import looking_at, turned
from underwater_spectral.datasets.camera import PinholeCamera
from underwater_spectral.datasets.depth_maps import (
    planar_depth,
    read_depth_exr,
    read_depth_png,
)
from underwater_spectral.datasets.formats import FORMATS
from underwater_spectral.datasets.index import read_index
from underwater_spectral.datasets.layer_file import read_layers
from underwater_spectral.datasets.picture_codes import read_codes
from underwater_spectral.datasets.specification import read_spec
from underwater_spectral.jobs import (
    batch,
    data_set_jobs,
    data_set_plan,
    staging,
)
from underwater_spectral.jobs.data_set_jobs import read_jobs
from underwater_spectral.jobs.manifest_files import read_manifest
from underwater_spectral.jobs.progress import Progress
from underwater_spectral.jobs.stage import Place, Stage, StageCamera, StageLamp
from underwater_spectral.scene import stored_settings
from underwater_spectral.scene.readers import surroundings
from underwater_spectral.scene.readers.pinhole import pinhole_of, pose_of
from underwater_spectral.scene.readers.room import Room
from underwater_spectral.tests.scene import scenes
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr

# pycocotools' own, of its masks as arrays.
pytestmark = pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")

OPTICS = StageCamera("probe", 120, 90, 110.0, 121.0, 66.5, 40.25)
SPEC = """
title = "Discs"
licence = "CC0-1.0"
seed = 5
[water]
name = ["jerlov:IB", "air"]
[sun]
zenith = 30
[scene]
file = "discs.blend"
depth = 1.5
[render]
engine = "eevee"
mode = "realtime"
samples = 1
bands = 3
diffuse_shadows = false
[[camera]]
name = "probe"
width = 160
height = 120
focal = [150, 160]
centre = [84.5, 55.25]
sensor = "Nikon D7000"
[[poses]]
name = "around"
kind = "orbit"
target = [0, 0, -3]
radius = 3
elevation = 25
start = -100
arc = 30
count = 2
[[rig]]
name = "sun alone"
[detector]
pattern = "GRBG"
[splits]
train = 0.5
val = 0.5
test = 0
[output]
formats = FORMATS
leave_out = ["sand"]
layers = "position"
""".replace("FORMATS", json.dumps(list(FORMATS)))
DISCS = ((-0.6, 0.1, -2.8), (0.5, -0.2, -3.1), (0.1, 0.5, -2.5))


def _blank() -> bpy.types.Scene:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        bpy.ops.wm.read_factory_settings(use_empty=True)
    if not hasattr(bpy.types.Scene, stored_settings.PROPERTY):
        stored_settings.register()
    bpy.context.scene.eevee.shadow_pool_size = "128"
    return bpy.context.scene


def _mesh(name: str, vertices: np.ndarray, faces: list) -> bpy.types.Object:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices.tolist(), [], faces)
    item = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(item)
    return item


def _rim(place: tuple[float, ...], radius: float = 0.25) -> np.ndarray:
    """Corners of a disc that looks at where the cameras are, world coordinates."""
    angle = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    pose = looking_at(place, (0.3, 2.0, -4.0))
    flat = radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    return flat @ pose[:3, :3].T + pose[:3, 3]


def _discs(path: Path) -> None:
    """Three discs over sand."""
    _blank()
    paint = scenes.principled("paint", (0.9, 0.7, 0.5, 1.0))
    for number, place in enumerate(DISCS):
        corners = _rim(place)
        disc = _mesh(f"disc {number}", corners - place, [tuple(range(len(corners)))])
        disc.location, disc["category"] = place, "marker"
        disc.data.materials.append(paint)
    wide = 8.0 * np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    sand = _mesh("sand", wide - (0, 0, 4.5), [(0, 1, 2, 3)])
    sand.data.materials.append(paint)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def _run(*arguments: object) -> int:
    return batch.main([str(a) for a in arguments], inside_blender=False)


# --- The stage --------------------------------------------------------------------------------


def test_a_stage_is_what_it_says_and_leaves_no_trace(empty_blender):
    _blank()
    scene = bpy.context.scene
    box = scenes._cube("box", (0.0, 8.0, -6.0))
    child = scenes._cube("child", (1.0, 0.0, 0.0))
    child.parent = box
    for frame, x in ((1, 0.0), (11, 10.0)):
        box.location.x = x
        box.keyframe_insert("location", frame=frame)
    scene.frame_set(3)
    before = sorted(block.name_full for block in bpy.data.user_map())
    poses = {
        1: looking_at((0, 0, -2), (1, 5, -3)),
        2: looking_at((2, 1, -4), (0, 0, -6), 30.0),
        9: looking_at((0, -1, -8), (0, 0, -1)),
    }
    places = {n: Place(tuple(map(tuple, p.tolist())), 0.5 * n) for n, p in poses.items()}
    lamp = StageLamp(900.0, "lm", "led", (0.3, 0.1, 0.0), (0.0, 0.2, -1.0), 60.0)
    with staging.staged(scene, Stage(OPTICS, 6, (lamp,), places)):
        camera = scene.camera
        assert camera.name == "probe"
        found = pinhole_of(scene, camera)
        for name in ("width", "height", "fx", "fy", "cx", "cy"):
            assert getattr(found, name) == pytest.approx(getattr(OPTICS, name), abs=1e-4), name
        light = next(item for item in scene.objects if item.type == "LIGHT")
        for frame, pose in poses.items():
            scene.frame_set(frame)
            assert pose_of(camera) == pytest.approx(pose, abs=2e-6)
            # The animation stands still at frame 6, and all has gone down.
            depsgraph = bpy.context.evaluated_depsgraph_get()
            place = child.evaluated_get(depsgraph).matrix_world.translation
            assert tuple(place) == pytest.approx((6.0, 8.0, -6.0 - 0.5 * frame), abs=1e-5)
            hangs = light.evaluated_get(depsgraph).matrix_world.translation
            assert tuple(hangs) == pytest.approx((pose @ (0.3, 0.1, 0.0, 1.0))[:3], abs=1e-5)
    assert sorted(block.name_full for block in bpy.data.user_map()) == before
    assert scene.frame_current == 3
    assert box.parent is None
    scene.frame_set(6)
    assert box.matrix_world.translation.x == pytest.approx(5.0)


def test_categories_and_their_numbers_are_those_of_the_scene(empty_blender):
    scene, objects = _blank(), {}
    holder = bpy.data.collections.new("Everything")
    scene.collection.children.link(holder)
    for name in ("fish", "fish.001", "rock"):
        objects[name] = bpy.data.objects.new(name, bpy.data.meshes.new(name))
        holder.objects.link(objects[name])

    def found():
        rows = data_set_plan.objects_of(scene, 1)
        return {row.name: (row.category, row.category_id) for row in rows}

    assert found() == {"fish": ("fish", None), "fish.001": ("fish", None), "rock": ("rock", None)}
    for name, number in (("fish", 4), ("fish.001", 4), ("rock", 9)):
        objects[name]["category_id"] = number
    assert found() == {"fish": ("fish", 4), "fish.001": ("fish", 4), "rock": ("rock", 9)}
    objects["rock"]["category_id"] = 4
    assert set(found().values()) == {("category 4", 4)}
    objects["fish"]["category_id"] = 5
    objects["rock"]["category_id"] = 9
    with pytest.raises(InputError, match="category 'fish' have another"):
        found()
    objects["fish"]["category_id"] = "four"
    with pytest.raises(InputError, match="whole number"):
        found()


def test_room_knows_inside_and_outside(empty_blender):
    _blank()
    rock = scenes._cube("rock", (0.0, 0.0, -5.0))  # from -1 to 1
    rock.scale = (2.0, 1.0, 0.5)
    wide = 20.0 * np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    _mesh("sand", wide - (0, 0, 8.0), [(0, 1, 2, 3)])
    bpy.context.view_layer.update()
    room = Room(bpy.context.evaluated_depsgraph_get())
    assert room.clearance((3.0, 0.0, -5.0)) == pytest.approx(1.0, abs=1e-5)
    assert room.clearance((0.0, 0.0, -2.5)) == pytest.approx(2.0, abs=1e-5)
    assert room.clearance((0.0, 0.0, -5.2)) == pytest.approx(-0.3, abs=1e-5)
    assert room.clearance((9.0, 9.0, -8.7)) == pytest.approx(-0.7, abs=1e-5)
    camera = PinholeCamera.from_field_of_view(60, 40, 60.0)
    level = looking_at((0.0, -9.0, -5.0), (0.0, 0.0, -5.0))
    down = looking_at((6.0, 6.0, -5.0), (6.0, 6.0, -8.0))
    up = looking_at((6.0, 6.0, -5.0), (6.0, 6.0, 0.0))
    assert room.seen_fraction(down, camera) == 1.0
    assert room.seen_fraction(up, camera) == 0.0
    assert 0.2 < room.seen_fraction(level, camera) < 0.6


# --- From a specification to files ------------------------------------------------------------

Made = namedtuple("Made", "folder index spec")


class StoppedError(Exception):
    """Stands for a process that is killed."""


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Made:
    """A set that was stopped after its first pass, and gone on with."""
    folder = tmp_path_factory.mktemp("set")
    _discs(folder / "discs.blend")
    spec, out = folder / "spec.toml", folder / "out"
    spec.write_text(SPEC)

    def stop(self, step):
        raise StoppedError

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(Progress, "report", stop)
        with pytest.raises(StoppedError):
            _run("--dataset", spec, "--out", out)
    assert len(list(out.glob("jobs/*/passes/*/pass_00.exr"))) == 1
    assert _run("--dataset", spec, "--out", out) == 0
    return Made(out, read_index(out / "dataset.json"), spec)


@pytest.mark.slow
def test_a_run_that_was_killed_goes_on_with_the_same_bits(made, monkeypatch):
    monkeypatch.setattr(surroundings, "PROBES", 6000)  # as the set was made
    monkeypatch.setattr(surroundings, "_COARSE", 120_000)
    first = made.index.jobs[0]
    job = made.folder / "jobs" / first
    passes = sorted(job.glob("passes/*/*.exr"))
    before = {path: read_exr(path)[0] for path in passes}
    kept = (job / "passes" / "0002" / "pass_00.exr").stat().st_mtime_ns
    for path in (*job.glob("passes/0001/*"), *job.glob("0001*")):
        path.unlink()
    pictures = {p: p.read_bytes() for p in (made.folder / "images").iterdir()}
    assert _run("--dataset", made.spec, "--out", made.folder) == 0
    for path, pixels in before.items():
        assert np.array_equal(read_exr(path)[0], pixels, equal_nan=True), path
    assert (job / "passes" / "0002" / "pass_00.exr").stat().st_mtime_ns == kept
    assert {p: p.read_bytes() for p in (made.folder / "images").iterdir()} == pictures


def _polygon_centroid(corners: np.ndarray) -> np.ndarray:
    x, y = corners.T
    cross = x * np.roll(y, -1) - y * np.roll(x, -1)
    sums = [((c + np.roll(c, -1)) * cross).sum() for c in (x, y)]
    return np.array(sums) / (3.0 * cross.sum())


def _numbers(index) -> dict[str, int]:
    return {scene_object.name: number for number, scene_object in enumerate(index.objects, 1)}


def _centroid(mask: np.ndarray) -> np.ndarray:
    rows, columns = np.nonzero(mask)
    return np.array([columns.mean() + 0.5, rows.mean() + 0.5])


def _lowered_rim(number: int) -> np.ndarray:
    return _rim(DISCS[number]) - (0.0, 0.0, 1.5)


def test_discs_are_seen_where_poses_and_cameras_put_them(made):
    """Through our own camera, pycolmap, OpenCV by BOP, and nerfstudio's convention."""
    numbers, checked = _numbers(made.index), 0
    transforms = json.loads((made.folder / "transforms.json").read_text())
    frames = {Path(frame["file_path"]).stem: frame for frame in transforms["frames"]}
    groups = [pycolmap.Reconstruction(str(p)) for p in made.folder.glob("scenes/*/sparse/0")]
    for path in made.folder.glob("scenes/*"):
        named = pycolmap.Reconstruction(str(path / "sparse" / "0")).images.values()
        assert {i.name for i in named} == {p.name for p in (path / "images").iterdir()}
    of_colmap = {Path(i.name).stem: i for model in groups for i in model.images.values()}
    assert len(groups) == 2
    assert len(of_colmap) == len(frames) == 4
    for view in made.index.views.values():
        ids = read_codes(made.folder / "instances" / f"{view.name}.png")
        for number in range(len(DISCS)):
            mask, rim = ids == numbers[f"disc {number}"], _lowered_rim(number)
            assert mask.sum() > 150
            seen = _centroid(mask)
            image = of_colmap[view.name]
            by_colmap = np.array([image.project_point(p) for p in rim])
            frame = frames[view.name]
            local = (np.c_[rim, np.ones(len(rim))]) @ np.linalg.inv(frame["transform_matrix"]).T
            by_nerf = np.stack(
                [
                    transforms["fl_x"] * local[:, 0] / -local[:, 2] + transforms["cx"],
                    transforms["fl_y"] * -local[:, 1] / -local[:, 2] + transforms["cy"],
                ],
                axis=-1,
            )
            for corners in (by_colmap, by_nerf):
                assert _polygon_centroid(corners) == pytest.approx(seen, abs=0.1)
            checked += 1
    assert checked == 12


def test_bop_is_read_by_opencv(made):
    checked = 0
    for folder in sorted((made.folder / "bop").glob("*/000*")):
        cameras = json.loads((folder / "scene_camera.json").read_text())
        truths = json.loads((folder / "scene_gt.json").read_text())
        infos = json.loads((folder / "scene_gt_info.json").read_text())
        for key, camera in cameras.items():
            K = np.array(camera["cam_K"]).reshape(3, 3)
            assert cv2.imread(str(folder / "rgb" / f"{int(key):06d}.png")).shape == (120, 160, 3)
            for place, (pose, info) in enumerate(zip(truths[key], infos[key], strict=True)):
                path = folder / "mask_visib" / f"{int(key):06d}_{place:06d}.png"
                mask = cv2.imread(str(path), cv2.IMREAD_UNCHANGED) > 0
                # The mesh of a disc is its rim, moved to its origin.
                errors = []
                for centre in DISCS:
                    rim_mm = 1e3 * (_rim(centre) - centre)
                    turn = cv2.Rodrigues(np.array(pose["cam_R_m2c"]).reshape(3, 3))[0]
                    shift = np.array(pose["cam_t_m2c"])
                    at = cv2.projectPoints(rim_mm, turn, shift, K, None)[0][:, 0]
                    errors.append(np.abs(_polygon_centroid(at) + 0.5 - _centroid(mask)).max())
                assert min(errors) < 0.1
                assert info["visib_fract"] > 0.95
                checked += 1
    assert checked == 12


def test_depth_is_that_of_the_scene(made):
    numbers = _numbers(made.index)
    for view in made.index.views.values():
        in_mm = read_depth_png(made.folder / "depth" / f"{view.name}.png")
        distances, planar = read_depth_exr(made.folder / "depth" / f"{view.name}.exr")
        finite = np.isfinite(planar)
        assert finite.sum() > 5000
        assert np.array_equal(finite, np.isfinite(in_mm))
        assert np.abs(in_mm[finite] - planar[finite]).max() < 0.6e-3
        along = planar_depth(distances, view.camera)[finite]
        assert planar[finite] == pytest.approx(along, rel=1e-5)
        ids = read_codes(made.folder / "instances" / f"{view.name}.png")
        for number, centre in enumerate(DISCS):
            mask = ids == numbers[f"disc {number}"]
            rays = view.camera.rays()[mask] * (1, -1, -1) @ view.camera_to_world[:3, :3].T
            normal = looking_at(centre, (0.3, 2.0, -4.0))[:3, 2]
            offset = np.subtract(centre, (0, 0, 1.5)) - view.camera_to_world[:3, 3]
            true = offset @ normal / (rays @ normal)
            assert distances[mask] == pytest.approx(true, rel=2e-4)


def test_coco_openimageio_and_libraw_read_their_files(made, capsys):
    annotations = 0
    for split in ("train", "val"):
        coco = COCO(str(made.folder / f"coco_{split}.json"))
        assert [c["name"] for c in coco.loadCats(coco.getCatIds())] == ["marker"]
        for item in coco.loadAnns(coco.getAnnIds()):
            name = Path(coco.loadImgs(item["image_id"])[0]["file_name"]).stem
            ids = read_codes(made.folder / "instances" / f"{name}.png")
            mask = coco.annToMask(item).astype(bool)
            (number,) = set(ids[mask].tolist())
            assert np.array_equal(mask, ids == number)
            annotations += 1
    capsys.readouterr()
    assert annotations == 12
    for view in made.index.views.values():
        spec = oiio.ImageInput.open(str(made.folder / "layers" / f"{view.name}.exr")).spec()
        assert {"range", "planar_depth", "position.X"} <= set(spec.channelnames)
        linear = read_exr(made.folder / "linear" / f"{view.name}.exr")[0]
        with rawpy.imread(str(made.folder / "raw" / f"{view.name}.dng")) as raw:
            developed = raw.postprocess(
                gamma=(1, 1), no_auto_bright=True, output_bps=16, half_size=True,
                use_camera_wb=True, output_color=rawpy.ColorSpace.sRGB,
            )  # fmt: skip
        # White is half the well, and a full well is the white of the file.
        wanted = linear.reshape(60, 2, 80, 2, 3).mean(axis=(1, 3))
        ratio = developed.mean(axis=(0, 1)) / 65535 / wanted.mean(axis=(0, 1))
        bright = wanted.mean(axis=(0, 1)) > 0.1
        assert ratio[bright] == pytest.approx(np.full(bright.sum(), 0.5), rel=0.02)


def test_air_is_clear_and_water_is_not(made):
    by_water = {}
    for view in made.index.views.values():
        numbers = read_codes(made.folder / "instances" / f"{view.name}.png")
        pixels = read_exr(made.folder / "linear" / f"{view.name}.exr")[0]
        seen = pixels[numbers == _numbers(made.index)["disc 0"]].mean(axis=0)
        by_water.setdefault(view.record["settings"]["water"], []).append(seen)
    assert set(by_water) == {"jerlov:IB", "air"}
    red_over_blue = {w: np.mean(v, axis=0)[0] / np.mean(v, axis=0)[2] for w, v in by_water.items()}
    # The paint's own colour in air: 0.9 to 0.5.
    assert red_over_blue["air"] == pytest.approx(0.9 / 0.5, rel=0.1)
    assert red_over_blue["jerlov:IB"] < 1.0


def test_the_card_and_the_truth_are_there(made):
    text = (made.folder / "README.md").read_text()
    for part in ("# Discs", "CC0-1.0", "| train | 2 |", "| val | 2 |", "marker", "Blender"):
        assert part in text
    assert all(line.count("|") in (0, 3, 4) for line in text.splitlines())
    wet = [v for v in made.index.views.values() if v.record["settings"]["water"] == "jerlov:IB"]
    for view in wet:
        truth = json.loads((made.folder / "truth" / f"{view.name}.json").read_text())
        assert truth["camera"]["K"] == pytest.approx(view.camera.K, abs=1e-3)
        assert truth["water"]["layers"][0]["name"].startswith("Jerlov IB")


def test_a_set_grows_by_what_is_new(made, tmp_path):
    folder = tmp_path / "grown"
    shutil.copytree(made.folder, folder / "out")
    shutil.copy(made.spec.with_name("discs.blend"), folder / "discs.blend")
    spec = folder / "spec.toml"
    spec.write_text(SPEC.replace('"air"]', '"air", "jerlov:II"]'))
    assert _run("--dataset", spec, "--out", folder / "out", "--dataset-plan") == 0
    index = read_index(folder / "out" / "dataset.json")
    assert index.jobs[:2] == made.index.jobs
    assert len(index.jobs) == 3
    assert len(index.views) == 6
    new = [view for view in index.views.values() if view.name not in made.index.views]
    assert {view.job for view in new} == {index.jobs[2]}
    # The same poses are at the same frames.
    manifests = [read_manifest(index.manifest(job)) for job in index.jobs]
    places = [manifest.stage.places for manifest in manifests]
    assert places[0] == places[2]
    assert read_jobs(index).status()[0].count("2 of 2 passes done") == 2


def test_what_is_rendered_can_be_exported_before_the_rest(made, tmp_path, capsys):
    shutil.copytree(made.folder, tmp_path / "set" / "out")
    for name in ("discs.blend", "spec.toml"):
        shutil.copy(made.spec.with_name(name), tmp_path / "set" / name)
    out = tmp_path / "set" / "out"
    job = out / "jobs" / made.index.jobs[0]
    (job / "0001.json").unlink()  # is developed again
    for path in (*job.glob("passes/0002/*"), *job.glob("0002*")):
        path.unlink()
    assert _run("--dataset-export", out) == 0
    assert "exported: 3 view(s), 1 not rendered yet" in capsys.readouterr().out
    frames = json.loads((out / "transforms.json").read_text())["frames"]
    assert len(frames) == 3
    assert (job / "0001.json").is_file()


def test_another_render_is_refused_in_the_same_folder(made, capsys):
    assert _run("--dataset", made.spec, "--out", made.folder, "--samples", 2) == 2
    assert "other values of samples" in capsys.readouterr().err


def _copy(made, folder):
    """Return the output folder and the specification of a copy of a set."""
    shutil.copytree(made.folder, folder / "out")
    for name in ("discs.blend", "spec.toml"):
        shutil.copy(made.spec.with_name(name), folder / name)
    return folder / "out", folder / "spec.toml"


@pytest.mark.slow
def test_pictures_of_another_scene_are_not_exported(made, tmp_path):
    """With dataset.json deleted and the scene changed, old pictures were taken for the new ones."""
    out, spec = _copy(made, tmp_path / "set")
    old = {path.name: path.read_bytes() for path in (out / "images").iterdir()}
    (out / "dataset.json").unlink()
    bpy.ops.wm.open_mainfile(filepath=str(spec.with_name("discs.blend")))
    for number in range(len(DISCS)):
        bpy.data.objects.remove(bpy.data.objects[f"disc {number}"])
    bpy.ops.wm.save_mainfile()
    assert _run("--dataset", spec, "--out", out) == 0
    new = {path.name: path.read_bytes() for path in (out / "images").iterdir()}
    assert new.keys() == old.keys()
    assert all(new[name] != old[name] for name in new)


@pytest.mark.slow
def test_a_detector_and_layers_can_be_added_to_a_finished_set(made, tmp_path, capsys):
    """The former ended in "there is no 'I'" for ever, the latter were left out in silence."""
    full = SPEC.replace('"jerlov:IB", "air"', '"jerlov:IB"').replace("count = 2", "count = 1")
    full = full.replace(json.dumps(list(FORMATS)), '["coco"]')
    plain = full.replace('[detector]\npattern = "GRBG"\n', "").replace('layers = "position"\n', "")
    out, spec = tmp_path / "out", tmp_path / "spec.toml"
    shutil.copy(made.spec.with_name("discs.blend"), tmp_path / "discs.blend")
    spec.write_text(plain)
    assert _run("--dataset", spec, "--out", out) == 0
    assert not (out / "raw").exists()
    spec.write_text(full)
    assert _run("--dataset", spec, "--out", out) == 0
    for name in read_index(out / "dataset.json").views:
        layers = read_layers(out / "layers" / f"{name}.exr")
        assert "position" in layers.layers
    assert len(list((out / "raw").iterdir())) > 0


def test_workers_and_status_take_the_index(made, capsys):
    assert _run("--from", made.folder / "dataset.json") == 0
    assert "0 of 4 view(s) rendered here" in capsys.readouterr().out
    assert _run("--status", made.folder / "dataset.json", "--json") == 0
    status = json.loads(capsys.readouterr().out.strip().splitlines()[-1])
    assert [job["done"] for job in status.values()] == [2, 2]
    images = {p: p.read_bytes() for p in (made.folder / "images").iterdir()}
    shutil.rmtree(made.folder / "images")
    assert _run("--dataset-export", made.folder) == 0
    assert {p: p.read_bytes() for p in (made.folder / "images").iterdir()} == images


# --- Flow, pairs, compositors, models, and the way of a camera ---------------------------------


def _of_pose(made, water: str) -> list:
    views = [v for v in made.index.views.values() if v.record["settings"]["water"] == water]
    return sorted(views, key=lambda view: view.record["pose"])


def _layers_of(made, view):
    return read_layers(made.folder / "jobs" / view.job / f"{view.frame:04d}_layers.exr")


@pytest.mark.slow
def test_what_swims_moves_in_the_flow(tmp_path):
    """A sheet that *Scene Time* moves by 2 m/s, before a camera that moves."""
    scene = _blank()
    paint = scenes.principled("paint", (0.9, 0.7, 0.5, 1.0))
    for name, size, depth in (("wall", 8.0, 6.0), ("fish", 0.5, 3.0)):
        corners = size * np.array([(-1.0, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1)])
        item = _mesh(name, np.add(corners, (0.0, depth, -4.0)), [(0, 1, 2, 3)])
        item.data.materials.append(paint)
    tree = bpy.data.node_groups.new("swims", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    nodes = {
        kind: tree.nodes.new(kind)
        for kind in ("NodeGroupInput", "GeometryNodeInputSceneTime", "ShaderNodeCombineXYZ",
                     "ShaderNodeMath", "GeometryNodeTransform", "NodeGroupOutput")
    }  # fmt: skip
    given, time, vector, double, moved, out = nodes.values()
    double.operation, double.inputs[1].default_value = "MULTIPLY", 2.0
    for one, other in (
        (given.outputs[0], moved.inputs[0]), (time.outputs["Seconds"], double.inputs[0]),
        (double.outputs[0], vector.inputs[0]), (vector.outputs[0], moved.inputs["Translation"]),
        (moved.outputs[0], out.inputs[0]),
    ):  # fmt: skip
        tree.links.new(one, other)
    item.modifiers.new("swims", "NODES").node_group = tree
    scene.render.fps = 24
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "swims.blend"))
    (tmp_path / "spec.toml").write_text("""
title = "Swims"
licence = "CC0-1.0"
seed = 1
[water]
name = "air"
[sun]
zenith = 30
[scene]
file = "swims.blend"
[render]
engine = "eevee"
mode = "realtime"
samples = 1
bands = 3
[[camera]]
name = "probe"
width = 96
height = 72
field_of_view = 60
[[poses]]
name = "by"
kind = "transect"
start = [0, 0, -4]
end = [0.2, 0, -4]
heading = 90
count = 3
[splits]
train = 1
val = 0
test = 0
[output]
formats = ["flow"]
layers = "instance"
""")
    assert _run("--dataset", tmp_path / "spec.toml", "--out", tmp_path / "out") == 0
    index = read_index(tmp_path / "out" / "dataset.json")
    first, second, third = sorted(index.views.values(), key=lambda view: view.record["pose"])
    layers = read_layers(tmp_path / "out" / "jobs" / second.job / f"{second.frame:04d}_layers.exr")
    number = {name: number for number, name in layers.instances.items()}["fish"]
    swims = layers["instance"] == number
    assert swims.sum() > 300
    f, step = second.camera.fx, 2.0 / 24.0
    for end, other, sign in (("", third, 1.0), ("_back", first, -1.0)):
        flow = cv2.readOpticalFlow(str(tmp_path / "out" / "flow" / f"{second.name}{end}.flo"))
        camera = other.camera_to_world[0, 3] - second.camera_to_world[0, 3]
        inner = cv2.erode(swims.astype(np.uint8), np.ones((5, 5))) > 0
        np.testing.assert_allclose(
            flow[inner], [(f * (sign * step - camera) / 3.0, 0.0)] * inner.sum(), atol=0.02
        )
        wall = ~swims & (np.abs(flow) < 1e9).all(axis=-1)
        np.testing.assert_allclose(np.median(flow[wall], axis=0), (-f * camera / 6.0, 0), atol=1e-3)


def test_flow_is_that_of_blenders_own_vectors(made):
    for water in ("jerlov:IB", "air"):
        view, following = _of_pose(made, water)
        flow = cv2.readOpticalFlow(str(made.folder / "flow" / f"{view.name}.flo"))
        assert not (made.folder / "flow" / f"{following.name}.flo").exists()
        assert (made.folder / "flow" / f"{following.name}_back.flo").exists()
        layers = _layers_of(made, view)
        # Blender's is from the frame after, to the right and up.
        theirs = layers["motion"][..., 2:] * (-1.0, 1.0)
        seen = np.isfinite(layers["planar_depth"])
        numbers = {name: number for number, name in layers.instances.items()}
        assert (layers["instance"] == numbers["UW Floor"]).sum() > 1000
        size = np.linalg.norm(flow[seen], axis=-1)
        assert np.median(size) > 20
        apart = np.linalg.norm(flow[seen] - theirs[seen], axis=-1)
        # Its 16 bits are cut to eleven digits of base two, in the engine and in the file.
        assert np.quantile(apart / size, 0.99) < 2 * 2**-10
        unknown = np.isinf(layers["planar_depth"])
        assert np.array_equal((np.abs(flow) > 1e9).all(axis=-1), unknown)


def _decoded(path: Path) -> np.ndarray:
    """Linear values of an sRGB picture."""
    codes = cv2.imread(str(path))[..., ::-1] / 255.0
    return np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)


@pytest.mark.parametrize("kind", ["pairs", "pairs_air"])
def test_pairs_are_the_picture_and_the_same_without_water(made, kind):
    rows = (made.folder / kind / "pairs.csv").read_text().splitlines()[1:]
    gains = {row.split(",")[0]: float(row.split(",")[-1]) for row in rows}
    views = _of_pose(made, "jerlov:IB")
    assert set(gains) == {view.name for view in views}
    for view in views:
        raw, reference = (
            _decoded(made.folder / kind / x / f"{view.name}.png") for x in ("raw", "reference")
        )
        linear = read_exr(made.folder / "linear" / f"{view.name}.exr")[0] * gains[view.name]
        # Half a code of 8 bits, at its steepest.
        assert raw == pytest.approx(linear.clip(0, 1), abs=1.2 / 255)
        numbers = read_codes(made.folder / "instances" / f"{view.name}.png")
        disc = numbers == _numbers(made.index)["disc 0"]
        red_over_blue = [x[disc][:, 0].mean() / x[disc][:, 2].mean() for x in (raw, reference)]
        assert red_over_blue[1] > 1.2 * red_over_blue[0]
        if kind == "pairs_air":
            # What makes the wet channels this picture makes the dry ones the other.
            (dry,) = (x for x in _of_pose(made, "air") if x.record["pose"] == view.record["pose"])
            channels = [_layers_of(made, x)["I"] for x in (view, dry)]
            matrix = np.linalg.lstsq(channels[0].reshape(-1, 3), linear.reshape(-1, 3))[0]
            assert reference[disc].mean(axis=0) == pytest.approx(
                (channels[1] @ matrix)[disc].mean(axis=0), rel=0.01
            )


def test_blender_reads_its_own_names(made, empty_blender):
    view = _of_pose(made, "air")[0]
    path = made.folder / "exr" / f"{view.name}.exr"
    image = bpy.data.images.load(str(path))
    assert len(image.pixels) == 0  # reads it; pictures of several layers have none of their own
    assert image.type == "MULTILAYER"
    tree = bpy.data.node_groups.new("compositing", "CompositorNodeTree")
    node = tree.nodes.new("CompositorNodeImage")
    node.image = image
    assert {"Combined", "Depth", "Normal", "Vector"} <= {x.name for x in node.outputs}
    spec = oiio.ImageInput.open(str(path)).spec()
    ours = read_exr(path)[0][..., list(spec.channelnames).index("ViewLayer.Depth.Z")]
    planar = read_depth_exr(made.folder / "depth" / f"{view.name}.exr")[1]
    assert ours == pytest.approx(np.where(np.isfinite(planar), planar, 1e10), rel=1e-5)


def test_models_of_bop_are_the_discs_in_millimetres(made):
    root = made.folder / "bop"
    infos = json.loads((root / "models" / "models_info.json").read_text())
    truth = json.loads((root / "train" / "000000" / "scene_gt.json").read_text())
    models = {item["obj_id"] for items in truth.values() for item in items}
    assert set(infos) == {str(model) for model in models}
    for model in models:
        mesh = trimesh.load(root / "models" / f"obj_{model:06d}.ply", process=False)
        assert mesh.area == pytest.approx(np.pi * 250**2, rel=0.002)
        assert infos[str(model)]["diameter"] == pytest.approx(500, rel=1e-3)
    camera = json.loads((root / "camera.json").read_text())
    assert (camera["fx"], camera["fy"], camera["cx"], camera["cy"]) == (150, 160, 84, 54.75)


@pytest.mark.parametrize("engine", ["cycles", "eevee"])
def test_pairs_of_layered_water_are_made_or_refused_before_a_render(tmp_path, capsys, engine):
    """Cycles rendered such a set and then had no J to make the pairs of."""
    profile, out = tmp_path / "profile.csv", tmp_path / "out"
    profile.write_text("depth_m,cdom\n0,0.02\n4,0.5\n")
    small = SPEC.replace('"jerlov:IB", "air"', f'"file:{profile}"').replace(
        "count = 2", "count = 1"
    )
    small = small.replace(json.dumps(list(FORMATS)), '["pairs"]').replace('layers = "position"', "")
    if engine == "cycles":
        small = small.replace('"eevee"\nmode = "realtime"', '"cycles"')
        small = small.replace("diffuse_shadows = false\n", "")
    (tmp_path / "spec.toml").write_text(small)
    _discs(tmp_path / "discs.blend")
    plan = ["--dataset", tmp_path / "spec.toml", "--dataset-plan", "--out", out]
    assert _run(*plan) == (2 if engine == "cycles" else 0)
    told = capsys.readouterr().err
    assert ("pairs is made of the layer J, which Cycles" in told) is (engine == "cycles")
    assert (out / "dataset.json").exists() is (engine == "eevee")


def test_a_model_without_a_mesh_is_named(made, tmp_path, capsys):
    """An object of geometry nodes that make instances has none, and was left out in silence."""
    # The first disc becomes one; its number, poses and pixels are those of the set.
    folder, index = tmp_path / "set", made.index
    shutil.copytree(made.folder, folder, ignore=shutil.ignore_patterns("bop"))
    bpy.ops.wm.open_mainfile(filepath=str(made.spec.with_name("discs.blend")))
    (lost,) = (scene_object for scene_object in index.objects if scene_object.name == "disc 0")
    others = {
        scene_object.name for scene_object in index.objects if scene_object.model == lost.model
    }
    for name in others:
        bpy.data.objects[name].data.clear_geometry()
    notes: list[str] = []
    moved = replace(index, folder=folder)
    data_set_jobs.export(
        read_jobs(moved), read_spec(made.spec), lambda: bpy.context.scene, notes.append
    )
    (note,) = notes
    assert f"models {lost.model} ({lost.category}) have no mesh" in note
    assert note in (folder / "README.md").read_text()
    assert not (folder / "bop" / "models" / f"obj_{lost.model:06d}.ply").exists()
    assert "have no mesh" not in (made.folder / "README.md").read_text()


def test_every_format_has_its_folder_and_evo_reads_the_ways(made):
    folders = {"yolo", "yolo_segments", "tum", "euroc", "kitti", "tartanair", "rosbag2", "hdf5"}
    assert folders | {"camera_info", "croissant.json"} <= {x.name for x in made.folder.iterdir()}
    for water, folder in zip(("jerlov:IB", "air"), sorted((made.folder / "tum").iterdir())[::-1],
                             strict=True):  # fmt: skip
        views = _of_pose(made, water)
        found = file_interface.read_tum_trajectory_file(folder / "probe" / "groundtruth.txt")
        euroc = made.folder / "euroc" / folder.name / "mav0" / "state_groundtruth_estimate0"
        also = file_interface.read_euroc_csv_trajectory(euroc / "data.csv")
        for ways in (found, also):
            assert [turned(pose) for pose in ways.poses_se3] == [
                pytest.approx(view.camera_to_world, abs=1e-6) for view in views
            ]
            assert ways.timestamps == pytest.approx([0, 0.1])
        bag = made.folder / "rosbag2" / folder.name
        with Reader(bag) as reader:
            odometry = file_interface.read_bag_trajectory(reader, "/odometry")
        assert odometry.positions_xyz == pytest.approx(found.positions_xyz, abs=1e-9)


def _with_way(path: Path) -> list[np.ndarray]:
    """Save the discs with a camera that moves; return its poses of frames 2, 4, 6."""
    _discs(path)
    scene = bpy.context.scene
    scene.render.fps, scene.frame_start, scene.frame_end = 25, 2, 7
    camera = bpy.data.objects.new("diver", bpy.data.cameras.new("diver"))
    scene.collection.objects.link(camera)
    for frame, x, tilt in ((1, -1.0, 1.0), (8, 1.5, 1.4)):
        camera.location, camera.rotation_euler = (x, -3.0, -2.0), (tilt, 0.1, 0.3 * x)
        for name in ("location", "rotation_euler"):
            camera.keyframe_insert(name, frame=frame)
    poses = []
    for frame in (2, 4, 6):
        scene.frame_set(frame)
        poses.append(np.array(camera.matrix_world))
    scene.frame_set(1)
    bpy.ops.wm.save_mainfile()
    return poses


def test_the_way_of_a_camera_of_the_scene_is_planned(tmp_path, capsys):
    true = _with_way(tmp_path / "discs.blend")
    poses = '[[poses]]\nkind = "camera"\ncamera = "diver"\nstep = 2\n'
    before, after = SPEC.split("[[poses]]")[0], SPEC.split("count = 2\n")[1]
    spec, out = tmp_path / "spec.toml", tmp_path / "out"
    spec.write_text(before + poses + after)
    assert _run("--dataset", spec, "--out", out, "--dataset-plan") == 0
    views = _of_pose(Made(out, read_index(out / "dataset.json"), spec), "air")
    for view, pose in zip(views, true, strict=True):
        lowered = pose - np.outer((0, 0, 1.5, 0), (0, 0, 0, 1))
        assert view.camera_to_world == pytest.approx(lowered, abs=1e-6)
    assert [view.record["time_s"] for view in views] == pytest.approx([0, 0.08, 0.16])
    capsys.readouterr()
    spec.write_text(before + poses.replace("diver", "driver") + after)
    assert _run("--dataset", spec, "--out", tmp_path / "other", "--dataset-plan") == 2
    assert "has no camera 'driver', but diver; name one of them" in capsys.readouterr().err


# --- What cannot be used ----------------------------------------------------------------------


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("zenith = 30", "zenith = { from = 40, to = 20 }", "range from 40 to 20 is empty"),
        ('"jerlov:IB"', '"jerlov:IX"', "water.name: unknown Jerlov type 'IX'"),
        ('file = "discs.blend"', 'file = "disks.blend"', "disks.blend .*is not there"),
        ('file = "discs.blend"\n', "", "names no scene"),
        ("samples = 1", "sample = 1", r"\[render\].*--sample"),
        ("samples = 1", "samples = 0", "--samples: 0 is outside"),
        ("radius = 3", "radius = 30", "above the water"),
        ('["sand"]', '["sandd"]', "category of output.leave_out 'sandd'. Near names: sand"),
        ("seed = 5", "seed = 99999999999", "seed: 99999999999 is above 2147483647"),
        ('name = "probe"', 'name = "disc 0"', "the scene has an object of that name"),
        ("seed = 5", "seed = 5\nrepeats = 2", None),
        ('[detector]\npattern = "GRBG"', '[detector]\npattern = "GBRB"', "GBRB"),
        ("[detector]", "[detector]\nbits = 20", "bits must be 1 to 16"),
        ('layers = "position"', 'layers = "depth"', "depth"),
    ],
)
def test_bad_specifications_say_what_to_do(tmp_path, capsys, old, new, message):
    _discs(tmp_path / "discs.blend")
    _blank()
    assert old in SPEC
    (tmp_path / "spec.toml").write_text(SPEC.replace(old, new))
    out = tmp_path / "out"
    status = _run("--dataset", tmp_path / "spec.toml", "--out", out, "--dataset-plan")
    error = capsys.readouterr().err
    if message is None:
        assert status == 0
        return
    assert status == 2
    assert re.search(message, error), error
    assert not list(tmp_path.glob("out/jobs/*/passes"))


def test_cameras_that_are_always_in_rock_say_so(tmp_path, capsys):
    _discs(tmp_path / "discs.blend")
    rock = scenes._cube("rock", (0.0, 0.0, -20.0))
    rock.scale = (5.0, 5.0, 5.0)
    bpy.ops.wm.save_mainfile()
    poses = """[[poses]]
kind = "random"
low = [-1, -1, -21]
high = [1, 1, -19]
target_low = [0, 0, -20]
target_high = [0.1, 0.1, -19]
clearance = 0.1
count = 2
"""
    before, after = SPEC.split("[[poses]]")[0], SPEC.split("count = 2\n")[1]
    after = after.replace(json.dumps(list(FORMATS)), '["coco"]')
    (tmp_path / "spec.toml").write_text(before + poses + after)
    assert _run("--dataset", tmp_path / "spec.toml", "--out", tmp_path / "out") == 2
    error = capsys.readouterr().err
    assert "of 500 cameras none fits: 500 are inside objects" in error
    assert "change the box" in error


def test_an_orbit_into_the_ground_says_so(tmp_path, capsys):
    _discs(tmp_path / "discs.blend")
    text = SPEC.replace("target = [0, 0, -3]", "target = [0, 0, -7]")
    (tmp_path / "spec.toml").write_text(text)
    assert _run("--dataset", tmp_path / "spec.toml", "--out", tmp_path / "out") == 2
    assert "around: camera 0, at (-0.47" in capsys.readouterr().err


def test_a_full_disk_says_how_much_is_needed(tmp_path, capsys, monkeypatch):
    _discs(tmp_path / "discs.blend")
    (tmp_path / "spec.toml").write_text(SPEC)
    usage = shutil.disk_usage(tmp_path)._replace(free=100_000)
    monkeypatch.setattr(data_set_jobs.shutil, "disk_usage", lambda _: usage)
    assert _run("--dataset", tmp_path / "spec.toml", "--out", tmp_path / "out") == 2
    assert "make room, choose another --out, or shorten" in capsys.readouterr().err


def test_repeats_need_noise_of_their_own(tmp_path, capsys):
    _discs(tmp_path / "discs.blend")
    text = SPEC.replace("seed = 5", "seed = 5\nrepeats = 2").replace("[detector]", "")
    (tmp_path / "spec.toml").write_text(text.replace('pattern = "GRBG"\n', ""))
    assert _run("--dataset", tmp_path / "spec.toml", "--out", tmp_path / "out") == 2
    assert "the pictures would be the same; give a [detector]" in capsys.readouterr().err


def test_options_that_the_specification_decides_are_refused(tmp_path, capsys):
    (tmp_path / "spec.toml").write_text(SPEC)
    for options, message in (
        (["--water", "jerlov:II"], "--water: .*decides"),
        (["--resolution", 8, 8], "--resolution: not with a data set"),
        (["--frames", "1-3"], "--frames: not with a data set"),
    ):
        assert _run("--dataset", tmp_path / "spec.toml", "--out", tmp_path / "out", *options) == 2
        assert message.split(":")[0] in capsys.readouterr().err
