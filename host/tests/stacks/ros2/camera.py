"""A camera's node of ROS 2 on Cyclone DDS, for host/tests/it/ros2/.

    python camera.py DOMAIN [--plumb PATH] [--type TYPE] [--compressed] [--no-depth]
                            [--depth-delay SECONDS] [--focal PIXELS] [--wait] [--info-once]
                            [--no-info] [--compressed-depth] [--clock-rate RATE]
                            [--clock-zero SECONDS] [--stamps FILE] [--info-frame FRAME]

With --plumb it starts an emulated board on the terminal `board` and shows the ball where the
board's motors let it hang (host/examples/stream_rig.py). Without, the ball hangs still at the
paper's target. The topics are those of realsense-ros: colour is published reliably, depth as sensor
data, which is best effort. --type CompressedImage publishes colour with that type on the topic of
raw pictures. --compressed publishes colour as PNG on the topic of compressed pictures.
--depth-delay publishes depth at least so long after the colour of the same stamp. --focal states
this focal length, which the pictures do not have. --wait publishes the first picture after the
signal SIGUSR1. --info-once publishes the description once, before anything else, and keeps it for
readers that come later. --no-info announces the description and sends none. --compressed-depth
publishes depth as compressed_depth_image_transport does. --clock-rate lets the stamps run so many
times as fast as this computer's clock, --clock-zero lets them begin at this time. --stamps appends
seconds and nanoseconds of each stamp of colour to a file, before it is published. --info-frame has
the description of another camera, in this frame.
"""

import argparse
import atexit
import signal
import struct
import sys
import time
import zlib
from collections import deque
from pathlib import Path

import messages
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl._machinery import PlainCdrV2SequenceOfPrimitiveMachine as SequenceMachine
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic
from peer import LATCHED, RELIABLE, SENSOR_DATA

sys.path.insert(0, str(Path(__file__).parents[3] / "examples"))
import stream_rig  # noqa: E402

PAPER = (0.4, 0.4, 0.15)  # m
NAME = "rt/camera/camera"


def write_sequence(machine, buffer, value, *arguments, **options):
    """Writes the bytes of a picture as a whole: the package writes them one by one, in 160 ms."""
    if not isinstance(value, bytes):
        return SLOW(machine, buffer, value, *arguments, **options)
    buffer.align(4)
    buffer.write("I", 4, len(value))
    buffer.write_bytes(value)


SLOW, SequenceMachine.serialize = SequenceMachine.serialize, write_sequence


def header(stamp, frame="camera_color_optical_frame"):
    """Returns the header of a picture of the time `stamp`, nanoseconds since 1970."""
    return messages.Header(messages.Time(*divmod(stamp, 10**9)), frame)


def image(stamp, encoding, pixel_bytes, data):
    width, height = stream_rig.WIDTH, stream_rig.HEIGHT
    return messages.Image(
        header(stamp), height, width, encoding, 0, pixel_bytes * width, bytes(data)
    )


def info(stamp, fx, frame):
    cx, cy = stream_rig.CX, stream_rig.CY
    return messages.CameraInfo(
        header(stamp, frame),
        stream_rig.HEIGHT,
        stream_rig.WIDTH,
        "plumb_bob",
        [0.0] * 5,
        [fx, 0.0, cx, 0.0, fx, cy, 0.0, 0.0, 1.0],
        [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        [fx, 0.0, cx, 0.0, 0.0, fx, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
        0,
        0,
        messages.RegionOfInterest(0, 0, 0, 0, False),
    )


def png(pixels, pixel_bytes):
    """Returns a picture as PNG: of colour with 3 bytes, or depth with 2, the lower one first."""
    if pixel_bytes == 2:
        swapped = bytearray(pixels)
        swapped[::2], swapped[1::2] = pixels[1::2], pixels[::2]
        pixels = swapped
    row = pixel_bytes * stream_rig.WIDTH
    rows = b"".join(b"\0" + pixels[at : at + row] for at in range(0, len(pixels), row))
    bits, kind = (8, 2) if pixel_bytes == 3 else (16, 0)
    header = struct.pack(">IIBBBBB", stream_rig.WIDTH, stream_rig.HEIGHT, bits, kind, 0, 0, 0)

    def chunk(kind, data):
        checked = kind + data
        return struct.pack(">I", len(data)) + checked + struct.pack(">I", zlib.crc32(checked))

    data = chunk(b"IDAT", zlib.compress(rows, 1))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + data + chunk(b"IEND", b"")


def compressed_depth(stamp, depth):
    """Returns depth with the header of compressed_depth_image_transport, 12 bytes."""
    data = bytes(12) + png(depth, 2)
    return messages.CompressedImage(header(stamp), "16UC1; compressedDepth png", data)


class Node:
    def __init__(self, domain, options):
        self.participant = DomainParticipant(domain)
        self.is_compressed = options.compressed
        self.depth_delay = options.depth_delay
        self.focal, self.info_frame = options.focal, options.info_frame
        self.waiting = deque()  # depth pictures, and when they are due
        self.kind = messages.CompressedImage if options.compressed else options.kind
        raw = f"{NAME}/color/image_raw"
        name = f"{raw}/compressed" if options.compressed else raw
        self.colour = self.writer(name, self.kind, RELIABLE)
        self.stamps = options.stamps and open(options.stamps, "a")  # noqa: SIM115
        depth, kind = f"{NAME}/aligned_depth_to_color/image_raw", messages.Image
        self.has_depth_files = options.compressed_depth
        if self.has_depth_files:
            depth, kind = f"{depth}/compressedDepth", messages.CompressedImage
        self.depth = options.depth and self.writer(depth, kind, SENSOR_DATA)
        self.is_info_due, self.is_info_once = options.has_info, options.info_once
        qos = LATCHED if self.is_info_once else RELIABLE
        self.info = self.writer(f"{NAME}/color/camera_info", messages.CameraInfo, qos)

    def writer(self, name, kind, qos):
        return DataWriter(self.participant, Topic(self.participant, name, kind), qos=qos)

    def describe(self, stamp):
        if self.is_info_due:
            self.info.write(info(stamp, self.focal, self.info_frame))
            self.is_info_due = not self.is_info_once

    def publish(self, stamp, colour, depth):
        if self.stamps:
            print(*divmod(stamp, 10**9), file=self.stamps, flush=True)
        self.describe(stamp)
        if self.kind is messages.CompressedImage:
            data = png(colour, 3) if self.is_compressed else b""
            self.colour.write(messages.CompressedImage(header(stamp), "png", data))
        else:
            self.colour.write(image(stamp, "rgb8", 3, colour))
        if self.depth:
            due = time.monotonic() + self.depth_delay
            files = self.has_depth_files
            message = compressed_depth(stamp, depth) if files else image(stamp, "16UC1", 2, depth)
            self.waiting.append((due, message))
            while self.waiting and self.waiting[0][0] <= time.monotonic():
                self.depth.write(self.waiting.popleft()[1])


def main():
    options = argparse.ArgumentParser()
    options.add_argument("domain", type=int)
    options.add_argument("--plumb")
    options.add_argument("--type", default="Image", choices=["Image", "CompressedImage"])
    options.add_argument("--compressed", action="store_true")
    options.add_argument("--no-depth", dest="depth", action="store_false")
    options.add_argument("--depth-delay", type=float, default=0.0)
    options.add_argument("--focal", type=float, default=stream_rig.FOCAL)
    options.add_argument("--wait", action="store_true")
    options.add_argument("--info-once", action="store_true")
    options.add_argument("--no-info", dest="has_info", action="store_false")
    options.add_argument("--compressed-depth", action="store_true")
    options.add_argument("--clock-rate", type=float, default=1.0)
    options.add_argument("--clock-zero", type=float)
    options.add_argument("--stamps")
    options.add_argument("--info-frame", default="camera_color_optical_frame")
    options = options.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit())
    rig = stream_rig.Rig(options.plumb, "board") if options.plumb else None
    if rig:
        atexit.register(rig.process.kill)
    options.kind = getattr(messages, options.type)
    node = Node(options.domain, options)
    background = stream_rig.room()
    if options.wait:
        signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGUSR1])
    print("ready", flush=True)
    if options.wait:
        signal.sigwait([signal.SIGUSR1])
    zero = time.time_ns()
    first = zero if options.clock_zero is None else int(options.clock_zero * 1e9)
    if options.info_once:
        node.describe(first)
    while True:
        begin = time.monotonic()
        colour, depth = (bytearray(part) for part in background)
        stamp = first + int((time.time_ns() - zero) * options.clock_rate)
        stream_rig.draw(rig.ball if rig else PAPER, colour, depth)
        node.publish(stamp, colour, depth)
        time.sleep(max(0.0, stream_rig.FRAME_S - (time.monotonic() - begin)))


main()
