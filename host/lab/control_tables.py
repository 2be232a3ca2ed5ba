#!/usr/bin/env python3
"""Writes docs/understand/results.md: every table of `plumb-lab control` and `paths`.

    python3 host/lab/control_tables.py [--seed N] [--out FILE | --only HEADING]

Takes about a quarter of an hour; build the program first (cargo build --release -p plumb-lab).
Runs it from CARGO_TARGET_DIR, target/ by default."""
import argparse
import json
import os
import subprocess
import sys

ROOT = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))
TARGET = os.environ.get("CARGO_TARGET_DIR", os.path.join(ROOT, "target"))
LAB = os.path.join(TARGET, "release", "plumb-lab")
PAGE = os.path.join(ROOT, "docs", "understand", "results.md")

LAWS = "interval,sign,adaptive,taut"
BASELINES = "broyden,model-5,model-10,model-20"
LIMITS = "oracle,reference"
STRESS = (
    "yaw,tilt,radii,heights,noise,outliers,ages,latency,drift,unilateral,"
    "bounce4,bounce3,bounce2,edge,high,fine"
)

INTRODUCTION = """\
# Results

`host/lab/control_tables.py` writes this page; do not edit it by hand. [How the laws are
measured](method.md) explains rigs, measures and baselines. Times are multiples of an oracle's time;
a dash means that not enough runs converged for the number to exist. Every table is at seed {seed}.
"""


def by_law(row):
    """The first cells of a row in a table of one suite."""
    return [row["law"]]


def by_suite(row):
    """The first cells of a row in a table of several suites."""
    return [row["suite"], row["law"]]


class Table:
    """A section of the page: a heading, what the table shows, and the command behind it."""

    def __init__(self, heading, about, rigs, laws, suites="quasi-static", *more, render=None):
        self.heading, self.about = heading, about
        arguments = ["--rigs", str(rigs), "--law", laws, "--suite", suites, *more]
        self.command = ["paths" if render is along_paths else "control", *arguments]
        self.render = render or full(by_law)

    def measure(self, seed):
        """Returns the rows of the command's JSON; its progress goes to the terminal."""
        command = [LAB, *self.command, "--seed", seed, "--json"]
        done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
        return [json.loads(line) for line in done.stdout.splitlines()]

    def section(self, seed):
        """Returns the section as Markdown."""
        lines = [f"\n## {self.heading}\n", self.about + "\n"]
        lines.append("```sh\nplumb-lab " + " ".join(self.command) + "\n```\n")
        heads, rows = self.render(self.measure(seed))
        lines.append("| " + " | ".join(heads) + " |\n|" + "---|" * len(heads))
        lines += ["| " + " | ".join(row) + " |" for row in rows]
        return "\n".join(lines) + "\n"


def number(value, digits):
    """Returns a number with so many digits, or a dash where the JSON has null."""
    return "-" if value is None else f"{value:.{digits}f}"


def percent(share):
    """Returns a share in percent."""
    return f"{100 * share:.1f} %"


def full(first):
    """Returns what renders every measure of each row, after the cells that `first` returns."""

    def cells(row):
        times = [number(row["median"], 3)]
        times += [number(row[key], 2) for key in ("p90", "p99", "max")]
        hold = f'{number(row["hold_mean_mm"], 2)}, {number(row["hold_p99_mm"], 1)}'
        shares = [percent(row["slack"]), hold, percent(row["false_reached"])]
        return first(row) + [f'{row["converged"]:.4f}', *times, *shares]

    def render(rows):
        names = ["law"] if first is by_law else ["suite", "law"]
        measures = ["converged", "median", "90 %", "99 %", "largest", "slack"]
        return [*names, *measures, "hold mean, 99 % (mm)", "false reached"], map(cells, rows)

    return render


def short(rows):
    """Renders converged, median and 90 % of each law, a suite a row."""
    laws = list(dict.fromkeys(row["law"] for row in rows))
    suites = list(dict.fromkeys(row["suite"] for row in rows))
    found = {(row["suite"], row["law"]): row for row in rows}

    def cell(row):
        return f'{row["converged"]:.3g}, {number(row["median"], 2)}, {number(row["p90"], 2)}'

    heads = ["suite", *(f"{law}: converged, median, 90 %" for law in laws)]
    return heads, ([suite, *(cell(found[suite, law]) for law in laws)] for suite in suites)


def by_target(rows):
    """Renders the times, a target of a suite a row."""

    def cells(row):
        times = [number(row["median"], 3)]
        times += [number(row[key], 2) for key in ("p90", "p99", "lost_s", "told_s", "told_p99_s")]
        shares = [percent(row["slack"]), percent(row["false_reached"])]
        return [row["suite"], str(row["target"]), f'{row["converged"]:.4f}', *times, *shares]

    heads = ["suite", "target", "converged", "median", "90 %", "99 %", "lost (s)"]
    return [*heads, "told (s)", "99 % (s)", "slack", "false reached"], map(cells, rows)


def along_paths(rows):
    """Renders the deviations from paths, a controller and a speed a row."""

    def cells(row):
        keys = ("rms_mm", "p99_mm", "cross_mm")
        pairs = [[number(row[key][q], 2) for q in ("median", "p90")] for key in keys]
        name = [row["suite"], row["law"], f'{100 * row["speed_m_s"]:.0f}']
        shares = [percent(row["slack"]), number(row["kept"], 3)]
        return [*name, *map(", ".join, pairs), *shares, f'{row["lost"]} of {row["runs"]}']

    measures = ("rms", "99 %", "cross-track rms")
    heads = [f"{measure} (mm): median, 90 %" for measure in measures]
    return ["suite", "law", "cm/s", *heads, "slack", "speed kept", "lost"], map(cells, rows)


TABLES = [
    Table(
        "Rigid cables",
        "Cables are always taut, as in the paper; `interval` has γ = 450 /s.",
        3000,
        f"{LAWS},{BASELINES},{LIMITS}",
    ),
    Table(
        "Rigid cables, clock from the target",
        "The clock starts when the target is set, 1 to 2 frames before the first picture arrives.",
        1000,
        f"{LAWS},{BASELINES}",
        "quasi-static",
        "--clock",
        "target",
    ),
    Table(
        "Elastic cables",
        "A ball of 0.1 to 0.3 kg on cables of 800 and of 150 N/m. The oracle ignores stretch, the\n"
        "reference does not. Hold includes runs that did not stay.",
        1000,
        f"{LAWS},broyden,model-10,{LIMITS}",
        "elastic800,elastic150",
        render=full(by_suite),
    ),
    Table(
        "Further targets",
        "Each rig goes to three targets. The law knows the rig from the second one on. In the\n"
        "suite `stiff` the rig file says that the cables are stiff. Lost is the median of the\n"
        "time above the oracle's; told is the time from the arrival to `reached`.",
        2000,
        "taut",
        "elastic800,stiff,elastic150",
        "--targets",
        "3",
        render=by_target,
    ),
    Table(
        "The paper's task",
        "P0 to PT on the paper's rig with the camera's noise; the oracle takes 1.97 s.",
        100,
        f"{LAWS},oracle",
        "paper-task",
    ),
    Table(
        "Stress",
        "One disturbance at a time; `plumb-lab control --help` lists them.",
        400,
        "adaptive,taut",
        STRESS,
        render=short,
    ),
    Table(
        "A turned frame",
        "The camera's pose is turned by 5, 10 and 20 degrees about a random axis. The target's\n"
        "own position is right.",
        200,
        LAWS,
        "quasi-static,frame5,frame10,frame20",
        render=short,
    ),
    Table(
        "Along paths",
        "Circle, square, figure of eight and spline at four speeds;\n"
        "[the measures](method.md#paths).",
        50,
        "taut,adaptive,sign,broyden,model-5,model-10",
        "path,path-elastic",
        render=along_paths,
    ),
]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", default="1", help="seed of rigs and noise")
    parser.add_argument("--out", default=PAGE, help="the file to write")
    parser.add_argument("--only", metavar="HEADING", help="print this section and write no file")
    args = parser.parse_args()
    if args.only:
        for table in (table for table in TABLES if table.heading == args.only):
            print(table.section(args.seed), end="")
        return
    page = [INTRODUCTION.format(seed=args.seed)]
    for table in TABLES:
        print(f"{table.heading} ...", file=sys.stderr)
        page.append(table.section(args.seed))
    with open(args.out, "w", encoding="utf-8") as file:
        file.write("".join(page))


if __name__ == "__main__":
    main()
