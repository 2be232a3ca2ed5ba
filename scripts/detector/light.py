"""Light and colour, and the recorded pictures (TUM RGB-D folders)."""

import glob
import os

import cv2
import numpy as np

# Depth units of a metre in TUM RGB-D pictures.
TUM_DEPTH = 5000.0
# Of so many recorded pictures the last one is held out for the bench (`--held-out`).
HELD_OUT = 4


def to_linear(srgb):
    """Returns linear light of sRGB values, both 0 to 1."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def to_srgb(light):
    """Returns sRGB values of linear light, both 0 to 1."""
    light = np.clip(light, 0.0, 1.0)
    return np.where(light <= 0.0031308, light * 12.92, 1.055 * light ** (1 / 2.4) - 0.055)


def rotate_hue(image, degrees):
    """Returns sRGB values whose hues are turned by `degrees` about the grey axis.

    The detector turns its pictures in the same way, so that its ball is always red.
    """
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    same = cosine + (1 - cosine) / 3
    forward = (1 - cosine) / 3 - sine / np.sqrt(3)
    backward = (1 - cosine) / 3 + sine / np.sqrt(3)
    matrix = np.array(
        [[same, forward, backward], [backward, same, forward], [forward, backward, same]]
    )
    return image @ matrix.T.astype(np.float32)


def read_frames(folders):
    """Returns (linear light, depth in metres) of the pictures in TUM RGB-D folders that are not
    held out."""
    frames = []
    for folder in folders:
        depths = sorted(glob.glob(os.path.join(folder, "depth", "*.png")))
        for number, path in enumerate(sorted(glob.glob(os.path.join(folder, "rgb", "*.png")))):
            if number % HELD_OUT == HELD_OUT - 1:
                continue
            colour = cv2.imread(path)[..., ::-1].astype(np.float32) / 255
            twin = os.path.join(folder, "depth", os.path.basename(path))
            depth = cv2.imread(twin if os.path.exists(twin) else depths[0], cv2.IMREAD_UNCHANGED)
            depth = depth.astype(np.float32) / TUM_DEPTH
            frames.append((to_linear(colour).astype(np.float32), depth))
    return frames
