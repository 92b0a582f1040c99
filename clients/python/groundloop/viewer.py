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

    Each has `text`, a line for people, and `event`; the last one has `end` instead, which tells the verdict.
    """
    bus = bus or Bus(run)
    events = bus.reader("event", wire.StreamHeader, ctypes.c_uint8)
    verdicts = bus.reader("verdict", wire.StreamHeader, ctypes.c_uint8)
    while True:
        ended = [json.loads(payload.tobytes()) for _, payload in verdicts.take()]
        for _, payload in events.take():
            yield json.loads(payload.tobytes())
        if ended:
            yield ended[-1]
            return
        events.wait(WAIT_S)
