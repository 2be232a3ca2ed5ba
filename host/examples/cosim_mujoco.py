#!/usr/bin/env python3
"""`plumb cosim` on MuJoCo: a ball on three elastic cables (spatial tendons that pull and do not push).

    pip install mujoco
    python3 host/examples/cosim_mujoco.py [--plumb PATH] [--law NAME] [--seed N]

Drives the paper's task with a camera of 30 pictures/s, two pictures late and noisy. Ends with a line of JSON; exit code 0
where the target was reached.
"""

import argparse
import collections
import json
import math
import random
import subprocess
import sys

import mujoco
import numpy

MOTORS = {"A": (0.850, 0.610, 0.665), "B": (0.850, 0.0, 0.665), "C": (0.0, 0.240, 0.665)}
START, TARGET = (0.540, 0.220, 0.459), (0.400, 0.400, 0.150)
STEP_M = 2 * math.pi * 0.015 / 200
MASS, STIFFNESS = 0.2, 800.0
DAMPING = 2 * 0.1 * math.sqrt(STIFFNESS * MASS)
FRAME_S, LATE, SAMPLES = 1 / 30, 2, 33


def model():
    """The ball and its cables; each is a tendon that an actuator pulls by."""
    sites = "".join(f'<site name="{name}" pos="{x} {y} {z}"/>' for name, (x, y, z) in MOTORS.items())
    tendons = "".join(
        f'<spatial name="{name}"><site site="{name}"/><site site="ball"/></spatial>' for name in MOTORS
    )
    pulls = "".join(f'<motor tendon="{name}" gear="-1"/>' for name in MOTORS)
    return mujoco.MjModel.from_xml_string(
        f"""<mujoco><option timestep="0.0005" gravity="0 0 -9.81"/><worldbody>{sites}
        <body name="ball" pos="{' '.join(map(str, START))}"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>
        <joint type="slide" axis="0 0 1"/><geom type="sphere" size="0.02" mass="{MASS}"/><site name="ball"/></body></worldbody>
        <tendon>{tendons}</tendon><actuator>{pulls}</actuator></mujoco>"""
    )


def hang(m, d):
    """Cable lengths with which the ball hangs at rest at START: straight, less what its weight stretches them."""
    mujoco.mj_forward(m, d)
    directions = numpy.array(list(MOTORS.values())) - START
    lengths = numpy.linalg.norm(directions, axis=1)
    tensions = numpy.linalg.solve((directions / lengths[:, None]).T, [0, 0, MASS * 9.81])
    return lengths - tensions / STIFFNESS


def advance(m, d, lengths, rates):
    """One time step with cables of these lengths (m) that grow at these rates (m/s); which of them are slack. A cable pulls where it
    is stretched, and is damped as it stretches: not as it is paid out."""
    mujoco.mj_step1(m, d)
    stretch = d.ten_length - lengths
    pulls = STIFFNESS * stretch + DAMPING * (d.ten_velocity - rates)
    d.ctrl[:] = numpy.where(stretch > 0, numpy.maximum(pulls, 0), 0)
    mujoco.mj_step2(m, d)
    return stretch <= 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plumb", default="plumb", help="the program")
    parser.add_argument("--law", help="a law's name")
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    noise = random.Random(args.seed)
    command = [args.plumb, "cosim", "--samples", str(SAMPLES)] + (["--law", args.law] if args.law else [])
    board = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    m = model()
    d = mujoco.MjData(m)
    rest = lengths = hang(m, d)
    seen = collections.deque(maxlen=LATE + 1)
    slack_s, reached_s, frame, error = numpy.zeros(3), None, 0, math.inf
    while frame < 30 * 30 and (reached_s is None or frame * FRAME_S < reached_s + 2):
        ball = [START[i] + d.qpos[i] for i in range(3)]
        error = math.dist(ball, TARGET)
        seen.append([p + noise.gauss(0, sd) for p, sd in zip(ball, (0.002, 0.001, 0.001))])
        line = {"t": frame * FRAME_S, "dt": FRAME_S, "position": None, "age": LATE * FRAME_S}
        if len(seen) > LATE:
            line["position"] = seen[0]
        if frame == 0:
            line["target"] = TARGET
        board.stdin.write(json.dumps(line) + "\n")
        board.stdin.flush()
        answer = json.loads(board.stdout.readline())
        for k, steps in enumerate(answer["steps"]):
            before, lengths = lengths, rest + STEP_M * numpy.array(steps)
            begin, span = (frame + k / SAMPLES) * FRAME_S, FRAME_S / SAMPLES
            rates = (lengths - before) / span
            while d.time < begin + span:
                slack_s += m.opt.timestep * advance(m, d, before + rates * (d.time - begin), rates)
        if answer["reached"] and reached_s is None:
            reached_s = (frame + 1) * FRAME_S
        frame += 1
    board.stdin.close()
    board.wait()
    print(json.dumps({"reached_s": reached_s, "error_mm": round(error * 1e3, 2), "slack_s": round(max(slack_s), 3)}))
    return 0 if reached_s is not None else 1


if __name__ == "__main__":
    sys.exit(main())
