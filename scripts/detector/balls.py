"""Writes recordings of balls of many materials and sizes without depth: balls.py OUT SEED FOLDER...

OUT gets a folder for each kind, size of picture and hue, with its `camera.toml` and the true
circles in `truth.csv` (time stamp, column, row, radius; pixels). A third of the pictures show an
even wall, a third a shaded one, and a third the recorded pictures of the TUM RGB-D folders.
`found.py` counts the balls that are found. No network is trained with these pictures.
"""

import os
import sys
from typing import NamedTuple

import cv2
import numpy as np

from drawing import BallDisc
from light import paired, read_picture, rotate_hue

CAMERA = """[intrinsics]
width = {width}
height = {height}
fx = {focal}
fy = {focal}
cx = {middle[0]}
cy = {middle[1]}
depth_scale = "none"
[pose]
translation = [1.737, 0.286, 0.225]
quaternion = [-0.5, -0.5, 0.5, 0.5]
[ball]
diameter_m = {diameter}
hue = {hue}
"""
# Focal length in the picture's width, and distance of the largest ball, metres.
FOCAL, NEAREST = 0.82, 0.26
# Samples of a pixel in either direction, and of a ball's motion.
SAMPLES, TAPS = 2, 9
# Sharpness of a highlight: exponent of Blinn's model.
SHININESS = 60

# Red, green and blue of dark, dull balls and of usual ones where they are fully lit, 0 to 255.
DULL = [(75, 38, 42), (60, 35, 38), (90, 30, 32), (110, 45, 45)]
DULL += [(70, 25, 25), (95, 50, 52), (130, 35, 40), (65, 38, 40)]
USUAL = [(230, 30, 25), (190, 25, 30), (235, 80, 85), (150, 20, 25)]


class Kind(NamedTuple):
    """A kind of balls. Ranges are a least and a largest number."""

    colours: list
    # Columns and rows of the pictures.
    sizes: list = [(640, 480)]
    # Range of the radii, pixels, or radii in the picture's height.
    radii: tuple = (12, 50)
    parts: list = []
    hues: list = [0]
    # Range of the highlight's brightness.
    gloss: tuple = ()
    # Range of the width over the height.
    narrow: tuple = ()
    # Range of the length of the motion, radii.
    motion: tuple = ()
    pictures: int = 24


LARGE = [80 / 720, 100 / 720, 150 / 720, 0.3, 0.45]
KINDS = {
    "dull": Kind(DULL, [(640, 480), (1280, 720)]),
    "glossy": Kind(DULL + USUAL, gloss=(0.3, 1.0)),
    "dullhue": Kind(DULL, hues=[60, 120, 210, 300]),
    "narrow": Kind(USUAL + DULL[4:], radii=(14, 45), narrow=(0.74, 0.86), hues=[0, 60, 210]),
    "moving": Kind(USUAL + DULL, radii=(14, 45), motion=(0.3, 1.0)),
    "large": Kind(USUAL, [(1280, 720), (640, 480)], parts=LARGE, hues=[0, 60, 210]),
    "large4k": Kind(
        USUAL + DULL[:4], [(3840, 2160)], parts=[0.05, 0.1, 0.2, 0.3, 0.45], pictures=10
    ),
    "largedull": Kind(DULL, [(1280, 720)], parts=LARGE),
}


class Ball(NamedTuple):
    """A ball in a picture of a camera with the focal length `focal`."""

    focal: float
    # Column, row and radius, pixels.
    place: tuple
    # Red, green and blue where it is fully lit, 0 to 255.
    colour: np.ndarray
    gloss: float
    narrow: float
    # Length of the motion, pixels.
    motion: float
    # Direction to the light: right, down, towards the camera.
    light: tuple

    def paint(self, rng, image):
        """Paints it into an image of floats, 0 to 255."""
        height, width = image.shape[:2]
        u, v, radius = self.place
        reach = int(1.6 * radius / self.narrow + self.motion + 4)
        left, right = max(0, int(u) - reach), min(width, int(u) + reach + 1)
        top, bottom = max(0, int(v) - reach), min(height, int(v) + reach + 1)
        disc = BallDisc(u, v, radius, self.focal, ((width - 1) / 2, (height - 1) / 2))
        turn, ambient = rng.uniform(0, np.pi), rng.uniform(0.35, 0.6)
        total = np.zeros((bottom - top, right - left, 3))
        cover = np.zeros(total.shape[:2])
        half = self.motion / 2
        taps = np.linspace(-half, half, TAPS) if self.motion else [0]
        steps = (np.arange(SAMPLES) + 0.5) / SAMPLES - 0.5
        for tap in taps:
            for dy in steps:
                for dx in steps:
                    rows, columns = np.mgrid[top:bottom, left:right] + np.array([[[dy]], [[dx]]])
                    at = disc.on(columns - tap * np.cos(turn), rows - tap * np.sin(turn))
                    hit, drawn = self.shade(ambient, at[0] / self.narrow, at[1])
                    total += hit[..., None] * drawn
                    cover += hit
        count = len(taps) * SAMPLES**2
        image[top:bottom, left:right] *= 1 - cover[..., None] / count
        image[top:bottom, left:right] += total / count

    def shade(self, ambient, u, v):
        """Returns which places are on the ball, and their colours."""
        square = u * u + v * v
        way = np.array(self.light) / np.linalg.norm(self.light)
        half = way + [0, 0, 1]
        half = half / np.linalg.norm(half)
        normal = np.stack([u, v, np.sqrt(np.clip(1 - square, 0, 1))], -1)
        lit = ambient + (1 - ambient) * np.clip(normal @ way, 0, 1)
        glint = self.gloss * np.clip(normal @ half, 0, 1) ** SHININESS
        return square < 1, self.colour * lit[..., None] + 255 * glint[..., None]


def wall(rng, number, size, recorded):
    """Returns the background of the picture with this number."""
    width, height = size
    if number % 3 == 0:
        return np.full((height, width, 3), rng.uniform(80, 210))
    if number % 3 == 2:
        return cv2.resize(recorded[rng.integers(len(recorded))], size).astype(float)
    colour = rng.uniform(60, 220, 3) * 0.3 + rng.uniform(60, 180)
    rows, columns = np.mgrid[0:height, 0:width]
    slope = (columns / width - 0.5) * rng.normal() + (rows / height - 0.5) * rng.normal()
    return np.clip(colour * (1 + 0.3 * slope)[..., None], 0, 255)


def draw(rng, kind, number, size, hue, recorded):
    """Returns the picture with this number (red, green, blue) and the circle of its ball."""
    width, height = size
    radius = kind.parts[number % len(kind.parts)] * height if kind.parts else None
    radius = radius or rng.uniform(*kind.radii)
    image = wall(rng, number, size, recorded)
    margin = min(radius, height / 2 - 2) + 1
    u = rng.uniform(margin, width - margin)
    v = rng.uniform(margin, height - margin) if height > 2 * margin else height / 2
    colour = np.array(kind.colours[number % len(kind.colours)], float) * rng.uniform(0.9, 1.1)
    if hue:
        colour = np.clip(rotate_hue(colour[None], hue)[0], 5, 250)
    narrow = rng.uniform(*kind.narrow) if kind.narrow else 1.0
    motion = rng.uniform(*kind.motion) * radius if kind.motion else 0.0
    gloss = rng.uniform(*kind.gloss) if kind.gloss else 0.0
    light = rng.normal(0, 0.5), -abs(rng.normal(0.4, 0.4)), rng.uniform(0.3, 1)
    place = u, v, radius
    Ball(FOCAL * width, place, colour, gloss, narrow, motion, light).paint(rng, image)
    image = cv2.GaussianBlur(image, (0, 0), rng.uniform(0.5, 1.2))
    image += rng.uniform(1, 5) * rng.standard_normal(image.shape)
    return np.clip(image, 0, 255).astype(np.uint8), (u, v, radius * np.sqrt(narrow))


def write(folder, rng, kind, size, hue, recorded):
    """Writes the recording of a kind."""
    os.makedirs(folder)
    (width, height), focal = size, FOCAL * size[0]
    largest = max(kind.parts) * height if kind.parts else kind.radii[1]
    camera = CAMERA.format(
        width=width,
        height=height,
        focal=focal,
        middle=((width - 1) / 2, (height - 1) / 2),
        diameter=max(0.06, 2 * largest * NEAREST / focal),
        hue=float(hue),
    )
    lists = {"camera.toml": camera, "rgb.txt": "", "depth.txt": "", "truth.csv": ""}
    for number in range(kind.pictures):
        image, circle = draw(rng, kind, number, size, hue, recorded)
        quality = [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(60, 95))]
        cv2.imwrite(f"{folder}/{number}.jpg", image[..., ::-1], quality)
        lists["rgb.txt"] += f"{number}.0 {number}.jpg\n"
        lists["truth.csv"] += f"{number}.0,{circle[0]},{circle[1]},{circle[2]}\n"
    for name, text in lists.items():
        with open(f"{folder}/{name}", "w", encoding="utf-8") as file:
            file.write(text)


def main():
    out, seed, *folders = sys.argv[1:]
    paths = [colour for folder in folders for colour, _ in paired(folder)]
    recorded = [read_picture(path, cv2.IMREAD_COLOR)[..., ::-1] for path in paths]
    for number, (name, kind) in enumerate(KINDS.items()):
        for place, size in enumerate(kind.sizes):
            for hue in kind.hues:
                rng = np.random.default_rng([int(seed), number, place, hue])
                write(f"{out}/{name}-{size[0]}-{hue}", rng, kind, size, hue, recorded)


if __name__ == "__main__":
    main()
