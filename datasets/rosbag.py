"""What ROS reads: ``CameraInfo`` of cameras, and a bag of ROS 2 for each way."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .axes import Array, quaternion, turned
from .camera import PinholeCamera
from .files import make_folder, plain_name, plain_names, write_text
from .set_files import SetFiles, camera_of_view, shown_pixels
from .trajectories import Trajectory, baseline, trajectories
from .trajectory_files import NANOSECONDS
from .view import DataSetView

MODEL = "plumb_bob"
"""Of the distortion: Brown and Conrady's, five coefficients in OpenCV's order."""
WORLD = "world"
_BAG = 9  # version of the bag's own description


@dataclass(frozen=True)
class CameraInfo:
    """A camera as ROS describes it; the first pixel's centre is at (0, 0).

    ``name`` is that in paths, ``right`` how far it stands to the right of the first one of its
    pair, m.
    """

    name: str
    camera: PinholeCamera
    right: float

    @property
    def P(self) -> Array:
        """Projection of the rectified picture, shape (3, 4)."""
        return self.camera.projection(self.right)

    def yaml(self) -> str:
        """Return it as a file."""
        matrices = (
            ("camera_matrix", self.camera.K_opencv),
            ("distortion_coefficients", np.array([self.camera.distortion])),
            ("rectification_matrix", np.eye(3)),
            ("projection_matrix", self.P),
        )
        lines = [
            f"image_width: {self.camera.width}",
            f"image_height: {self.camera.height}",
            f"camera_name: {self.name}",
            f"distortion_model: {MODEL}",
        ]
        for name, matrix in matrices:
            rows, columns = matrix.shape
            numbers = ", ".join(map(repr, matrix.ravel().tolist()))
            lines += [f"{name}:", f"  rows: {rows}", f"  cols: {columns}", f"  data: [{numbers}]"]
        return "\n".join(lines) + "\n"


def camera_infos(files: SetFiles) -> dict[str, CameraInfo]:
    """Return the cameras of a set by name; the right one of a pair knows how far it stands."""
    views, plain = files.views, files.camera_names
    cameras = {camera_of_view(view): view.camera for view in views}
    right = dict.fromkeys(cameras, 0.0)
    if len(cameras) == 2:
        one, two = cameras
        apart = _baseline(views, one)
        right[two if apart > 0 else one] = abs(apart)
    return {name: CameraInfo(plain[name], camera, right[name]) for name, camera in cameras.items()}


def _baseline(views: Sequence[DataSetView], first: str) -> float:
    """How far the other camera stands to the right, where a pose is seen by both; else 0."""
    waiting: dict[tuple[object, object], DataSetView] = {}
    for view in views:
        place = view.metadata.get("pose"), view.metadata.get("lowered_m")
        other = waiting.setdefault(place, view)
        if camera_of_view(other) != camera_of_view(view):
            pair = (other, view) if camera_of_view(other) == first else (view, other)
            return baseline(*pair) or 0.0
    return 0.0


def write_camera_infos(files: SetFiles) -> None:
    """Write a file for each camera, ``camera_info/NAME.yaml``.

    Source: ROS, *sensor_msgs/CameraInfo*; *camera_calibration_parsers*.
    """
    folder = make_folder(files.folder / "camera_info")
    for info in camera_infos(files).values():
        write_text(folder / f"{info.name}.yaml", info.yaml())


def write_rosbags(files: SetFiles) -> None:
    """Write ``rosbag2/NAME`` for each way, with the topics of each camera.

    ``/CAMERA/image_raw``, ``/CAMERA/depth/image_raw`` (planar, m), ``/CAMERA/camera_info``;
    ``/odometry`` of the first camera and ``/tf`` of all, in OpenCV's axes.

    Source: ROS 2, *rosbag2*; REP 103, 104, 118.
    """
    infos = camera_infos(files)
    root = make_folder(files.folder / "rosbag2")
    for way in trajectories(files, "rosbag2"):
        whole, partial = root / way.name, root / f"{way.name}.part"
        for folder in (partial, whole):
            if folder.is_dir():
                shutil.rmtree(folder)
        _write(files, way, infos, partial)
        partial.rename(whole)


def _write(files: SetFiles, way: Trajectory, infos: dict[str, CameraInfo], folder: Path) -> None:
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    types = get_typestore(Stores.ROS2_HUMBLE)
    with Writer(folder, version=_BAG) as bag:
        connections: dict[str, Any] = {}

        def tell(topic: str, kind: str, time: int, message: Any) -> None:  # noqa: ANN401
            if topic not in connections:
                connections[topic] = bag.add_connection(topic, kind, typestore=types)
            bag.write(connections[topic], time, types.serialize_cdr(message, kind))

        made, names = _Messages(types.types), plain_names(infos, ros_name)
        for place, time in enumerate(way.times):
            for number, (name, views) in enumerate(way.cameras.items()):
                view, topic, frame = views[place], f"/{names[name]}", f"{names[name]}_optical"
                head = made.header(time, frame)
                image = made.image(head, "rgb8", shown_pixels(view))
                tell(f"{topic}/image_raw", made.IMAGE, time, image)
                depth = made.image(head, "32FC1", files.planar_depth(view).astype("<f4"))
                tell(f"{topic}/depth/image_raw", made.IMAGE, time, depth)
                tell(f"{topic}/camera_info", made.INFO, time, made.info(head, infos[name]))
                pose = turned(view.camera_to_world)
                tell("/tf", made.TF, time, made.transform(time, frame, pose))
                if number == 0:
                    tell("/odometry", made.ODOMETRY, time, made.odometry(time, frame, pose))


def ros_name(name: str) -> str:
    """Return a camera's name as a part of a topic.

    Examples
    --------
    >>> ros_name("2nd camera-left")
    'camera_2nd_camera_left'
    """
    found = plain_name(name).replace("-", "_").replace(".", "_")
    return found if found[:1].isalpha() else f"camera_{found}"


class _Messages:
    """Messages of ROS, made of our values."""

    IMAGE = "sensor_msgs/msg/Image"
    INFO = "sensor_msgs/msg/CameraInfo"
    ODOMETRY = "nav_msgs/msg/Odometry"
    TF = "tf2_msgs/msg/TFMessage"

    def __init__(self, types: Any) -> None:  # noqa: ANN401 - by name, of rosbags
        self._types = types

    def _new(self, kind: str, **values: object) -> Any:  # noqa: ANN401
        package, name = kind.split("/")
        return self._types[f"{package}/msg/{name}"](**values)

    def header(self, time: int, frame: str) -> Any:  # noqa: ANN401
        seconds, rest = divmod(time, NANOSECONDS)
        return self._new(
            "std_msgs/Header",
            stamp=self._new("builtin_interfaces/Time", sec=seconds, nanosec=rest),
            frame_id=frame,
        )

    def image(self, header: object, encoding: str, pixels: Any) -> Any:  # noqa: ANN401
        data = np.ascontiguousarray(pixels).view(np.uint8)
        high, wide = pixels.shape[:2]
        return self._new(
            "sensor_msgs/Image", header=header, height=high, width=wide, encoding=encoding,
            is_bigendian=0, step=data.size // high, data=data.ravel(),
        )  # fmt: skip

    def info(self, header: object, info: CameraInfo) -> Any:  # noqa: ANN401
        region = self._new(
            "sensor_msgs/RegionOfInterest",
            x_offset=0, y_offset=0, height=0, width=0, do_rectify=False,
        )  # fmt: skip
        camera = info.camera
        return self._new(
            "sensor_msgs/CameraInfo", header=header, height=camera.height, width=camera.width,
            distortion_model=MODEL, d=np.array(camera.distortion), k=camera.K_opencv.ravel(),
            r=np.eye(3).ravel(), p=info.P.ravel(), binning_x=0, binning_y=0, roi=region,
        )  # fmt: skip

    def transform(self, time: int, frame: str, pose: Array) -> Any:  # noqa: ANN401
        x, y, z = pose[:3, 3].tolist()
        place = self._new("geometry_msgs/Vector3", x=x, y=y, z=z)
        moved = self._new(
            "geometry_msgs/Transform", translation=place, rotation=self._rotation(pose)
        )
        one = self._new(
            "geometry_msgs/TransformStamped",
            header=self.header(time, WORLD), child_frame_id=frame, transform=moved,
        )  # fmt: skip
        return self._new("tf2_msgs/TFMessage", transforms=[one])

    def odometry(self, time: int, frame: str, pose: Array) -> Any:  # noqa: ANN401
        x, y, z = pose[:3, 3].tolist()
        place = self._new("geometry_msgs/Point", x=x, y=y, z=z)
        there = self._new("geometry_msgs/Pose", position=place, orientation=self._rotation(pose))
        still = [self._new("geometry_msgs/Vector3", x=0.0, y=0.0, z=0.0) for _ in range(2)]
        unknown = np.zeros(36)
        return self._new(
            "nav_msgs/Odometry",
            header=self.header(time, WORLD),
            child_frame_id=frame,
            pose=self._new("geometry_msgs/PoseWithCovariance", pose=there, covariance=unknown),
            twist=self._new(
                "geometry_msgs/TwistWithCovariance",
                twist=self._new("geometry_msgs/Twist", linear=still[0], angular=still[1]),
                covariance=unknown,
            ),
        )

    def _rotation(self, pose: Array) -> Any:  # noqa: ANN401
        w, x, y, z = quaternion(pose[:3, :3]).tolist()
        return self._new("geometry_msgs/Quaternion", x=x, y=y, z=z, w=w)
