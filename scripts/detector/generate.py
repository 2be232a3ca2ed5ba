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
# First shard whose rooms have surfaces of the ball's own colour.
FIRST_CAMOUFLAGED = 53
# First shard with two-coloured fruit, and without those surfaces.
FIRST_FRUIT = 69
# First shard of difficult pictures: some have the surfaces, some have fruit (see the shares below).
FIRST_DIFFICULT = 76
# First shard with brown figures as well.
FIRST_FIGURES = 110
# First shard with something in front of most of the balls as well.
FIRST_COVERED = 501
# First shard of balls of any material and size.
FIRST_MATERIALS = 601
# Share of them that may also have what difficult pictures have, and that have brown figures.
DIFFICULT = 0.3
# Share of the difficult pictures with surfaces of the ball's own colour.
OWN_COLOUR = 0.35
# Share of the difficult pictures with fruit.
WITH_FRUIT = 0.3
# Depth units of a metre in a shard.
DEPTH_UNITS = 10000.0


def scene(shard, rng, frames):
    """Returns a scene of a shard."""
    if shard >= FIRST_MATERIALS:
        draws = rng.random(3)
        kind = scenes.Kind(
            camouflaged=draws[0] < DIFFICULT * OWN_COLOUR,
            fruit=draws[1] < DIFFICULT * WITH_FRUIT,
            figures=draws[2] < DIFFICULT,
            materials=True,
        )
    elif shard >= FIRST_DIFFICULT:
        camouflaged, fruit = rng.random() < OWN_COLOUR, rng.random() < WITH_FRUIT
        further = {"figures": shard >= FIRST_FIGURES, "covered": shard >= FIRST_COVERED}
        kind = scenes.Kind(camouflaged, fruit, difficult=True, **further)
    else:
        camouflaged = FIRST_CAMOUFLAGED <= shard < FIRST_FRUIT
        kind = scenes.Kind(camouflaged, fruit=shard >= FIRST_FRUIT)
    return scenes.Scene(rng, frames, kind)


def generate(shard, frames):
    """Returns the arrays of a shard."""
    rng = np.random.default_rng(shard)
    made = [scene(shard, rng, frames) for _ in range(SHARD)]
    depths = [np.clip(each.depth * DEPTH_UNITS, 0, 65535).astype(np.uint16) for each in made]
    return {
        "colour": np.stack([each.colour for each in made]),
        "depth": np.stack(depths),
        "lens": np.array([(each.focal, each.radius, each.hue) for each in made], np.float32),
        "ball": np.array([each.ball or (0, 0, 0, 0) for each in made], np.float32),
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
