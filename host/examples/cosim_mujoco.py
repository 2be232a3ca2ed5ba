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
MASS, STIFFNESS, DAMPING_RATIO = 0.2, 800.0, 0.1
FRAME_S, LATE, SAMPLES = 1 / 30, 2, 33


def model():
    """The ball and its cables; each is a tendon with a spring that is dead below its length."""
    sites = "".join(f'<site name="{name}" pos="{x} {y} {z}"/>' for name, (x, y, z) in MOTORS.items())
    damping = 2 * DAMPING_RATIO * math.sqrt(STIFFNESS * MASS)
    tendons = "".join(
        f'<spatial name="{name}" stiffness="{STIFFNESS}" damping="{damping}" springlength="0 1">'
        f'<site site="{name}"/><site site="ball"/></spatial>'
        for name in MOTORS
    )
    return mujoco.MjModel.from_xml_string(
        f"""<mujoco><option timestep="0.0005" integrator="implicitfast"/><worldbody>{sites}
        <body name="ball" pos="{' '.join(map(str, START))}"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>
        <joint type="slide" axis="0 0 1"/><geom type="sphere" size="0.02" mass="{MASS}"/><site name="ball"/></body></worldbody>
        <tendon>{tendons}</tendon></mujoco>"""
    )


def hang(m, d):
    """Cable lengths with which the ball hangs at rest at START: straight, less what its weight stretches them."""
    mujoco.mj_forward(m, d)
    directions = numpy.array([numpy.subtract(site, START) for site in MOTORS.values()], float)
    units = directions / numpy.linalg.norm(directions, axis=1)[:, None]
    tensions = numpy.linalg.solve(units.T, [0, 0, MASS * 9.81])
    return numpy.linalg.norm(directions, axis=1) - tensions / STIFFNESS


def set_lengths(m, lengths):
    """A cable pulls where it is stretched beyond its length, and is damped only there."""
    for k, length in enumerate(lengths):
        m.tendon_lengthspring[k] = (0, length)


def advance(m, d, lengths, damping):
    """One time step; a slack cable does not damp."""
    set_lengths(m, lengths)
    slack = [d.ten_length[k] <= lengths[k] for k in range(3)]
    for k in range(3):
        m.tendon_damping[k] = 0.0 if slack[k] else damping[k]
    mujoco.mj_step(m, d)
    return slack


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
    m.opt.gravity[:] = (0, 0, -9.81)
    d = mujoco.MjData(m)
    rest, damping = hang(m, d), list(m.tendon_damping)
    seen = collections.deque(maxlen=LATE + 1)
    slack_s, reached_s, frame, error = [0.0] * 3, None, 0, math.inf
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
            lengths = [rest[i] + steps[i] * STEP_M for i in range(3)]
            while d.time < (frame + (k + 1) / SAMPLES) * FRAME_S:
                slack = advance(m, d, lengths, damping)
                slack_s = [s + m.opt.timestep * is_slack for s, is_slack in zip(slack_s, slack)]
        if answer["reached"] and reached_s is None:
            reached_s = (frame + 1) * FRAME_S
        frame += 1
    board.stdin.close()
    board.wait()
    print(json.dumps({"reached_s": reached_s, "error_mm": round(error * 1e3, 2), "slack_s": round(max(slack_s), 3)}))
    return 0 if reached_s is not None else 1


if __name__ == "__main__":
    sys.exit(main())
