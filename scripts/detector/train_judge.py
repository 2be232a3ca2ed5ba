"""Trains a judging network: train_judge.py [--keep] screen|judge STEPS OUT START TEST PATCHES...

START is a network that is trained further, at a lower rate (`.pt`, or a weights file), or `-` for a
new one. TEST and PATCHES are files of patches.py or bench_patches.py: the network is trained with
PATCHES, and the report is of TEST. A file that is given twice counts twice. With `--keep` the loss
has a further term: it grows where a ball gets lower log-odds than START gives it, or another patch
higher ones.
"""

import sys

import numpy as np
import torch

from networks import JUDGE, SCREEN, Judge
from weights_file import give_statistics, read_network

# Networks of a weights file, in their order.
KINDS = ["proposer", "screen", "judge"]
BATCH = 128
# Batches whose statistics the normalisations of a weights file are given.
MEASURED = 50
# Highest rate of the training of a new network.
NEW_RATE = 3e-3
# Highest rate of a further training.
FURTHER_RATE = 1e-3
# Seed of the training of a new network.
NEW_SEED = 1
# Seed of a further training.
FURTHER_SEED = 2
# Weight of the error of place and size.
PLACE_WEIGHT = 4.0
# Weight of the log-odds that are kept, and the largest ones that are.
KEEP_WEIGHT, MAX_KEPT = 0.1, 8.0


def read(paths):
    """Returns patches, labels and places of files."""
    files = [np.load(path) for path in paths]
    names = "patches", "labels", "places"
    kept = [np.concatenate([file[name] for file in files]) for name in names]
    print("patches", len(kept[1]), "balls", (kept[1] == 1).sum(), "others", (kept[1] == 0).sum())
    return kept


def loss(result, labels, places, least):
    """Returns the loss of the log-odds and the error of place and size. `least` are the log-odds to
    keep, those of other patches than the ball negated."""
    sure, near = labels >= 0, ~torch.isnan(places[:, 0])
    odds = result[sure, 0]
    score = torch.nn.functional.binary_cross_entropy_with_logits(odds, labels[sure])
    lost = (least[sure] - odds * (2 * labels[sure] - 1)).clamp(min=0).mean()
    error = torch.nn.functional.smooth_l1_loss(result[near, 1:], places[near], beta=0.05)
    return score + PLACE_WEIGHT * error + KEEP_WEIGHT * lost


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


def to_keep(network, patches, labels):
    """Returns the log-odds that `network` gives patches and mirrored ones, those of other patches
    than the ball negated."""
    parts = [torch.from_numpy(patches[at : at + 1000]) for at in range(0, len(labels), 1000)]
    with torch.no_grad():
        odds = [[network(x)[:, 0] for x in (part.float(), part.float().flip(3))] for part in parts]
    both = torch.cat([torch.stack(pair, 1) for pair in odds]).numpy()
    return np.minimum(both * (2 * labels[:, None] - 1), MAX_KEPT)


def batches(rng, patches, labels, places, least):
    """Yields batches of patches, labels, places and log-odds to keep for ever, mirrored at
    random."""
    while True:
        chosen = rng.integers(0, len(labels), BATCH)
        x, place = (torch.from_numpy(k[chosen].astype(np.float32)) for k in (patches, places))
        mirrored = rng.random() < 0.5
        if mirrored:
            x, place = x.flip(3), place * torch.tensor([-1.0, 1.0, 1.0])
        x = x.contiguous(memory_format=torch.channels_last)
        kept = torch.from_numpy(least[chosen, int(mirrored)])
        yield x, torch.from_numpy(labels[chosen]), place, kept


def train(network, kept, steps, rate, seed):
    """Trains a network with patches, labels, places and log-odds to keep."""
    optimiser = torch.optim.AdamW(network.parameters(), rate, weight_decay=1e-3)
    plan = torch.optim.lr_scheduler.OneCycleLR(optimiser, rate, steps, pct_start=0.1)
    total = 0.0
    made = batches(np.random.default_rng(seed), *kept)
    for step, (x, *wanted) in zip(range(1, steps + 1), made):
        value = loss(network(x), *wanted)
        optimiser.zero_grad()
        value.backward()
        optimiser.step()
        plan.step()
        total += value.item()
        if step % 500 == 0:
            print(step, round(total / 500, 4), flush=True)
            total = 0.0


def unused(kept):
    """Returns log-odds to keep that keep nothing."""
    return np.full((len(kept[1]), 2), -np.inf, np.float32)


def measured(kept):
    """Returns the batches whose statistics the normalisations of a weights file are given."""
    made = batches(np.random.default_rng(0), *kept)
    return [next(made)[0] for _ in range(MEASURED)]


def start(kind, path, kept):
    """Returns the network to train with `kept`, and the highest rate and seed of its training."""
    if path == "-":
        torch.manual_seed(NEW_SEED)
        return Judge(*{"screen": SCREEN, "judge": JUDGE}[kind]), NEW_RATE, NEW_SEED
    torch.manual_seed(FURTHER_SEED)
    network = read_network(KINDS.index(kind), path)
    if not path.endswith(".pt"):
        give_statistics(network, measured(kept))
    return network.train(), FURTHER_RATE, FURTHER_SEED


def main():
    keeps = sys.argv[1] == "--keep"
    kind, steps, out, before, test, *paths = sys.argv[1 + keeps :]
    torch.set_num_threads(1)
    kept = read(paths)
    named = KINDS.index(kind)
    kept.append(to_keep(read_network(named, before), *kept[:2]) if keeps else unused(kept))
    network, rate, seed = start(kind, before, kept)
    network = network.to(memory_format=torch.channels_last)
    train(network, kept, int(steps), rate, seed)
    network.eval()
    torch.save(network.state_dict(), out)
    report(network, *read([test]))


if __name__ == "__main__":
    main()
