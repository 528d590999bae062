"""Ways of cameras: read from files, written to files, and read again by evo."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from evo.core.trajectory import PoseTrajectory3D
from evo.tools import file_interface
from underwater_spectral.datasets.axes import (
    inverse,
    looking_at,
    placed,
    quaternion,
    rotation,
    turned,
)
from underwater_spectral.datasets.enumeration import enumerate_views
from underwater_spectral.datasets.specification import parse_spec
from underwater_spectral.datasets.trajectory_files import (
    READERS,
    euroc_rows,
    kitti_rows,
    nanoseconds,
    read_euroc,
    read_kitti,
    tum_rows,
)
from underwater_spectral.uw_spectral.errors import InputError

SPEC = Path(__file__).with_name("reef.toml")
TIMES = tuple(1403636579.25 + 0.05 * n for n in range(9))
STAMPS = [round(time * 1e9) for time in TIMES]  # ns
BODY = placed(rotation([0.7, 0.1, -0.2, 0.67]), (0.05, -0.02, 0.01))
CLOSE = 1e-6  # m, and of the rotation's elements


def way() -> list[np.ndarray]:
    """A dive on a spiral, with roll."""
    angle = np.linspace(0.0, 2.0, len(TIMES))
    eyes = np.stack([3 * np.cos(angle), 3 * np.sin(angle), -2 - angle], axis=-1)
    return [looking_at(eye, (0, 0.5, -4), 20 * n) for n, eye in enumerate(eyes)]


def of_evo(found) -> list[np.ndarray]:
    """Poses that evo read, camera to world in Blender's axes."""
    return [turned(pose) for pose in found.poses_se3]


def same(found, wanted) -> bool:
    return len(found) == len(wanted) and np.abs(np.array(found) - np.array(wanted)).max() < CLOSE


def test_quaternions_and_rotations_undo_each_other():
    for pose in way():
        assert rotation(quaternion(pose[:3, :3])) == pytest.approx(pose[:3, :3], abs=1e-12)


def test_evo_reads_tum_as_it_was_written(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text(tum_rows(way(), STAMPS))
    found = file_interface.read_tum_trajectory_file(path)
    assert found.timestamps == pytest.approx(TIMES, abs=1e-6)
    assert same(of_evo(found), way())
    assert found.check()[0]


def test_evo_reads_euroc_as_it_was_written(tmp_path):
    path = tmp_path / "data.csv"
    path.write_text(euroc_rows(way(), STAMPS))
    found = file_interface.read_euroc_csv_trajectory(path)
    assert found.timestamps == pytest.approx(TIMES, abs=1e-6)
    assert same(of_evo(found), way())
    rows = np.loadtxt(path, delimiter=",")
    assert rows.shape == (len(TIMES), 17)
    assert found.speeds == pytest.approx(np.linalg.norm(rows[:, 8:11], axis=1)[1:], rel=0.05)


def test_evo_reads_kitti_from_the_first_camera(tmp_path):
    path = tmp_path / "00.txt"
    path.write_text(kitti_rows(way()))
    found = file_interface.read_kitti_poses_file(path)
    first = turned(way()[0])
    assert same([turned(first @ pose) for pose in found.poses_se3], way())
    assert np.array(found.poses_se3[0]) == pytest.approx(np.eye(4), abs=1e-12)


def _evo_writes(kind: str, path: Path) -> None:
    """A file by evo, or nerfstudio's as its documentation has it."""
    poses = [turned(pose) for pose in way()]
    trajectory = PoseTrajectory3D(poses_se3=poses, timestamps=np.array(TIMES))
    if kind == "tum":
        file_interface.write_tum_trajectory_file(path, trajectory)
    elif kind == "kitti":
        file_interface.write_kitti_poses_file(path, trajectory)
    elif kind == "euroc":
        rows = np.column_stack([trajectory.positions_xyz, trajectory.orientations_quat_wxyz])
        lines = [
            ",".join([str(round(time * 1e9)), *map(repr, row.tolist())])
            for time, row in zip(TIMES, rows, strict=True)
        ]
        path.write_text("#timestamp,x,y,z,qw,qx,qy,qz\n" + "\n".join(lines))
    else:
        frames = [
            {"file_path": f"{n}.png", "transform_matrix": pose.tolist(), "time": time}
            for n, (pose, time) in enumerate(zip(way(), TIMES, strict=True))
        ]
        path.write_text(json.dumps({"frames": frames}))


@pytest.mark.parametrize("kind", list(READERS))
def test_ways_that_evo_wrote_are_poses_of_a_set(kind, tmp_path):
    """From a file through the specification to views, and by TUM back to evo."""
    _evo_writes(kind, tmp_path / "way.txt")
    given = {"kind": kind, "file": "way.txt", "every": 2, "rate": 20}
    content = tomllib.loads(SPEC.read_text()) | {"poses": [given], "scene": {"depth": 0}}
    content |= {"water": {"name": "air"}, "camera": content["camera"][:1], "rig": []}
    views = enumerate_views(parse_spec(content, tmp_path))
    assert same([view.camera_to_world for view in views], way()[::2])
    steps = np.diff([float(view.time) for view in views])
    assert steps == pytest.approx(np.full(4, 0.05 if kind == "kitti" else 0.1), abs=1e-6)
    again = tmp_path / "again.txt"
    again.write_text(
        tum_rows([v.camera_to_world for v in views], [nanoseconds(v.time) for v in views])
    )
    found = file_interface.read_tum_trajectory_file(again)
    assert same(of_evo(found), way()[::2])


EXACT = (1403636579763555585, 1403636579763555586, 1403636579963555713)
"""ns; a float tells only the last from the others."""


@pytest.mark.parametrize(
    ("kind", "written"),
    [
        ("euroc", "{},0,0,0,1,0,0,0"),
        ("euroc", "{}.0, 0, 0, 0, 1, 0, 0, 0"),
        ("euroc", "{}e0,0,0,0,1,0,0,0"),
        ("tum", "{}e-9 0 0 0 0 0 0 1"),
        ("tum", "0.{}e10 0 0 0 0 0 0 1"),
    ],
)
def test_times_are_kept_to_the_nanosecond(kind, written, tmp_path):
    path = tmp_path / "way.txt"
    path.write_text("\n".join(map(written.format, EXACT)))
    found = READERS[kind](path)
    assert tuple(nanoseconds(time) for time in found.times) == EXACT
    path.write_text(euroc_rows(found.poses, EXACT))
    assert READERS["euroc"](path).times == found.times
    path.write_text(tum_rows(found.poses, EXACT))
    assert READERS["tum"](path).times == found.times
    content = tomllib.loads(SPEC.read_text()) | {"scene": {"depth": 0}, "rig": []}
    content |= {"poses": [{"kind": "tum", "file": "way.txt"}], "water": {"name": "air"}}
    views = enumerate_views(parse_spec(content | {"camera": content["camera"][:1]}, tmp_path))
    assert tuple(view.record()["time_ns"] for view in views) == EXACT


def test_the_camera_may_be_beside_the_body(tmp_path):
    path = tmp_path / "data.csv"
    bodies = [turned(pose) @ inverse(BODY) for pose in way()]
    path.write_text(euroc_rows([turned(body) for body in bodies], STAMPS))
    assert same(read_euroc(path, BODY).poses, way())
    content = tomllib.loads(SPEC.read_text())
    given = {"kind": "euroc", "file": "data.csv", "camera_in_body": BODY.ravel().tolist()}
    content |= {"poses": [given], "water": {"name": "air"}}
    assert same(list(parse_spec(content, tmp_path).poses[0].poses()), way())


def test_poses_with_few_digits_are_rotations(tmp_path):
    """KITTI's own files have seven digits."""
    rows = [turned(pose)[:3].ravel() for pose in way()]
    np.savetxt(tmp_path / "00.txt", rows, fmt="%.6e")
    for pose in read_kitti(tmp_path / "00.txt").poses:
        assert pose[:3, :3] @ pose[:3, :3].T == pytest.approx(np.eye(3), abs=1e-12)


def test_a_camera_that_waits_has_a_view_each_time(tmp_path):
    poses = [way()[0]] * 3
    (tmp_path / "way.txt").write_text(tum_rows(poses, STAMPS[:3]))
    content = tomllib.loads(SPEC.read_text()) | {"water": {"name": "air"}, "rig": []}
    content |= {"poses": [{"kind": "tum", "file": "way.txt"}], "camera": content["camera"][:1]}
    assert len({view.name for view in enumerate_views(parse_spec(content, tmp_path))}) == 3


@pytest.mark.parametrize(
    ("kind", "text", "message"),
    [
        ("tum", "# nothing\n", "holds no pose"),
        ("tum", "1 2 3 4 0 0 0\n", "line 1: .* should be time tx ty tz qx qy qz qw"),
        ("tum", "# a\n1 2 3 4 0 0 0 x\n", "line 2"),
        ("tum", "1 2 3 4 0 0 0 1\n1 2 3 4 0 0 0 1\n", "line 2: time 1.000000 s is not after 1.0"),
        ("tum", "1403636579763555584 0 0 0 0 0 0 1\n", "time 1.40364e.18 s is no date before 2038"),
        ("tum", "1e-999999999 0 0 0 0 0 0 1\n0 0 0 0 0 0 0 1\n", "line 2: time 0.000000 s is not"),
        ("tum", "1 0 0 0 2 0 0 0\n", "the order of its numbers another"),
        ("euroc", "1,2,3\n", r"line 1: .* should be time \[ns\]"),
        ("kitti", "1 0 0 0 0 2 0 0 0 0 1 0\n", "scales or mirrors"),
        ("kitti", "1 0 0 0 0 1 0 0 0 0 -1 0\n", "right-handed"),
        ("nerfstudio", "{}", "holds no frames of nerfstudio"),
        ("nerfstudio", '{"frames": [{"transform_matrix": [[1]]}]}', "frame 0: a pose has 3×4"),
    ],
)
def test_files_of_ways_that_are_none_say_where(kind, text, message, tmp_path):
    path = tmp_path / "way.txt"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        READERS[kind](path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"kind": "tum", "file": "none.txt"}, "none.txt: .*check the path"),
        ({"kind": "tum"}, r"poses\[0\].file is missing"),
        ({"kind": "tum", "file": "none.txt", "count": 3}, "none.txt"),
        ({"kind": "camera", "first": 9, "last": 3}, "run from 9 to 3"),
        ({"kind": "camera", "count": 3}, "unknown key"),
        ({"kind": "camera", "step": 0}, "1 or more"),
        ({"kind": "orbit", "count": 2, "target": [0, 0, -1], "radius": 1, "rate": 0}, "more than"),
        ({"kind": "spiral"}, "orbit, transect, random, camera, tum, euroc, kitti, nerfstudio"),
    ],
)
def test_ways_that_cannot_be_used_say_why(given, message, tmp_path):
    content = tomllib.loads(SPEC.read_text()) | {"poses": [given]}
    with pytest.raises(InputError, match=message):
        parse_spec(content, tmp_path)
    content |= {"poses": [{"kind": "camera"}]}
    with pytest.raises(InputError, match="needs the scene"):
        enumerate_views(parse_spec(content, tmp_path))
