"""Generates training pictures: generate.py OUT FIRST COUNT FOLDER...

The pictures of the shard N come from the seed N and the recorded pictures in the TUM RGB-D folders.
A shard is written under another name first, so that a file is complete if it exists.
"""

import os
import sys

import numpy as np

import light
import scenes

# Pictures in a shard.
SHARD = 500
# First shard whose rooms have surfaces of the ball's own colour, and first one after them, from
# which on there is two-coloured fruit instead.
CAMOUFLAGED, FRUIT = 53, 69
# Depth units of a metre in a shard.
DEPTH_UNITS = 10000.0


def generate(shard, frames):
    """Returns the arrays of a shard."""
    rng = np.random.default_rng(shard)
    kind = CAMOUFLAGED <= shard < FRUIT, shard >= FRUIT
    made = [scenes.Scene(rng, frames, *kind) for _ in range(SHARD)]
    depths = [np.clip(scene.depth * DEPTH_UNITS, 0, 65535).astype(np.uint16) for scene in made]
    return {
        "colour": np.stack([scene.colour for scene in made]),
        "depth": np.stack(depths),
        "lens": np.array([(scene.focal, scene.radius, scene.hue) for scene in made], np.float32),
        "ball": np.array([scene.ball or (0, 0, 0, 0) for scene in made], np.float32),
    }


def main():
    out, first, count = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    frames = light.read_frames(sys.argv[4:])
    for shard in range(first, first + count):
        path = f"{out}/shard{shard:04}"
        np.savez(f"{path}.part.npz", **generate(shard, frames))
        os.rename(f"{path}.part.npz", f"{path}.npz")


if __name__ == "__main__":
    main()
