"""Light and colour, and the recorded pictures (TUM RGB-D folders)."""

import os
import sys
from typing import NamedTuple

import cv2
import numpy as np

# Depth units of a metre in TUM RGB-D pictures.
TUM_DEPTH = 5000.0
# Largest time between a colour picture and its depth picture, seconds, as for the host's folders
# (`MAX_TIME_DIFFERENCE` in `host/cameras/src/tum/list.rs`).
MAX_TIME_DIFFERENCE = 0.02
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


class Entry(NamedTuple):
    """A line of a list of pictures."""

    # Time stamp, seconds.
    time: float
    # Path of the picture.
    path: str


def read_list(folder, name):
    """Returns the entries of the list `name` in a TUM RGB-D folder, in its order. Ends the program
    if the list cannot be read."""
    path = os.path.join(folder, name)
    try:
        with open(path, encoding="utf-8", errors="replace") as file:
            lines = [line.strip() for line in file]
    except OSError as error:
        sys.exit(f"cannot read {path} ({error.strerror}): give a TUM RGB-D folder, with rgb.txt "
                 "and depth.txt")
    entries = []
    for number, line in enumerate(lines, 1):
        if not line or line.startswith("#"):
            continue
        try:
            time, picture = line.split(maxsplit=1)
            entries.append(Entry(float(time), os.path.join(folder, picture)))
        except ValueError:
            sys.exit(f"{path}:{number}: write `timestamp path` (seconds, then a file) instead of "
                     f"{line!r}")
    return entries


def paired(folder):
    """Returns the paths of (colour, depth) of each picture in a TUM RGB-D folder, in the order of
    `rgb.txt`. The depth picture is the one nearest in time. Ends the program if there is none
    within MAX_TIME_DIFFERENCE."""
    depths = sorted(read_list(folder, "depth.txt"))
    pairs = []
    for colour in read_list(folder, "rgb.txt"):
        depth = min(depths, key=lambda entry: abs(entry.time - colour.time), default=None)
        if depth is None or not abs(depth.time - colour.time) <= MAX_TIME_DIFFERENCE:
            sys.exit(f"{colour.path} has no depth: no time stamp in {folder}/depth.txt is within "
                     f"{MAX_TIME_DIFFERENCE} s of {colour.time:.6f} s. Add a line with its depth "
                     f"picture there, or remove its line from {folder}/rgb.txt")
        pairs.append((colour.path, depth.path))
    return pairs


def read_picture(path, kind):
    """Returns the picture in a file; `kind` is a flag of `cv2.imread`. Ends the program if it
    cannot be read."""
    picture = cv2.imread(path, kind)
    if picture is None:
        sys.exit(f"cannot read the picture {path}: restore the file, or remove its line from the "
                 "list of its folder (rgb.txt or depth.txt)")
    return picture


def read_frames(folders):
    """Returns (linear light, depth in metres) of the pictures in TUM RGB-D folders that are not
    held out, in the order of each folder's `rgb.txt`."""
    frames = []
    for folder in folders:
        for number, (colour_path, depth_path) in enumerate(paired(folder)):
            if number % HELD_OUT == HELD_OUT - 1:
                continue
            colour = read_picture(colour_path, cv2.IMREAD_COLOR)[..., ::-1].astype(np.float32) / 255
            depth = read_picture(depth_path, cv2.IMREAD_UNCHANGED).astype(np.float32) / TUM_DEPTH
            frames.append((to_linear(colour).astype(np.float32), depth))
    return frames
