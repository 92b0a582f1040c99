"""ROS 2 topics for a groundloop run: a camera, a robot, and what the run says.

    pip install ./clients/python numpy
    python3 examples/ros2_bridge.py RUN --image /camera/color/image_raw --depth /camera/aligned_depth_to_color/image_raw \
        --camera-info /camera/color/camera_info --world-frame base_link --tool-pose /tool_pose --finger-joints left,right

ROS to groundloop: the picture with depth and camera_info, and the camera's pose from tf, as `camera/NAME`; the tool's pose and the
gripper's joints as `robot/state`. groundloop to ROS: where the tool shall go as PoseStamped on `groundloop/tool_goal` and
the jaws' opening in metres as Float64 on `groundloop/gripper_goal`, for a controller of yours (MoveIt Servo, a Cartesian controller); the
goal of the run and its events as String on `groundloop/goal` and `groundloop/event`.

It has not been tried with a ROS installation: what converts messages is tested with messages that only look like those of ROS
(tests/attach/ros2_bridge.rs), and what speaks to rclpy is short. Try it with the arm switched off first.
"""

import argparse
import math
import sys
import time
from typing import Any

import numpy as np

EXIT_MISSING = 5
# Channels of a picture and which of them are red, green and blue.
COLOURS = {
    "rgb8": (3, (0, 1, 2)),
    "bgr8": (3, (2, 1, 0)),
    "rgba8": (4, (0, 1, 2)),
    "bgra8": (4, (2, 1, 0)),
    "8UC3": (3, (2, 1, 0)),
    "mono8": (1, (0, 0, 0)),
    "8UC1": (1, (0, 0, 0)),
}
DEPTHS = {"16UC1": "u2", "mono16": "u2", "32FC1": "f4"}
# Depth and picture of one capture are stamped within this, nanoseconds.
PAIR_NS_MAX = 20_000_000
# The tool is where it should be.
ARRIVED_M, ARRIVED_RAD, ARRIVED_OPENING_M = 0.004, 0.05, 0.003
# Jaws that have moved less than this for so long have closed on something, or are where they should be.
STALLED_M, STALLED_S = 0.0005, 0.4
# A pose of the tool that is older than this is none.
POSE_AGE_S_MAX = 0.5


# What follows knows nothing of rclpy: messages are anything with their fields.


def rows_of(image: Any, item_bytes: int) -> np.ndarray:
    """The bytes of an Image, height x used bytes of a row, without what pads each row to `step`."""
    data = np.frombuffer(bytes(image.data), np.uint8)
    used = image.width * item_bytes
    if image.step < used or data.size < image.step * image.height:
        raise ValueError(
            f"image: expected {image.height} rows of {used} bytes or more, got step {image.step} and {data.size} bytes"
        )
    return data[: image.step * image.height].reshape(image.height, image.step)[:, :used]


def rgb_of(image: Any) -> np.ndarray:
    """A sensor_msgs/Image as height x width x 3 of uint8."""
    if image.encoding not in COLOURS:
        known = ", ".join(COLOURS)
        raise ValueError(f'encoding: expected one of {known}, got "{image.encoding}"; republish it with image_proc')
    n, order = COLOURS[image.encoding]
    pixels = rows_of(image, n).reshape(image.height, image.width, n)
    return np.ascontiguousarray(pixels[:, :, order])


def depth_of(image: Any) -> np.ndarray:
    """A sensor_msgs/Image of depth as height x width of metres; 0 where there is none."""
    if image.encoding not in DEPTHS:
        raise ValueError(f'depth encoding: expected one of {", ".join(DEPTHS)}, got "{image.encoding}"')
    kind = np.dtype((">" if image.is_bigendian else "<") + DEPTHS[image.encoding])
    raw = np.ascontiguousarray(rows_of(image, kind.itemsize)).view(kind)
    metres = raw.astype(np.float32) / (1000.0 if kind.kind == "u" else 1.0)
    metres[~np.isfinite(metres) | (metres < 0.0)] = 0.0
    return metres


def intrinsics_of(info: Any, size: tuple[int, int]) -> tuple[float, float, float, float]:
    """fx, fy, cx, cy of a sensor_msgs/CameraInfo for pictures of `size` (width, height)."""
    if (info.width, info.height) != size:
        raise ValueError(f"camera_info: expected that of {size[0]}x{size[1]} pixels, got {info.width}x{info.height}")
    k = info.k
    if not (k[0] > 0.0 and k[4] > 0.0):
        raise ValueError("camera_info: expected focal lengths above 0 in k: the camera is not calibrated")
    return (k[0], k[4], k[2], k[5])


def matrix_of(position: Any, orientation: Any) -> np.ndarray:
    """The 4x4 of a geometry_msgs position (or translation) and Quaternion."""
    q = np.array([orientation.x, orientation.y, orientation.z, orientation.w], float)
    length = np.linalg.norm(q)
    if not (np.isfinite(length) and length > 0.5):
        raise ValueError(f"orientation: expected a unit quaternion, got {q.tolist()}")
    x, y, z, w = q / length
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, 3] = [position.x, position.y, position.z]
    return matrix


def yaw_of(world_from_tool: np.ndarray) -> float:
    """The turn about the world's z of a tool whose fingers point down: where its x axis points, radians."""
    return math.atan2(world_from_tool[1, 0], world_from_tool[0, 0])


def down_with(yaw_rad: float) -> tuple[float, float, float, float]:
    """The quaternion (x, y, z, w) of a tool whose z axis points down and whose x axis is turned by yaw."""
    # A turn about z after a half turn about x.
    return (math.cos(yaw_rad / 2), math.sin(yaw_rad / 2), 0.0, 0.0)


def opening_of(joints: Any, names: list[str]) -> float:
    """The jaws' opening in metres: the sum of the finger joints' positions in a sensor_msgs/JointState."""
    missing = [name for name in names if name not in joints.name]
    if missing:
        raise ValueError(f"joint_states: expected {', '.join(missing)} among {', '.join(joints.name)}")
    return float(sum(joints.position[list(joints.name).index(name)] for name in names))


def apart_rad(a: float, b: float) -> float:
    """The angle between two yaws; a parallel gripper is the same after half a turn."""
    return abs((a - b + math.pi / 2) % math.pi - math.pi / 2)


def nanoseconds(stamp: Any) -> int:
    """A builtin_interfaces/Time."""
    return stamp.sec * 1_000_000_000 + stamp.nanosec


def monotonic_of(stamp_ns: int, ros_now_ns: int, monotonic_now_ns: int) -> int:
    """A ROS stamp as CLOCK_MONOTONIC: as old as it is; one of the future, or none (0), is now."""
    age_ns = max(0, ros_now_ns - stamp_ns) if stamp_ns else 0
    return max(1, monotonic_now_ns - age_ns)


class Jaws:
    """The gripper, by its opening: whether it has come to rest, and whether something keeps it from closing."""

    def __init__(self) -> None:
        self.opening_m = 0.0
        self.wanted_m: float | None = None
        self._moved_s = 0.0

    def hear(self, opening_m: float, now_s: float) -> None:
        if abs(opening_m - self.opening_m) > STALLED_M:
            self._moved_s = now_s
            self.opening_m = opening_m

    def want(self, wanted_m: float, now_s: float) -> None:
        if self.wanted_m is None or abs(wanted_m - self.wanted_m) > STALLED_M:
            self._moved_s = now_s
        self.wanted_m = wanted_m

    def is_at_rest(self, now_s: float) -> bool:
        is_there = self.wanted_m is None or abs(self.opening_m - self.wanted_m) <= ARRIVED_OPENING_M
        return is_there or (self._is_blocked() and now_s - self._moved_s >= STALLED_S)

    def is_holding(self, now_s: float) -> bool:
        return self._is_blocked() and now_s - self._moved_s >= STALLED_S

    def _is_blocked(self) -> bool:
        return self.wanted_m is not None and self.opening_m > self.wanted_m + ARRIVED_OPENING_M


# What follows speaks to ROS.


class RosArm:
    """An arm behind ROS topics, as `groundloop.Robot` drives one."""

    def __init__(self, node: Any, args: argparse.Namespace, messages: Any) -> None:
        self._args, self._node, self._messages = args, node, messages
        self._jaws, self._target = Jaws(), None
        self._pose, self._heard_s = None, 0.0
        self._goals = node.create_publisher(messages.PoseStamped, "groundloop/tool_goal", 1)
        self._openings = node.create_publisher(messages.Float64, "groundloop/gripper_goal", 1)
        node.create_subscription(messages.PoseStamped, args.tool_pose, self._hear_pose, 1)
        node.create_subscription(messages.JointState, args.joint_states, self._hear_joints, 10)

    def is_known(self) -> bool:
        """Whether the tool's place is known and young: without it nothing may be said of it."""
        return self._pose is not None and time.monotonic() - self._heard_s < POSE_AGE_S_MAX

    def _hear_pose(self, message: Any) -> None:
        self._pose = matrix_of(message.pose.position, message.pose.orientation)
        self._heard_s = time.monotonic()

    def _hear_joints(self, message: Any) -> None:
        names = self._args.finger_joints
        if all(name in message.name for name in names):
            self._jaws.hear(opening_of(message, names), time.monotonic())

    def go(self, target: Any) -> None:
        self._target = target
        self._jaws.want(target.opening_m, time.monotonic())
        goal = self._messages.PoseStamped()
        goal.header.frame_id = self._args.world_frame
        goal.header.stamp = self._node.get_clock().now().to_msg()
        goal.pose.position.x, goal.pose.position.y, goal.pose.position.z = map(float, target.position)
        q = goal.pose.orientation
        q.x, q.y, q.z, q.w = down_with(target.yaw_rad)
        self._goals.publish(goal)
        self._openings.publish(self._messages.Float64(data=float(target.opening_m)))

    def has_arrived(self) -> bool:
        if self._target is None:
            return True
        here, there = self.tool(), self._target
        is_there = math.dist(here.position, there.position) <= ARRIVED_M
        is_turned = apart_rad(here.yaw_rad, there.yaw_rad) <= ARRIVED_RAD
        return is_there and is_turned and self._jaws.is_at_rest(time.monotonic())

    def is_holding(self) -> bool:
        return self._jaws.is_holding(time.monotonic())

    def tool(self) -> Any:
        from groundloop import Target

        speed_m_s = self._target.speed_m_s if self._target else 0.1
        position = tuple(float(x) for x in self._pose[:3, 3])
        return Target(position, yaw_of(self._pose), self._jaws.opening_m, speed_m_s)


class RosCamera:
    """A camera behind ROS topics."""

    def __init__(self, node: Any, args: argparse.Namespace, ros: Any, camera: Any) -> None:
        self._node, self._args, self._ros, self._camera = node, args, ros, camera
        self._info = self._depth = None
        qos = ros.qos_profile_sensor_data
        node.create_subscription(ros.Image, args.image, self._hear_image, qos)
        if args.depth:
            node.create_subscription(ros.Image, args.depth, lambda m: setattr(self, "_depth", m), qos)
        if args.camera_info:
            node.create_subscription(ros.CameraInfo, args.camera_info, lambda m: setattr(self, "_info", m), qos)
        self._tf = ros.Buffer() if args.world_frame else None
        self._listener = ros.TransformListener(self._tf, node) if self._tf else None

    def _hear_image(self, image: Any) -> None:
        try:
            self._publish(image)
        except (ValueError, self._ros.TransformException) as error:
            self._node.get_logger().warning(str(error), throttle_duration_sec=5.0)

    def _publish(self, image: Any) -> None:
        from groundloop import Intrinsics

        stamp_ns = nanoseconds(image.header.stamp)
        if self._info:
            self._camera.intrinsics = Intrinsics(*intrinsics_of(self._info, (image.width, image.height)))
        if self._tf:
            at = self._ros.Time.from_msg(image.header.stamp)
            found = self._tf.lookup_transform(self._args.world_frame, image.header.frame_id, at).transform
            self._camera.world_from_camera = matrix_of(found.translation, found.rotation)
        depth = self._depth
        if depth is not None and abs(nanoseconds(depth.header.stamp) - stamp_ns) > PAIR_NS_MAX:
            depth = None
        now_ns = self._node.get_clock().now().nanoseconds
        capture_ns = monotonic_of(stamp_ns, now_ns, time.monotonic_ns())
        self._camera.publish(rgb_of(image), depth_of(depth) if depth is not None else None, capture_ns)


def relay(node: Any, bus: Any, string: Any) -> Any:
    """What the run says, on ROS topics; the returned function passes on what has come."""
    import ctypes

    from groundloop import wire

    topics = [("goal", wire.TaskHeader), ("event", wire.StreamHeader)]
    pairs = [
        (bus.reader(topic, header, ctypes.c_uint8), node.create_publisher(string, f"groundloop/{topic}", 10))
        for topic, header in topics
    ]

    def pass_on() -> None:
        for reader, publisher in pairs:
            for _, payload in reader.take():
                if payload.size:
                    publisher.publish(string(data=payload.tobytes().decode()))

    return pass_on


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", help="the name of the run")
    parser.add_argument("--camera", default="main", help='which camera of the run it is: "main", or that of [cameras.NAME]')
    parser.add_argument("--image", help="sensor_msgs/Image of the rectified picture; without it no camera")
    parser.add_argument("--depth", help="sensor_msgs/Image of depth, aligned with the picture")
    parser.add_argument("--camera-info", help="sensor_msgs/CameraInfo of the picture")
    parser.add_argument("--world-frame", default="", help="the tf frame that is the run's world, such as base_link")
    parser.add_argument("--tool-pose", help="geometry_msgs/PoseStamped of the tool in the world; without it no robot")
    parser.add_argument("--joint-states", default="/joint_states", help="sensor_msgs/JointState with the finger joints")
    parser.add_argument("--finger-joints", type=lambda text: text.split(","), default=[], help="the joints whose sum is the opening")
    args = parser.parse_args()
    if args.tool_pose and not args.finger_joints:
        parser.error("--finger-joints: expected the gripper's joints beside --tool-pose")
    return args


def main() -> int:
    args = arguments()
    try:
        import rclpy
        from geometry_msgs.msg import PoseStamped
        from rclpy.qos import qos_profile_sensor_data
        from rclpy.time import Time
        from sensor_msgs.msg import CameraInfo, Image, JointState
        from std_msgs.msg import Float64, String
        from tf2_ros import Buffer, TransformException, TransformListener
    except ImportError as error:
        what = "source the set-up of your ROS 2 installation, such as /opt/ros/jazzy/setup.bash"
        print(f"error: rclpy is missing ({error}): {what}", file=sys.stderr)
        return EXIT_MISSING
    from groundloop import Bus, Camera, Robot

    names = dict(PoseStamped=PoseStamped, Float64=Float64, JointState=JointState, Image=Image, CameraInfo=CameraInfo)
    tf = dict(Buffer=Buffer, TransformListener=TransformListener, TransformException=TransformException, Time=Time)
    ros = argparse.Namespace(**names, **tf, qos_profile_sensor_data=qos_profile_sensor_data)
    rclpy.init()
    node = rclpy.create_node("groundloop_bridge")
    bus = Bus(args.run)
    parts: list[Any] = []
    if args.image:
        parts.append(RosCamera(node, args, ros, Camera(args.run, args.camera, bus=bus)))
    if args.tool_pose:
        arm = RosArm(node, args, ros)
        robot = Robot(args.run, arm, bus=bus)
        # A tool whose place is not known says nothing: the run holds, and names the robot if that lasts.
        node.create_timer(1.0 / 50.0, lambda: robot.step() if arm.is_known() else None)
        parts.append(robot)
    node.create_timer(0.1, relay(node, bus, String))
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    return 0


if __name__ == "__main__":
    sys.exit(main())
