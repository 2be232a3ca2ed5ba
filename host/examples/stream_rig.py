#!/usr/bin/env python3
"""A camera that is a Python program: it sees the ball of an emulated rig.

    python3 host/examples/stream_rig.py [--plumb PATH] [--port LINK] [--stream unix:camera.sock]

Starts `plumb emulate --motors` with its board on the terminal LINK. The motors of that board hang a
ball on three cables; each picture shows the ball where the cables of that moment let it hang. The
pictures go to the address `camera.stream` of a rig file, which `plumb run` reads at the same time.
Needs no package. Ends when Plumb closes the stream.
"""

import argparse
import json
import math
import random
import socket
import subprocess
import threading
import time

MOTORS = ((0.850, 0.610, 0.665), (0.850, 0.0, 0.665), (0.0, 0.240, 0.665))  # A, B, C; m
START = (0.540, 0.220, 0.459)  # m
STEP_M = 2 * math.pi * 0.015 / 200  # cable of a full step
RADIUS = 0.040  # of the ball, m

# The camera of host/rigs/camera.toml: it stands at EYE and looks along -x.
EYE = (1.737, 0.286, 0.225)  # m
WIDTH, HEIGHT, FOCAL, CX, CY = 640, 480, 525.0, 319.5, 239.5  # pixels
DEPTH_SCALE = 1000.0  # depth is in millimetres
WALL_MM = 2500
LIGHT = (-0.5, -0.7, -0.5)  # from the ball, in the camera's axes
FRAME_S = 1 / 30


def hang(lengths):
    """Returns the lower intersection of the spheres of three taut cables (m); None without one."""
    a, b, c = MOTORS
    ex = [(q - p) / math.dist(a, b) for p, q in zip(a, b)]
    along = sum(u * (q - p) for u, p, q in zip(ex, a, c))
    across = [q - p - along * u for u, p, q in zip(ex, a, c)]
    j = math.hypot(*across)
    ey = [v / j for v in across]
    ez = [ex[i] * ey[k] - ex[k] * ey[i] for i, k in ((1, 2), (2, 0), (0, 1))]
    d = math.dist(a, b)
    la, lb, lc = (length * length for length in lengths)
    x = (la - lb + d * d) / (2 * d)
    y = (la - lc + along * along + j * j - 2 * along * x) / (2 * j)
    square = la - x * x - y * y
    if square < 0:
        return None
    z = math.sqrt(square) * (-1 if ez[2] > 0 else 1)
    return [p + x * u + y * v + z * w for p, u, v, w in zip(a, ex, ey, ez)]


class Rig:
    """The emulated board, and the ball that its motors move."""

    def __init__(self, plumb, port):
        command = [plumb, "emulate", "--motors", "--link", port]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        self.process.stdout.readline()  # the terminal's path
        self.start = [math.dist(motor, START) for motor in MOTORS]
        self.ball = list(START)
        threading.Thread(target=self.follow, daemon=True).start()

    def follow(self):
        """Moves the ball with the motors."""
        for line in self.process.stdout:
            steps = json.loads(line)["motors"]
            lengths = [length + STEP_M * n for length, n in zip(self.start, steps)]
            self.ball = hang(lengths) or self.ball


def room():
    """Returns the colour and depth of a wall with some texture."""
    noise = random.Random(1)
    grey = bytearray()
    for _ in range(WIDTH * HEIGHT):
        level = 110 + noise.randrange(12)
        grey += bytes((level, level, level + 4))
    return grey, bytearray(WALL_MM.to_bytes(2, "little") * (WIDTH * HEIGHT))


def draw(ball, colour, depth):
    """Draws the ball at a place (m) into a picture."""
    # In the camera's axes: right, down, forward.
    x, y, z = ball[1] - EYE[1], EYE[2] - ball[2], EYE[0] - ball[0]
    u, v, reach = CX + FOCAL * x / z, CY + FOCAL * y / z, FOCAL * RADIUS / z * 1.1 + 1
    for row in range(max(0, int(v - reach)), min(HEIGHT, int(v + reach) + 1)):
        for column in range(max(0, int(u - reach)), min(WIDTH, int(u + reach) + 1)):
            ray = ((column - CX) / FOCAL, (row - CY) / FOCAL, 1.0)
            square = ray[0] ** 2 + ray[1] ** 2 + 1
            middle = (ray[0] * x + ray[1] * y + z) / square
            inside = middle**2 - (x * x + y * y + z * z - RADIUS**2) / square
            if inside < 0:
                continue
            s = middle - math.sqrt(inside)
            normal = [(s * r - p) / RADIUS for r, p in zip(ray, (x, y, z))]
            light = 0.45 + 0.55 * max(0.0, sum(n * l for n, l in zip(normal, LIGHT)))
            pixel = row * WIDTH + column
            colour[3 * pixel : 3 * pixel + 3] = bytes(int(c * light) for c in (215, 25, 30))
            depth[2 * pixel : 2 * pixel + 2] = round(s * DEPTH_SCALE).to_bytes(2, "little")


def connect(stream):
    """Connects to a stream; waits until Plumb listens."""
    kind, _, address = stream.partition(":")
    while True:
        try:
            if kind == "unix":
                plumb = socket.socket(socket.AF_UNIX)
                plumb.connect(address)
                return plumb
            host, _, port = address.rpartition(":")
            return socket.create_connection((host, int(port)))
        except (FileNotFoundError, ConnectionRefusedError):
            time.sleep(0.05)


def send(plumb, rig):
    """Sends pictures of the rig until Plumb closes the stream."""
    background = room()
    header = {"width": WIDTH, "height": HEIGHT, "colour": "rgb8", "depth": "z16"}
    header |= {"colour_bytes": 3 * WIDTH * HEIGHT, "depth_bytes": 2 * WIDTH * HEIGHT}
    header |= {"depth_scale": DEPTH_SCALE}
    while True:
        colour, depth = (bytearray(part) for part in background)
        header["t"] = time.monotonic()
        draw(rig.ball, colour, depth)
        header["age"] = time.monotonic() - header["t"]
        plumb.sendall(json.dumps(header).encode() + b"\n" + colour + depth)
        time.sleep(max(0.0, header["t"] + FRAME_S - time.monotonic()))


def main():
    """Starts the rig and sends its pictures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plumb", default="plumb", help="the program")
    parser.add_argument("--port", default="board", help="link to the board's terminal")
    parser.add_argument("--stream", default="unix:camera.sock", help="where Plumb listens")
    options = parser.parse_args()
    rig = Rig(options.plumb, options.port)
    try:
        send(connect(options.stream), rig)
    except (BrokenPipeError, ConnectionResetError):
        pass
    finally:
        rig.process.terminate()
        rig.process.wait()


if __name__ == "__main__":
    main()
