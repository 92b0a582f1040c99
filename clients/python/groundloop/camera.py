"""A camera: pictures of a process of yours for a run."""

import ctypes
import time
from dataclasses import dataclass

import numpy as np

from . import wire
from .bus import Bus

RGB8 = 0
DEPTH_F32 = 1
MILLIMETRES_PER_METRE = 1000.0


@dataclass(frozen=True)
class Intrinsics:
    """The pinhole of a camera, in pixels of its pictures."""

    fx: float
    fy: float
    cx: float
    cy: float


class Camera:
    """Publishes pictures to `camera/NAME` of a run whose `camera.kind` (or that of `[cameras.NAME]`) is `external`."""

    def __init__(
        self,
        run: str,
        name: str = "main",
        intrinsics: Intrinsics | None = None,
        world_from_camera: np.ndarray | None = None,
        bus: Bus | None = None,
    ) -> None:
        """Waits for the run. `world_from_camera` is 4x4: metres, world z up; camera x right, y down, z forward.

        Raises `Taken` when another process is this camera.
        """
        bus = bus or Bus(run)
        bus.refuse_second(f"camera/{name}/rgb", wire.FrameHeader, ctypes.c_uint8)
        self.intrinsics = intrinsics
        self.world_from_camera = world_from_camera
        self._bus = bus
        self._rgb = bus.writer(f"camera/{name}/rgb", wire.FrameHeader, ctypes.c_uint8, 640 * 480 * 3)
        self._depth = bus.writer(f"camera/{name}/depth", wire.FrameHeader, ctypes.c_uint8, 640 * 480 * 4)
        self._sequence = 0

    def publish(self, rgb: np.ndarray, depth: np.ndarray | None = None, capture_ns: int | None = None) -> None:
        """Publishes one picture.

        `rgb` is height x width x 3, 8 bits. `depth` is height x width along the optical axis: float metres or 16-bit
        millimetres, 0 where there is none. `capture_ns` is when it was taken (CLOCK_MONOTONIC); without it, now.
        """
        rgb = np.ascontiguousarray(rgb)
        if rgb.ndim != 3 or rgb.shape[2] != 3 or rgb.dtype != np.uint8:
            raise ValueError(f"rgb: expected height x width x 3 of uint8, got {rgb.shape} of {rgb.dtype}")
        header = self._header(rgb.shape, capture_ns if capture_ns is not None else time.monotonic_ns())
        if depth is not None:
            if depth.shape != rgb.shape[:2]:
                raise ValueError(f"depth: expected {rgb.shape[:2]} as of rgb, got {depth.shape}")
            metres = depth / MILLIMETRES_PER_METRE if depth.dtype == np.uint16 else depth
            header.encoding, header.stride = DEPTH_F32, 4 * rgb.shape[1]
            # Before the picture: who sees the picture has its depth.
            self._depth.send(header, metres.astype("<f4"))
        header.encoding, header.stride = RGB8, 3 * rgb.shape[1]
        self._rgb.send(header, rgb)
        self._sequence += 1

    def _header(self, shape: tuple[int, ...], capture_ns: int) -> wire.FrameHeader:
        header = wire.FrameHeader(sequence=self._sequence, capture_ns=capture_ns, width=shape[1], height=shape[0])
        if self.intrinsics is not None:
            header.has_intrinsics = 1
            header.fx, header.fy = self.intrinsics.fx, self.intrinsics.fy
            header.cx, header.cy = self.intrinsics.cx, self.intrinsics.cy
        if self.world_from_camera is not None:
            pose = np.asarray(self.world_from_camera, float)
            header.has_pose = 1
            header.world_from_camera_xyz[:] = pose[:3, 3]
            header.world_from_camera_xyzw[:] = quaternion(pose[:3, :3])
        return header


def quaternion(rotation: np.ndarray) -> np.ndarray:
    """The unit quaternion (x, y, z, w) of a rotation matrix, by its largest component (Shepperd, 1978)."""
    trace = np.trace(rotation)
    squares = np.array([*(1 - trace + 2 * np.diag(rotation)), 1 + trace])
    largest = int(np.argmax(squares))
    skew = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    q = np.empty(4)
    if largest == 3:
        q[:3], q[3] = skew, squares[3]
    else:
        q[:3] = rotation[largest] + rotation[:, largest]
        q[largest], q[3] = squares[largest], skew[largest]
    return q / np.linalg.norm(q)
