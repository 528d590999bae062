"""What is written is read by the software it is for, and known points reproject."""

from __future__ import annotations

import contextlib
import dataclasses
import io
import json

import cv2
import numpy as np
import OpenImageIO as oiio
import pycolmap
import pytest
from pycocotools import mask as coco_mask
from pycocotools.coco import COCO
from underwater_spectral.datasets.axes import blender_from_opencv
from underwater_spectral.datasets.bop import write_bop
from underwater_spectral.datasets.card import DataCard, Source, write_card
from underwater_spectral.datasets.coco import category_ids, compressed, run_lengths, write_coco
from underwater_spectral.datasets.colmap import SparsePoint, write_colmap
from underwater_spectral.datasets.depth_maps import (
    euclidean_range,
    planar_depth,
    read_depth_exr,
    read_depth_png,
    write_depth_exr,
    write_depth_png,
)
from underwater_spectral.datasets.files import write_json
from underwater_spectral.datasets.instance_maps import visible_masks, write_instance_map
from underwater_spectral.datasets.nerfstudio import write_nerfstudio
from underwater_spectral.datasets.picture_codes import read_codes
from underwater_spectral.datasets.view import DataSetView, SeenInstance
from underwater_spectral.tests.datasets.scene_of_boxes import ACROSS, BENT, PLAIN, POINTS, poses
from underwater_spectral.tests.datasets.scene_of_boxes import views as made_views
from underwater_spectral.uw_spectral.errors import InputError

CARD = DataCard(
    "Reef", "CC-BY-4.0", (Source("reef", "GPL-3.0-or-later", "examples/"),), {"Blender": "5.2.3"}
)
CLOSE = 1e-6  # pixels; 0.1 would hide a wrong coefficient of distortion
# pycocotools' own, of its masks as arrays.
pytestmark = pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")


@pytest.fixture
def views(tmp_path):
    return made_views(tmp_path)


def test_colmap_reads_cameras_poses_and_points(views, tmp_path):
    points = [
        SparsePoint(
            tuple(p.tolist()), (10, 20, 30), {v.name: tuple(v.project(p).tolist()) for v in views}
        )
        for p in POINTS
    ]
    write_colmap(tmp_path / "sparse", views, points)
    model = pycolmap.Reconstruction(str(tmp_path / "sparse"))
    assert (len(model.cameras), len(model.images), len(model.points3D)) == (3, 3, len(POINTS))
    for view in views:
        image = next(i for i in model.images.values() if i.name == view.image.name)
        camera = model.cameras[image.camera_id]
        assert (camera.width, camera.height) == (view.camera.width, view.camera.height)
        for p in POINTS:
            seen = camera.img_from_cam(image.cam_from_world() * p)
            assert np.abs(seen - view.project(p)).max() < CLOSE
        for point in image.points2D:
            world = model.points3D[point.point3D_id].xyz
            assert np.abs(view.project(world) - point.xy).max() < 1e-6
    # And back: the pose that COLMAP read is the camera's in Blender's axes.
    matrix = np.eye(4)
    matrix[:3] = image.cam_from_world().matrix()
    assert blender_from_opencv(matrix) == pytest.approx(view.camera_to_world, abs=1e-9)
    errors = [p.error for p in model.points3D.values()]
    assert max(errors) < CLOSE


def test_colmap_keeps_no_more_of_a_camera_than_it_needs(views, tmp_path):
    write_colmap(tmp_path / "sparse", views)
    cameras = pycolmap.Reconstruction(str(tmp_path / "sparse")).cameras
    models = [cameras[i].model.name for i in sorted(cameras)]
    assert models == ["PINHOLE", "OPENCV", "FULL_OPENCV"]
    same = [dataclasses.replace(view, camera=BENT) for view in views]
    write_colmap(tmp_path / "sparse", same)
    assert len(pycolmap.Reconstruction(str(tmp_path / "sparse")).cameras) == 1


def _nerfstudio_pixels(frame: dict, points: np.ndarray) -> np.ndarray:
    """Pixels as nerfstudio's documentation of its convention has them: OpenGL, -z ahead."""
    pose = np.array(frame["transform_matrix"])
    local = (points - pose[:3, 3]) @ pose[:3, :3]
    ahead = local * (1, -1, -1)
    K = np.array([[frame["fl_x"], 0, frame["cx"]], [0, frame["fl_y"], frame["cy"]], [0, 0, 1]])
    distortion = np.array([frame[k] for k in ("k1", "k2", "p1", "p2", "k3")])
    return cv2.projectPoints(ahead, np.zeros(3), np.zeros(3), K, distortion)[0][:, 0]


def test_nerfstudio_poses_reproject(views, tmp_path):
    path = tmp_path / "transforms.json"
    write_nerfstudio(path, views)
    content = json.loads(path.read_text())
    assert content["depth_unit_scale_factor"] == 1e-3
    for view, frame in zip(views, content["frames"], strict=True):
        seen = _nerfstudio_pixels(frame, POINTS)
        assert np.abs(seen - view.project(POINTS)).max() < CLOSE
        assert cv2.imread(tmp_path / frame["file_path"]).shape[:2] == (frame["h"], frame["w"])
        depth = cv2.imread(tmp_path / frame["depth_file_path"], cv2.IMREAD_UNCHANGED)
        assert depth.dtype == np.uint16
    assert content["train_filenames"] == ["view_0.png"]
    assert content["test_filenames"] == ["view_2.png"]


def test_nerfstudio_has_one_camera_at_the_top(views, tmp_path):
    path = tmp_path / "transforms.json"
    write_nerfstudio(path, [dataclasses.replace(view, camera=PLAIN) for view in views])
    content = json.loads(path.read_text())
    assert content["fl_x"] == PLAIN.fx
    assert "fl_x" not in content["frames"][0]


def test_bop_scenes_reproject_and_count(views, tmp_path):
    with pytest.raises(InputError, match="no lens distortion"):
        write_bop(tmp_path / "bent", views)
    views = made_views(tmp_path, [ACROSS] * 3)
    scene = tmp_path / "set" / "train" / "000000"
    write_bop(scene, views)
    cameras, poses_of, infos = (
        json.loads((scene / f"scene_{name}.json").read_text())
        for name in ("camera", "gt", "gt_info")
    )
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * 100.0  # mm
    for number, view in enumerate(views):
        camera = cameras[str(number)]
        K = np.array(camera["cam_K"]).reshape(3, 3)
        for item, pose in zip(view.instances, poses_of[str(number)], strict=True):
            R = np.array(pose["cam_R_m2c"]).reshape(3, 3)
            turn, shift = cv2.Rodrigues(R)[0], np.array(pose["cam_t_m2c"])
            seen = cv2.projectPoints(corners, turn, shift, K, None)[0][:, 0]
            world = corners / 1e3 @ item.object_to_world[:3, :3].T + item.object_to_world[:3, 3]
            ours = view.project(world) - 0.5
            ahead = (corners @ R.T + shift)[:, 2] > 0
            assert np.abs(seen - ours)[ahead].max() < CLOSE
            assert pose["obj_id"] == item.model
        coral, rock = infos[str(number)]
        assert coral["bbox_obj"] == [8, 10, 32, 20]
        assert coral["bbox_visib"] == [24, 10, 16, 20]
        assert coral["visib_fract"] == 0.5
        assert rock["px_count_valid"] == rock["px_count_all"] * 19 // 24  # no depth from x = 0 to 4
        depth = cv2.imread(scene / "depth" / f"{number:06d}.png", cv2.IMREAD_UNCHANGED)
        metres = depth * camera["depth_scale"] / 1e3
        assert metres == pytest.approx(np.nan_to_num(read_depth_png(view.depth), posinf=0.0))
        mask = cv2.imread(scene / "mask_visib" / f"{number:06d}_000000.png", cv2.IMREAD_UNCHANGED)
        assert set(np.unique(mask)) == {0, 255}
        assert np.count_nonzero(mask) == coral["px_count_visib"]


def test_coco_is_read_and_its_masks_decode(views, tmp_path):
    path = tmp_path / "instances.json"
    write_coco(path, views, CARD)
    with contextlib.redirect_stdout(io.StringIO()):
        coco = COCO(str(path))
    assert [c["name"] for c in coco.loadCats(coco.getCatIds())] == ["coral", "rock"]
    assert len(coco.getAnnIds()) == 6
    for image, view in zip(coco.loadImgs(coco.getImgIds()), views, strict=True):
        masks = visible_masks(view)
        found = coco.loadAnns(coco.getAnnIds(imgIds=image["id"]))
        for annotation, item in zip(found, view.instances, strict=True):
            mask = coco.annToMask(annotation).astype(bool)
            assert np.array_equal(mask, masks[item.number])
            assert coco_mask.area(annotation["segmentation"]) == annotation["area"]
            assert coco_mask.toBbox(annotation["segmentation"]).tolist() == annotation["bbox"]


def test_coco_numbers_categories_as_the_scene_does_and_alike_in_all_splits(views, tmp_path):
    """A split that lacked a category numbered the others anew."""

    def with_ids(view, ids):
        seen = [dataclasses.replace(x, category_id=ids.get(x.category)) for x in view.instances]
        return dataclasses.replace(view, instances=tuple(seen))

    names = sorted({x.category for view in views for x in view.instances})
    first, *others = names
    assert category_ids([with_ids(view, {first: 17}) for view in views])[first] == 17
    assert category_ids(views) == {name: n for n, name in enumerate(names, 1)}
    given = category_ids([with_ids(view, {first: 17}) for view in views])
    assert sorted(given.values()) == [17, *range(18, 18 + len(others))]
    of_set = {"another": 1} | {name: n for n, name in enumerate(names, 2)}
    write_coco(tmp_path / "few.json", views[:1], CARD, of_set)
    written = json.loads((tmp_path / "few.json").read_text())
    assert {x["name"]: x["id"] for x in written["categories"]} == of_set
    assert {x["category_id"] for x in written["annotations"]} <= {*range(2, 2 + len(names))}


def test_coco_leaves_out_what_is_hidden(views, tmp_path):
    hidden = dataclasses.replace(views[0], instances=(*views[0].instances, SeenInstance(9, "fish")))
    write_coco(tmp_path / "instances.json", [hidden], CARD)
    content = json.loads((tmp_path / "instances.json").read_text())
    assert len(content["annotations"]) == 2
    assert [c["name"] for c in content["categories"]] == ["coral", "fish", "rock"]


@pytest.mark.parametrize("seed", range(30))
def test_run_lengths_are_those_of_pycocotools(seed):
    random = np.random.default_rng(seed)
    shape = random.integers(1, 90, 2)
    mask = random.random(shape) < random.choice([0.01, 0.5, 0.99])
    if seed % 3 == 0:
        mask = np.repeat(np.repeat(mask, 40, axis=0), 9, axis=1)
    theirs = coco_mask.encode(np.asfortranarray(mask.astype(np.uint8)))["counts"].decode()
    assert compressed(run_lengths(mask)) == theirs


def test_depth_keeps_its_millimetres(tmp_path):
    depth = np.array([[0.001, 1.2344, 65.535], [np.inf, 0.0, 70.0]])
    assert write_depth_png(tmp_path / "depth.png", depth) == 1
    codes = cv2.imread(tmp_path / "depth.png", cv2.IMREAD_UNCHANGED)
    assert codes.tolist() == [[1, 1234, 65535], [0, 0, 0]]
    again = read_depth_png(tmp_path / "depth.png")
    assert again[0] == pytest.approx([0.001, 1.234, 65.535])
    assert np.isinf(again[1]).all()


@pytest.mark.parametrize("value", [-1.0, np.nan])
def test_depths_that_are_none_are_refused(tmp_path, value):
    with pytest.raises(InputError, match="negative or not a number"):
        write_depth_png(tmp_path / "depth.png", [[value]])


def test_exr_holds_range_and_planar_depth_by_name(tmp_path):
    distances = np.random.default_rng(1).uniform(1, 9, (BENT.height, BENT.width))
    distances[0, 0] = np.inf
    write_depth_exr(tmp_path / "depth.exr", distances, BENT)
    image = oiio.ImageBuf(str(tmp_path / "depth.exr"))
    assert set(image.spec().channelnames) == {"range", "planar_depth"}
    assert "optical axis" in image.spec().get_string_attribute("planar_depth_is")
    across, along = read_depth_exr(tmp_path / "depth.exr")
    assert across == pytest.approx(distances, rel=1e-6)
    assert (along <= across).all()
    # Planar depth is that of the points themselves.
    points = BENT.rays() * np.where(np.isfinite(distances), distances, 1.0)[..., None]
    finite = np.isfinite(distances)
    assert along[finite] == pytest.approx(points[..., 2][finite], rel=1e-6)
    assert euclidean_range(planar_depth(distances, BENT), BENT) == pytest.approx(distances)


def test_eight_bit_codes_are_read_as_they_are(views):
    assert set(np.unique(read_codes(views[0].instances[0].silhouette))) == {0, 255}
    assert set(np.unique(read_codes(views[0].instances[1].silhouette))) == {0, 1}


def test_the_card_names_what_a_user_must_know(views, tmp_path):
    write_card(tmp_path / "README.md", CARD, views)
    text = (tmp_path / "README.md").read_text()
    for part in ("CC-BY-4.0", "GPL-3.0-or-later", "Blender 5.2.3", "| test | 1 |", "jerlov:IB",
                 "64 × 48", "| coral | 3 |", "planar_depth"):  # fmt: skip
        assert part in text


def test_a_card_without_licence_is_refused():
    with pytest.raises(InputError, match="licence is empty"):
        DataCard("Reef", " ")


def _broken(views, **changes):
    return [dataclasses.replace(views[0], **changes)]


def test_what_cannot_be_written_says_why(views, tmp_path):
    with pytest.raises(InputError, match="no view to write"):
        write_nerfstudio(tmp_path / "transforms.json", [])
    with pytest.raises(InputError, match="two views are named '0'"):
        write_colmap(tmp_path / "sparse", [views[0], views[0]])
    with pytest.raises(InputError, match="without spaces"):
        write_colmap(tmp_path / "sparse", _broken(views, image=tmp_path / "a b.png"))
    with pytest.raises(InputError, match="needs its depth"):
        write_bop(tmp_path / "bop", _broken(views, depth=None))
    with pytest.raises(InputError, match="no silhouette"):
        write_bop(
            tmp_path / "bop",
            _broken(views, instances=(SeenInstance(7, "a"), SeenInstance(12, "b"))),
        )
    with pytest.raises(InputError, match=r"not '.exr'"):
        write_bop(tmp_path / "bop", _broken(views, image=tmp_path / "a.exr"))
    with pytest.raises(InputError, match="no instance of view 0 has"):
        write_coco(tmp_path / "c.json", _broken(views, instances=(SeenInstance(7, "a"),)), CARD)
    with pytest.raises(InputError, match="give the picture of their numbers"):
        write_coco(tmp_path / "c.json", _broken(views, instance_map=None), CARD)
    with pytest.raises(InputError, match="the camera"):
        write_coco(tmp_path / "c.json", _broken(views, camera=BENT), CARD)
    with pytest.raises(InputError, match="is not a folder"):
        write_nerfstudio(tmp_path / "none" / "transforms.json", views)
    with pytest.raises(InputError, match="split 'testing'"):
        _broken(views, split="testing")
    with pytest.raises(InputError, match="share a number"):
        _broken(views, instances=(SeenInstance(7, "a"), SeenInstance(7, "b")))
    with pytest.raises(InputError, match="1 to 65535"):
        SeenInstance(0, "a")
    with pytest.raises(InputError, match="whole"):
        write_instance_map(tmp_path / "ids.png", np.array([[1.5]]))
    assert not list(tmp_path.rglob("*.tmp*"))


def test_views_compare_by_what_they_show(tmp_path):
    one, two = (DataSetView("a", tmp_path / "a.png", PLAIN, pose) for pose in poses()[:2])
    assert one.camera_to_world.flags.writeable is False
    assert one != dataclasses.replace(two, name="b")


def test_lists_of_numbers_take_a_line_and_text_stays(tmp_path):
    text = 'a [\n 1,\n 2\n] "b" \\n'
    content = {"K": [[1, 2.5, -3e-9], [0, 4, 5]], "none": [], "names": ["x", text], text: [None]}
    write_json(tmp_path / "a.json", content)
    written = (tmp_path / "a.json").read_text()
    assert json.loads(written) == content
    assert "  [1, 2.5, -3e-09],\n" in written
