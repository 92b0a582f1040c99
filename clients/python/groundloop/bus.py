"""Topics of a run: writers and readers over iceoryx2."""

import ctypes
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Generic, TypeVar

import iceoryx2 as iox2
import numpy as np

from . import wire

# Each user of a machine has a bus of its own.
NAME = f"groundloop-{os.getuid()}"
PREFIX = f"groundloop_{os.getuid()}_"
EVENT_SENT = 4
EVENT_JOINED = 5
# How often a topic is looked for that no run has created yet.
LOOK_S = 0.1

Header = TypeVar("Header", bound=ctypes.Structure)


class Taken(RuntimeError):
    """Another process writes a topic that has one writer: two would be mixed."""


class Bus:
    """The topics of one run. Everything is released when the object is; keep it in a function, not in a module."""

    def __init__(self, run: str, root: Path | None = None, prefix: str = PREFIX) -> None:
        """`root` and `prefix` are the run's; the defaults are those of `groundloop run`."""
        if root is None:
            root = (Path("/dev/shm") if Path("/dev/shm").is_dir() else Path(tempfile.gettempdir())) / NAME
        config = iox2.config.default()
        config.global_cfg.root_path = iox2.Path.new(str(root))
        config.global_cfg.prefix = iox2.FileName.new(prefix)
        self.run = run
        self._node = (
            iox2.NodeBuilder.new()
            .config(config)
            .signal_handling_mode(iox2.SignalHandlingMode.Disabled)
            .create(iox2.ServiceType.Ipc)
        )

    def refuse_second(self, topic: str, header: type, record: type) -> None:
        """Raises `Taken` when somebody writes the topic already, once the run has created it. What died does not."""
        self._node.try_cleanup_dead_nodes()
        samples, _, _ = self._services(topic, header, record)
        if samples.dynamic_config.number_of_publishers > 0:
            raise Taken(
                f'{topic} of run "{self.run}" has a writer already: another process does the same; end it, or give '
                "the run another name (--run)"
            )

    def writer(self, topic: str, header: type[Header], record: type, size: int = 1) -> "Writer[Header]":
        """Opens a topic for writing, once the run has created it. `size`: elements of the first message."""
        samples, events, joins = self._services(topic, header, record)
        publisher = (
            samples.publisher_builder()
            .initial_max_slice_len(size)
            .allocation_strategy(iox2.AllocationStrategy.PowerOfTwo)
            .create()
        )
        notifier = events.notifier_builder().default_event_id(iox2.EventId.new(EVENT_SENT)).create()
        return Writer(publisher, notifier, joins.listener_builder().create(), record)

    def reader(self, topic: str, header: type[Header], record: type) -> "Reader[Header]":
        """Opens a topic for reading, once the run has created it; what it keeps for late joiners comes first."""
        samples, events, joins = self._services(topic, header, record)
        # The listener comes first: what is sent between the two has woken it.
        listener = events.listener_builder().create()
        subscriber = samples.subscriber_builder().create()
        joined = joins.notifier_builder().default_event_id(iox2.EventId.new(EVENT_JOINED)).create()
        joined.notify()
        return Reader(samples, subscriber, listener, joined)

    def _services(self, topic: str, header: type, record: type) -> tuple[Any, Any, Any]:
        name = f"groundloop/{self.run}/{topic}"

        def service(name: str) -> Any:
            return self._node.service_builder(iox2.ServiceName.new(name))

        payload = iox2.Slice[record]
        samples = _when_there(lambda: service(name).publish_subscribe(payload).user_header(header).open(), name)
        events = _when_there(lambda: service(name).event().open(), name)
        late = f"{name}/late-joiners"
        joins = _when_there(lambda: service(late).event().open(), late)
        return samples, events, joins


def _when_there(open_it: Callable[[], Any], what: str) -> Any:
    """The service, once the run has created it: its settings are the run's to choose."""
    is_told = False
    while True:
        try:
            return open_it()
        except (iox2.PublishSubscribeOpenError, iox2.EventOpenError) as error:
            if "DoesNotExist" not in str(error):
                raise RuntimeError(f"{what}: {error}; docs/protocol.md says what it must be") from error
            if not is_told:
                print(f"waiting for {what}: no run has created it yet", file=sys.stderr, flush=True)
                is_told = True
            time.sleep(LOOK_S)


class Writer(Generic[Header]):
    """The writing end of a topic."""

    def __init__(self, publisher: Any, notifier: Any, joins: Any, record: type) -> None:
        self._publisher, self._notifier, self._joins, self._record = publisher, notifier, joins, record

    def send(self, header: Header, payload: "np.ndarray | ctypes.Structure") -> None:
        """Sends one message: the bytes of an array, or one record. Stamps `schema` and `send_ns`."""
        if isinstance(payload, ctypes.Structure):
            data, n = np.frombuffer(payload, np.uint8), 1
        else:
            data = np.ascontiguousarray(payload).reshape(-1).view(np.uint8)
            n = data.size // ctypes.sizeof(self._record)
        sample = self._publisher.loan_slice_uninit(n)
        there = ctypes.cast(sample.payload_ptr, ctypes.POINTER(ctypes.c_uint8))
        np.ctypeslib.as_array(there, shape=(data.size,))[:] = data
        header.schema, header.send_ns = wire.SCHEMA, time.monotonic_ns()
        ctypes.memmove(sample.user_header(), ctypes.byref(header), ctypes.sizeof(header))
        sample.assume_init().send()
        self._notifier.notify()
        self.tend()

    def tend(self) -> None:
        """Hands late joiners what the topic keeps. `send` does it too; what is written seldom calls it now and then."""
        if self._joins.try_wait():
            self._publisher.update_connections()
            self._notifier.notify()


class Reader(Generic[Header]):
    """The reading end of a topic."""

    def __init__(self, service: Any, subscriber: Any, listener: Any, joined: Any) -> None:
        # What has announced this reader lives as long as the reader does.
        self._service, self._subscriber, self._listener, self._joined = service, subscriber, listener, joined

    def has_writer(self) -> bool:
        """Whether somebody writes the topic."""
        return self._service.dynamic_config.number_of_publishers > 0

    def take(self) -> Iterator[tuple[Header, np.ndarray]]:
        """Every message that has come, as header and the payload's bytes, both copied; other versions are left out."""
        while (sample := self._subscriber.receive()) is not None:
            header = sample.user_header().contents
            header = type(header).from_buffer_copy(header)
            payload = np.frombuffer(bytes(sample.payload().as_memory_view().cast("B")), np.uint8)
            sample.delete()
            if header.schema == wire.SCHEMA:
                yield header, payload

    def wait(self, timeout_s: float) -> None:
        """Sleeps until something comes, so long at most."""
        self._listener.timed_wait(iox2.Duration.from_secs_f64(timeout_s))
