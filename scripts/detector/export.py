"""Writes the weights file that the detector reads: export.py PROPOSER SCREEN JUDGE OUT.

Each network is that of a training (`.pt`), or of a weights file. The script prints the outputs
of the networks for a fixed input, which a test of the detector checks.
"""

import sys

import torch

from weights_file import read_network, write_networks


def pattern(rows, columns):
    """Returns a fixed input of five channels, from -1 to 1."""
    values = torch.arange(5 * rows * columns) * 37 % 101
    return (values / 50 - 1).view(1, 5, rows, columns)


def main():
    *paths, out = sys.argv[1:]
    networks = [read_network(place, path) for place, path in enumerate(paths)]
    write_networks(out, networks)
    proposer, *judges = networks
    with torch.no_grad():
        head = proposer.head(proposer.coarse(proposer.fine(pattern(16, 24))))
        print("proposer: channels 0, 4, 8, 12 of row 1, column 2:", head[0, ::4, 1, 2].tolist())
        for name, judge in zip(("screen", "judge"), judges):
            print(f"{name}:", judge(pattern(24, 24))[0].tolist())


if __name__ == "__main__":
    main()
