"""Jobs of views, their index, known points, and raw pictures; without Blender."""

from __future__ import annotations

import dataclasses
import tomllib
from pathlib import Path

import numpy as np
import pytest
import rawpy
from underwater_spectral.datasets.axes import looking_at
from underwater_spectral.datasets.camera import PinholeCamera
from underwater_spectral.datasets.colmap import sparse_points
from underwater_spectral.datasets.enumeration import enumerate_views
from underwater_spectral.datasets.grouping import group_views
from underwater_spectral.datasets.index import (
    Index,
    SceneObject,
    is_index,
    read_index,
    write_index,
)
from underwater_spectral.datasets.outputs import RawOutputs
from underwater_spectral.datasets.raw_files import write_raw
from underwater_spectral.datasets.specification import parse_spec, read_spec
from underwater_spectral.datasets.view import DataSetView
from underwater_spectral.uw_spectral.detector import Detector, Vignetting
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr

SPEC = Path(__file__).with_name("reef.toml")
RANDOM = {
    "kind": "random", "low": [0, 0, -3], "high": [1, 1, -3], "target_low": [0, 0, -4],
    "target_high": [1, 1, -4], "count": 2,
}  # fmt: skip


BENT = {
    "name": "bent", "width": 64, "height": 48, "field_of_view": 60,
    "distortion": [0, 0, 0, 0, 0.1],
}  # fmt: skip
DISTORTED = {"camera": [BENT]}
PORT = {"camera": [{k: v for k, v in BENT.items() if k != "distortion"} | {"port": "flat"}]}


def spec_with(**changes):
    return parse_spec(tomllib.loads(SPEC.read_text()) | changes, SPEC.parent)


def test_jobs_have_one_water_camera_and_rig_and_a_frame_a_pose():
    spec = spec_with(scene={"depth": [2, 5]})
    views = enumerate_views(spec)
    jobs, places = group_views(spec, views, seeded=False)
    assert len(jobs) == 3 * 2 * 2
    assert len({job.name for job in jobs}) == len(jobs)
    assert len({job.group for job in jobs}) == 3 * 2  # two cameras see one scene
    for job in jobs:
        assert list(job.frames) == list(range(1, 9))
        assert {view.camera.name for view in job.frames.values()} == {job.camera.name}
    by_frame = {}
    for view in views:
        pose = view.pose, view.lowered
        assert by_frame.setdefault(places[view.name].frame, pose) == pose
    # What is drawn for a pose is the frame's, not the job's.
    zeniths = {view.settings["sun_zenith"] for view in jobs[0].frames.values()}
    assert len(zeniths) == 4


def test_repeats_are_rendered_where_noise_has_a_seed():
    spec = spec_with(repeats=2)
    views = enumerate_views(spec)
    together, _ = group_views(spec, views, seeded=False)
    apart, places = group_views(spec, views, seeded=True)
    assert (len(together), len(apart)) == (12, 24)
    assert {job.seed for job in apart} == {19, 20}
    assert len({(place.job, place.frame) for place in places.values()}) == len(views)


def test_jobs_of_cameras_whose_names_differ_by_case_have_folders_of_their_own():
    spec = spec_with()
    (camera, *_) = spec.cameras
    both = tuple(dataclasses.replace(camera, name=name) for name in ("Left", "left"))
    spec = dataclasses.replace(spec, cameras=both)
    jobs, _ = group_views(spec, enumerate_views(spec), seeded=False)
    assert len({job.name.lower() for job in jobs}) == len(jobs)


def test_names_of_other_jobs_are_not_taken():
    spec = spec_with()
    views = enumerate_views(spec)
    jobs, _ = group_views(spec, views, seeded=False)
    more, _ = group_views(spec, views, seeded=False, taken=[job.name for job in jobs])
    assert {job.name for job in jobs}.isdisjoint(job.name for job in more)


@pytest.fixture
def index(tmp_path) -> Index:
    spec = spec_with()
    jobs, views = group_views(spec, enumerate_views(spec), seeded=False)
    scene_object = SceneObject("rock", "rocks", 7, 1, tuple(map(tuple, np.eye(4).tolist())))
    return Index(
        tmp_path, tmp_path / "spec.toml", tmp_path / "reef.blend", "12ab", {"engine": "eevee"},
        tuple(job.name for job in jobs), views, (scene_object,),
    )  # fmt: skip


def test_an_index_is_read_as_it_was_written(index, tmp_path):
    path = tmp_path / "dataset.json"
    write_index(path, index)
    assert is_index(path)
    found = read_index(path)
    assert found.jobs == index.jobs
    assert found.objects == index.objects
    assert (found.spec, found.scene) == (index.spec.resolve(), index.scene.resolve())
    for view, other in zip(found.views.values(), index.views.values(), strict=True):
        assert (view.name, view.job, view.frame) == (other.name, other.job, other.frame)
        assert view.camera == other.camera
        assert np.array_equal(view.camera_to_world, other.camera_to_world)
    moved = tmp_path / "elsewhere"
    moved.mkdir()
    assert read_index(path.rename(moved / path.name)).folder == moved
    assert str(tmp_path) not in (moved / path.name).read_text()


def test_an_index_that_is_none_says_so(index, tmp_path):
    path = tmp_path / "dataset.json"
    with pytest.raises(InputError, match="plan the data set with --dataset"):
        read_index(path)
    write_index(path, index)
    text = path.read_text()
    for content, message in (
        (text[:100], "is damaged"),
        ("{}", "no index of a data set"),
        (text.replace('"format": 1', '"format": 9'), "format 9"),
        (text.replace('"jobs"', '"gigs"'), "is damaged .KeyError"),
    ):
        path.write_text(content)
        with pytest.raises(InputError, match=message):
            read_index(path)
    assert not is_index(tmp_path)


def _plane(camera: PinholeCamera, name: str, eye) -> tuple[DataSetView, np.ndarray]:
    """A view of the level plane z = -8, and its planar depth."""
    view = DataSetView(name, Path(f"{name}.png"), camera, looking_at(eye, (0, 0, -8)))
    rays = camera.rays() * (1, -1, -1) @ view.camera_to_world[:3, :3].T
    distance = np.where(rays[..., 2] < -1e-3, (-8 - eye[2]) / rays[..., 2], np.inf)
    return view, distance * camera.rays()[..., 2]


def test_points_are_where_the_views_see_them():
    camera = PinholeCamera(80, 60, 60.0, 61.0, 41.3, 28.2)
    made = [_plane(camera, str(n), eye) for n, eye in enumerate([(0, -4, -5), (3, -2, -4)])]
    views, depths = [view for view, _ in made], {view.name: d for view, d in made}
    colours = np.arange(80 * 60 * 3).reshape(60, 80, 3).astype(np.uint8)
    points = sparse_points(views, lambda v: depths[v.name], lambda _: colours, 40)
    assert len(points) == 80
    assert sum(len(point.seen) == 2 for point in points) > 30
    for number, point in enumerate(points):
        assert point.position[2] == pytest.approx(-8.0)
        assert views[number // 40].name in point.seen
        for view in views:
            if view.name in point.seen:
                at = view.project(np.array(point.position))
                assert point.seen[view.name] == pytest.approx(tuple(at), abs=1e-9)
    # Where another object is nearer, the point is not seen.
    wall = {"0": depths["0"], "1": np.full((60, 80), 0.5)}
    hidden = sparse_points(views[:1], lambda v: depths[v.name], lambda _: colours, 40)
    both = sparse_points(views, lambda v: wall[v.name], lambda _: colours, 40)
    assert [p.position for p in both[:40]] == [p.position for p in hidden]
    assert all(set(p.seen) == {"0"} for p in both[:40])


@pytest.mark.parametrize("iso", [100.0, 400.0, 6400.0])
def test_no_iso_clips_what_is_below_white(index, tmp_path, iso):
    """At four times the base ISO everything above half of white was clipped."""
    view = next(iter(index.views.values()))
    raw = RawOutputs(Detector(shot_noise=False), iso=iso)
    grey = np.broadcast_to(0.95, (view.camera.height, view.camera.width, 3))
    write_raw(tmp_path / "a.tiff", view, raw, grey, np.eye(3))
    counts = np.round(read_exr(tmp_path / "a.tiff")[0] * 65535)
    full = raw.detector.full_well * raw.detector.gain
    fraction = (counts - raw.detector.black_level) / full
    assert np.median(fraction) == pytest.approx(0.475, rel=0.02)


def test_raw_pictures_are_counted_by_the_detector(index, tmp_path):
    view = next(iter(index.views.values()))
    size = (view.camera.height, view.camera.width)
    to_rec709 = np.array([[2.0, -0.5, 0.0], [-0.25, 1.5, -0.25], [0.0, -0.5, 3.0]])
    white = np.linalg.solve(to_rec709, np.ones(3))
    still = Detector(10_000.0, 0.0, 0.0, 0.4, 12, 50.0, shot_noise=False)
    raw = RawOutputs(still, white=0.5, pattern="RGGB", file="dng")
    grey = np.broadcast_to(0.3 * white, (*size, 3))
    record = write_raw(tmp_path / "a.dng", view, raw, grey, to_rec709)
    assert record["white_response"] == pytest.approx(white)
    with rawpy.imread(str(tmp_path / "a.dng")) as found:
        wanted = 50 + 0.4 * 10_000 * 0.5 * 0.3 * white / white.max()
        counts = [found.raw_image[0, 0], found.raw_image[0, 1], found.raw_image[1, 1]]
        assert counts == pytest.approx(wanted, abs=0.51)
    dark = dataclasses.replace(raw, pattern=None, file="tiff", vignetting=Vignetting())
    write_raw(tmp_path / "a.tiff", view, dark, grey, to_rec709)
    channels = np.round(read_exr(tmp_path / "a.tiff")[0] * 65535)
    middle, corner = channels[size[0] // 2, size[1] // 2], channels[0, 0]
    x, y = (0.5 - view.camera.cx) / view.camera.fx, (0.5 - view.camera.cy) / view.camera.fy
    # A count of 0.5 is 0.3 % of the darkest channel's.
    fraction = (1 + x**2 + y**2) ** -2
    assert (corner - 50) / (middle - 50) == pytest.approx(np.full(3, fraction), rel=0.01)
    noisy = RawOutputs(Detector(), pattern="RGGB", file="dng")
    for name in ("b", "c"):
        write_raw(tmp_path / f"{name}.dng", view, noisy, grey, to_rec709)
    assert (tmp_path / "b.dng").read_bytes() == (tmp_path / "c.dng").read_bytes()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"output": {"picture": "gif"}}, "output.picture 'gif'"),
        ({"output": {"formats": ["kiti"]}}, "output.formats 'kiti'. Near names: kitti"),
        ({"output": {"formats": ["kitti"]}}, "'kitti' takes one .*not wide, narrow; leave out"),
        ({"output": {"formats": ["flow"]}, "poses": [RANDOM]}, "'flow' needs poses that follow"),
        (
            {"output": {"formats": ["tum"]}, "scene": {"depth": {"from": 3, "to": 5}}},
            "'tum' needs ways, and scene.depth is drawn",
        ),
        ({"output": {"formats": ["pairs_air"]}, "water": {"name": "jerlov:I"}}, "'air' beside it"),
        ({"output": {"formats": ["pairs"]}, "water": {"name": "air"}}, "'pairs' needs a water"),
        ({"detector": {"pattern": "RGGB"}}, "'narrow': the observer cie1931 has no mosaic RGGB"),
        ({"output": {"formats": "bop"}}, "list of texts"),
        (DISTORTED | {"output": {"formats": ["bop"]}}, "'bop' holds none .*'bent'"),
        (DISTORTED | {"output": {"formats": ["kitti"]}}, "'kitti' holds none"),
        (DISTORTED | {"output": {"formats": ["tartanair"]}}, "'tartanair' holds none"),
        (DISTORTED | {"output": {"formats": ["euroc"]}}, "'euroc' holds k1, k2, p1 and p2"),
        (PORT | {"output": {"formats": ["bop"]}}, "'bop' holds none"),
        (PORT | {"output": {"formats": ["euroc"]}}, "'euroc' holds k1"),
        ({"output": {"linear": 1}}, "true or false"),
        ({"output": {"masks": True}}, "unknown key of output 'masks'"),
        ({"detector": {"file": "dng"}}, "a DNG holds a mosaic"),
        ({"detector": {"iso": 50}}, "below the base"),
        ({"detector": {"white": 0}}, "white is above 0"),
        ({"detector": {"vignetting": "yes"}}, "list of radial coefficients"),
        ({"detector": {"gains": -1}}, "gains must be 0 or more"),
        ({"render": {"samples": [1, 2]}}, "render.samples"),
        ({"scene": {"file": 3}}, "scene.file"),
        ({"scene": {"frame": -1}}, "scene.frame"),
    ],
)
def test_bad_outputs_say_what_and_where(changes, message):
    with pytest.raises(InputError, match=message):
        spec_with(**changes)


def test_the_small_set_of_the_examples_has_32_views():
    spec = read_spec(SPEC.parents[2] / "examples" / "datasets" / "reef_small.toml")
    assert len(enumerate_views(spec)) == (3 + 1) * 4 * 2
