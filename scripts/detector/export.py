"""Writes the weights file that the detector reads: export.py PROPOSER JUDGE OUT.

It prints what both networks say about a fixed input, which a test of the detector checks.
"""

import sys

import torch
from torch import nn

from networks import Judge, Proposer

# First lines of the file; an empty line ends them.
TEXT = """Weights of the networks of Plumb's detector `ball`: {proposer} + {judge} numbers, f32.
Made by scripts/detector (README.md there says how), with torch {torch}.

"""


def folded(convolution, normalisation):
    """Returns weights and biases of a convolution together with its normalisation."""
    scale = normalisation.weight / torch.sqrt(normalisation.running_var + normalisation.eps)
    weight = convolution.weight * scale.view(-1, 1, 1, 1)
    return weight, normalisation.bias - normalisation.running_mean * scale


def layers(network):
    """Yields weights and biases of a network's layers in their order."""
    pending = None
    for module in network.modules():
        if isinstance(module, (nn.Conv2d, nn.Linear)):
            if pending is not None:
                yield pending.weight, pending.bias
            pending = module
        elif isinstance(module, nn.BatchNorm2d):
            yield folded(pending, module)
            pending = None
    if pending is not None:
        yield pending.weight, pending.bias


def numbers(network):
    """Returns all weights and biases of a network, in the order of the file."""
    return torch.cat([part.detach().flatten() for layer in layers(network) for part in layer])


def pattern(rows, columns):
    """Returns a fixed input of five channels, from -1 to 1."""
    values = torch.arange(5 * rows * columns) * 37 % 101
    return (values / 50 - 1).view(1, 5, rows, columns)


def main():
    proposer, judge = Proposer(), Judge()
    proposer.load_state_dict(torch.load(sys.argv[1]))
    judge.load_state_dict(torch.load(sys.argv[2]))
    proposer.eval()
    judge.eval()
    parts = [numbers(proposer), numbers(judge)]
    text = TEXT.format(proposer=len(parts[0]), judge=len(parts[1]), torch=torch.__version__)
    with open(sys.argv[3], "wb") as out:
        out.write(text.encode())
        for part in parts:
            out.write(part.numpy().astype("<f4").tobytes())
    with torch.no_grad():
        head = proposer.head(proposer.coarse(proposer.fine(pattern(16, 24))))
        print("proposer: channels 0, 4, 8, 12 of row 1, column 2:", head[0, ::4, 1, 2].tolist())
        print("judge:", judge(pattern(24, 24))[0].tolist())


if __name__ == "__main__":
    main()
