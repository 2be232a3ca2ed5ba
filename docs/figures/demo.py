#!/usr/bin/env python3
"""Draws the pictures of the README and the book from runs of the demo in virtual time:

    docs/figures/demo.py [FOLDER]     docs/figures/ by default

camera-view.png shows the camera's view at the end of a run, the detected circle and the ball's
path; run.svg is that run's figure. run-over-time.svg and run-in-space.svg are of a run with the
paper's law, eight.svg and deviation.svg of one along a figure of eight. Needs target/release/plumb;
uses only Python's own library."""
import csv
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import zlib

FIGURES = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.normpath(os.path.join(FIGURES, "..", ".."))
TARGET = os.environ.get("CARGO_TARGET_DIR", os.path.join(ROOT, "target"))
PLUMB = os.path.join(TARGET, "release", "plumb")

CROP = (70, 0, 590, 400)  # left, top, right, bottom, pixels
AVERAGED = 8  # last pictures whose mean is shown, so that their noise does not fill the file
GHOSTS = 4  # earlier balls along the path
GREEN, WHITE = (60, 230, 90), (255, 255, 255)


def paeth(left, above, corner):
    """Returns PNG's predictor of a byte."""
    guess = left + above - corner
    return min((left, above, corner), key=lambda value: abs(guess - value))


def read_png(path):
    """Returns width, height and the rows of RGB bytes of an 8-bit RGB picture."""
    data = open(path, "rb").read()
    at, packed, size = 8, b"", None
    while at < len(data):
        (length,), kind = struct.unpack(">I", data[at : at + 4]), data[at + 4 : at + 8]
        if kind == b"IHDR":
            size = struct.unpack(">II", data[at + 8 : at + 16])
        elif kind == b"IDAT":
            packed += data[at + 8 : at + 8 + length]
        at += 12 + length
    (width, height), raw = size, zlib.decompress(packed)
    stride, rows, above = 3 * width, [], bytearray(3 * width)
    for y in range(height):
        start = y * (stride + 1)
        method, row = raw[start], bytearray(raw[start + 1 : start + 1 + stride])
        for i in range(stride) if method else ():
            left = row[i - 3] if i > 2 else 0
            corner = above[i - 3] if i > 2 else 0
            guess = (left, above[i], (left + above[i]) // 2, paeth(left, above[i], corner))
            row[i] = (row[i] + guess[method - 1]) & 255
        rows.append(row)
        above = row
    return width, height, rows


def write_png(path, width, rows):
    """Writes rows of RGB bytes, each with the filter that leaves the smallest differences."""
    stride, raw, above = 3 * width, bytearray(), bytearray(3 * width)
    for row in rows:
        left = bytes(3) + row[:-3]
        corner = bytes(3) + above[:-3]
        tries = (
            bytes((v - a) & 255 for v, a in zip(row, left)),
            bytes((v - a) & 255 for v, a in zip(row, above)),
            bytes((v - paeth(a, b, c)) & 255 for v, a, b, c in zip(row, left, above, corner)),
        )
        cost = [sum(min(v, 256 - v) for v in line) for line in tries]
        best = cost.index(min(cost))
        raw += bytes([(1, 2, 4)[best]]) + tries[best]
        above = row

    def chunk(kind, data):
        check = zlib.crc32(kind + data)
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", check)

    header = struct.pack(">IIBBBBB", width, len(rows), 8, 2, 0, 0, 0)
    chunks = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(bytes(raw), 9))
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunks + chunk(b"IEND", b""))
    assert stride == len(rows[0])


class Canvas:
    """A picture that is drawn on, with coordinates in pixels."""

    def __init__(self, rows):
        self.rows = rows

    def blend(self, x, y, colour, share):
        """Mixes a share of a colour into a pixel."""
        if 0 <= y < len(self.rows) and 0 <= 3 * x < len(self.rows[0]) and share > 0:
            row = self.rows[y]
            for i in range(3):
                row[3 * x + i] = round(row[3 * x + i] + share * (colour[i] - row[3 * x + i]))

    def each(self, u, v, reach):
        """Yields the pixels around a point with their distance from it."""
        for y in range(int(v - reach), int(v + reach) + 2):
            for x in range(int(u - reach), int(u + reach) + 2):
                yield x, y, ((x - u) ** 2 + (y - v) ** 2) ** 0.5

    def circle(self, u, v, radius, colour, line=1.0):
        """Draws a circle."""
        for x, y, distance in self.each(u, v, radius + line + 1):
            self.blend(x, y, colour, min(1.0, max(0.0, line + 0.5 - abs(distance - radius))))

    def segment(self, start, end, colour, line=0.6):
        """Draws a straight line."""
        steps = max(1, int(2 * max(abs(end[0] - start[0]), abs(end[1] - start[1]))))
        for k in range(steps + 1):
            u, v = (a + (b - a) * k / steps for a, b in zip(start[:2], end[:2]))
            for x, y, distance in self.each(u, v, line + 1):
                self.blend(x, y, colour, 0.5 * min(1.0, max(0.0, line + 0.5 - distance)))

    def paste(self, rows, u, v, radius):
        """Copies a disc of another picture."""
        for x, y, distance in self.each(u, v, radius + 1):
            share = min(1.0, max(0.0, radius + 0.5 - distance))
            self.blend(x, y, rows[y][3 * x : 3 * x + 3], share)


def mean(pictures):
    """Returns the mean of pictures, with the last two bits rounded away."""
    count = len(pictures)
    return [
        bytearray(min(255, (sum(values) + count * 2) // count & ~3) for values in zip(*rows))
        for rows in zip(*pictures)
    ]


def ghosts(points):
    """Returns the numbers of pictures whose balls are about evenly spaced along the path."""
    length, sums = 0.0, []
    for before, after in zip([points[0]] + points, points):
        length += ((after[0] - before[0]) ** 2 + (after[1] - before[1]) ** 2) ** 0.5
        sums.append(length)
    marks = [length * k / GHOSTS for k in range(GHOSTS)]
    return [next(i for i, s in enumerate(sums) if s >= mark) for mark in marks]


def draw(run, pictures, path):
    """Draws the camera's view at the end of a run."""
    with open(os.path.join(run, "run.csv"), encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["u_px"]]
    seen = [tuple(float(row[key]) for key in ("u_px", "v_px", "radius_px")) for row in rows]
    names = sorted(os.listdir(pictures))

    def picture(number):
        return read_png(os.path.join(pictures, names[number]))[2]

    last = int(rows[-1]["frame"])
    canvas = Canvas(mean([picture(last - k) for k in range(AVERAGED)]))
    for k in ghosts(seen):
        u, v, radius = seen[k]
        canvas.paste(picture(int(rows[k]["frame"])), u, v, radius)
        canvas.circle(u, v, radius + 1, WHITE, 0.4)
    for start, end in zip(seen, seen[1:]):
        canvas.segment(start, end, WHITE)
    u, v, radius = seen[-1]
    canvas.circle(u, v, radius, GREEN, 1.2)
    for du, dv in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        inner, outer = radius + 5, radius + 14
        canvas.segment((u + inner * du, v + inner * dv), (u + outer * du, v + outer * dv), GREEN, 1)
    left, top, right, bottom = CROP
    write_png(path, right - left, [row[3 * left : 3 * right] for row in canvas.rows[top:bottom]])


def demo(run, *options):
    """Runs the demo in virtual time and leaves its folder in `run`."""
    command = [PLUMB, "demo", "--virtual-time", "--out", run, *options]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def main():
    folder = sys.argv[1] if len(sys.argv) > 1 else FIGURES
    with tempfile.TemporaryDirectory() as work:
        run, record = os.path.join(work, "run"), os.path.join(work, "record")
        demo(run, "--record", record)
        draw(run, os.path.join(record, "rgb"), os.path.join(folder, "camera-view.png"))
        shutil.copy(os.path.join(run, "figure4.svg"), os.path.join(folder, "run.svg"))
        paper = os.path.join(work, "paper")
        demo(paper, "--law", "interval")
        for name, copy in (("figure4", "run-over-time"), ("figure5", "run-in-space")):
            shutil.copy(f"{paper}/{name}.svg", os.path.join(folder, copy + ".svg"))
        eight = os.path.join(work, "eight")
        demo(eight, "--follow", "eight", "--upright")
        for name, copy in (("figure5", "eight"), ("deviation", "deviation")):
            shutil.copy(f"{eight}/{name}.svg", os.path.join(folder, copy + ".svg"))


if __name__ == "__main__":
    main()
