"""Writes the weights file that the detector reads: export.py PROPOSER SCREEN JUDGE OUT.

It prints what the networks say about a fixed input, which a test of the detector checks.
"""

import sys

import torch

from networks import JUDGE, SCREEN, Judge, Proposer
from weights_file import write_networks


def pattern(rows, columns):
    """Returns a fixed input of five channels, from -1 to 1."""
    values = torch.arange(5 * rows * columns) * 37 % 101
    return (values / 50 - 1).view(1, 5, rows, columns)


def main():
    *paths, out = sys.argv[1:]
    networks = [Proposer(), Judge(*SCREEN), Judge(*JUDGE)]
    for network, path in zip(networks, paths, strict=True):
        network.load_state_dict(torch.load(path))
        network.eval()
    write_networks(out, networks)
    proposer, *judges = networks
    with torch.no_grad():
        head = proposer.head(proposer.coarse(proposer.fine(pattern(16, 24))))
        print("proposer: channels 0, 4, 8, 12 of row 1, column 2:", head[0, ::4, 1, 2].tolist())
        for name, judge in zip(("screen", "judge"), judges):
            print(f"{name}:", judge(pattern(24, 24))[0].tolist())


if __name__ == "__main__":
    main()
