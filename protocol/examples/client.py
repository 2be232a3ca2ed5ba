"""Connects to a board without Plumb: configures it, jogs motor A by ten steps, prints telemetry.

usage: client.py PORT      (a serial port, or the path that `plumb emulate` prints)

Uses only Python's own library. docs/understand/wire-format.md describes the bytes.
"""

import os
import select
import sys
import time
import tty
import zlib

MAGIC, VERSION = b"PLMB", 3
# Identifies the types of all messages. A board with another schema rejects the Hello.
SCHEMA = bytes.fromhex("0269ad900b362a7e")
HELLO, STOP, CONFIGURE, JOG, CLEAR_FAULT, STATUS, WIRE = 0, 1, 3, 6, 8, 9, 16
STATES = ["unconfigured", "ready", "seeking", "holding", "fault"]
STATES += ["jogging", "stopping", "storing", "following"]


def unsigned(number):
    """Encodes a number as a varint: seven bits a byte, the lowest first."""
    out = bytearray()
    while number > 0x7F:
        out.append(number & 0x7F | 0x80)
        number >>= 7
    return bytes(out + bytes([number]))


def signed(*numbers):
    """Encodes numbers with a sign: zigzag, then varint."""
    return b"".join(unsigned(2 * n if n >= 0 else -2 * n - 1) for n in numbers)


def frame(message):
    """Wraps a message: appends its CRC-32, encodes with COBS, appends a zero.

    Runs of 254 bytes and more, which COBS splits, do not occur in these frames."""
    runs = (message + zlib.crc32(message).to_bytes(4, "little")).split(b"\0")
    return b"".join(bytes([len(run) + 1]) + run for run in runs) + b"\0"


def message(chunk):
    """Returns the message of a frame without its zero; None if it is damaged."""
    plain, at = b"", 0
    while at < len(chunk):
        plain += chunk[at + 1 : at + chunk[at]] + b"\0"
        at += chunk[at]
    body, crc = plain[:-5], plain[-5:-1]
    return body if zlib.crc32(body).to_bytes(4, "little") == crc else None


class Reader:
    """Reads a message's fields one after the other."""

    def __init__(self, data):
        self.data, self.at = data, 0

    def byte(self):
        self.at += 1
        return self.data[self.at - 1]

    def unsigned(self):
        number, shift = 0, 0
        while True:
            byte = self.byte()
            number |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return number

    def signed(self):
        number = self.unsigned()
        return -(number + 1) // 2 if number & 1 else number // 2

    def motors(self, read):
        """Reads a list with an entry for each motor."""
        return [read() for _ in range(self.unsigned())]

    def option(self):
        return self.unsigned() if self.byte() else None


def telemetry(fields):
    """Reads the fields of telemetry that follow the number of its variant."""
    told = {"time_us": fields.unsigned(), "state": STATES[fields.unsigned()]}
    fault = fields.unsigned() if told["state"] == "fault" else None
    if fault == 4 or fault == 11 and fields.unsigned() > 0:
        fields.byte()  # the motor that would have passed its travel, or whose driver failed
    told |= {name: fields.option() for name in ("configuration", "target", "sequence")}
    told["motors_steps"] = [steps / 16 for steps in fields.motors(fields.signed)]
    told["rates_steps_s"] = [rate / 256 for rate in fields.motors(fields.signed)]
    told["error_m"] = [fields.signed() / 1e6 for _ in range(3)]
    told["filtered_error_m"] = fields.signed() / 1e6
    told["bad_frames"] = fields.unsigned()
    has_tensions = fields.byte() == 1
    told["tensions_weights"] = (
        [tension / 256 for tension in fields.motors(fields.unsigned)] if has_tensions else None
    )
    if fields.byte() == 1:  # the board follows a reference
        told["reference"] = {name: fields.unsigned() for name in ("sequence", "time_us", "pace")}
        told["reference"]["position_m"] = [fields.signed() / 1e6 for _ in range(3)]
    told["late_ticks"] = fields.unsigned()
    return told


class Board:
    """A board at the other end of a serial port."""

    def __init__(self, port):
        self.port = os.open(port, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self.port)
        self.waiting, self.id, self.telemetry = b"", 0, None

    def messages(self, seconds):
        """Waits for at most `seconds` and yields the received messages as readers."""
        if select.select([self.port], [], [], seconds)[0]:
            self.waiting += os.read(self.port, 4096)
        *chunks, self.waiting = self.waiting.split(b"\0")
        for body in filter(None, map(message, filter(None, chunks))):
            yield Reader(body)

    def request(self, command, content=b""):
        """Sends a command, and repeats it with the same id until the board answers.

        Raises SystemExit if the board refuses it or does not answer."""
        self.id += 1
        for _ in range(25):
            os.write(self.port, frame(unsigned(self.id) + unsigned(command) + content))
            deadline = time.monotonic() + 0.2
            while time.monotonic() < deadline:
                for fields in self.messages(0.02):
                    kind = fields.unsigned()
                    if kind == 2:
                        self.telemetry = telemetry(fields)
                    elif kind in (0, 1) and fields.unsigned() == self.id:
                        refused = fields.data[-1] == 0 if kind == 0 else fields.byte() == 1
                        if refused:
                            raise SystemExit(f"command {command} is refused: {fields.data.hex()}")
                        return
        raise SystemExit("the board does not answer")

    def status(self):
        """Asks for telemetry until it comes, and returns it."""
        self.telemetry = None
        while self.telemetry is None:
            self.request(STATUS)
        return self.telemetry


def wiring():
    """Returns the wiring of a Pico: STEP at GP2, 4, 6, DIR at the pins after them, ENABLE at GP14,
    low to switch on, the emergency input at GP15, the LED at GP25; STEP/DIR drivers."""
    pico, step_dir, active_low, shared = (bytes([number]) for number in (1, 0, 0, 0))
    motors = b"".join(bytes([step, 0, step + 1, 0]) for step in (2, 4, 6))
    no_pen = bytes([0])
    others = shared + bytes([14]) + active_low + bytes([15, 0]) + bytes([1, 25, 0]) + no_pen
    pins = unsigned(3) + motors + others
    nanoseconds = unsigned(1000) + unsigned(1000) + unsigned(200) + unsigned(200)
    return pico + pins + step_dir + nanoseconds + unsigned(0)


def config():
    """Returns a configuration: law `sign`, 400 steps/s, 2000 steps/s², 3000 steps of travel, 16
    microsteps."""
    motor = signed(400 * 256) + unsigned(2000) + signed(-3000 * 16, 3000 * 16) + b"\0"
    workspace = signed(-200_000, -200_000, -100_000, 1_100_000, 900_000, 600_000)
    reached = signed(10_000) + bytes([10])
    deadlines = unsigned(300) + unsigned(500) + unsigned(250)
    growth = signed(40_000) + unsigned(200)
    following = signed(400 * 16, 20_000)
    progress = signed(1_000) + unsigned(10_000)
    jog = signed(100 * 256, 200 * 16)
    path = signed(300_000) + unsigned(1_000) + unsigned(10_000) + signed(20_000)
    law = unsigned(1) + unsigned(1000)
    mean = unsigned(0)
    limits = workspace + reached + deadlines + growth + following + progress + jog + path
    return law + unsigned(3) + 3 * motor + bytes([16]) + limits + mean


def main():
    if len(sys.argv) != 2:
        raise SystemExit("usage: client.py PORT")
    board = Board(sys.argv[1])
    os.write(board.port, b"\0")  # ends whatever the board has half received
    board.request(HELLO, MAGIC + unsigned(VERSION) + SCHEMA)
    board.request(STOP)
    board.request(CLEAR_FAULT)
    board.request(WIRE, wiring())
    board.request(CONFIGURE, config())
    begin = board.status()["motors_steps"][0]
    board.request(JOG, bytes([0]) + signed(10 * 16, 100 * 256))
    while True:
        told = board.status()
        print(told, flush=True)
        if told["state"] == "ready" and told["motors_steps"][0] == begin + 10:
            return


if __name__ == "__main__":
    main()
