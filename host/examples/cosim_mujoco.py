#!/usr/bin/env python3
"""`plumb cosim` on MuJoCo: a ball on elastic cables, spatial tendons that only pull.

    pip install mujoco
    python3 host/examples/cosim_mujoco.py [--plumb PATH] [--law NAME] [--rig FILE] [--seed N]
                                           [--planar]

Drives the paper's task with a noisy camera of 30 pictures/s whose positions are two pictures late.
With --planar two cables, which let the ball swing out of their plane; it begins 2 cm out of it, and
the camera does not see that. Needs the rig file of `plumb init --planar --simulated`.
Ends with a line of JSON. Exit code: 0 if the board reports the target as reached, 1 otherwise.
"""

import argparse
import collections
import dataclasses
import json
import math
import os
import random
import subprocess
import sys

import mujoco
import numpy

STEP_M = 2 * math.pi / 200  # cable of a full step for a drum's radius of 1 m
MASS, STIFFNESS = 0.2, 800.0  # kg, N/m
DAMPING = 2 * 0.1 * math.sqrt(STIFFNESS * MASS)  # N s/m
NOISE_M = (0.002, 0.001, 0.001)  # standard deviations
FRAME_S = 1 / 30
LATE = 2  # pictures
SAMPLES = 33  # motor positions in an answer
LIMIT_S = 30
AFTER_S = 2  # simulated after the target is reached


@dataclasses.dataclass
class World:
    """Places (m) and radii of the drums (m)."""

    motors: dict
    radii: tuple
    start: tuple
    target: tuple
    aside: float = 0.0  # of the ball at the start, along x

    @property
    def is_planar(self):
        return len(self.motors) == 2


SPACE = World(
    {"A": (0.850, 0.610, 0.665), "B": (0.850, 0.0, 0.665), "C": (0.0, 0.240, 0.665)},
    (0.015, 0.015, 0.015), (0.540, 0.220, 0.459), (0.400, 0.400, 0.150),
)
PLANE = World(
    {"A": (0.0, 1.1, 1.25), "B": (0.0, 0.1, 1.25)},
    (0.015, 0.012), (0.0, 0.45, 0.75), (0.0, 0.8, 0.55), aside=0.02,
)
AIR = 0.02  # N s/m, of a ball of 0.2 kg that swings: a tenth of its speed a second


def model(world):
    """Returns the ball and its cables; each cable is a tendon with an actuator that pulls."""
    sites = "".join(
        f'<site name="{n}" pos="{x} {y} {z}"/>' for n, (x, y, z) in world.motors.items()
    )
    tendons = "".join(
        f'<spatial name="{n}"><site site="{n}"/><site site="ball"/></spatial>' for n in world.motors
    )
    pulls = "".join(f'<motor tendon="{n}" gear="-1"/>' for n in world.motors)
    start = " ".join(map(str, world.start))
    air = AIR if world.is_planar else 0
    joints = "".join(
        f'<joint type="slide" axis="{axis}" damping="{air}"/>'
        for axis in ("1 0 0", "0 1 0", "0 0 1")
    )
    return mujoco.MjModel.from_xml_string(
        f"""<mujoco><option timestep="0.0005" gravity="0 0 -9.81"/><worldbody>{sites}
        <body name="ball" pos="{start}">{joints}<geom type="sphere" size="0.02" mass="{MASS}"/>
        <site name="ball"/></body></worldbody>
        <tendon>{tendons}</tendon><actuator>{pulls}</actuator></mujoco>"""
    )


def hang(m, d, world):
    """Returns the unstretched cable lengths (m) with which the ball hangs at rest at the start."""
    mujoco.mj_forward(m, d)
    directions = numpy.array(list(world.motors.values())) - world.start
    lengths = numpy.linalg.norm(directions, axis=1)
    weight = [0, 0, MASS * 9.81]
    tensions = numpy.linalg.lstsq((directions / lengths[:, None]).T, weight, rcond=None)[0]
    return lengths - tensions / STIFFNESS


def advance(m, d, lengths, rates):
    """Simulates one time step with unstretched cable lengths (m) and their rates (m/s).

    Returns which cables are slack. A cable pulls where it is stretched. Its damping is on the rate
    of the stretch, not on the rate at which it is paid out.
    """
    mujoco.mj_step1(m, d)
    stretch = d.ten_length - lengths
    pulls = STIFFNESS * stretch + DAMPING * (d.ten_velocity - rates)
    d.ctrl[:] = numpy.where(stretch > 0, numpy.maximum(pulls, 0), 0)
    mujoco.mj_step2(m, d)
    return stretch <= 0


class Board:
    """The program's end: `plumb cosim` in a process of its own."""

    def __init__(self, plumb, law, rig):
        command = [plumb, "cosim", "--samples", str(SAMPLES), *(["--law", law] if law else [])]
        command += ["--rig", rig] if rig else []
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True)

    def step(self, frame, position, target):
        """Runs the board over one picture's time; returns its answer."""
        line = {"t": frame * FRAME_S, "dt": FRAME_S, "position": position, "age": LATE * FRAME_S}
        if frame == 0:
            line["target"] = target
        self.process.stdin.write(json.dumps(line) + "\n")
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline())

    def close(self):
        """Ends the process."""
        self.process.stdin.close()
        self.process.wait()


def simulate(board, noise, world):
    """Drives to the target. Returns when it was reached (s; None: never), the last error (m) and
    the times that each cable was slack (s)."""
    m = model(world)
    d = mujoco.MjData(m)
    rest = lengths = hang(m, d, world)
    d.qpos[0] = world.aside
    step_m = STEP_M * numpy.array(world.radii)
    seen = collections.deque(maxlen=LATE + 1)
    slack_s, reached_s, frame, error = numpy.zeros(len(rest)), None, 0, math.inf
    while frame < LIMIT_S * 30 and (reached_s is None or frame * FRAME_S < reached_s + AFTER_S):
        ball = [world.start[i] + d.qpos[i] for i in range(3)]
        if world.is_planar:
            ball[0] = 0.0
        error = math.dist(ball, world.target)
        seen.append([p + noise.gauss(0, sd) for p, sd in zip(ball, NOISE_M)])
        if world.is_planar:
            seen[-1][0] = 0.0
        answer = board.step(frame, seen[0] if len(seen) > LATE else None, world.target)
        for k, steps in enumerate(answer["steps"]):
            before, lengths = lengths, rest + step_m * numpy.array(steps[: len(rest)])
            begin, span = (frame + k / SAMPLES) * FRAME_S, FRAME_S / SAMPLES
            rates = (lengths - before) / span
            while d.time < begin + span:
                slack_s += m.opt.timestep * advance(m, d, before + rates * (d.time - begin), rates)
        if answer["reached"] and reached_s is None:
            reached_s = (frame + 1) * FRAME_S
        frame += 1
    return reached_s, error, slack_s


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plumb", default="plumb", help="the program")
    parser.add_argument("--law", help="a law's name")
    parser.add_argument("--rig", help="a rig file")
    parser.add_argument("--seed", type=int, default=1, help="seed of the camera's noise")
    parser.add_argument("--planar", action="store_true", help="two cables")
    args = parser.parse_args()
    board = Board(args.plumb, args.law, args.rig)
    reached_s, error, slack_s = simulate(
        board, random.Random(args.seed), PLANE if args.planar else SPACE
    )
    board.close()
    result = {"reached_s": reached_s, "error_mm": round(error * 1e3, 2)}
    print(json.dumps(result | {"slack_s": round(max(slack_s), 3)}))
    return 0 if reached_s is not None else 1


if __name__ == "__main__":
    sys.exit(main())
