"""What happens in a run."""

import ctypes
import json
from collections.abc import Iterator
from typing import Any

from . import wire
from .bus import Bus

WAIT_S = 0.5


def watch(run: str, bus: Bus | None = None) -> Iterator[dict[str, Any]]:
    """Every event of a run, from the last ones that it keeps, until it has ended. Waits for the run to start.

    Each has `text`, a line for people, and `event`; the last one's `event["event"]` is "end", with the verdict. A run
    that breaks off has no such one. A run that serves has one for each of its goals, and is watched until it is over.
    """
    bus = bus or Bus(run)
    descriptions = bus.reader("run", wire.DeviceHeader, ctypes.c_uint8)
    events = bus.reader("event", wire.StreamHeader, ctypes.c_uint8)
    is_started, takes_tasks = False, None
    while True:
        for _, payload in descriptions.take():
            takes_tasks = json.loads(payload.tobytes())["takes_tasks"]
        # Between two goals nobody writes events.
        has_writer = (descriptions if takes_tasks else events).has_writer()
        for _, payload in events.take():
            event = json.loads(payload.tobytes())
            yield event
            if event["event"]["event"] == "end" and takes_tasks is False:
                return
        if is_started and not has_writer:
            return
        is_started |= has_writer
        events.wait(WAIT_S)
