"""Checks the MCAP file of a run against its run folder, with Python's mcap library.

usage: mcap_agrees.py RUN.mcap RUN_FOLDER [--events]     (only the events)
Prints the number of messages by topic as JSON; fails at the first difference.
"""

import csv
import json
import math
import sys
from pathlib import Path

from mcap.decoder import DecoderFactory as AnyDecoderFactory
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

# Records have micrometres; the scene has all digits.
NEAR = 1e-6


class JsonDecoderFactory(AnyDecoderFactory):
    """Decodes the messages that are JSON."""

    def decoder_for(self, message_encoding, schema):
        return json.loads if message_encoding == "json" else None


def read(path):
    """Returns the decoded messages by topic, with their log times, and the schemas by topic."""
    messages, schemas = {}, {}
    factories = [DecoderFactory(), JsonDecoderFactory()]
    with open(path, "rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=factories)
        for schema, channel, message, decoded in reader.iter_decoded_messages():
            messages.setdefault(channel.topic, []).append((message.log_time, decoded))
            schemas[channel.topic] = schema
        statistics = reader.get_summary().statistics
    assert statistics.message_count == sum(map(len, messages.values())), statistics
    return messages, schemas


def near(a, b):
    return math.isclose(a, b, rel_tol=0.0, abs_tol=NEAR)


def check_schema(topic, schema, messages):
    """Each message has exactly the properties of its schema that it must have, or more."""
    properties = json.loads(schema.data)["properties"]
    required = json.loads(schema.data)["required"]
    for _, message in messages:
        assert set(required) <= set(message), (topic, message)
        unknown = set(message) - set(properties)
        assert topic == "/run/summary" or not unknown, (topic, unknown)


def check_observations(messages, rows):
    assert len(messages) == len(rows), (len(messages), len(rows))
    start = messages[0][0] - round(float(rows[0]["time_s"]) * 1e9)
    for (stamp, message), row in zip(messages, rows):
        assert message["frame"] == int(row["frame"]), (message, row)
        assert abs(stamp - start - message["time_s"] * 1e9) < 1e3, (stamp, message)
        assert near(message["time_s"], float(row["time_s"])), (message, row)
        position = message["position_m"]
        assert (position is None) == (row["position_m_x"] == ""), (message, row)
        if position is None:
            continue
        for axis, coordinate in zip("xyz", position):
            assert near(coordinate, float(row[f"position_m_{axis}"])), row
        assert near(message["error_m"], float(row["error_m"])), row
        covariance = message["covariance_m2"]
        assert all(covariance[i] > 0.0 for i in (0, 4, 8)), covariance
        assert covariance[1] == covariance[3], covariance


def check_telemetry(messages, rows):
    """The columns of the motors are those of the newest telemetry."""
    by_frame = {message["frame"]: message for _, message in messages}
    newest = None
    for row in rows:
        newest = by_frame.get(int(row["frame"]), newest)
        assert (newest is None) == (row["motors_steps_a"] == ""), row
        if newest is not None:
            for name, steps, rate in zip("abc", newest["motors_steps"], newest["rates_steps_s"]):
                assert near(steps, float(row[f"motors_steps_{name}"])), row
                assert near(rate, float(row[f"rates_steps_s_{name}"])), row
            for name, tension in zip("abc", newest["tensions_weights"] or [None] * 3):
                column = row[f"tensions_weights_{name}"]
                assert column == "" if tension is None else near(tension, float(column)), row
        if int(row["frame"]) in by_frame:
            assert (newest["driver_warnings"] or "") == row["driver_warnings"], row


def check_pictures(messages, frames):
    for topic in ("/camera/image", "/camera/calibration", "/tf", "/scene"):
        assert len(messages[topic]) == frames, (topic, len(messages[topic]))
    for stamp, image in messages["/camera/image"]:
        assert image.format == "jpeg" and image.data[:3] == b"\xff\xd8\xff", image.format
        assert image.data[-2:] == b"\xff\xd9"
        assert image.timestamp.ToNanoseconds() == stamp
    _, calibration = messages["/camera/calibration"][0]
    assert (calibration.width, calibration.height) == (640, 480), calibration
    _, transform = messages["/tf"][0]
    assert (transform.parent_frame_id, transform.child_frame_id) == ("rig", "camera"), transform


def check_scene(messages, rows):
    """The ball of the scene is where the row has it; the target is the row's."""
    for (_, update), row in zip(messages, rows):
        entities = {entity.id: entity for entity in update.entities}
        target = entities["target"].spheres[0].pose.position
        assert near(target.x, float(row["target_m_x"])), row
        balls = entities["ball"].spheres
        assert len(balls) == (row["position_m_x"] != ""), row
        for ball in balls:
            assert near(ball.pose.position.z, float(row["position_m_z"])), row


def check_events(messages, schema, summary):
    """The events are those of the summary, which leaves lost frames out."""
    check_schema("/run/events", schema, messages)
    events = [message for _, message in messages if message["kind"] != "frame_lost"]
    assert events == summary["events"], (events, summary["events"])


def main():
    messages, schemas = read(sys.argv[1])
    folder = Path(sys.argv[2])
    rows = list(csv.DictReader((folder / "run.csv").open()))
    summary = json.loads((folder / "summary.json").read_text())
    check_events(messages["/run/events"], schemas["/run/events"], summary)
    if "--events" in sys.argv:
        return
    for topic in ("/ball/observation", "/board/telemetry", "/run/summary"):
        check_schema(topic, schemas[topic], messages[topic])
    check_observations(messages["/ball/observation"], rows)
    check_telemetry(messages["/board/telemetry"], rows)
    check_pictures(messages, len(rows))
    check_scene(messages["/scene"], rows)
    assert [message for _, message in messages["/run/summary"]] == [summary], summary
    assert summary["frames"] == len(rows), summary
    ended = [m for _, m in messages["/run/events"] if m["kind"] == "target_ended"]
    assert len(ended) == len(summary["legs"]), ended
    assert [m["ok"] for m in ended] == [leg["reached"] for leg in summary["legs"]], ended
    print(json.dumps({topic: len(kept) for topic, kept in messages.items()}))


if __name__ == "__main__":
    main()
