"""Backgrounds: recorded pictures in other colours, and textures on planes."""

import cv2
import numpy as np

import drawing
from drawing import HEIGHT, WIDTH, noise


def albedo(rng, reddish):
    """Returns a random colour (linear light); `reddish` is the probability of red to brown."""
    if rng.random() < reddish:
        red = rng.uniform(0.04, 0.7)
        green = red * rng.choice([rng.uniform(0.02, 0.25), rng.uniform(0.2, 0.65)])
        return np.array([red, green, green * rng.uniform(0.4, 1.15)], np.float32)
    if rng.random() < 0.5:
        return (rng.uniform(0.02, 0.85) * rng.uniform(0.85, 1.0, 3)).astype(np.float32)
    return rng.uniform(0.02, 0.7, 3).astype(np.float32)


def wood(rng):
    """Returns how dark (0 to 1) the grain of wood is."""
    x, y = rng.uniform(20, 120), rng.uniform(1.2, 5)
    grain = noise(rng, *((x, y) if rng.random() < 0.5 else (y, x))) + noise(rng, 60, 60)
    return 0.5 + 0.5 * np.sin(rng.uniform(1, 6) * grain)


def tiles(rng):
    """Returns the joints (0 or 1) of tiles, boards or bricks."""
    a, b = rng.uniform(8, 70, 2)
    u, v = turned_grid(rng.uniform(0, np.pi))
    shift = (np.floor(v / b) % 2) * rng.uniform(0, 0.5) * a
    return ((np.mod(u + shift, a) < 2) | (np.mod(v, b) < 2)) * 1.0


def stripes(rng):
    """Returns stripes or checks (0 or 1)."""
    u, v = turned_grid(rng.uniform(0, np.pi))
    period = rng.uniform(6, 50)
    mixed = np.mod(u / period, 1) < rng.uniform(0.2, 0.8)
    if rng.random() < 0.4:
        mixed = mixed ^ (np.mod(v / period, 1) < 0.5)
    return mixed * 1.0


def spots(rng):
    """Returns round spots (0 or 1): a pattern of cloth or paper."""
    u, v = turned_grid(rng.uniform(0, np.pi))
    period = rng.uniform(8, 50)
    size = rng.uniform(0.15, 0.42) * period
    return (np.hypot(np.mod(u, period) - period / 2, np.mod(v, period) - period / 2) < size) * 1.0


def turned_grid(turn):
    """Returns columns and rows of all pixels, turned by `turn` radians."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float32)
    return x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)


def folds(rng):
    """Returns the brightness of a curtain's or cloth's folds, about 1."""
    narrow, long = rng.uniform(6, 30), rng.uniform(40, 250)
    scales = (narrow, long) if rng.random() < 0.7 else (narrow, narrow)
    return np.exp(rng.uniform(0.1, 0.5) * noise(rng, *scales))[..., None]


def duller(rng, own):
    """Returns the colour `own` (linear light) darker and mixed with grey."""
    grey = rng.uniform(0.0, 0.35)
    return (rng.uniform(0.15, 1.0) * (own * (1 - grey) + own.mean() * grey)).astype(np.float32)


def texture(rng, reddish, own=None):
    """Returns a picture (linear light) of wood, cloth, carpet, tiles, stripes or a wall.

    Its colours are about `own`, if that is given.
    """
    colour, other = albedo(rng, reddish)[None, None], albedo(rng, reddish)[None, None]
    if own is not None:
        colour = duller(rng, own)[None, None]
        other = duller(rng, own)[None, None] if rng.random() < 0.7 else other
    kind = rng.integers(8)
    if kind == 0:
        mixed, other = wood(rng), colour * rng.uniform(0.3, 0.8)
    elif kind == 1:  # patterned cloth
        mixed = (noise(rng, *rng.uniform(8, 40, 2)) > rng.uniform(0.3, 1.5)) * 1.0
    elif kind == 2:  # carpet
        mixed = 0.5 + 0.25 * noise(rng, 1.5, 1.5) + 0.3 * noise(rng, *rng.uniform(4, 30, 2))
    elif kind == 3:
        mixed = tiles(rng)
    elif kind == 4:
        mixed = stripes(rng)
    elif kind == 5:
        mixed = spots(rng)
    else:  # wall, curtain
        mixed = 0.15 * noise(rng, *rng.uniform(2, 40, 2))
    if kind in (1, 5, 6) and rng.random() < 0.6:
        cloth = folds(rng)
        colour, other = colour * cloth, other * cloth
    mixed = np.clip(np.asarray(mixed, np.float32), 0, 1)[..., None]
    grain = np.exp(rng.uniform(0, 0.12) * noise(rng, 1.0, 1.0))[..., None]
    shade = np.exp(rng.uniform(0, 0.5) * noise(rng, 150, 150))[..., None]
    return (colour * (1 - mixed) + other * mixed) * grain * shade


def plane(rng, near, far):
    """Returns the depth (metres) of a plane that is `near` to `far` metres away in the middle."""
    y, x = np.mgrid[-0.5 : 0.5 : HEIGHT * 1j, -0.5 : 0.5 : WIDTH * 1j]
    tilt = 1 + rng.normal(0, 0.35) * x + abs(rng.normal(0, 0.6)) * y
    inverse = tilt / rng.uniform(near, far)
    return (1 / np.maximum(inverse, 0.12)).astype(np.float32)


def background(rng, frames):
    """Returns linear light and depth of a picture without a ball."""
    if frames and rng.random() < 0.5:
        light, depth = frames[rng.integers(len(frames))]
        factor = rng.choice([1.0, 1.5, 2.0])
        width, height = int(WIDTH * factor), int(HEIGHT * factor)
        x = rng.integers(0, light.shape[1] - width + 1)
        y = rng.integers(0, light.shape[0] - height + 1)
        light, depth = (image[y : y + height, x : x + width] for image in (light, depth))
        light = cv2.resize(light, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)
        depth = cv2.resize(depth, (WIDTH, HEIGHT), interpolation=cv2.INTER_NEAREST)
        if rng.random() < 0.5:
            light, depth = light[:, ::-1].copy(), depth[:, ::-1].copy()
        return tinted(rng, light), depth * rng.uniform(0.7, 1.7)
    reddish = rng.choice([0.15, 0.5, 0.95])
    light, depth = texture(rng, reddish), plane(rng, 0.8, 3.5)
    for _ in range(rng.integers(0, 3)):  # a table, a curtain, a piece of furniture
        x, y = rng.uniform(0, WIDTH), rng.uniform(0, HEIGHT)
        mask = drawing.shape(rng, x, y, rng.uniform(60, 220), square=True)
        drawing.paint(light, depth, mask, texture(rng, reddish), plane(rng, 0.5, 2.0))
    return light, depth


def reddish_background(rng, frames, own=None):
    """Returns linear light and depth of a room whose walls, floor or cloth are about red, or of the
    colour `own`."""
    light, depth = background(rng, frames)
    for _ in range(rng.integers(1, 4)):
        x, y = rng.uniform(0, WIDTH), rng.uniform(0, HEIGHT)
        mask = drawing.shape(rng, x, y, rng.uniform(60, 260), square=rng.random() < 0.5)
        # A cloth or paint on what is there, or a thing before it.
        distance = depth.copy() if rng.random() < 0.6 else plane(rng, 0.5, 2.5)
        shade = 1.0
        if rng.random() < 0.5:
            shade = light.mean(-1, keepdims=True) / max(0.02, light.mean()) * rng.uniform(0.6, 1.2)
        drawing.paint(light, depth, mask, texture(rng, 0.95, own) * shade, distance)
    return light, depth


def tinted(rng, light):
    """Returns a picture in other colours: a reddish room, turned hues, or as it is."""
    kind = rng.random()
    if kind < 0.25:
        gains = [rng.uniform(0.9, 1.7), rng.uniform(0.35, 0.9), rng.uniform(0.3, 0.9)]
        return light * np.array(gains, np.float32)
    if kind < 0.4:
        return light[..., rng.permutation(3)]
    if kind < 0.5:
        grey = light.mean(-1, keepdims=True)
        gains = [rng.uniform(0.8, 1.2), rng.uniform(0.08, 0.45), rng.uniform(0.08, 0.45)]
        return grey * np.array(gains, np.float32)
    return light
