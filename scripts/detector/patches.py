"""Writes patches for training the judging networks: patches.py SHARDS WEIGHTS OUT SEED NUMBER...

They are of the pictures of generate.py in SHARDS with these numbers. WEIGHTS is a weights file: the
patches are about the proposals of its proposal network, about where its first judging network moves
them, about the ball, and about wrong places and sizes near the ball.
"""

import sys

import numpy as np
import torch

import inputs
from drawing import depth_at
from generate import DEPTH_UNITS, FIRST_MATERIALS
from inputs import MIN_VISIBLE
from networks import CELL, RADIUS_UNIT, SCREEN, Judge, Proposer
from weights_file import read_networks

# Largest number of proposals in a picture that are judged.
PROPOSALS = 6
# Least log-odds of a proposal.
MIN_LOG_ODDS = -6.0
# A disc is the ball if its error is below this. The error is the larger one of the distance of the
# centres, in the disc's radius, and of the logarithm of the ratio of the radii.
MAX_BALL_ERROR = 0.3
# A disc is not the ball if its error is above this.
MIN_OTHER_ERROR = 0.5
# A disc has a place (the ball's against the disc's) if its error is below this.
MAX_PLACE_ERROR = 0.6
# A disc with a larger error than this is not the ball, however little of the ball is visible.
MIN_FAR_ERROR = 1.5
# Half the side of the square whose depths give the radius of a disc, in the disc's radius.
DEPTH_REACH = 0.4
# Radii of discs that are judged, pixels: least and largest; in shards with large balls.
RADII, LARGE_RADII = (2, 45), (2, 130)


def proposals(network, picture):
    """Returns the discs (column, row, radius; pixels) that the network proposes."""
    with torch.no_grad():
        out = network(torch.from_numpy(picture.proposal_input()[None]))[0]
    score = out[0]
    peak = torch.nn.functional.max_pool2d(score[None], 3, 1, 1)[0] == score
    rows, columns = torch.nonzero(peak & (score > MIN_LOG_ODDS), as_tuple=True)
    best = torch.argsort(score[rows, columns], descending=True)[:PROPOSALS]
    discs = []
    for row, column in zip(rows[best].tolist(), columns[best].tolist()):
        dx, dy, log_radius = out[1:, row, column].tolist()
        scale = CELL * inputs.STEP
        disc = [(column + dx + 0.5) * scale - 0.5, (row + dy + 0.5) * scale - 0.5]
        discs.append(disc + [np.exp(log_radius) * RADIUS_UNIT * inputs.STEP])
    return discs


def with_depth(picture, disc):
    """Returns a disc with the radius that a ball has at the depth there."""
    x, y, size = disc
    known = depth_at(picture.depth, x, y, DEPTH_REACH * size)
    if len(known) > 3:
        size = picture.focal * picture.radius / (np.median(known) + 0.85 * picture.radius)
    return x, y, size


def moved(network, picture, disc):
    """Returns the disc of the ball that the network estimates from the patch about `disc`."""
    with torch.no_grad():
        estimate = network(torch.from_numpy(picture.patch_input(disc)[None]))[0]
    right, down, growth = estimate[1:].tolist()
    return *picture.disc(disc).at(right, down), disc[2] * np.exp(growth)


def near_ball(rng, ball):
    """Yields discs about the ball: nearly right ones, and wrong ones."""
    x, y, size = ball[:3]
    for error in (0.03, 0.12, 0.2):
        dx, dy, grown = rng.normal(0, error, 3)
        yield x + dx * size, y + dy * size, size * np.exp(grown)
    turn, reach = rng.uniform(0, 2 * np.pi), rng.uniform(0.5, 2.0) * size
    grown = rng.choice([rng.uniform(0.3, 0.6), rng.uniform(1.65, 3)])
    yield [
        (x + reach * np.cos(turn), y + reach * np.sin(turn), size * np.exp(rng.normal(0, 0.2))),
        (x, y, size * grown),
    ][rng.integers(2)]


def discs(rng, proposer, screen, picture, ball, radii):
    """Yields the discs of a picture whose patches the judging networks are trained with."""
    if ball[2] > 0:
        yield from near_ball(rng, ball)
    for disc in proposals(proposer, picture):
        disc = with_depth(picture, disc)
        yield disc
        if is_possible(disc, radii):
            yield moved(screen, picture, disc)


def labelled(picture, disc, ball):
    """Returns (label, place) of a disc. The label is 1 for the ball, 0 for others, and -1 if it is
    unsure; the place is the ball's against the disc's, NaN if the ball is far."""
    if ball[2] == 0:
        return 0, np.full(3, np.nan)
    error = np.array([*picture.disc(disc).on(*ball[:2]), np.log(ball[2] / disc[2])])
    off = max(np.hypot(error[0], error[1]), abs(error[2]))
    sure = ball[3] > MIN_VISIBLE or off > MIN_FAR_ERROR
    label = 1 if off < MAX_BALL_ERROR else 0 if off > MIN_OTHER_ERROR else -1
    has_place = sure and off < MAX_PLACE_ERROR
    return (label if sure else -1), (error if has_place else np.full(3, np.nan))


def is_possible(disc, radii):
    """Checks whether the radius of a disc is between the two of `radii`, pixels."""
    return radii[0] < disc[2] < radii[1]


def patches(picture, discs, ball, radii):
    """Yields (patch, label, place) of the discs in a picture that have possible `radii`."""
    for disc in discs:
        if not is_possible(disc, radii):
            continue
        label, place = labelled(picture, disc, ball)
        if label >= 0 or not np.isnan(place[0]):
            yield picture.patch_input(disc).astype(np.float16), label, place


def write(path, kept):
    """Writes patches, labels and places to a file."""
    found, labels, places = zip(*kept)
    arrays = {"patches": np.stack(found), "labels": np.array(labels, np.float32)}
    np.savez(path, places=np.array(places, np.float32), **arrays)


def main():
    shards, weights, out, seed, *numbers = sys.argv[1:]
    torch.set_num_threads(1)
    proposer, screen = Proposer(), Judge(*SCREEN)
    read_networks(weights, [proposer, screen])
    rng, kept = np.random.default_rng(int(seed)), []
    for number in map(int, numbers):
        radii = LARGE_RADII if number >= FIRST_MATERIALS else RADII
        for picture, ball in inputs.pictures(f"{shards}/shard{number:04}.npz", DEPTH_UNITS):
            chosen = discs(rng, proposer, screen, picture, ball, radii)
            kept.extend(patches(picture, chosen, ball, radii))
    write(out, kept)


if __name__ == "__main__":
    main()
