"""The three networks: one proposes places in a picture, the others judge a patch about a disc.

All fold squares of 2x2 pixels into channels, mix the channels of each pixel, and convolve each
channel by itself.
"""

import torch
from torch import nn

# Channels of the judging networks: of the one that looks at each proposal, and of the one that
# looks at each refined circle.
SCREEN, JUDGE = (24, 64), (48, 128)


def mix(inputs, outputs):
    """Returns a 1x1 convolution with normalisation."""
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, 1, bias=False), nn.BatchNorm2d(outputs), nn.ReLU()
    )


class Block(nn.Module):
    """A 3x3 convolution of each channel by itself and a mix, added to what was there."""

    def __init__(self, channels, dilation):
        super().__init__()
        self.depthwise = nn.Sequential(
            nn.Conv2d(channels, channels, 3, 1, dilation, dilation, channels, bias=False),
            nn.BatchNorm2d(channels),
            nn.ReLU(),
        )
        self.mix = mix(channels, channels)

    def forward(self, x):
        return x + self.mix(self.depthwise(x))


def folded(inputs, outputs, dilations):
    """Returns layers that halve the size: a fold, a mix, and blocks of these dilations."""
    blocks = [Block(outputs, dilation) for dilation in dilations]
    return nn.Sequential(nn.PixelUnshuffle(2), mix(4 * inputs, outputs), *blocks)


class Proposer(nn.Module):
    """Finds places where the ball may be: 5 channels in, 4 out at half the size (the ball's
    log-odds, offset to its centre, logarithm of its radius over 5, in input pixels)."""

    def __init__(self):
        super().__init__()
        self.fine = folded(5, 16, [1])
        self.coarse = folded(16, 40, [1, 2, 4, 2])
        self.head = nn.Conv2d(40, 16, 1)
        self.head.bias.data[:4] = -4.0

    def forward(self, x):
        return nn.functional.pixel_shuffle(self.head(self.coarse(self.fine(x))), 2)


class Judge(nn.Module):
    """Tells whether the disc of a patch is the ball: 5 channels in, 4 out (log-odds; where the
    ball's centre is to the right and down, and the logarithm of its radius, against the disc's, in
    the disc's radius)."""

    def __init__(self, fine, coarse):
        super().__init__()
        self.fine = folded(5, fine, [1])
        self.coarse = folded(fine, coarse, [1, 1])
        self.head = nn.Linear(6 * 6 * coarse, 4)

    def forward(self, x):
        return self.head(self.coarse(self.fine(x)).contiguous().flatten(1))
