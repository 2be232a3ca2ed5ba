"""The weights file that the detector reads: lines of text, an empty line, and numbers (f32)."""

import numpy as np
import torch
from torch import nn

from networks import JUDGE, SCREEN, Judge, Proposer

# First lines of the file; an empty line ends them.
TEXT = """Weights of the networks of Plumb's detector `ball`: {counts} numbers, f32.
Made by scripts/detector (README.md there says how), with torch {torch}.

"""


def layers(network):
    """Returns (layer, normalisation or None) of a network in their order."""
    kinds = (nn.Conv2d, nn.Linear, nn.BatchNorm2d)
    found = [module for module in network.modules() if isinstance(module, kinds)]
    after = found[1:] + [None]
    return [
        (layer, following if isinstance(following, nn.BatchNorm2d) else None)
        for layer, following in zip(found, after)
        if not isinstance(layer, nn.BatchNorm2d)
    ]


def folded(layer, normalisation):
    """Returns weights and biases of a layer together with its normalisation."""
    if normalisation is None:
        return layer.weight, layer.bias
    scale = normalisation.weight / torch.sqrt(normalisation.running_var + normalisation.eps)
    weight = layer.weight * scale.view(-1, 1, 1, 1)
    return weight, normalisation.bias - normalisation.running_mean * scale


def numbers(network):
    """Returns all weights and biases of a network, in the order of the file."""
    parts = [part for pair in layers(network) for part in folded(*pair)]
    return torch.cat([part.detach().flatten() for part in parts])


def write_networks(path, networks):
    """Writes the weights of networks."""
    parts = [numbers(network) for network in networks]
    counts = " + ".join(str(len(part)) for part in parts)
    with open(path, "wb") as out:
        out.write(TEXT.format(counts=counts, torch=torch.__version__).encode())
        for part in parts:
            out.write(part.numpy().astype("<f4").tobytes())


def read_networks(path, networks):
    """Sets networks to the first weights of a file, ready to be used. Their normalisations do
    nothing but add the biases."""
    with open(path, "rb") as file:
        values = np.frombuffer(file.read().split(b"\n\n", 1)[1], "<f4")
    place = 0
    for network in networks:
        for layer, normalisation in layers(network):
            biases = layer.bias
            if normalisation is not None:
                normalisation.weight.data.fill_(1)
                normalisation.running_mean.zero_()
                normalisation.running_var.fill_(1 - normalisation.eps)
                biases = normalisation.bias
            for part in (layer.weight, biases):
                taken = values[place : place + part.numel()].reshape(part.shape)
                part.data.copy_(torch.from_numpy(taken.copy()))
                place += part.numel()
        network.eval()


def read_network(place, path):
    """Returns the network of a training (`.pt`), or the one at `place` in a weights file."""
    networks = [Proposer(), Judge(*SCREEN), Judge(*JUDGE)]
    if path.endswith(".pt"):
        networks[place].load_state_dict(torch.load(path))
        return networks[place].eval()
    read_networks(path, networks)
    return networks[place]


def give_statistics(network, inputs):
    """Gives the normalisations of a network of a weights file the statistics of `inputs`, batches.
    What the network computes stays the same."""
    for _, normalisation in layers(network):
        if normalisation is None:
            continue
        seen = []
        hook = normalisation.register_forward_hook(lambda _, x, y: seen.append(x[0]))
        with torch.no_grad():
            for x in inputs:
                network(x)
        hook.remove()
        values = torch.cat(seen)
        mean, variance = values.mean((0, 2, 3)), values.var((0, 2, 3), unbiased=False)
        normalisation.running_mean.copy_(mean)
        normalisation.running_var.copy_(variance)
        normalisation.weight.data.copy_(torch.sqrt(variance + normalisation.eps))
        normalisation.bias.data.add_(mean)
