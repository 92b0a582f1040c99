"""Cameras, robots and viewers for groundloop runs.

`Camera` publishes pictures, `Robot` carries out motions with an `Arm` of yours, `watch` tells what happens. All of them
wait for the run to start. The protocol is docs/protocol.md of groundloop.
"""

from .bus import Bus, Reader, Taken, Writer
from .camera import Camera, Intrinsics
from .robot import Arm, Refused, Robot, Target
from .viewer import watch

__all__ = ["Arm", "Bus", "Camera", "Intrinsics", "Reader", "Refused", "Robot", "Taken", "Target", "Writer", "watch"]
