"""Goals for a run that serves: asked for, cancelled, and what becomes of them."""

import ctypes
import json
import time
import uuid
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import wire
from .bus import Bus

# How long nothing may be said of a goal before it is asked for again: messages may be lost.
ASK_AGAIN_S = 1.0
# How long is slept at most before it is looked whether the run is still there.
WAIT_S = 0.2
# Statuses that wait to be iterated over, at most.
STATUSES_MAX = 1024
TEXT_BYTES = 4096


class Ended(RuntimeError):
    """The run has ended: nothing more becomes of its goals."""


@dataclass(frozen=True)
class TaskStatus:
    """What has become of a goal."""

    id: str
    """Whoever submitted it has chosen it."""
    kind: str | None
    """What reads the text; `None`: what the run file says."""
    text: str
    """The goal as it was submitted."""
    state: str
    """queued, running, done, cancelled, refused or failed."""
    line: str
    """The same for people."""
    reason: str
    """Why it was cancelled, refused or has failed; empty otherwise."""
    verdict: str | None
    """How its episode ended, once it is done: reached, planned, executed, unsolvable or gave-up."""
    goal: str | None
    """What was read out of the text, as PDDL, once it is done."""
    run_s: float | None
    """How long its episode took in run time, seconds."""
    goal_in_simulator: bool | None
    """Whether the goal really holds, where the world is simulated."""

    @property
    def is_over(self) -> bool:
        """Whether nothing more comes of it."""
        return self.state not in ("queued", "running")

    @staticmethod
    def of(message: dict[str, Any]) -> "TaskStatus":
        """What a message on `task/status` says."""
        end = message.get("end")
        return TaskStatus(
            id=message["id"],
            kind=message.get("kind"),
            text=message["text"],
            state=message["state"],
            line=message["line"],
            reason=message.get("reason", ""),
            verdict=end["verdict"] if end else None,
            goal=message.get("goal"),
            run_s=message.get("run_s"),
            goal_in_simulator=message.get("goal_in_simulator"),
        )


class Tasks:
    """Asks a run of `groundloop serve` for goals. It carries them out one after another."""

    def __init__(self, run: str, bus: Bus | None = None) -> None:
        """Waits for the run."""
        self._bus = bus or Bus(run)
        self._statuses = self._bus.reader("task/status", wire.DeviceHeader, ctypes.c_uint8)
        self._requests = self._bus.writer("task", wire.DeviceHeader, ctypes.c_uint8, TEXT_BYTES)
        self._n_asked = 0
        self._submitted: dict[str, dict[str, Any]] = {}
        self._cancelled: set[str] = set()
        self._known: dict[str, TaskStatus] = {}
        self._new: deque[TaskStatus] = deque(maxlen=STATUSES_MAX)

    def submit(self, text: str, kind: str | None = None, id: str | None = None) -> str:
        """Asks for a goal, and returns its id. `text` and `kind` are as in `[goal]` of a run file.

        One whose `id` is known to the run is answered, and not carried out again.
        """
        id = id or uuid.uuid4().hex
        request = {"request": "submit", "id": id, "text": text}
        if kind is not None:
            request["kind"] = kind
        self._submitted[id] = request
        self._ask(request)
        return id

    def cancel(self, id: str) -> None:
        """Asks not to go on with a goal: the robot holds, if it is at work for it. `wait` tells when it is so."""
        self._cancelled.add(id)
        self._ask({"request": "cancel", "id": id})

    def wait(self, id: str) -> TaskStatus:
        """Waits until nothing more comes of a goal. What is not answered is asked again. Raises `Ended`."""
        asked_s = time.monotonic()
        while True:
            self._take()
            status = self._known.get(id)
            if status is not None and status.is_over:
                return status
            if time.monotonic() - asked_s > ASK_AGAIN_S:
                asked_s = time.monotonic()
                if status is None and id in self._submitted:
                    self._ask(self._submitted[id])
                if id in self._cancelled:
                    self._ask({"request": "cancel", "id": id})
            self._sleep()

    def statuses(self) -> Iterator[TaskStatus]:
        """All that is said of goals, of anybody's, until the run has ended; what the run keeps comes first."""
        while True:
            self._take()
            while self._new:
                yield self._new.popleft()
            try:
                self._sleep()
            except Ended:
                self._take()
                yield from self._new
                return

    def __iter__(self) -> Iterator[TaskStatus]:
        return self.statuses()

    def _ask(self, request: dict[str, Any]) -> None:
        header = wire.DeviceHeader(sequence=self._n_asked)
        self._n_asked += 1
        self._requests.send(header, np.frombuffer(json.dumps(request).encode(), np.uint8))

    def _take(self) -> None:
        for _, payload in self._statuses.take():
            status = TaskStatus.of(json.loads(payload.tobytes()))
            self._known[status.id] = status
            self._new.append(status)

    def _sleep(self) -> None:
        """Until something is said, and not for long; raises `Ended` when nobody is left who could."""
        if not self._statuses.has_writer():
            raise Ended(f'run "{self._bus.run}" has ended')
        self._requests.tend()
        self._statuses.wait(WAIT_S)
