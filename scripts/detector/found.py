"""Counts the balls that a program finds in the recordings of balls.py: found.py PLUMB OUT

PLUMB is the program `plumb`. A ball is found if its centre and its radius are at most 0.3 radii
off. A circle that is farther off is wrong.
"""

import glob
import os
import subprocess
import sys

# Largest error of the centre and of the radius, in the radius.
MAX_ERROR = 0.3


def circles(program, folder):
    """Returns the circles (column, row, radius; pixels) that are found, by their time stamps."""
    command = [program, "replay", folder, "--camera", f"{folder}/camera.toml"]
    lines = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    rows = [line.split(",") for line in lines if line[:1].isdigit() and line.count(",") > 5]
    return {float(row[0]): [float(value) for value in row[1:4]] for row in rows if row[1]}


def is_right(circle, truth):
    """Checks whether a circle is the true one."""
    off = max(distance(circle, truth), abs(circle[2] - truth[2]))
    return off < MAX_ERROR * truth[2]


def distance(circle, truth):
    """Returns the distance of the centres."""
    return ((circle[0] - truth[0]) ** 2 + (circle[1] - truth[1]) ** 2) ** 0.5


def main():
    program, out = sys.argv[1:]
    for camera in sorted(glob.glob(f"{out}/*/camera.toml")):
        folder = os.path.dirname(camera)
        with open(f"{folder}/truth.csv", encoding="utf-8") as file:
            truths = [[float(value) for value in line.split(",")] for line in file]
        found = circles(program, folder)
        judged = [is_right(found[time], truth) for time, *truth in truths if time in found]
        wrong = len(judged) - sum(judged)
        print(f"{os.path.basename(folder)}: {sum(judged)} of {len(truths)}, {wrong} wrong")


if __name__ == "__main__":
    main()
