"""Cameras, robots, viewers and goals for groundloop runs.

`Camera` publishes pictures, `Robot` carries out motions with an `Arm` of yours, `watch` tells what happens, `Tasks`
asks a run that serves for goals. All of them wait for the run to start. The protocol is docs/protocol.md of groundloop.
"""

from .bus import Bus, Reader, Taken, Writer
from .camera import Camera, Intrinsics
from .robot import Arm, Refused, Robot, Target
from .tasks import Ended, Tasks, TaskStatus
from .viewer import watch

__all__ = [
    "Arm",
    "Bus",
    "Camera",
    "Ended",
    "Intrinsics",
    "Reader",
    "Refused",
    "Robot",
    "Taken",
    "Target",
    "TaskStatus",
    "Tasks",
    "Writer",
    "watch",
]
