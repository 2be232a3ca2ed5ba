"""Writes a judging network between two: blend.py screen|judge BEFORE AFTER SHARE OUT PATCHES...

BEFORE is a weights file, AFTER the network (`.pt`) that `train_judge.py` made from it with PATCHES.
The weights are those of BEFORE and AFTER in the parts 1 - SHARE and SHARE. The normalisations get
the statistics of PATCHES anew: those of a mean are not the mean of those.
"""

import sys

import torch
from torch import nn

from train_judge import KINDS, measured, read, unused
from weights_file import give_statistics, read_network


def blend(before, after, share):
    """Returns the weights between those of two networks."""
    pairs = {name: (value, after[name]) for name, value in before.items()}
    return {
        name: (1 - share) * old + share * new if old.is_floating_point() else old
        for name, (old, new) in pairs.items()
    }


def measure(network, inputs):
    """Gives the normalisations of a network the statistics of `inputs`, batches."""
    for module in network.modules():
        if isinstance(module, nn.BatchNorm2d):
            module.momentum = None
            module.reset_running_stats()
    network.train()
    with torch.no_grad():
        for x in inputs:
            network(x)
    network.eval()


def main():
    kind, before, after, share, out, *paths = sys.argv[1:]
    torch.set_num_threads(1)
    kept = read(paths)
    inputs = measured(kept + [unused(kept)])
    network, trained = (read_network(KINDS.index(kind), path) for path in (before, after))
    give_statistics(network, inputs)
    network.load_state_dict(blend(network.state_dict(), trained.state_dict(), float(share)))
    measure(network, inputs)
    torch.save(network.state_dict(), out)


if __name__ == "__main__":
    main()
