"""A robot: an arm with a gripper that carries out a run's motions."""

import ctypes
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from . import wire
from .bus import Bus

CONTINUE, START, CANCEL, HOLD = range(4)
ACCEPTED, DONE, FAILED, CANCELLED = range(4)
EMPTY, HOLDING = 1, 2
# A robot whose executive has said nothing for so long stands still.
SILENCE_S_MAX = 1.0


@dataclass(frozen=True)
class Target:
    """Where the tool shall be: its centre between the finger tips, in the world frame."""

    position: tuple[float, float, float]
    """Metres, z up."""
    yaw_rad: float
    """Turn about z."""
    opening_m: float
    """Between the fingers; they stop earlier at what they close on."""
    speed_m_s: float
    """At most."""


class Refused(Exception):
    """The arm does not go there; the text says why, such as "unreachable"."""


class Arm(Protocol):
    """What a robot needs of an arm with a gripper."""

    def go(self, target: Target) -> None:
        """Sets the target, and returns at once.

        Raises `Refused` when it will not go there.
        """

    def has_arrived(self) -> bool:
        """Whether tool and fingers are where they should be; fingers that closed on something are."""

    def is_holding(self) -> bool:
        """Whether something is in the gripper."""

    def tool(self) -> Target:
        """Where the tool is now."""


@dataclass
class _Motion:
    command_id: int
    waypoints: list[wire.WaypointRecord]
    phase: int = 0
    # The motion is over; the tool goes up or stands, and this is what will be said then.
    ending: tuple[int, str] | None = None


class Robot:
    """Plays the robot of a run whose `robot.kind` is `external`."""

    def __init__(self, run: str, arm: Arm, bus: Bus | None = None, silence_s_max: float = SILENCE_S_MAX) -> None:
        """Waits for the run. Raises `Taken` when another process is its robot."""
        bus = bus or Bus(run)
        bus.refuse_second("robot/state", wire.DeviceHeader, wire.RobotStateRecord)
        self._arm, self._bus, self._silence_s_max = arm, bus, silence_s_max
        self._commands = bus.reader("robot/command", wire.DeviceHeader, wire.CommandRecord)
        self._states = bus.writer("robot/state", wire.DeviceHeader, wire.RobotStateRecord)
        self._statuses = bus.writer("robot/status", wire.DeviceHeader, wire.StatusRecord)
        self._motion: _Motion | None = None
        self._n_states = self._n_statuses = 0
        self._heard_s = time.monotonic()

    def serve(self, hz: float = 50.0, until: Callable[[], bool] = lambda: False) -> None:
        """Works until `until` says so: takes commands, carries them out, says how it fares, `hz` times a second."""
        while not until():
            self.step()
            self._commands.wait(1.0 / hz)

    def step(self) -> None:
        """One control period, for who has a loop of their own."""
        for header, payload in self._commands.take():
            # What a run has said before this robot was there is not for it.
            if time.monotonic_ns() - header.send_ns > 1e9 * self._silence_s_max:
                continue
            self._heard_s = time.monotonic()
            self._take(wire.CommandRecord.from_buffer_copy(payload))
        if self._motion and not self._motion.ending and time.monotonic() - self._heard_s > self._silence_s_max:
            self._end((FAILED, f"nothing was heard of the executive for {self._silence_s_max} s"), stand=True)
        self._carry_on()
        self._say_state()

    def _take(self, command: wire.CommandRecord) -> None:
        if command.kind == START:
            self._start(command)
        elif command.kind == CANCEL and self._motion and not self._motion.ending:
            self._end((CANCELLED, ""))
        elif command.kind == HOLD:
            self._end((CANCELLED, ""), stand=True)

    def _start(self, command: wire.CommandRecord) -> None:
        waypoints = list(command.waypoints[: command.n_waypoints])
        reason = "another motion is running" if self._motion else "" if waypoints else "the motion has no waypoints"
        try:
            if not reason:
                self._arm.go(_target(waypoints[0]))
        except Refused as refused:
            reason = str(refused) or "refused"
        if reason:
            self._say(command.command_id, FAILED, reason)
        else:
            self._motion = _Motion(command.command_id, waypoints)
            self._say(command.command_id, ACCEPTED)

    def _carry_on(self) -> None:
        motion = self._motion
        if not motion or not self._arm.has_arrived():
            return
        if motion.ending:
            self._motion = None
            self._say(motion.command_id, *motion.ending)
            return
        expect, holding = motion.waypoints[motion.phase].expect, self._arm.is_holding()
        if expect == EMPTY and holding:
            self._end((FAILED, "something is still in the gripper"))
        elif expect == HOLDING and not holding:
            self._end((FAILED, "nothing is in the gripper"))
        elif motion.phase + 1 == len(motion.waypoints):
            self._motion = None
            self._say(motion.command_id, DONE)
        else:
            motion.phase += 1
            try:
                self._arm.go(_target(motion.waypoints[motion.phase]))
            except Refused as refused:
                self._end((FAILED, str(refused) or "refused"))

    def _end(self, ending: tuple[int, str], stand: bool = False) -> None:
        """Ends the motion: the tool stands, or goes straight up, jaws as they are; then it is said."""
        here = self._arm.tool()
        x, y, z = here.position
        speed_m_s = here.speed_m_s
        if self._motion:
            self._motion.ending = self._motion.ending or ending
            speed_m_s = max(w.speed_m_s for w in self._motion.waypoints)
            z = z if stand else max(z, *(w.position[2] for w in self._motion.waypoints))
        opening_m = 0.0 if self._arm.is_holding() else here.opening_m
        try:
            self._arm.go(Target((x, y, z), here.yaw_rad, opening_m, speed_m_s))
        except Refused:
            pass  # It stands where it was going.

    def _say(self, command_id: int, kind: int, reason: str = "") -> None:
        status = wire.StatusRecord(command_id=command_id, kind=kind)
        text = reason.encode()[: wire.DETAIL_BYTES_MAX]
        ctypes.memmove(status.detail, text, len(text))
        header = wire.DeviceHeader(sequence=self._n_statuses, capture_ns=time.monotonic_ns())
        self._n_statuses += 1
        self._statuses.send(header, status)

    def _say_state(self) -> None:
        tool = self._arm.tool()
        motion = self._motion
        state = wire.RobotStateRecord(
            position=(ctypes.c_double * 3)(*np.asarray(tool.position, float)),
            yaw_rad=tool.yaw_rad,
            opening_m=tool.opening_m,
            holding=int(self._arm.is_holding()),
            phase=motion.phase if motion else 0,
            command_id=motion.command_id if motion else 0,
        )
        header = wire.DeviceHeader(sequence=self._n_states, capture_ns=time.monotonic_ns())
        self._n_states += 1
        self._states.send(header, state)
        self._statuses.tend()


def _target(waypoint: wire.WaypointRecord) -> Target:
    # What is held stays gripped: its width is where the jaws are, not where they should be sent.
    opening_m = 0.0 if waypoint.expect == HOLDING else waypoint.opening_m
    return Target(tuple(waypoint.position), waypoint.yaw_rad, opening_m, waypoint.speed_m_s)
