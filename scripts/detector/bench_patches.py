"""Writes patches of pictures of the bench: pictures SUITE ... | bench_patches.py OUT SEED

The pictures are what the example `pictures` of plumb-bench writes. The patches are about the discs
that the detector judges there, and about right and wrong places near the ball.
"""

import sys

import numpy as np

from bench import pictures, true_ball
from patches import near_ball, patches, with_depth, write

# Proposals of a picture that patches are made of: the most promising ones.
PROPOSALS = 8
# Radii of discs that are judged, pixels: least and largest.
RADII = 4, 90


def discs(rng, header, picture, ball):
    """Yields the discs of a picture whose patches the judging networks are trained with."""
    if ball[2] > 0:
        yield from near_ball(rng, ball)
    yield from (with_depth(picture, disc) for disc in header["proposals"][:PROPOSALS])
    yield from header["circles"]


def main():
    out, seed = sys.argv[1:]
    rng, kept = np.random.default_rng(int(seed)), []
    for header, picture in pictures(sys.stdin.buffer):
        ball = true_ball(header)
        chosen = discs(rng, header, picture, ball)
        kept.extend(patches(picture, chosen, ball, RADII))
    write(out, kept)


if __name__ == "__main__":
    main()
