"""Poses go both ways between axes, and known points land where they must."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from underwater_spectral.datasets import axes
from underwater_spectral.datasets.camera import PinholeCamera
from underwater_spectral.tests.datasets import scene_of_boxes
from underwater_spectral.uw_spectral.errors import InputError


@pytest.mark.parametrize("pose", scene_of_boxes.poses())
def test_axes_go_there_and_back(pose):
    there = axes.world_to_opencv(pose)
    assert axes.blender_from_opencv(there) == pytest.approx(pose, abs=1e-12)
    assert axes.world_to_opencv(axes.blender_from_opencv(there)) == pytest.approx(there, abs=1e-12)


def test_a_camera_sees_right_on_the_right_and_up_above():
    # From the south, looking north: east is on the right, up is up.
    pose = axes.looking_at((0, -3, -5), (0, 0, -5))
    camera = PinholeCamera.from_field_of_view(200, 100, 90.0)
    points = np.array([(1.0, 0, -5), (0, 0, -4.5)])
    matrix = axes.world_to_opencv(pose)
    east, high = camera.project(points @ matrix[:3, :3].T + matrix[:3, 3])
    assert east == pytest.approx([100 + 100 / 3, 50])
    assert high == pytest.approx([100, 50 - 50 / 3])


def test_a_rolled_camera_sees_the_world_turned_the_other_way():
    # The camera turns counter-clockwise by 90°: up in the world is to its right.
    pose = axes.looking_at((0, -3, -5), (0, 0, -5), roll=90.0)
    assert pose[:3, 0] == pytest.approx([0, 0, 1], abs=1e-12)


def test_looking_straight_down_has_a_top():
    pose = axes.looking_at((0, 0, 0), (0, 0, -5))
    assert pose == pytest.approx(np.eye(4))


@pytest.mark.parametrize("pose", scene_of_boxes.poses())
def test_quaternions_turn_as_their_matrix(pose):
    turn = axes.world_to_opencv(pose)[:3, :3]
    w, x, y, z = axes.quaternion(turn)
    axis = 2 * np.arccos(w) * np.array([x, y, z]) / np.linalg.norm([x, y, z])
    assert cv2.Rodrigues(axis)[0] == pytest.approx(turn, abs=1e-9)
    assert w >= 0


@pytest.mark.parametrize("turn", [np.diag(d) for d in [(1, 1, 1), (-1, -1, 1), (-1, 1, -1)]])
def test_half_turns_have_quaternions(turn):
    w, x, y, z = axes.quaternion(turn)
    again = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip
    assert again == pytest.approx(turn, abs=1e-12)


@pytest.mark.parametrize("camera", scene_of_boxes.CAMERAS)
@pytest.mark.parametrize("pose", scene_of_boxes.poses())
def test_opencv_projects_the_same_pixels(camera, pose):
    matrix, points = axes.world_to_opencv(pose), scene_of_boxes.POINTS
    ours = camera.project(points @ matrix[:3, :3].T + matrix[:3, 3])
    rotation, _ = cv2.Rodrigues(matrix[:3, :3])
    distortion = np.array(camera.distortion)
    theirs, _ = cv2.projectPoints(points, rotation, matrix[:3, 3], camera.K_opencv, distortion)
    assert ours - 0.5 == pytest.approx(theirs[:, 0], abs=1e-6)


@pytest.mark.parametrize("camera", scene_of_boxes.CAMERAS)
def test_rays_meet_the_centres_of_their_pixels(camera):
    seen = camera.project(3.0 * camera.rays())
    y, x = np.mgrid[: camera.height, : camera.width] + 0.5
    assert seen == pytest.approx(np.stack([x, y], axis=-1), abs=1e-6)


def test_points_behind_a_camera_are_not_seen():
    assert np.isnan(scene_of_boxes.PLAIN.project([0.1, 0.2, -1.0])).all()


@pytest.mark.parametrize(
    ("pose", "message"),
    [
        (2 * np.eye(4), "apply its scale"),
        (np.diag([-1.0, 1, 1, 1]), "right-handed"),
        (np.eye(3), "4×4"),
        (np.full((4, 4), np.nan), "finite"),
    ],
)
def test_what_is_no_pose_is_refused(pose, message):
    with pytest.raises(InputError, match=message):
        axes.rigid(pose, "view a")


def test_a_camera_that_looks_at_itself_is_refused():
    with pytest.raises(InputError, match="move one"):
        axes.looking_at((1, 2, 3), (1, 2, 3))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ((0, 10, 1, 1, 0, 0), "empty"),
        ((10, 10, -1, 1, 0, 0), "focal"),
        ((10, 10, 1, 1, np.nan, 0), "principal"),
        ((10, 10, 1, 1, 0, 0, (0.0, 0.0)), "five"),
    ],
)
def test_what_is_no_camera_is_refused(values, message):
    with pytest.raises(InputError, match=message):
        PinholeCamera(*values)


def test_distortion_that_folds_the_picture_is_refused():
    camera = PinholeCamera(64, 64, 20.0, 20.0, 32, 32, (-2.0, 0, 0, 0, 0))
    with pytest.raises(InputError, match="folds the picture"):
        camera.rays()
