"""Inputs of the networks: channels of a picture, and of a patch.

A picture is one of generate.py, half the size of a camera's, or one of the bench. The first three
channels are red, green and blue from -1 to 1, with the hues turned so that the ball's is red.

The detector computes these channels in `propose/input.rs`, `disc_depth.rs` and `view.rs` (in
`host/vision/src/detect/shape`). It differs from this file in the following. The weights in use were
trained with the inputs of this file, so the differences stay.

- A depth is known here if it is above MIN_DEPTH, and in the detector if its raw value is not 0.
- A pixel of the proposal network's input has one depth of four by four pixels of the full-size
  picture. The detector reads that in the third row and column (`QUARTER / 2` of 0 to 3 in
  `middle_rows` and `read_middles`). `proposal_input` reads the second row and column of two by two
  pixels at half the size. In a picture of generate.py this pixel lies over the third and fourth
  rows and columns of the full size; in one of bench_shard.py it has the depth of the fourth ones.
- The colours of a patch are rounded to 8 bits here (`cv2.remap`), and not in the detector.
"""

import cv2
import numpy as np

from drawing import MIDDLE, MIN_DEPTH, BallDisc
from light import rotate_hue

# Pixels of the picture in a pixel of the proposal network's input, of the full-size picture 4.
STEP = 2
# Largest expected radius (input pixels) and its unit.
MAX_EXPECTED, EXPECTED_UNIT = 30.0, 10.0
# Distance of the middle of a ball's visible surface from its centre, in its radius.
SURFACE = 0.7

# Side of a patch (pixels) and radius of the disc in it.
PATCH, PATCH_RADIUS = 24, 7.0
# Times that a picture of the bench, and one of generate.py, is halved for patches of large balls.
HALVINGS, DRAWN_HALVINGS = 2, 4
# Largest depth against the ball's centre that a patch shows, in the ball's radius.
PATCH_DEPTH = 3.0

# Balls with a smaller visible part count neither as a ball nor as something else in a training.
MIN_VISIBLE = 0.35


class Picture:
    """A picture: colour (8 bits), depth (metres), focal length (pixels), radius of the ball
    (metres) and its hue (degrees), and the column and row at which the optical axis meets it."""

    def __init__(self, colour, depth, focal, radius, hue, middle=MIDDLE, halvings=HALVINGS):
        self.depth, self.focal, self.radius, self.hue = depth, focal, radius, hue
        self.middle = middle
        self.levels = [colour]
        for _ in range(halvings):
            size = (self.levels[-1].shape[1] // 2, self.levels[-1].shape[0] // 2)
            self.levels.append(cv2.resize(self.levels[-1], size, interpolation=cv2.INTER_AREA))

    def disc(self, disc):
        """Returns the disc (column, row, pixels) of a ball."""
        return BallDisc(*disc, self.focal, self.middle)

    def channels(self, pixels, depth, known):
        """Returns (5, rows, columns) of 8-bit colours and the two channels of depth."""
        colour = pixels.astype(np.float32) / 255
        if self.hue:
            colour = rotate_hue(colour, -self.hue)
        colour = colour.transpose(2, 0, 1) * 2 - 1
        return np.concatenate([colour, depth[None], known[None]]).astype(np.float32)

    def proposal_input(self):
        """Returns the channels of the whole picture; the fourth is the radius that a ball has at
        the depth (0 where unknown), the fifth whether the depth is known."""
        nearest = self.depth[STEP // 2 :: STEP, STEP // 2 :: STEP]
        known = nearest > MIN_DEPTH
        centre = np.where(known, nearest + SURFACE * self.radius, 1)
        expected = np.minimum(self.focal / STEP * self.radius / centre, MAX_EXPECTED)
        return self.channels(self.levels[1], np.where(known, expected / EXPECTED_UNIT, 0), known)

    def patch_input(self, disc):
        """Returns the channels about `disc` (column, row, pixels), brought to one size, in which a
        ball is round; the fourth is the depth behind the ball's centre in its radius, the fifth
        whether it is known."""
        size = disc[2]
        scale = size / PATCH_RADIUS
        places = (np.arange(PATCH) - (PATCH - 1) / 2) / PATCH_RADIUS
        columns, rows = self.disc(disc).at(*np.meshgrid(places, places))
        level = min(max(0, int(np.floor(np.log2(scale)))), len(self.levels) - 1)
        in_level = [((k + 0.5) / 2**level - 0.5).astype(np.float32) for k in (columns, rows)]
        pixels = cv2.remap(
            self.levels[level], *in_level, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        )
        depth = self.depth
        u, v = (np.floor(k + 0.5).astype(int) for k in (columns, rows))
        inside = (v >= 0) & (v < depth.shape[0]) & (u >= 0) & (u < depth.shape[1])
        nearest = depth[np.clip(v, 0, depth.shape[0] - 1), np.clip(u, 0, depth.shape[1] - 1)]
        known = inside & (nearest > MIN_DEPTH)
        behind = (nearest - self.focal * self.radius / size) / self.radius / PATCH_DEPTH
        return self.channels(pixels, np.where(known, np.clip(behind, -1, 1), 0), known)


def pictures(path, units):
    """Yields the pictures of a shard, whose depth has `units` in a metre, and their balls."""
    shard = np.load(path)
    arrays = (shard[name] for name in ("colour", "depth", "lens", "ball"))
    for colour, depth, (focal, radius, hue), ball in zip(*arrays):
        metres = depth.astype(np.float32) / units
        yield Picture(colour, metres, focal, radius, hue, halvings=DRAWN_HALVINGS), ball
