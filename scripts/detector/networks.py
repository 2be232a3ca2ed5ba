"""The three networks: one proposes places in a picture, the others judge a patch about a disc.

All fold squares of 2x2 pixels into channels, mix the channels of each pixel, and convolve each
channel by itself.
"""

import torch
from torch import nn

# Channels of the judging network for the proposals, at half and at a quarter of a patch's size.
SCREEN = 24, 64
# Channels of the judging network for the refined circles, at the same sizes.
JUDGE = 48, 128
# Pixels of the proposal network's input, in a row, in a cell of its output.
CELL = 2
# Unit of the radii that the proposal network gives, input pixels.
RADIUS_UNIT = 5.0


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
    """Network that proposes places of the ball: 5 channels in, 4 out at half the size. These are
    the ball's log-odds, the offset to its centre (right and down, cells), and the logarithm of its
    radius over RADIUS_UNIT."""

    def __init__(self):
        super().__init__()
        self.fine = folded(5, 16, [1])
        self.coarse = folded(16, 40, [1, 2, 4, 2])
        self.head = nn.Conv2d(40, 16, 1)
        self.head.bias.data[:4] = -4.0

    def forward(self, x):
        return nn.functional.pixel_shuffle(self.head(self.coarse(self.fine(x))), 2)


class Judge(nn.Module):
    """Network that judges whether the disc of a patch is the ball: 5 channels in, 4 out. These are
    the log-odds, the offset from the disc's centre to the ball's (right and down, in the disc's
    radius), and the logarithm of the ball's radius over the disc's."""

    def __init__(self, fine, coarse):
        super().__init__()
        self.fine = folded(5, fine, [1])
        self.coarse = folded(fine, coarse, [1, 1])
        self.head = nn.Linear(6 * 6 * coarse, 4)

    def forward(self, x):
        return self.head(self.coarse(self.fine(x)).contiguous().flatten(1))
