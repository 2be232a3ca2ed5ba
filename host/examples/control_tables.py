#!/usr/bin/env python3
"""Prints the tables of docs/understand/results.md, "Measured", anew.

    python3 host/examples/control_tables.py [SEED]

Takes minutes; build plumb first.
Runs plumb from CARGO_TARGET_DIR, target/ by default. Columns are the JSON fields of `plumb bench control --json`."""
import json
import os
import subprocess
import sys

SEED = sys.argv[1] if len(sys.argv) > 1 else "1"
ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
PLUMB = os.path.join(os.environ.get("CARGO_TARGET_DIR", os.path.join(ROOT, "target")), "release", "plumb")
PEERS = "broyden,model-5,model-10,model-20"
STRESS = "yaw,tilt,radii,heights,noise,outliers,ages,latency,drift,unilateral,bounce4,bounce3,bounce2,edge,high,fine"


def bench(rigs, laws, suites="quasi-static", *more):
    """The command's rows; what it says to people goes on to the terminal."""
    arguments = ["--rigs", str(rigs), "--law", laws, "--suite", suites, *more]
    print("\n`plumb bench control " + " ".join(arguments) + "`\n", flush=True)
    command = [PLUMB, "bench", "control", *arguments, "--seed", SEED, "--json"]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    return [json.loads(line) for line in done.stdout.splitlines()]


def number(value, digits):
    """`null` is what no number says: endless, or nothing measured."""
    return "-" if value is None else f"{value:.{digits}f}"


def percent(share):
    return f"{100 * share:.1f} %"


def cells(row):
    times = [number(row["median"], 3)] + [number(row[key], 2) for key in ("p90", "p99", "max")]
    hold = f'{number(row["hold_mean_mm"], 2)}, {number(row["hold_p99_mm"], 1)}'
    return [f'{row["converged"]:.4f}', *times, percent(row["slack"]), hold, percent(row["false_reached"])]


def table(heads, rows):
    print("| " + " | ".join(heads) + " |\n|" + "---|" * len(heads))
    for row in rows:
        print("| " + " | ".join(row) + " |")


HEADS = ["converged", "median", "p90", "p99", "max", "slack", "hold mean, p99 mm", "false reached"]


def by_law(*request):
    table(["law", *HEADS], ([row["law"], *cells(row)] for row in bench(*request)))


def by_suite(*request):
    table(["suite", "law", *HEADS], ([row["suite"], row["law"], *cells(row)] for row in bench(*request)))


def stress(rigs, laws, suites):
    """Converged, median and 90 % of each law."""
    found = {(row["suite"], row["law"]): row for row in bench(rigs, ",".join(laws), ",".join(suites))}
    short = lambda row: f'{row["converged"]:.3g}, {number(row["median"], 2)}, {number(row["p90"], 2)}'
    table(["suite", *laws], ([suite, *(short(found[suite, law]) for law in laws)] for suite in suites))


by_law(3000, f"interval,sign,adaptive,taut,{PEERS},oracle,reference")
by_law(1000, f"interval,sign,adaptive,taut,{PEERS}", "quasi-static", "--clock", "target")
by_suite(1000, "interval,sign,adaptive,taut,broyden,model-10,oracle,reference", "elastic800,elastic150")
by_law(300, "interval,interval-f64,sign,sign-f64,adaptive,adaptive-f64")
by_law(100, "interval,sign,adaptive,taut,oracle", "paper-task")
stress(400, ["adaptive", "taut"], STRESS.split(","))
