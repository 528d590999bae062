"""Specifications: what they stand for, and what a bad one says."""

from __future__ import annotations

import json
import time
import tomllib
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from underwater_spectral.datasets.enumeration import enumerate_views, unfinished, write_plan
from underwater_spectral.datasets.pose_sets import RandomPoses, heading_pose
from underwater_spectral.datasets.specification import parse_spec, read_spec
from underwater_spectral.uw_spectral.errors import InputError

SPEC = Path(__file__).with_name("reef.toml")


def content(**changes) -> dict:
    """The specification beside this file with other tables; None takes one out."""
    found = tomllib.loads(SPEC.read_text()) | changes
    return {key: value for key, value in found.items() if value is not None}


def views(folder=Path(), **changes):
    return enumerate_views(parse_spec(content(**changes), folder))


def test_the_large_set_has_a_thousand_views_each_with_one_in_air():
    """Its four specifications."""
    specs = sorted((SPEC.parents[2] / "examples" / "datasets" / "sea_1000").glob("*.toml"))
    found = {path.stem: enumerate_views(read_spec(path)) for path in specs}
    assert {name: len(each) for name, each in found.items()} == {
        "pool": 180, "port": 242, "reef": 308, "wreck": 280,
    }  # fmt: skip
    waters = {view.settings["water"] for view in found["reef"]}
    assert len(waters) == 11
    for each in found.values():
        taken = {(view.pose, view.camera.name, view.rig.name) for view in each}
        dry = [view for view in each if view.settings["water"] == "air"]
        assert {(view.pose, view.camera.name, view.rig.name) for view in dry} == taken


def test_lists_are_crossed_and_the_same_views_are_in_every_water():
    found = enumerate_views(read_spec(SPEC))
    assert len(found) == 3 * 2 * 4 * 2
    assert len({view.name for view in found}) == len(found)
    by_water = Counter(view.settings["water"] for view in found)
    assert by_water == {"jerlov:IB": 16, "jerlov:3C": 16, "air": 16}
    for pose in range(4):
        of_pose = [view for view in found if view.pose == pose]
        assert len({view.camera_to_world.tobytes() for view in of_pose}) == 1
        # What is drawn is drawn once for a pose.
        assert len({view.settings["sun_zenith"] for view in of_pose}) == 1
        assert 10 <= of_pose[0].settings["sun_zenith"] <= 50
        assert len({view.split for view in of_pose}) == 1
    assert len({view.settings["sun_zenith"] for view in found}) == 4
    assert Counter(view.split for view in found) == {"train": 24, "val": 12, "test": 12}
    assert {view.in_air for view in found if view.settings["water"] == "air"} == {True}


def test_scenes_are_lowered_with_their_cameras():
    view = views(scene={"depth": [2, 7]})[-1]
    assert view.lowered == 7.0
    assert view.camera_to_world[2, 3] == pytest.approx(-1 + 3 * np.sin(np.radians(20)) - 7)


def test_it_is_the_same_every_time():
    one, two = (enumerate_views(read_spec(SPEC)) for _ in range(2))
    assert [view.record() for view in one] == [view.record() for view in two]
    other = views(seed=20)
    assert {view.name for view in other}.isdisjoint(view.name for view in one)


def test_names_stay_when_the_set_grows():
    before = {view.name for view in views()}
    more = views(water={"name": ["jerlov:IB", "jerlov:3C", "air", "case:baltic"]})
    assert before < {view.name for view in more}
    assert {view.name for view in unfinished(more, before)}.isdisjoint(before)
    assert len(unfinished(more, before)) == 16
    pinned = views()[0].name
    assert pinned == "b7a6f68e03cdee0d"


def test_files_count_by_their_content(tmp_path):
    names = []
    for folder, a in (("one", 0.1), ("two", 0.1), ("three", 0.2)):
        (tmp_path / folder).mkdir()
        rows = "\n".join(f"{nm},{a},0.2" for nm in (300, 500, 800))
        (tmp_path / folder / "water.csv").write_text(f"wavelength_nm,a,b\n{rows}\n")
        found = views(tmp_path / folder, water={"name": "file:water.csv"})
        assert found[0].settings["water"] == f"file:{tmp_path / folder / 'water.csv'}"
        names.append([view.name for view in found])
    assert names[0] == names[1] != names[2]


def test_settings_that_change_nothing_make_no_views():
    water = {"name": ["jerlov:IB", "constituents", "air"], "chlorophyll": [0.1, 1, 10],
             "source": ["solonenko2015", "williamson2022"]}  # fmt: skip
    sea = {"surface": ["flat", "waves"], "wind": [2, 8]}
    found = views(water=water, sea=sea, rig=None)
    poses, cameras = 4, 2
    waters_and_seas = {(v.settings["water"], v.settings.get("surface")) for v in found}
    assert ("air", None) in waters_and_seas
    per_pose = (2 + 3) * (1 + 2) + 1  # sources or amounts, times flat or two winds; air once
    assert len(found) == poses * cameras * per_pose
    assert "chlorophyll" not in found[0].settings


def test_repeats_differ_by_their_noise():
    found = views(repeats=3, rig=None)
    seeds = {view.noise_seed for view in found}
    assert len(seeds) == len(found) == 72


def test_settings_are_those_of_a_scene():
    from underwater_spectral.settings.scene_settings import SceneSettings

    water = {"name": "constituents", "chlorophyll": {"from": 0.1, "to": 10, "log": True},
             "cdom": 0.2, "minerals": 0, "detritus": 0.01, "scattering_factor": 1.5}  # fmt: skip
    sun = {"zenith": 20, "azimuth": 3, "sky": "clear", "sky_radiance": 0.1, "illuminant": "d65"}
    sea = {"surface": "waves", "wind": 4, "wind_direction": 10, "fetch": 20, "seed": 3}
    settings = views(water=water, sun=sun, sea=sea)[0].settings
    assert SceneSettings(**settings).wave_seed == 3
    assert 0.1 <= settings["chlorophyll"] <= 10


def test_orbits_look_at_their_target():
    poses = {view.pose: view.camera_to_world for view in views()}
    for pose in poses.values():
        along = np.array([0, 0, -6.0]) - pose[:3, 3]
        assert np.linalg.norm(along) == pytest.approx(3.0)
        assert -pose[:3, 2] == pytest.approx(along / 3.0, abs=1e-8)
    assert len({tuple(pose[:3, 3].round(6)) for pose in poses.values()}) == 4


def test_transects_keep_their_distance_and_heading():
    line = {"kind": "transect", "start": [0, 0, -2], "end": [0, 4, -2], "count": 5, "pitch": -30}
    poses = [v.camera_to_world for v in views(poses=[line], rig=None, water={"name": "air"})][::2]
    assert [pose[1, 3] for pose in poses] == [0, 1, 2, 3, 4]
    ahead = -poses[0][:3, 2]
    assert ahead == pytest.approx([0, np.cos(np.pi / 6), -0.5])
    across = heading_pose((0, 0, 0), 90.0, 0.0)
    assert -across[:3, 2] == pytest.approx([0, 1, 0], abs=1e-12)
    assert np.linalg.det(across[:3, :3]) == pytest.approx(1.0)


class Ball:
    """A ball of rock around the origin, seen if it lies within 20° of the optical axis."""

    radius = 1.0

    def clearance(self, point):
        return float(np.linalg.norm(point)) - self.radius

    def seen_fraction(self, camera_to_world, camera):
        del camera
        to_ball = -camera_to_world[:3, 3]
        cosine = to_ball @ -camera_to_world[:3, 2] / np.linalg.norm(to_ball)
        return 0.2 if cosine > np.cos(np.radians(20)) else 0.0


RANDOM = {
    "kind": "random",
    "name": "anywhere",
    "low": [-2, -2, -2],
    "high": [2, 2, 2],
    "target_low": [-2, -2, -2],
    "target_high": [2, 2, 2],
    "count": 40,
    "roll": 10,
}


def test_random_poses_keep_clear_and_see_objects():
    spec = parse_spec(content(poses=[RANDOM | {"clearance": 0.3, "in_view": 0.1}]), Path())
    found = {view.pose: view for view in enumerate_views(spec, Ball())}
    assert len(found) == 40
    for view in found.values():
        pose = view.camera_to_world.copy()
        pose[2, 3] += view.lowered
        assert Ball().clearance(pose[:3, 3]) >= 0.3 - 1e-6
        assert Ball().seen_fraction(pose, view.camera.optics) > 0.1
    free = {v.pose: v for v in enumerate_views(parse_spec(content(poses=[RANDOM]), Path()))}
    inside = [v for v in free.values() if np.linalg.norm(v.camera_to_world[:3, 3] + [0, 0, 5]) < 1]
    assert inside  # which shows that the constraint did something


def test_a_camera_that_is_always_inside_rock_says_so():
    box = {"low": [-0.1, -0.1, -0.1], "high": [0.1, 0.1, 0.1], "clearance": 0.2}
    spec = parse_spec(content(poses=[RANDOM | box]), Path())
    with pytest.raises(InputError, match="of 500 cameras none fits: 500 are inside objects"):
        enumerate_views(spec, Ball())
    with pytest.raises(InputError, match="need the scene"):
        enumerate_views(spec)


def test_a_pose_does_not_depend_on_how_many_there_are():
    sets = [RandomPoses("a", (0, 0, 0), (1, 1, 1), (2, 2, 2), (3, 3, 3), n) for n in (5, 50)]
    camera = read_spec(SPEC).cameras[0].optics
    one, two = (found.pose(1, 4, camera, None) for found in sets)
    assert np.array_equal(one, two)


def test_a_thousand_views_are_planned_in_a_second(tmp_path):
    poses = RANDOM | {"count": 84}
    spec = parse_spec(
        content(
            poses=[poses],
            rig=None,
            water={
                "name": ["jerlov:I", "jerlov:IB", "jerlov:II", "jerlov:3C", "case:baltic", "air"]
            },
        ),
        Path(),
    )
    start = time.process_time()
    found = enumerate_views(spec)
    write_plan(tmp_path / "views.jsonl", found)
    assert len(found) == 1008
    assert time.process_time() - start < 1.0
    lines = (tmp_path / "views.jsonl").read_text().splitlines()
    assert [json.loads(line)["name"] for line in lines] == [view.name for view in found]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"water": {"name": "jerlov:IBB"}},
            "water.name: unknown Jerlov type 'IBB'. Near names: IB",
        ),
        ({"water": {"name": []}}, "water.name: the list is empty"),
        ({"water": {}}, "water.name is missing"),
        ({"water": {"name": "seawater"}}, "is not understood; write jerlov:IB"),
        ({"water": {"name": "file:none.csv"}}, "none.csv"),
        ({"water": {"name": ["jerlov:IB", "jerlov:IB"]}}, "holds a value twice"),
        ({"water": {"name": "jerlov:IB", "chlorophyll": 1}}, "add it to the names"),
        ({"water": {"name": "jerlov:IB", "source": "mobley"}}, "unknown water.source 'mobley'"),
        ({"water": {"name": "jerlov:IB", "colour": 1}}, "unknown key of water 'colour'"),
        (
            {"sun": {"zenith": {"from": 50, "to": 10}}},
            "sun.zenith: the range from 50 to 10 is empty",
        ),
        ({"sun": {"zenith": {"from": 10, "to": 10}}}, "is empty; let it end above"),
        ({"sun": {"zenith": {"from": 10}}}, "a range is {from = 1, to = 5}"),
        ({"sun": {"zenith": {"from": 1, "to": 5, "steps": 1}}}, "steps: 1 is not"),
        ({"sun": {"zenith": 95}}, "0 to 89.9°"),
        ({"sun": {"zenith": "high"}}, "'high' is not a finite number"),
        ({"sun": {"zenith": True}}, "True is not a finite number"),
        ({"sun": {"zeniht": 5}}, "unknown key of sun 'zeniht'. Near names: zenith"),
        ({"sun": {"sky": "blue"}}, "unknown sun.sky 'blue'"),
        ({"sun": {"illuminant": "d66"}}, "d65"),
        ({"sea": {"surface": "rough"}}, "unknown sea.surface 'rough'"),
        ({"sea": {"wind": -1}}, "values are 0 or more"),
        ({"sea": {"seed": 1.5}}, "whole numbers"),
        ({"scene": {"depth": -3}}, "lowered by 0 m or more"),
        ({"scene": {"depth": 0}}, "around: a camera is 0.0260604 m above the water"),
        ({"camera": None}, r"\[\[camera\]\] is missing"),
        ({"camera": [{"name": "a", "width": 8, "height": 8}]}, "give field_of_view in degrees"),
        ({"camera": [{"name": "a", "width": 8, "height": 8, "field_of_view": 190}]}, "190°"),
        ({"camera": [{"name": "a", "width": 0, "height": 8, "field_of_view": 90}]}, "1 or more"),
        (
            {
                "camera": [
                    {
                        "name": "a",
                        "width": 8,
                        "height": 8,
                        "field_of_view": 90,
                        "sensor": "Nikon D7001",
                    }
                ]
            },
            "unknown sensor 'Nikon D7001'. Near names: Nikon",
        ),
        (
            {"camera": [{"name": "a", "width": 8, "height": 8, "field_of_view": 9}] * 2},
            "two are named",
        ),
        ({"camera": {"name": "a"}}, r"a list of tables, \[\[camera\]\]"),
        ({"poses": None}, r"\[\[poses\]\] is missing"),
        ({"poses": [{"kind": "spiral", "count": 3}]}, "'spiral' is not one of orbit, transect"),
        (
            {"poses": [{"kind": "orbit", "count": 0}]},
            "count: 0 should be a whole number, 1 or more",
        ),
        (
            {"poses": [{"kind": "orbit", "count": 3, "target": [0, 0], "radius": 1}]},
            "a list of 3 numbers",
        ),
        ({"poses": [{"kind": "orbit", "count": 3, "target": [0, 0, 0], "radius": 0}]}, "above 0 m"),
        (
            {
                "poses": [
                    {
                        "kind": "orbit",
                        "count": 3,
                        "target": [0, 0, 0],
                        "radius": {"from": 1, "to": 2},
                    }
                ]
            },
            "give steps to the range",
        ),
        (
            {"poses": [{"kind": "transect", "count": 3, "start": [0, 0, 0], "end": [0, 0, 0]}]},
            "same point",
        ),
        ({"poses": [RANDOM | {"low": [3, 0, 0]}]}, "is empty; exchange"),
        ({"poses": [RANDOM | {"in_view": 2}]}, "a fraction is 0 to 1"),
        ({"rig": [{"name": "a", "lamps": [{"power": -5}]}]}, "power is above 0"),
        (
            {"rig": [{"name": "a", "lamps": [{"power": 5, "emission": "neon?"}]}]},
            "unknown emission",
        ),
        ({"rig": [{"name": "a", "lamps": [{"power": 5, "axis": [0, 0, 0]}]}]}, "no direction"),
        ({"splits": {"train": 0.5}}, "add up to 1"),
        ({"title": None}, "title is missing"),
        ({"licence": ""}, "licence"),
        ({"most_views": 10}, "makes 48 views, more than most_views = 10"),
        ({"sensors": 1}, "unknown key of the file 'sensors'"),
        ({"water": 3}, "water is 3; it should be a table"),
    ],
)
def test_bad_specifications_say_what_and_where(changes, message):
    with pytest.raises(InputError, match=message):
        views(**changes)


def test_files_that_are_none_say_so(tmp_path):
    path = tmp_path / "spec.toml"
    with pytest.raises(InputError, match="check the path"):
        read_spec(path)
    path.write_text("title = ")
    with pytest.raises(InputError, match="is not TOML"):
        read_spec(path)
    path.write_text('title = "a"')
    with pytest.raises(InputError, match=r"spec.toml: water.name is missing"):
        read_spec(path)


def test_the_specification_of_the_manual_is_one():
    text = (SPEC.parents[2] / "docs" / "researcher.md").read_text()
    written = tomllib.loads(text.split("```toml\n")[1].split("```")[0])
    found = enumerate_views(parse_spec(written, Path()))
    poses, seas = 12 * 2 + 20 + 30, 1 + 2  # flat, or waves of two winds
    assert len(found) == poses * 2 * 2 * 2 * (3 * seas + 1)
