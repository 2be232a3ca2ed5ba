#!/usr/bin/env python3
"""Compares the runs of the demo on two architectures.

What the board computes from integers must be the same: its state, motor positions and rates. What
the detector computes may differ in the last digit that run.csv has.

usage: tests/same_numbers.py FOLDER FOLDER     (each with a run folder for each law)
exit: 1 a number differs by more than it may
"""

import csv
import sys
from pathlib import Path

# Columns whose text must be the same.
EXACT = ("frame", "time_s", "state", "target_state", "motors_", "rates_", "near_slack")
# Most that another column may differ: one in the sixth digit after the point, and rounding.
LAST_DIGIT = 1.001e-6


def rows(folder, law):
    with open(folder / law / "run.csv", newline="") as file:
        return list(csv.DictReader(file))


def difference(mine, theirs):
    if mine == theirs:
        return 0.0
    try:
        return abs(float(mine) - float(theirs))
    except ValueError:
        return float("inf")


def compare(here, there, law):
    """Prints the largest difference of each column that differs; returns whether it may."""
    mine, theirs = rows(here, law), rows(there, law)
    largest = {}
    for a, b in zip(mine, theirs):
        for column in a:
            largest[column] = max(largest.get(column, 0.0), difference(a[column], b[column]))
    may = len(mine) == len(theirs)
    for column, value in largest.items():
        allowed = 0.0 if column.startswith(EXACT) else LAST_DIGIT
        may = may and value <= allowed
        if value > 0.0:
            print(f"{law}: {column} differs by up to {value:.2g}", file=sys.stderr)
    print(f"{law}: {len(mine)} and {len(theirs)} pictures", file=sys.stderr)
    return may


def main():
    here, there = map(Path, sys.argv[1:])
    laws = sorted(path.name for path in here.iterdir() if path.is_dir())
    sys.exit(0 if laws and all([compare(here, there, law) for law in laws]) else 1)


main()
