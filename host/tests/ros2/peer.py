"""A node of ROS 2 on Cyclone DDS, an independent implementation, for host/tests/ros2.rs.

    python peer.py DOMAIN NAMESPACE [--plain]

Prints what it receives as lines of JSON, and reads commands as lines of JSON from standard input:

    {"target": [x, y, z], "frame": "plumb/rig"}      publishes a target
    {"flood": 2.0, "target": [x, y, z], "frame": f}  publishes targets for 2 s as fast as it can
    {"vector": [x, y, z]}                            publishes another type on the targets' topic
    {"call": "stop"}                                 calls a service

Services are called as rmw_cyclonedds_cpp does, with the identity of the request in the message, or
with --plain as rmw_fastrtps_cpp does, without it. Only the loopback interface is used.
"""

import json
import os
import sys
import threading
import time
from dataclasses import dataclass

os.environ["CYCLONEDDS_URI"] = """<CycloneDDS><Domain id="any">
<General><AllowMulticast>false</AllowMulticast>
<Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex>
<MaxAutoParticipantIndex>30</MaxAutoParticipantIndex>
<Peers><Peer address="127.0.0.1"/></Peers></Discovery>
</Domain></CycloneDDS>"""

from cyclonedds.core import Policy, Qos  # noqa: E402
from cyclonedds.domain import DomainParticipant  # noqa: E402
from cyclonedds.idl import IdlStruct  # noqa: E402
from cyclonedds.idl.types import (  # noqa: E402
    array,
    byte,
    float64,
    int32,
    int64,
    sequence,
    uint8,
    uint32,
    uint64,
)
from cyclonedds.internal import InvalidSample  # noqa: E402
from cyclonedds.pub import DataWriter  # noqa: E402
from cyclonedds.sub import DataReader  # noqa: E402
from cyclonedds.topic import Topic  # noqa: E402
from cyclonedds.util import duration  # noqa: E402

RELIABLE = Qos(
    Policy.Reliability.Reliable(duration(milliseconds=100)),
    Policy.History.KeepLast(10),
    Policy.Durability.Volatile,
    Policy.DataRepresentation(use_cdrv0_representation=True),
)


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class Point(IdlStruct, typename="geometry_msgs::msg::dds_::Point_"):
    x: float64
    y: float64
    z: float64


@dataclass
class PointStamped(IdlStruct, typename="geometry_msgs::msg::dds_::PointStamped_"):
    header: Header
    point: Point


@dataclass
class Vector3Stamped(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3Stamped_"):
    header: Header
    vector: Point


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Pose(IdlStruct, typename="geometry_msgs::msg::dds_::Pose_"):
    position: Point
    orientation: Quaternion


@dataclass
class PoseWithCovariance(IdlStruct, typename="geometry_msgs::msg::dds_::PoseWithCovariance_"):
    pose: Pose
    covariance: array[float64, 36]


@dataclass
class PoseStamped(IdlStruct, typename="geometry_msgs::msg::dds_::PoseWithCovarianceStamped_"):
    header: Header
    pose: PoseWithCovariance


@dataclass
class Transform(IdlStruct, typename="geometry_msgs::msg::dds_::Transform_"):
    translation: Point
    rotation: Quaternion


@dataclass
class TransformStamped(IdlStruct, typename="geometry_msgs::msg::dds_::TransformStamped_"):
    header: Header
    child_frame_id: str
    transform: Transform


@dataclass
class TFMessage(IdlStruct, typename="tf2_msgs::msg::dds_::TFMessage_"):
    transforms: sequence[TransformStamped]


@dataclass
class KeyValue(IdlStruct, typename="diagnostic_msgs::msg::dds_::KeyValue_"):
    key: str
    value: str


@dataclass
class DiagnosticStatus(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticStatus_"):
    level: byte
    name: str
    message: str
    hardware_id: str
    values: sequence[KeyValue]


@dataclass
class DiagnosticArray(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticArray_"):
    header: Header
    status: sequence[DiagnosticStatus]


@dataclass
class Image(IdlStruct, typename="sensor_msgs::msg::dds_::Image_"):
    header: Header
    height: uint32
    width: uint32
    encoding: str
    is_bigendian: uint8
    step: uint32
    data: sequence[uint8]


@dataclass
class CompressedImage(IdlStruct, typename="sensor_msgs::msg::dds_::CompressedImage_"):
    header: Header
    format: str
    data: sequence[uint8]


@dataclass
class RegionOfInterest(IdlStruct, typename="sensor_msgs::msg::dds_::RegionOfInterest_"):
    x_offset: uint32
    y_offset: uint32
    height: uint32
    width: uint32
    do_rectify: bool


@dataclass
class CameraInfo(IdlStruct, typename="sensor_msgs::msg::dds_::CameraInfo_"):
    header: Header
    height: uint32
    width: uint32
    distortion_model: str
    d: sequence[float64]
    k: array[float64, 9]
    r: array[float64, 9]
    p: array[float64, 12]
    binning_x: uint32
    binning_y: uint32
    roi: RegionOfInterest


@dataclass
class CycloneRequest(IdlStruct, typename="std_srvs::srv::dds_::Trigger_Request_"):
    guid: uint64
    number: int64
    empty: uint8


@dataclass
class CycloneResponse(IdlStruct, typename="std_srvs::srv::dds_::Trigger_Response_"):
    guid: uint64
    number: int64
    success: bool
    message: str


@dataclass
class PlainRequest(IdlStruct, typename="std_srvs::srv::dds_::Trigger_Request_"):
    empty: uint8


@dataclass
class PlainResponse(IdlStruct, typename="std_srvs::srv::dds_::Trigger_Response_"):
    success: bool
    message: str


OUTPUT = threading.Lock()


def show(kind, value):
    with OUTPUT:
        print(json.dumps({kind: value}), flush=True)


def samples(reader):
    """Returns the messages that have come, without the notes that a writer has gone."""
    return [it for it in reader.take(N=50) if not isinstance(it, InvalidSample)]


def xyz(point):
    return [point.x, point.y, point.z]


def status_of(status):
    values = {it.key: it.value for it in status.values}
    level = status.level if isinstance(status.level, int) else status.level[0]
    return {"name": status.name, "level": level, "message": status.message, "values": values}


class Peer:
    def __init__(self, domain, namespace, is_plain):
        self.participant = DomainParticipant(domain)
        self.namespace = namespace
        self.is_plain = is_plain
        self.targets = self.writer(f"rt{namespace}/target", PointStamped)
        self.vectors = None
        self.clients = {
            name: self.client(name) for name in ("stop", "resume", "hold", "clear_fault")
        }
        self.calls = 0
        self.guid = int.from_bytes(os.urandom(7), "little")
        self.readers = [
            (self.reader(f"rt{namespace}/ball", PointStamped), self.ball),
            (self.reader(f"rt{namespace}/ball_pose", PoseStamped), self.pose),
            (self.reader("rt/tf", TFMessage), self.transforms),
            (self.reader("rt/diagnostics", DiagnosticArray), self.diagnostics),
        ]

    def reader(self, name, kind):
        return DataReader(self.participant, Topic(self.participant, name, kind), qos=RELIABLE)

    def writer(self, name, kind):
        return DataWriter(self.participant, Topic(self.participant, name, kind), qos=RELIABLE)

    def client(self, name):
        request, response = (
            (PlainRequest, PlainResponse) if self.is_plain else (CycloneRequest, CycloneResponse)
        )
        return (
            self.writer(f"rq{self.namespace}/{name}Request", request),
            self.reader(f"rr{self.namespace}/{name}Reply", response),
        )

    def ball(self, message):
        stamp = message.header.stamp.sec + message.header.stamp.nanosec * 1e-9
        age = time.time() - stamp
        show("ball", {"at": xyz(message.point), "frame": message.header.frame_id, "age": age})

    def pose(self, message):
        pose = message.pose
        show("pose", {"at": xyz(pose.pose.position), "covariance": list(pose.covariance)})

    def transforms(self, message):
        for it in message.transforms:
            at, turn = it.transform.translation, it.transform.rotation
            show(
                "tf",
                {
                    "parent": it.header.frame_id,
                    "child": it.child_frame_id,
                    "at": xyz(at),
                    "turn": xyz(turn) + [turn.w],
                },
            )

    def diagnostics(self, message):
        for status in message.status:
            show("status", status_of(status))

    def receive(self):
        while True:
            for reader, handle in self.readers:
                for message in samples(reader):
                    handle(message)
            for name, (_, replies) in self.clients.items():
                for reply in samples(replies):
                    if self.is_plain or reply.guid == self.guid:
                        answer = {"success": reply.success, "message": reply.message}
                        show("answer", {"call": name} | answer)
            time.sleep(0.005)

    def target(self, at, frame):
        header = Header(Time(int(time.time()), 0), frame)
        self.targets.write(PointStamped(header, Point(*at)))

    def flood(self, seconds, at, frame):
        end, count = time.monotonic() + seconds, 0
        while time.monotonic() < end:
            x, y, z = at
            self.target([x + 1e-5 * (count % 100), y, z], frame)
            count += 1
        show("flooded", count)

    def vector(self, at):
        if self.vectors is None:
            participant = DomainParticipant(self.participant.get_domain_id())
            self.other = participant
            topic = Topic(participant, f"rt{self.namespace}/target", Vector3Stamped)
            self.vectors = DataWriter(participant, topic, qos=RELIABLE)
            time.sleep(1.0)
        header = Header(Time(int(time.time()), 0), f"{self.namespace[1:]}/rig")
        self.vectors.write(Vector3Stamped(header, Point(*at)))

    def call(self, name):
        self.calls += 1
        writer = self.clients[name][0]
        if self.is_plain:
            writer.write(PlainRequest(0))
        else:
            writer.write(CycloneRequest(self.guid, self.calls, 0))

    def obey(self, command):
        if "call" in command:
            self.call(command["call"])
        elif "vector" in command:
            self.vector(command["vector"])
        elif "flood" in command:
            self.flood(command["flood"], command["target"], command["frame"])
        else:
            self.target(command["target"], command["frame"])


def main():
    domain, namespace = int(sys.argv[1]), sys.argv[2]
    peer = Peer(domain, namespace, "--plain" in sys.argv)
    threading.Thread(target=peer.receive, daemon=True).start()
    show("ready", True)
    for line in sys.stdin:
        peer.obey(json.loads(line))


if __name__ == "__main__":
    main()
