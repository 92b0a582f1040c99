"""A camera of your own, in Python: publishes a moving test picture to a run.

    pip install iceoryx2 numpy
    python3 examples/attach_camera.py NAME [FRAMES]

NAME is the run's name (`--run NAME`, or `run = "NAME"` in its run file, with `camera.kind = "external"`). It waits for the
run to start, and ends with Ctrl-C or after FRAMES frames. examples/attach_camera.rs shows a run to try it with.
The fields are those of FrameHeader in src/transport/wire.rs.
"""

import ctypes
import sys
import time

import iceoryx2 as iox2
import numpy as np

WIDTH, HEIGHT, PERIOD_S = 640, 480, 0.1


class FrameHeader(ctypes.Structure):
    _fields_ = [(name, ctypes.c_uint32) for name in ("schema", "encoding")]
    _fields_ += [(name, ctypes.c_uint64) for name in ("sequence", "capture_ns", "send_ns")]
    _fields_ += [(name, ctypes.c_uint32) for name in ("width", "height", "stride", "has_intrinsics")]
    _fields_ += [(name, ctypes.c_double) for name in ("fx", "fy", "cx", "cy")]
    _fields_ += [("has_pose", ctypes.c_uint32), ("reserved", ctypes.c_uint32)]
    _fields_ += [("world_from_camera_xyz", ctypes.c_double * 3), ("world_from_camera_xyzw", ctypes.c_double * 4)]

    @staticmethod
    def type_name():
        return "groundloop.FrameHeader.v1"


def open_when_there(builder, what):
    """The service, once the run has created it: its settings are the run's to choose."""
    is_told = False
    while True:
        try:
            return builder().open()
        except (iox2.PublishSubscribeOpenError, iox2.EventOpenError) as error:
            if "DoesNotExist" not in str(error):
                raise
            if not is_told:
                print(f"waiting for {what}: no run has created it yet", file=sys.stderr, flush=True)
                is_told = True
            time.sleep(PERIOD_S)


def main(run, n_frames):
    config = iox2.config.default()
    config.global_cfg.root_path = iox2.Path.new("/dev/shm/groundloop")
    config.global_cfg.prefix = iox2.FileName.new("groundloop_")
    node = (iox2.NodeBuilder.new().config(config)
            .signal_handling_mode(iox2.SignalHandlingMode.Disabled).create(iox2.ServiceType.Ipc))
    topic = f"groundloop/{run}/camera/main/rgb"
    service = lambda: node.service_builder(iox2.ServiceName.new(topic))
    payload = iox2.Slice[ctypes.c_uint8]
    frames = open_when_there(lambda: service().publish_subscribe(payload).user_header(FrameHeader), topic)
    wake_ups = open_when_there(lambda: service().event(), topic)
    size = WIDTH * HEIGHT * 3
    publisher = frames.publisher_builder().initial_max_slice_len(size).create()
    notifier = wake_ups.notifier_builder().default_event_id(iox2.EventId.new(4)).create()
    picture = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    for sequence in range(n_frames):
        picture[:] = 40
        picture[200:280, sequence % (WIDTH - 80):][:, :80] = (200, 40, 40)
        sample = publisher.loan_slice_uninit(size)
        pixels = ctypes.cast(sample.payload_ptr, ctypes.POINTER(ctypes.c_uint8))
        np.ctypeslib.as_array(pixels, shape=(size,))[:] = picture.ravel()
        header = sample.user_header().contents
        header.schema, header.encoding = SCHEMA, 0
        header.sequence, header.capture_ns, header.send_ns = sequence, time.monotonic_ns(), time.monotonic_ns()
        header.width, header.height, header.stride = WIDTH, HEIGHT, WIDTH * 3
        sample.assume_init().send()
        notifier.notify()
        time.sleep(PERIOD_S)


SCHEMA = 3  # of src/transport/wire.rs

if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        sys.exit("usage: attach_camera.py NAME [FRAMES]")
    try:
        main(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else sys.maxsize)
    except KeyboardInterrupt:
        pass
