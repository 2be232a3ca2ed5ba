"""Averages the weights of two trained networks of one kind: average.py ONE OTHER OUT.

A network that was trained on with difficult pictures has forgotten a little of the usual ones; the
mean of before and after is good at both.
"""

import sys

import torch


def main():
    one, other, out = sys.argv[1:]
    one, other = torch.load(one), torch.load(other)
    means = {
        name: (value + other[name]) / 2 if value.is_floating_point() else value
        for name, value in one.items()
    }
    torch.save(means, out)


if __name__ == "__main__":
    main()
