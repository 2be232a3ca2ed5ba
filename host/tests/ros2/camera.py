"""A camera's node of ROS 2 on Cyclone DDS, for host/tests/ros2.rs.

    python camera.py DOMAIN [--plumb PATH] [--type TYPE]

With --plumb it starts an emulated board on the terminal `board` and shows the ball where the
board's motors let it hang (host/examples/stream_rig.py). Without, the ball hangs still at the
paper's target. The topics are those of realsense-ros: colour is published reliably, depth as sensor
data, which is best effort. --type CompressedImage publishes colour with that type on the topic of
raw pictures.
"""

import argparse
import atexit
import signal
import sys
import time
from pathlib import Path

import peer
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl._machinery import PlainCdrV2SequenceOfPrimitiveMachine as SequenceMachine
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic

sys.path.insert(0, str(Path(__file__).parents[2] / "examples"))
import stream_rig  # noqa: E402

PAPER = (0.4, 0.4, 0.15)  # m
NAME = "rt/camera/camera"
SENSOR_DATA = Qos(
    Policy.Reliability.BestEffort,
    Policy.History.KeepLast(5),
    Policy.Durability.Volatile,
    Policy.DataRepresentation(use_cdrv0_representation=True),
)


def write_sequence(machine, buffer, value, *arguments, **options):
    """Writes the bytes of a picture as a whole: the package writes them one by one, in 160 ms."""
    if not isinstance(value, bytes):
        return SLOW(machine, buffer, value, *arguments, **options)
    buffer.align(4)
    buffer.write("I", 4, len(value))
    buffer.write_bytes(value)


SLOW, SequenceMachine.serialize = SequenceMachine.serialize, write_sequence


def header(stamp):
    seconds = int(stamp)
    frame = "camera_color_optical_frame"
    return peer.Header(peer.Time(seconds, int((stamp - seconds) * 1e9)), frame)


def image(stamp, encoding, pixel_bytes, data):
    width, height = stream_rig.WIDTH, stream_rig.HEIGHT
    return peer.Image(
        header(stamp), height, width, encoding, 0, pixel_bytes * width, bytes(data)
    )


def info(stamp):
    fx, cx, cy = stream_rig.FOCAL, stream_rig.CX, stream_rig.CY
    return peer.CameraInfo(
        header(stamp),
        stream_rig.HEIGHT,
        stream_rig.WIDTH,
        "plumb_bob",
        [0.0] * 5,
        [fx, 0.0, cx, 0.0, fx, cy, 0.0, 0.0, 1.0],
        [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        [fx, 0.0, cx, 0.0, 0.0, fx, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
        0,
        0,
        peer.RegionOfInterest(0, 0, 0, 0, False),
    )


class Node:
    def __init__(self, domain, kind):
        self.participant = DomainParticipant(domain)
        self.kind = kind
        self.colour = self.writer(f"{NAME}/color/image_raw", kind, peer.RELIABLE)
        depth = f"{NAME}/aligned_depth_to_color/image_raw"
        self.depth = self.writer(depth, peer.Image, SENSOR_DATA)
        self.info = self.writer(f"{NAME}/color/camera_info", peer.CameraInfo, peer.RELIABLE)

    def writer(self, name, kind, qos):
        return DataWriter(self.participant, Topic(self.participant, name, kind), qos=qos)

    def publish(self, stamp, colour, depth):
        if self.kind is peer.CompressedImage:
            self.colour.write(peer.CompressedImage(header(stamp), "jpeg", b""))
        else:
            self.colour.write(image(stamp, "rgb8", 3, colour))
        self.info.write(info(stamp))
        self.depth.write(image(stamp, "16UC1", 2, depth))


def main():
    options = argparse.ArgumentParser()
    options.add_argument("domain", type=int)
    options.add_argument("--plumb")
    options.add_argument("--type", default="Image", choices=["Image", "CompressedImage"])
    options = options.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit())
    rig = stream_rig.Rig(options.plumb, "board") if options.plumb else None
    if rig:
        atexit.register(rig.process.kill)
    node = Node(options.domain, getattr(peer, options.type))
    background = stream_rig.room()
    print("ready", flush=True)
    while True:
        begin = time.monotonic()
        colour, depth = (bytearray(part) for part in background)
        stamp = time.time()
        stream_rig.draw(rig.ball if rig else PAPER, colour, depth)
        node.publish(stamp, colour, depth)
        time.sleep(max(0.0, stream_rig.FRAME_S - (time.monotonic() - begin)))


main()
