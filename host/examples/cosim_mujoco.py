#!/usr/bin/env python3
"""`plumb cosim` on MuJoCo: a ball on three elastic cables, spatial tendons that only pull.

    pip install mujoco
    python3 host/examples/cosim_mujoco.py [--plumb PATH] [--law NAME] [--rig FILE] [--seed N]

Drives the paper's task with a noisy camera of 30 pictures/s whose positions are two pictures late.
Ends with a line of JSON. Exit code: 0 if the board reports the target as reached, 1 otherwise.
"""

import argparse
import collections
import json
import math
import os
import random
import subprocess
import sys

import mujoco
import numpy

MOTORS = {"A": (0.850, 0.610, 0.665), "B": (0.850, 0.0, 0.665), "C": (0.0, 0.240, 0.665)}  # m
START, TARGET = (0.540, 0.220, 0.459), (0.400, 0.400, 0.150)  # m
STEP_M = 2 * math.pi * 0.015 / 200  # cable of a full step
MASS, STIFFNESS = 0.2, 800.0  # kg, N/m
DAMPING = 2 * 0.1 * math.sqrt(STIFFNESS * MASS)  # N s/m
NOISE_M = (0.002, 0.001, 0.001)  # standard deviations
FRAME_S = 1 / 30
LATE = 2  # pictures
SAMPLES = 33  # motor positions in an answer
LIMIT_S = 30
AFTER_S = 2  # simulated after the target is reached

JOINTS = "".join(f'<joint type="slide" axis="{axis}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1"))


def model():
    """Returns the ball and its cables; each cable is a tendon with an actuator that pulls."""
    sites = "".join(f'<site name="{n}" pos="{x} {y} {z}"/>' for n, (x, y, z) in MOTORS.items())
    tendons = "".join(
        f'<spatial name="{n}"><site site="{n}"/><site site="ball"/></spatial>' for n in MOTORS
    )
    pulls = "".join(f'<motor tendon="{n}" gear="-1"/>' for n in MOTORS)
    start = " ".join(map(str, START))
    return mujoco.MjModel.from_xml_string(
        f"""<mujoco><option timestep="0.0005" gravity="0 0 -9.81"/><worldbody>{sites}
        <body name="ball" pos="{start}">{JOINTS}<geom type="sphere" size="0.02" mass="{MASS}"/>
        <site name="ball"/></body></worldbody>
        <tendon>{tendons}</tendon><actuator>{pulls}</actuator></mujoco>"""
    )


def hang(m, d):
    """Returns the unstretched cable lengths (m) with which the ball hangs at rest at START."""
    mujoco.mj_forward(m, d)
    directions = numpy.array(list(MOTORS.values())) - START
    lengths = numpy.linalg.norm(directions, axis=1)
    tensions = numpy.linalg.solve((directions / lengths[:, None]).T, [0, 0, MASS * 9.81])
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

    def step(self, frame, position):
        """Runs the board over one picture's time; returns its answer."""
        line = {"t": frame * FRAME_S, "dt": FRAME_S, "position": position, "age": LATE * FRAME_S}
        if frame == 0:
            line["target"] = TARGET
        self.process.stdin.write(json.dumps(line) + "\n")
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline())

    def close(self):
        """Ends the process."""
        self.process.stdin.close()
        self.process.wait()


def simulate(board, noise):
    """Drives to the target. Returns when it was reached (s; None: never), the last error (m) and
    the times that each cable was slack (s)."""
    m = model()
    d = mujoco.MjData(m)
    rest = lengths = hang(m, d)
    seen = collections.deque(maxlen=LATE + 1)
    slack_s, reached_s, frame, error = numpy.zeros(3), None, 0, math.inf
    while frame < LIMIT_S * 30 and (reached_s is None or frame * FRAME_S < reached_s + AFTER_S):
        ball = [START[i] + d.qpos[i] for i in range(3)]
        error = math.dist(ball, TARGET)
        seen.append([p + noise.gauss(0, sd) for p, sd in zip(ball, NOISE_M)])
        answer = board.step(frame, seen[0] if len(seen) > LATE else None)
        for k, steps in enumerate(answer["steps"]):
            before, lengths = lengths, rest + STEP_M * numpy.array(steps)
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
    args = parser.parse_args()
    board = Board(args.plumb, args.law, args.rig)
    reached_s, error, slack_s = simulate(board, random.Random(args.seed))
    board.close()
    result = {"reached_s": reached_s, "error_mm": round(error * 1e3, 2)}
    print(json.dumps(result | {"slack_s": round(max(slack_s), 3)}))
    return 0 if reached_s is not None else 1


if __name__ == "__main__":
    sys.exit(main())
