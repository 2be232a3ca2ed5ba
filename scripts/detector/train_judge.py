"""Trains the judging network: train_judge.py SHARDS PROPOSER OUT STEPS.

SHARDS holds pictures of generate.py.

Its patches are about the proposals of the proposal network PROPOSER, about the ball, and about
wrong places and sizes near the ball.
"""

import glob
import sys

import numpy as np
import torch

import inputs
from generate import DEPTH_UNITS
from networks import Judge, Proposer

BATCH, RATE, SEED = 128, 3e-3, 2
# Proposals in a picture that are judged, and the least log-odds of one.
PROPOSALS, MIN_LOG_ODDS = 4, -6.0
# A disc is the ball if centre and radius are off by less than the first part of the radius, and is
# not the ball if one of them is off by more than the second. Within the last, the network tells
# where the ball is.
RIGHT, WRONG, NEAR = 0.3, 0.5, 0.6
# Balls of which less is visible are neither right nor wrong.
MIN_VISIBLE = 0.35
# Weight of the error of place and size.
PLACE_WEIGHT = 4.0


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
        scale = 2 * inputs.STEP
        disc = [(column + dx + 0.5) * scale - 0.5, (row + dy + 0.5) * scale - 0.5]
        discs.append(disc + [np.exp(log_radius) * 5 * inputs.STEP])
    return discs


def with_depth(picture, disc):
    """Returns a disc with the radius that a ball has at the depth there."""
    x, y, size = disc
    reach = max(1, int(0.4 * size))
    rows = slice(max(0, int(y) - reach), max(0, int(y) + reach + 1))
    columns = slice(max(0, int(x) - reach), max(0, int(x) + reach + 1))
    part = picture.depth[rows, columns]
    known = part[part > 0.1]
    if len(known) > 3:
        size = picture.focal * picture.radius / (np.median(known) + 0.85 * picture.radius)
    return x, y, size


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


def patches(rng, network, picture, ball):
    """Yields (patch, label, place) of a picture. The label is 1 for the ball, 0 for others, and -1
    if it is unsure; the place is the ball's against the disc's, NaN if the ball is far."""
    exists = ball[2] > 0
    discs = list(near_ball(rng, ball)) if exists else []
    for disc in proposals(network, picture):
        discs += [disc, with_depth(picture, disc)]
    for disc in discs:
        if not 2 < disc[2] < 45:
            continue
        label, place = 0, np.full(3, np.nan)
        if exists:
            x, y, size = disc
            error = np.array([(ball[0] - x) / size, (ball[1] - y) / size, np.log(ball[2] / size)])
            off = max(np.hypot(error[0], error[1]), abs(error[2]))
            sure = ball[3] > MIN_VISIBLE or off > 1.5
            label = 1 if off < RIGHT else 0 if off > WRONG else -1
            label, place = (label if sure else -1), (error if off < NEAR and sure else place)
        if label >= 0 or not np.isnan(place[0]):
            yield picture.patch_input(disc).astype(np.float16), label, place


def collect(network, files):
    """Returns patches, labels and places of the shards."""
    rng, kept = np.random.default_rng(SEED), ([], [], [])
    for path in files:
        for picture, ball in inputs.pictures(path, DEPTH_UNITS):
            for found in patches(rng, network, picture, ball):
                for values, value in zip(kept, found):
                    values.append(value)
    labels = np.array(kept[1])
    print("patches", len(labels), "balls", (labels == 1).sum(), "others", (labels == 0).sum())
    return np.stack(kept[0]), labels.astype(np.float32), np.array(kept[2], np.float32)


def loss(result, labels, places):
    """Returns the loss of the log-odds and the error of place and size."""
    sure, near = labels >= 0, ~torch.isnan(places[:, 0])
    score = torch.nn.functional.binary_cross_entropy_with_logits(result[sure, 0], labels[sure])
    error = torch.nn.functional.smooth_l1_loss(result[near, 1:], places[near], beta=0.05)
    return score + PLACE_WEIGHT * error


def report(network, patches, labels, places):
    """Prints how many balls have higher odds than most others, and the errors of place."""
    with torch.no_grad():
        parts = torch.from_numpy(patches).split(1000)
        out = torch.cat([network(part.float()) for part in parts]).numpy()
    right, wrong = out[labels == 1, 0], out[labels == 0, 0]
    for part in (0.9, 0.99, 0.995, 0.999):
        limit = np.quantile(wrong, part)
        print(f"{part} of {len(wrong)} others below {limit:.2f}: {(right > limit).mean():.4f}")
    near = ~np.isnan(places[:, 0])
    error = np.abs(out[near, 1:] - places[near])
    quantiles = np.quantile(error, [0.5, 0.9], axis=0).round(3).tolist()
    print("errors of place (median, 90 %)", quantiles)


def main():
    folder, proposer, out, steps = *sys.argv[1:4], int(sys.argv[4])
    torch.set_num_threads(1)
    torch.manual_seed(SEED)
    rng = np.random.default_rng(SEED)
    finder = Proposer()
    finder.load_state_dict(torch.load(proposer))
    finder.eval()
    kept, labels, places = collect(finder, sorted(glob.glob(f"{folder}/shard*.npz")))
    test = len(labels) // 20
    network = Judge().to(memory_format=torch.channels_last)
    optimiser = torch.optim.AdamW(network.parameters(), RATE, weight_decay=1e-3)
    plan = torch.optim.lr_scheduler.OneCycleLR(optimiser, RATE, steps, pct_start=0.1)
    total = 0.0
    for step in range(1, steps + 1):
        chosen = rng.integers(test, len(labels), BATCH)
        x = torch.from_numpy(kept[chosen].astype(np.float32))
        place = torch.from_numpy(places[chosen])
        if rng.random() < 0.5:
            x, place = x.flip(3), place * torch.tensor([-1.0, 1.0, 1.0])
        result = network(x.contiguous(memory_format=torch.channels_last))
        value = loss(result, torch.from_numpy(labels[chosen]), place)
        optimiser.zero_grad()
        value.backward()
        optimiser.step()
        plan.step()
        total += value.item()
        if step % 250 == 0:
            print(step, round(total / 250, 4), flush=True)
            total = 0.0
    network.eval()
    torch.save(network.state_dict(), out)
    report(network, kept[:test], labels[:test], places[:test])


if __name__ == "__main__":
    main()
