"""Trains the proposal network: train_proposer.py SHARDS OUT STEPS START NUMBER...

It is trained with the pictures of generate.py in SHARDS with these numbers. A number that is given
twice counts twice. START is a weights file whose network is trained further, or - for a new one. In
a further training, the depth of half of the pictures is left out.
"""

import sys
import time

import numpy as np
import torch

import inputs
from generate import DEPTH_UNITS
from inputs import MIN_VISIBLE
from networks import CELL, RADIUS_UNIT, Proposer
from weights_file import give_statistics, read_networks

BATCH = 32
SEED = 1
# Highest rate of the training of a new network.
NEW_RATE = 4e-3
# Highest rate of a further training.
FURTHER_RATE = 2e-3
# Part of the pictures whose depth is left out in a further training.
WITHOUT_DEPTH = 0.5
# Number of batches whose statistics the normalisations of a weights file are given.
MEASURED = 12


def targets(balls, rows, columns):
    """Returns (heat, peak, offsets and radius, near, weight) for `balls` in picture pixels."""
    step = inputs.STEP
    x, y = ((balls[:, i] - (step - 1) / 2) / step for i in (0, 1))
    radius = balls[:, 2] / step
    x, y = ((k - (CELL - 1) / 2) / CELL for k in (x, y))
    grid_y = torch.arange(rows).view(1, rows, 1).float()
    grid_x = torch.arange(columns).view(1, 1, columns).float()
    dx, dy = torch.broadcast_tensors(x.view(-1, 1, 1) - grid_x, y.view(-1, 1, 1) - grid_y)
    spread = torch.clamp(0.35 * radius / CELL, min=0.6).view(-1, 1, 1)
    exists = (balls[:, 2] > 0).view(-1, 1, 1)
    seen = (balls[:, 3] >= MIN_VISIBLE).view(-1, 1, 1)
    heat = torch.exp(-(dx**2 + dy**2) / (2 * spread**2)) * exists
    peak = (dx.abs() <= 0.5) & (dy.abs() <= 0.5) & exists
    near = ((dx.abs() <= 1.5) & (dy.abs() <= 1.5) & exists & seen).float()
    reach = (radius / CELL + 2).view(-1, 1, 1)
    unsure = exists & ~seen & (dx**2 + dy**2 < reach**2)
    log_radius = torch.log(torch.clamp(radius, min=0.5) / RADIUS_UNIT).view(-1, 1, 1).expand_as(dx)
    return heat, peak.float(), torch.stack([dx, dy, log_radius], 1), near, (~unsure).float()


def loss(out, heat, peak, place, near, weight):
    """Returns the focal loss of the log-odds and the error of place and size."""
    p = torch.sigmoid(out[:, 0]).clamp(1e-5, 1 - 1e-5)
    right = peak * (1 - p) ** 2 * torch.log(p)
    wrong = (1 - peak) * (1 - heat) ** 4 * p**2 * torch.log(1 - p)
    count = (peak * weight).sum().clamp(min=1)
    score = -((right + wrong) * weight).sum() / count
    error = torch.nn.functional.smooth_l1_loss(out[:, 1:], place, reduction="none", beta=0.3)
    return score + 0.7 * (error * near[:, None]).sum() / near.sum().clamp(min=1)


def batches(files):
    """Yields batches of pictures and balls for ever, mirrored at random."""
    rng = np.random.default_rng(SEED)
    while True:
        for pair in np.array_split(rng.permutation(files), max(1, len(files) // 2)):
            made = [each for path in pair for each in inputs.pictures(path, DEPTH_UNITS)]
            order = rng.permutation(len(made))
            for start in range(0, len(order) - BATCH + 1, BATCH):
                chosen = [made[k] for k in order[start : start + BATCH]]
                x = torch.from_numpy(np.stack([picture.proposal_input() for picture, _ in chosen]))
                b = torch.from_numpy(np.stack([ball for _, ball in chosen]))
                if rng.random() < 0.5:
                    x = x.flip(3)
                    last = inputs.STEP * x.shape[3] - 1
                    b = torch.stack([last - b[:, 0], b[:, 1], b[:, 2], b[:, 3]], 1)
                    b[:, 0] *= b[:, 2] > 0
                yield x.contiguous(memory_format=torch.channels_last), b


def without_depth(batches):
    """Yields `batches` in which a part of the pictures has no depth."""
    rng = np.random.default_rng(SEED + 100)
    for x, balls in batches:
        x[torch.from_numpy(rng.random(len(x)) < WITHOUT_DEPTH), 3:] = 0
        yield x, balls


def main():
    folder, out, steps, start, *numbers = sys.argv[1:]
    steps, files = int(steps), [f"{folder}/shard{int(number):04}.npz" for number in numbers]
    torch.set_num_threads(1)
    torch.manual_seed(SEED)
    network, made, rate = Proposer(), batches(files), NEW_RATE
    if start != "-":
        made, rate = without_depth(made), FURTHER_RATE
        read_networks(start, [network])
        give_statistics(network, [next(made)[0] for _ in range(MEASURED)])
        network.train()
    network = network.to(memory_format=torch.channels_last)
    optimiser = torch.optim.AdamW(network.parameters(), rate, weight_decay=1e-4)
    plan = torch.optim.lr_scheduler.OneCycleLR(optimiser, rate, steps, pct_start=0.1)
    began, total = time.time(), 0.0
    for step, (x, balls) in zip(range(1, steps + 1), made):
        result = network(x)
        value = loss(result, *targets(balls, *result.shape[2:]))
        optimiser.zero_grad()
        value.backward()
        optimiser.step()
        plan.step()
        total += value.item()
        if step % 100 == 0:
            print(step, round(total / 100, 3), round(time.time() - began), flush=True)
            total = 0.0
            torch.save(network.state_dict(), out)


if __name__ == "__main__":
    main()
