"""Pictures with and without a ball, composed at random, for training the detector's networks."""

from typing import NamedTuple

import cv2
import numpy as np

from drawing import HEIGHT, MIN_DEPTH, WIDTH, BallDisc, depth_at, line, noise, paint, shape
from light import rotate_hue, to_srgb
from surfaces import albedo, background, reddish_background
from things import (
    Surface,
    any_ball_colour,
    any_lamp,
    ball_colour,
    dull_thing,
    figure,
    fruit,
    hole,
    look_alike,
    red_thing,
    sphere,
)

# Share of the rooms that are about as red as the ball.
REDDISH = 0.4
# Share of the pictures with depth.
WITH_DEPTH = 0.5
# Share of the pictures in which a ball is drawn, if a free place for it is found.
WITH_BALL = 0.8
# Share of the balls that are not red.
OTHER_HUE = 0.3
# Of balls of any material: share of those with a radius above that of other balls; of those that
# move; of those that are seen narrower in one direction.
LARGE, MOVING, NARROW = 0.2, 0.3, 0.12
# Radii of balls, pixels, and those of large ones, up to half the picture's height.
RADII, LARGE_RADII = (2.3, 36), (36, 115)
# Least difference of the channels (0 to 255) in the middle of a ball of any material: with less it
# has no colour, and counts neither as a ball nor as something else.
MIN_CHROMA = 12


class Kind(NamedTuple):
    """What a scene has beyond what every scene may have."""

    # Surfaces of the ball's own colour.
    camouflaged: bool = False
    # Fruit of the ball's colour and another one.
    fruit: bool = False
    # Poor light, darker balls, more that covers them, and other round things.
    difficult: bool = False
    # Brown figures of round parts.
    figures: bool = False
    # Something in front of most of the balls.
    covered: bool = False
    # Balls of any material and size, and other round things of their colours.
    materials: bool = False


def scatter(rng, light, depth, draw, counts, sizes):
    """Draws one of the numbers `counts` of things, each of `sizes` (least and most) pixels."""
    for _ in range(rng.choice(counts)):
        size = np.exp(rng.uniform(np.log(sizes[0]), np.log(sizes[1])))
        draw(rng, light, depth, rng.uniform(0, WIDTH), rng.uniform(0, HEIGHT), size)


class Scene:
    """A picture for training.

    `colour` (sRGB, 8 bits), `hue` (degrees: the ball's), `depth` (metres, 0 where unknown), `focal`
    (pixels), `radius` (of the ball, metres), and `ball`: (column, row, radius in pixels, visible
    part), or None.
    """

    def __init__(self, rng, frames, kind=Kind()):
        self.difficult = kind.difficult
        self.covered = 0.9 if kind.covered else 0.45 if kind.difficult else 0.35
        self.focal = rng.uniform(190, 380)
        self.radius = rng.uniform(0.015, 0.05)
        self.ball = None
        self.materials = kind.materials
        self.radii = RADII
        if kind.materials and rng.random() < LARGE:
            self.radii, self.radius = LARGE_RADII, rng.uniform(0.06, 0.15)
        self.has_depth = rng.random() < WITH_DEPTH
        # The scene is composed for a red ball, and then its hues are turned.
        self.hue = rng.uniform(0, 360) if rng.random() < OTHER_HUE else 0.0
        self.own_colour = ball_colour(rng) if kind.camouflaged else None
        if kind.camouflaged or rng.random() < REDDISH:
            light, depth = reddish_background(rng, frames, self.own_colour)
        else:
            light, depth = background(rng, frames)
        scatter(rng, light, depth, red_thing, [0, 1, 2, 4, 7], (3, 40))
        if kind.fruit:
            scatter(rng, light, depth, fruit, [2, 4], (3, 36))
        if kind.difficult:
            scatter(rng, light, depth, look_alike, [0, 1, 2], (3, 36))
        if kind.figures:
            scatter(rng, light, depth, figure, [1, 2, 4], (4, 36))
        if kind.materials:
            scatter(rng, light, depth, dull_thing, [0, 1, 2, 3], (3, self.radii[1]))
            scatter(rng, light, depth, hole, [0, 1, 2], (3, 40))
        if self.has_depth and rng.random() < 0.3:
            self._wrong_ball(rng, light, depth)
        if rng.random() < 0.3:
            self._other_colour(rng, light, depth)
        if rng.random() < WITH_BALL:
            self._ball(rng, light, depth)
        self._expose(rng, light, depth)

    def _place(self, rng, depth, radius):
        """Returns a free place (column, row, pixels, metres) for a ball; None if none is found."""
        for _ in range(30):
            size = np.exp(rng.uniform(*np.log(self.radii)))
            distance = self.focal * radius / size
            if not 0.2 < distance < 3.2:
                continue
            x, y = rng.uniform(-2, WIDTH + 1), rng.uniform(-2, HEIGHT + 1)
            known = depth_at(depth, x, y, size)
            if len(known) == 0 or np.quantile(known, 0.1) > distance + 0.3 * radius:
                return x, y, size, distance
        return None

    def _wrong_ball(self, rng, light, depth):
        """Draws a ball of the ball's colour and of another size."""
        radius = self.radius * rng.choice([rng.uniform(0.3, 0.7), rng.uniform(1.45, 3)])
        place = self._place(rng, depth, radius)
        if place:
            sphere(rng, light, depth, place, radius, ball_colour(rng))

    def _other_colour(self, rng, light, depth):
        """Draws a ball of another colour."""
        radius = self.radius * rng.uniform(0.5, 2)
        place = self._place(rng, depth, radius)
        colour = np.clip(rotate_hue(ball_colour(rng)[None], rng.uniform(40, 320))[0], 0.005, 1)
        if rng.random() < 0.4:
            colour = albedo(rng, 0.0)
        if place:
            sphere(rng, light, depth, place, radius, colour)

    def _ball(self, rng, light, depth):
        """Draws the ball, its cables and what covers it."""
        place = self._place(rng, depth, self.radius)
        if not place:
            return
        x, y, size, _ = place
        blur = rng.uniform(0.3, 1.0) * size if rng.random() < 0.2 else 0.0
        colour = ball_colour(rng) if self.own_colour is None else self.own_colour
        if self.difficult:
            colour = colour * rng.uniform(0.4, 1.0)
        if self.materials:
            self._ball_of_any_material(rng, light, depth, place)
        else:
            sphere(rng, light, depth, place, self.radius, colour, blur)
        for _ in range(rng.choice([0, 0, 3])):
            end = (x + rng.uniform(-150, 150), y - rng.uniform(60, 200))
            start = (x + rng.normal(0, 0.2) * size, y - 0.9 * size)
            cable = line(start, end, rng.uniform(0.3, 1.8)) * rng.uniform(0.4, 1)
            paint(light, depth, cable, albedo(rng, 0.2)[None, None], depth.copy())
        hidden = np.zeros((HEIGHT, WIDTH), np.float32)
        if rng.random() < self.covered:
            for _ in range(2 if self.difficult and rng.random() < 0.4 else 1):
                hidden = np.maximum(hidden, self._cover(rng, light, depth, place))
        rows, columns = np.mgrid[0:HEIGHT, 0:WIDTH]
        disc = BallDisc(x, y, size, self.focal)
        u, v = disc.on(columns, rows)
        area = np.pi * size**2 * disc.right * disc.down
        visible = ((u**2 + v**2 < 1) * (1 - hidden)).sum() / area
        self.ball = (x, y, size, float(min(1.0, visible)))

    def _ball_of_any_material(self, rng, light, depth, place):
        """Draws the ball, dull or glossy, clean or worn, at rest or moving."""
        size = place[2]
        blur = rng.uniform(0.2, 1.2) * size if rng.random() < MOVING else 0.0
        narrow = rng.uniform(0.74, 0.95) if rng.random() < NARROW else 1.0
        colour = any_ball_colour(rng) if self.own_colour is None else self.own_colour
        lamp, surface = any_lamp(rng), Surface(rng, size)
        sphere(rng, light, depth, place, self.radius, colour, blur, lamp, surface, narrow)

    def _has_colour(self, image):
        """Checks whether the middle of the ball in the picture (0 to 1) has a colour."""
        x, y, size, _ = self.ball
        rows = slice(max(0, int(y - size / 2)), max(0, int(y + size / 2)) + 1)
        part = image[rows, max(0, int(x - size / 2)) : max(0, int(x + size / 2)) + 1]
        return part.size > 0 and 255 * np.ptp(np.median(part, (0, 1))) >= MIN_CHROMA

    def _cover(self, rng, light, depth, place):
        """Draws a cable, a post or a corner in front of the ball; returns its mask."""
        x, y, size, distance = place
        turn, offset = rng.uniform(0, np.pi), rng.uniform(-0.9, 0.9) * size
        along = np.array([np.cos(turn), np.sin(turn)])
        across = np.array([-along[1], along[0]])
        kind = rng.integers(3)
        if kind < 2:
            width = size * (rng.uniform(0.05, 0.3) if kind == 0 else rng.uniform(0.3, 1.0))
            middle = np.array([x, y]) + across * offset
            reach = rng.choice([3 * size, 300])
            mask = line(middle - along * reach, middle + along * reach, max(width, 0.7))
        else:
            reach = rng.uniform(2, 6) * size
            middle = np.array([x, y]) + along * (rng.uniform(-0.1, 0.8) * size + reach)
            mask = shape(rng, *middle, reach, square=True)
        shade = np.exp(rng.uniform(0, 0.5) * noise(rng, 40, 40))[..., None]
        before = distance - rng.uniform(1.2, 8) * self.radius
        paint(light, depth, mask, albedo(rng, 0.3)[None, None] * shade, before)
        return mask

    def _expose(self, rng, light, depth):
        """Makes the camera's picture: light of any colour, exposure, blur, noise, JPEG."""
        gains = rng.uniform(0.75, 1.25, 3) if rng.random() < 0.7 else rng.uniform(0.5, 1.6, 3)
        dim, bright = rng.uniform(0.06, 0.8), rng.uniform(1.2, 3.0)
        often = [0.3, 0.5, 0.2] if self.difficult else [0.5, 0.3, 0.2]
        if self.materials:  # dark balls are dark in good light too
            often, dim = [0.7, 0.15, 0.15], max(dim, 0.3)
        exposure = rng.choice([1.0, dim, bright], p=often)
        lamps = np.exp(rng.uniform(0, 0.4) * noise(rng, 200, 200))[..., None]
        light = light * (gains * exposure).astype(np.float32) * lamps
        if rng.random() < 0.35:
            light = cv2.GaussianBlur(light, (0, 0), rng.uniform(0.4, 2.5))
        image = to_srgb(light).astype(np.float32)
        if rng.random() < 0.4:  # a camera with other saturation and contrast
            grey = image.mean(-1, keepdims=True)
            image = np.clip(grey + rng.uniform(0.6, 1.4) * (image - grey), 0, 1)
            image = image ** rng.uniform(0.75, 1.3)
        if self.hue:
            image = np.clip(rotate_hue(image, self.hue), 0, 1)
        often = [0.3, 0.3, 0.4] if self.difficult else [0.4, 0.4, 0.2]
        level = rng.choice([0.004, 0.012, rng.uniform(0.02, 0.08)], p=often)
        if self.materials and self.ball and not self._has_colour(image):
            self.ball = (*self.ball[:3], 0.0)
        image = image + level * rng.standard_normal(image.shape, np.float32)
        image = np.round(np.clip(image, 0, 1) * 255).astype(np.uint8)
        if rng.random() < 0.3:
            quality = [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(8, 80))]
            image = cv2.imdecode(cv2.imencode(".jpg", image, quality)[1], cv2.IMREAD_COLOR)
        self.colour = image
        self.depth = self._holes(rng, depth) if self.has_depth else np.zeros_like(depth)

    def _holes(self, rng, depth):
        """Returns depth as a sensor gives it: noisy, shifted, with holes."""
        error = 0.0015 * rng.standard_normal(depth.shape, np.float32) * depth**2
        depth = np.where(depth > MIN_DEPTH, depth + error, 0)
        edge = cv2.morphologyEx(depth.astype(np.float32), cv2.MORPH_GRADIENT, np.ones((3, 3)))
        depth[(edge > 0.03) & (rng.random(depth.shape) < rng.uniform(0, 0.9))] = 0
        kind = rng.random()
        if kind < 0.2:
            depth[rng.random(depth.shape) < rng.uniform(0.05, 0.6)] = 0
        elif kind < 0.45:
            scale = np.exp(rng.uniform(np.log(2), np.log(50)))
            depth[noise(rng, scale, scale) > rng.uniform(-0.2, 1.2)] = 0
        elif kind < 0.55 and self.ball:  # a glossy ball without depth on it
            x, y, size, _ = self.ball
            rows, columns = np.mgrid[0:HEIGHT, 0:WIDTH]
            depth[(columns - x) ** 2 + (rows - y) ** 2 < (rng.uniform(0.5, 1.2) * size) ** 2] = 0
        if rng.random() < 0.25:
            depth = np.roll(depth, rng.integers(-3, 4, 2), (0, 1))
        return depth.astype(np.float32)
