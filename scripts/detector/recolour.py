"""Writes patches once more with what is red in them darker, duller, glossy or narrower:
recolour.py PATCHES OUT SEED

PATCHES is a file of patches.py or bench_patches.py. A red thing keeps its shading and its label, be
it a ball or not, and what is not red stays as it is.
"""

import sys

import cv2
import numpy as np

from inputs import PATCH, PATCH_RADIUS

# Least and largest factor of the saturation of what is red, and of its brightness.
SATURATION, BRIGHTNESS = (0.25, 1.0), (0.3, 1.1)
# Share of the patches with one more highlight, and with another shape.
GLOSSY, NARROW = 0.25, 0.15
# Least and largest width of those, in their length.
NARROWEST, WIDEST = 0.74, 0.95


def redness(colour):
    """Returns how red (0 to 1) pixels are, (3, rows, columns) of values from 0 to 1."""
    likeness = (colour[0] - np.maximum(colour[1], colour[2])) / (colour.max(0) + 0.1)
    return np.clip((likeness - 0.08) / 0.15, 0, 1)


def duller(rng, colour):
    """Returns pixels with what is red in other brightness and saturation, some with a highlight."""
    saturation, brightness = rng.uniform(*SATURATION), rng.uniform(*BRIGHTNESS)
    red, grey = redness(colour), colour.mean(0)
    changed = brightness * (grey + saturation * (colour - grey))
    if rng.random() < GLOSSY:
        rows, columns = (np.mgrid[0:PATCH, 0:PATCH] - (PATCH - 1) / 2) / PATCH_RADIUS
        turn, out = rng.uniform(0, 2 * np.pi), rng.uniform(0, 0.7)
        square = (columns - out * np.cos(turn)) ** 2 + (rows - out * np.sin(turn)) ** 2
        changed = changed + rng.uniform(0.2, 1.0) * np.exp(-square / rng.uniform(0.02, 0.2))
    return np.clip(colour + red * (changed - colour), 0, 1)


def narrower(rng, patch):
    """Returns a patch in which things are narrower in one direction and longer in the other."""
    turn, stretch = rng.uniform(0, np.pi), np.sqrt(rng.uniform(NARROWEST, WIDEST))
    way = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    matrix = way @ np.diag([stretch, 1 / stretch]) @ way.T
    middle = np.full(2, (PATCH - 1) / 2)
    whole = np.hstack([matrix, (middle - matrix @ middle)[:, None]])
    warp = lambda channel: cv2.warpAffine(
        channel, whole, (PATCH, PATCH), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    return np.stack([warp(channel) for channel in patch])


def main():
    source, out, seed = sys.argv[1:]
    rng, file = np.random.default_rng(int(seed)), np.load(source)
    made, places = file["patches"].astype(np.float32), file["places"].copy()
    for patch, place in zip(made, places):
        patch[:3] = duller(rng, (patch[:3] + 1) / 2) * 2 - 1
        # The place of a ball that is off the middle would move.
        if rng.random() < NARROW and not np.abs(place).max() > 0.2:
            patch[:] = narrower(rng, patch)
            place[:] = np.nan
    arrays = {"patches": made.astype(np.float16), "labels": file["labels"], "places": places}
    np.savez(out, **arrays)


if __name__ == "__main__":
    main()
