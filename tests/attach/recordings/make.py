"""Writes the recordings beside this file, with libraries that are not groundloop's.

    pip install rosbags mcap mcap-protobuf-support foxglove-schemas-protobuf opencv-python-headless
    python tests/attach/recordings/make.py

`ros2.mcap` is what rosbag2 records (MCAP storage), written by `rosbags`; `foxglove.mcap` has Foxglove's
messages as Protobuf and as JSON in compressed chunks. Frame N of each topic has four fields of colour and
the grey 40 * N in its lower half, so that colours, order and row steps show.
"""

import base64
import json
import shutil
from pathlib import Path

import cv2
import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from mcap.writer import CompressionType, Writer as McapWriter
from mcap_protobuf.writer import Writer as ProtobufWriter
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

HERE = Path(__file__).parent
WIDTH, HEIGHT, N_FRAMES, PERIOD_NS = 16, 8, 4, 50_000_000
START_NS = 1_700_000_000_000_000_000
STORE = get_typestore(Stores.ROS2_JAZZY)
TYPES = STORE.types
MATRIX = np.array([20.0, 0, 7.5, 0, 21.0, 3.5, 0, 0, 1])
PROJECTION = np.array([19.0, 0, 7.0, 0, 0, 19.5, 3.0, 0, 0, 0, 1, 0])
LENS = np.array([0.01, 0.0, 0.0, 0.0, 0.0])


def picture(n):
    rgb = np.full((HEIGHT, WIDTH, 3), 40 * n, np.uint8)
    colours = [(255, 0, 0), (0, 255, 0), (0, 0, 255), (200, 100, 50)]
    for i, colour in enumerate(colours):
        rgb[: HEIGHT // 2, 4 * i : 4 * i + 4] = colour
    return rgb


def depth_mm(n):
    mm = np.full((HEIGHT, WIDTH), 1000 + n, np.uint16)
    mm[0, 0] = 0
    return mm


def encodings(rgb):
    """Every encoding of a picture, by its name: bytes and row step."""
    padded = np.zeros((HEIGHT, WIDTH * 3 + 5), np.uint8)
    padded[:] = 77
    padded[:, : WIDTH * 3] = rgb.reshape(HEIGHT, -1)
    y = cv2.cvtColor(rgb, cv2.COLOR_RGB2YUV_YUY2)
    uy = cv2.cvtColor(rgb, cv2.COLOR_RGB2YUV_UYVY)
    i420 = cv2.cvtColor(rgb, cv2.COLOR_RGB2YUV_I420).ravel()
    n = WIDTH * HEIGHT
    u, v = i420[n : n + n // 4], i420[n + n // 4 :]
    nv12 = np.concatenate([i420[:n], np.stack([u, v], 1).ravel()])
    return {
        "rgb8": (padded, WIDTH * 3 + 5),
        "bgr8": (rgb[..., ::-1], WIDTH * 3),
        "rgba8": (cv2.cvtColor(rgb, cv2.COLOR_RGB2RGBA), WIDTH * 4),
        "bgra8": (cv2.cvtColor(rgb, cv2.COLOR_RGB2BGRA), WIDTH * 4),
        "mono8": (rgb[..., 0], WIDTH),
        "yuv422_yuy2": (y, WIDTH * 2),
        "yuv422": (uy, WIDTH * 2),
        "nv12": (nv12, WIDTH),
    }


def ros2(path):
    shutil.rmtree(path.with_suffix(""), ignore_errors=True)
    image, compressed = TYPES["sensor_msgs/msg/Image"], TYPES["sensor_msgs/msg/CompressedImage"]
    info, roi = TYPES["sensor_msgs/msg/CameraInfo"], TYPES["sensor_msgs/msg/RegionOfInterest"]
    with Writer(path.with_suffix(""), version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connections = {}

        def write(topic, message, stamp_ns):
            if topic not in connections:
                kind = message.__msgtype__
                connections[topic] = writer.add_connection(topic, kind, typestore=STORE)
            data = STORE.serialize_cdr(message, message.__msgtype__)
            writer.write(connections[topic], stamp_ns, data)

        def flat(array):
            return np.frombuffer(np.ascontiguousarray(array).tobytes(), np.uint8)

        for n in range(N_FRAMES):
            stamp_ns = START_NS + n * PERIOD_NS
            sec, nanosec = divmod(stamp_ns, 1_000_000_000)
            time = TYPES["builtin_interfaces/msg/Time"](sec, nanosec)
            header = TYPES["std_msgs/msg/Header"](time, "camera")
            rgb, mm = picture(n), depth_mm(n)
            for name, (data, step) in encodings(rgb).items():
                if n > 0 and name != "rgb8":
                    continue
                topic = "/camera/image_raw" if name == "rgb8" else f"/camera/{name}/image_raw"
                write(topic, image(header, HEIGHT, WIDTH, name, 0, step, flat(data)), stamp_ns)
            metres = mm.astype(np.float32) / 1000
            for topic, name, is_big, data, step in [
                ("/depth/image_raw", "16UC1", 0, mm, WIDTH * 2),
                ("/depth/big", "16UC1", 1, mm.astype(">u2"), WIDTH * 2),
                ("/depth/metres", "32FC1", 0, metres, WIDTH * 4),
            ]:
                # Depth comes a little later than colours, with a stamp that is a little off.
                late = TYPES["std_msgs/msg/Header"](
                    TYPES["builtin_interfaces/msg/Time"](sec, nanosec + 3_000_000), "camera"
                )
                message = image(late, HEIGHT, WIDTH, name, is_big, step, flat(data))
                write(topic, message, stamp_ns + 8_000_000)
            bgr = np.ascontiguousarray(rgb[..., ::-1])
            if n == 0:
                png = cv2.imencode(".png", bgr)[1].ravel()
                jpeg = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, 98])[1].ravel()
                write("/png/compressed", compressed(header, "rgb8; png compressed bgr8", png), stamp_ns)
                write("/jpeg/compressed", compressed(header, "jpeg", jpeg), stamp_ns)
                depth_png = cv2.imencode(".png", mm)[1].ravel()
                packed = np.concatenate([np.zeros(12, np.uint8), depth_png])
                kind = "16UC1; compressedDepth png"
                write("/depth/compressedDepth", compressed(header, kind, packed), stamp_ns)
            none = roi(0, 0, 0, 0, False)
            eye = np.eye(3).ravel()
            write(
                "/camera/camera_info",
                info(header, HEIGHT, WIDTH, "plumb_bob", LENS, MATRIX, eye, PROJECTION, 0, 0, none),
                stamp_ns + 1,
            )
    (written,) = path.with_suffix("").glob("*.mcap")
    shutil.move(written, path)
    shutil.rmtree(path.with_suffix(""))


def foxglove(path):
    rgb, mm = picture(1), depth_mm(1)
    jpeg = cv2.imencode(".png", np.ascontiguousarray(rgb[..., ::-1]))[1].tobytes()

    def calibration(kind):
        return kind(width=WIDTH, height=HEIGHT, distortion_model="plumb_bob", D=LENS, K=MATRIX, P=PROJECTION)

    with open(path, "wb") as file, ProtobufWriter(file, compression=CompressionType.LZ4) as writer:
        for topic, message in [
            ("/camera/info", calibration(CameraCalibration)),
            ("/camera/raw", RawImage(width=WIDTH, height=HEIGHT, encoding="rgb8", step=WIDTH * 3, data=rgb.tobytes())),
            ("/camera/depth", RawImage(width=WIDTH, height=HEIGHT, encoding="16UC1", step=WIDTH * 2, data=mm.tobytes())),
            ("/camera/png", CompressedImage(format="png", data=jpeg)),
        ]:
            if hasattr(message, "timestamp"):
                message.timestamp.FromNanoseconds(START_NS)
            writer.write_message(topic, message, START_NS, START_NS)


def foxglove_json(path):
    rgb = picture(2)
    stamp = {"sec": START_NS // 1_000_000_000, "nsec": 0}
    with open(path, "wb") as file:
        writer = McapWriter(file, compression=CompressionType.ZSTD)
        writer.start()
        messages = [
            ("/raw", "foxglove.RawImage", {
                "timestamp": stamp, "frame_id": "camera", "width": WIDTH, "height": HEIGHT,
                "encoding": "rgb8", "step": WIDTH * 3, "data": base64.b64encode(rgb.tobytes()).decode(),
            }),
            ("/camera_info", "foxglove.CameraCalibration", {
                "timestamp": stamp, "frame_id": "camera", "width": WIDTH, "height": HEIGHT,
                "distortion_model": "plumb_bob", "D": LENS.tolist(), "K": MATRIX.tolist(),
                "R": np.eye(3).ravel().tolist(), "P": PROJECTION.tolist(),
            }),
        ]
        for topic, name, message in messages:
            schema = writer.register_schema(name=name, encoding="jsonschema", data=b"{}")
            channel = writer.register_channel(schema_id=schema, topic=topic, message_encoding="json")
            data = json.dumps(message).encode()
            writer.add_message(channel, log_time=START_NS, publish_time=START_NS, data=data)
        writer.finish()


if __name__ == "__main__":
    ros2(HERE / "ros2.mcap")
    foxglove(HERE / "foxglove.mcap")
    foxglove_json(HERE / "foxglove_json.mcap")
