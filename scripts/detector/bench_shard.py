"""Writes pictures of the bench as those of generate.py: pictures SUITE ... | bench_shard.py OUT

The pictures are what the example `pictures` of plumb-bench writes. OUT is a shard, in which they
have half their size.
"""

import sys

import numpy as np

from bench import pictures, true_ball
from generate import DEPTH_UNITS


def main():
    rows = {"colour": [], "depth": [], "lens": [], "ball": []}
    for header, picture in pictures(sys.stdin.buffer):
        rows["colour"].append(picture.levels[1])
        depth = np.clip(picture.depth[1::2, 1::2] * DEPTH_UNITS, 0, 65535)
        rows["depth"].append(depth.astype(np.uint16))
        rows["lens"].append((picture.focal / 2, picture.radius, picture.hue))
        x, y, size, visible = true_ball(header)
        rows["ball"].append(((x - 0.5) / 2, (y - 0.5) / 2, size / 2, visible))
    lens, ball = (np.array(rows.pop(name), np.float32) for name in ("lens", "ball"))
    arrays = {name: np.stack(values) for name, values in rows.items()}
    np.savez(sys.argv[1], lens=lens, ball=ball, **arrays)


if __name__ == "__main__":
    main()
