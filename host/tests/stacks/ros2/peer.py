"""A node of ROS 2 on Cyclone DDS, an independent implementation, for host/tests/it/ros2/.

    python peer.py DOMAIN NAMESPACE [--plain]

Prints what it receives as lines of JSON, and reads commands as lines of JSON from standard input:

    {"target": [x, y, z], "frame": "plumb/rig"}      publishes a target
    {"flood": [x, y, z], "frame": "plumb/rig"}       publishes targets as fast as it can, in turn at
                                                     two places that are 4 cm apart
    {"circle": [x, y, z], "rate": 30}                publishes a moving target on a circle of 5 cm
                                                     round this place, once round in 6.3 s; with
                                                     "sensor_data": true without repetition
    {"calm": true}                                   ends both
    {"vector": [x, y, z]}                            publishes another type on the targets' topic
    {"best_effort": [x, y, z]}                       publishes a target without repetition
    {"call": "stop"}                                 calls a service

Services are called as rmw_cyclonedds_cpp does, with the identity of the request in the message, or
with --plain as rmw_fastrtps_cpp does, without it. Only the loopback interface is used.
"""

import json
import math
import os
import sys
import threading
import time

os.environ["CYCLONEDDS_URI"] = """<CycloneDDS><Domain id="any">
<General><AllowMulticast>false</AllowMulticast>
<Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex>
<MaxAutoParticipantIndex>30</MaxAutoParticipantIndex>
<Peers><Peer address="127.0.0.1"/></Peers></Discovery>
</Domain></CycloneDDS>"""

from cyclonedds.core import Policy, Qos  # noqa: E402
from cyclonedds.domain import DomainParticipant  # noqa: E402
from cyclonedds.internal import InvalidSample  # noqa: E402
from cyclonedds.pub import DataWriter  # noqa: E402
from cyclonedds.sub import DataReader  # noqa: E402
from cyclonedds.topic import Topic  # noqa: E402
from cyclonedds.util import duration  # noqa: E402
from messages import (  # noqa: E402
    CycloneRequest,
    CycloneResponse,
    DiagnosticArray,
    DiagnosticStatus,
    Header,
    PlainRequest,
    PlainResponse,
    Point,
    PointStamped,
    PoseStamped,
    TFMessage,
    Time,
    Vector3Stamped,
)

RELIABLE = Qos(
    Policy.Reliability.Reliable(duration(milliseconds=100)),
    Policy.History.KeepLast(10),
    Policy.Durability.Volatile,
    Policy.DataRepresentation(use_cdrv0_representation=True),
)
SENSOR_DATA = Qos(
    Policy.Reliability.BestEffort,
    Policy.History.KeepLast(5),
    Policy.Durability.Volatile,
    Policy.DataRepresentation(use_cdrv0_representation=True),
)

LATCHED = Qos(
    Policy.Reliability.Reliable(duration(milliseconds=100)),
    Policy.History.KeepLast(1),
    Policy.Durability.TransientLocal,
    Policy.DataRepresentation(use_cdrv0_representation=True),
)

OUTPUT = threading.Lock()


def show(kind, value):
    with OUTPUT:
        print(json.dumps({kind: value}), flush=True)


def samples(reader):
    """Returns the messages that have come, without the notes that a writer has gone."""
    return [it for it in reader.take(N=50) if not isinstance(it, InvalidSample)]


def xyz(point):
    return [point.x, point.y, point.z]


def stamp_of(header):
    return {"stamp": [header.stamp.sec, header.stamp.nanosec]}


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
        self.others = []
        self.is_calm = threading.Event()
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
            (self.reader(f"rt{namespace}/stop_status", DiagnosticStatus, LATCHED), self.stop),
        ]

    def reader(self, name, kind, qos=RELIABLE):
        return DataReader(self.participant, Topic(self.participant, name, kind), qos=qos)

    def writer(self, name, kind, qos=RELIABLE):
        return DataWriter(self.participant, Topic(self.participant, name, kind), qos=qos)

    def client(self, name):
        request, response = (
            (PlainRequest, PlainResponse) if self.is_plain else (CycloneRequest, CycloneResponse)
        )
        return (
            self.writer(f"rq{self.namespace}/{name}Request", request),
            self.reader(f"rr{self.namespace}/{name}Reply", response),
        )

    def ball(self, message):
        header = message.header
        age = time.time() - (header.stamp.sec + header.stamp.nanosec * 1e-9)
        shown = {"at": xyz(message.point), "frame": header.frame_id, "age": age}
        show("ball", shown | stamp_of(header))

    def pose(self, message):
        pose = message.pose
        shown = {"at": xyz(pose.pose.position), "covariance": list(pose.covariance)}
        show("pose", shown | stamp_of(message.header))

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
                }
                | stamp_of(it.header),
            )

    def diagnostics(self, message):
        for status in message.status:
            show("status", status_of(status))

    def stop(self, message):
        show("stop", status_of(message))

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

    def flood(self, at, frame):
        count = 0
        while not self.is_calm.is_set():
            x, y, z = at
            self.target([x, y + 0.04 * (count % 2), z], frame)
            count += 1
        show("flooded", count)

    def circle(self, centre, rate, qos):
        writer = self.writer(f"rt{self.namespace}/moving_target", PointStamped, qos)
        begin, count = time.time(), 0
        while not self.is_calm.is_set():
            now = begin + count / rate
            time.sleep(max(0.0, now - time.time()))
            x, y, z = centre
            angle = now - begin
            point = Point(x + 0.05 * math.cos(angle), y + 0.05 * math.sin(angle), z)
            stamp = Time(int(now), int(now % 1.0 * 1e9))
            writer.write(PointStamped(Header(stamp, f"{self.namespace[1:]}/rig"), point))
            count += 1
        show("circled", count)

    def write_as_other(self, kind, qos, at):
        """Publishes on the targets' topic as another program does."""
        participant = DomainParticipant(self.participant.get_domain_id())
        topic = Topic(participant, f"rt{self.namespace}/target", kind)
        writer = DataWriter(participant, topic, qos=qos)
        self.others += [participant, writer]
        time.sleep(1.0)
        header = Header(Time(int(time.time()), 0), f"{self.namespace[1:]}/rig")
        writer.write(kind(header, Point(*at)))

    def call(self, name):
        self.calls += 1
        writer = self.clients[name][0]
        if self.is_plain:
            writer.write(PlainRequest(0))
        else:
            writer.write(CycloneRequest(self.guid, self.calls, 0))

    def publish(self, function, *arguments):
        """Publishes in a thread, until a command ends it."""
        self.is_calm.clear()
        threading.Thread(target=function, args=arguments, daemon=True).start()

    def obey(self, command):
        if "call" in command:
            self.call(command["call"])
        elif "vector" in command:
            self.write_as_other(Vector3Stamped, RELIABLE, command["vector"])
        elif "best_effort" in command:
            self.write_as_other(PointStamped, SENSOR_DATA, command["best_effort"])
        elif "flood" in command:
            self.publish(self.flood, command["flood"], command["frame"])
        elif "circle" in command:
            qos = SENSOR_DATA if command.get("sensor_data") else RELIABLE
            self.publish(self.circle, command["circle"], command["rate"], qos)
        elif "calm" in command:
            self.is_calm.set()
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
