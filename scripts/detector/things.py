"""Things in a scene: balls, and red things that are no balls."""

import numpy as np

from drawing import HEIGHT, WIDTH, BallDisc, depth_at, line, noise, paint, polygon, shape
from light import rotate_hue, to_linear
from surfaces import albedo


class Lamp:
    """The light on a round thing."""

    def __init__(self, rng):
        side = [rng.normal(0, 0.7), -abs(rng.normal(0.7, 0.4)), -abs(rng.normal(0.5, 0.4)) - 0.05]
        self.way = np.array(side) / np.linalg.norm(side)
        half = self.way + [0, 0, -1]
        self.half = half / np.linalg.norm(half)
        self.ambient, self.diffuse = rng.uniform(0.12, 0.7), rng.uniform(0.3, 1.3)
        self.gloss, self.sharpness = rng.choice([0, rng.uniform(0, 0.6)]), rng.uniform(15, 120)
        # Light that comes back from the floor or table below.
        self.bounce = rng.uniform(0, 0.4)

    def on(self, u, v):
        """Returns the light and the glint on a unit sphere at (`u`, `v`)."""
        w = np.sqrt(np.clip(1 - u**2 - v**2, 0, 1))
        facing = np.clip(u * self.way[0] + v * self.way[1] - w * self.way[2], 0, 1)
        shade = self.ambient * (1 - 0.3 * v) + self.diffuse * facing
        mirrored = np.clip(u * self.half[0] + v * self.half[1] - w * self.half[2], 0, 1)
        return shade + self.bounce * np.clip(v, 0, 1), self.gloss * mirrored**self.sharpness


def any_lamp(rng):
    """Returns a light on a ball of any material: dull, glossy, or lit from the camera."""
    lamp = Lamp(rng)
    kind = rng.integers(4)
    if kind == 0:  # dull, in even light
        lamp.ambient, lamp.diffuse, lamp.gloss = rng.uniform(0.3, 0.8), rng.uniform(0.1, 0.6), 0
    elif kind == 1:  # glossy
        lamp.gloss = rng.uniform(0.2, 1.5)
        lamp.sharpness = np.exp(rng.uniform(np.log(15), np.log(400)))
    elif kind == 2:  # a light beside the camera
        way = np.array([rng.normal(0, 0.25), rng.normal(-0.1, 0.25), -1])
        lamp.way = way / np.linalg.norm(way)
        lamp.ambient, lamp.diffuse = rng.uniform(0.1, 0.5), rng.uniform(0.4, 1.1)
    return lamp


class Surface:
    """The colour of a ball of any material, clean or worn: dirt, and lines as of a seam."""

    def __init__(self, rng, size):
        self.dirt = self.normal = None
        if rng.random() < 0.5:
            scale = rng.uniform(0.1, 0.8) * size + 1
            self.dirt = np.exp(rng.uniform(0.03, 0.25) * noise(rng, scale, scale))
        if rng.random() < 0.15:
            way = rng.normal(0, 1, 3)
            self.normal, self.offset = way / np.linalg.norm(way), rng.uniform(-0.5, 0.5)
            self.width, self.paint = rng.uniform(0.02, 0.07), rng.uniform(0.4, 1.6)

    def on(self, u, v, window):
        """Returns the factor of the colour at (`u`, `v`) on a unit sphere, whose picture is in the
        rows and columns of `window`."""
        factor = np.ones_like(u) if self.dirt is None else self.dirt[window]
        if self.normal is not None:
            w = np.sqrt(np.clip(1 - u**2 - v**2, 0, 1))
            along = u * self.normal[0] + v * self.normal[1] + w * self.normal[2]
            factor = np.where(abs(along - self.offset) < self.width, self.paint, factor)
        return factor


class Squeeze:
    """A ball that is seen narrower in one direction than in the other, as a rolling shutter, a
    short motion or a push shows it; its area stays."""

    def __init__(self, rng, narrow):
        turn, self.stretch = rng.uniform(0, np.pi), np.sqrt(narrow)
        self.cosine, self.sine = np.cos(turn), np.sin(turn)

    def on(self, u, v):
        """Returns the places on the round ball of places on the squeezed one."""
        along = (u * self.cosine + v * self.sine) / self.stretch
        across = (v * self.cosine - u * self.sine) * self.stretch
        return along * self.cosine - across * self.sine, along * self.sine + across * self.cosine


def free_depth(rng, depth, x, y, size):
    """Returns a distance on or before what is at a place."""
    known = depth_at(depth, x, y, size / 2)
    behind = np.median(known) if len(known) else rng.uniform(0.5, 2)
    return behind * (rng.uniform(0.6, 1.0) if rng.random() < 0.6 else 1.0)


def red_thing(rng, light, depth, x, y, size):
    """Draws a coloured thing that is no ball: flat, a cylinder, soft, or a lump."""
    kind = rng.integers(6)
    if kind >= 4:
        lump(rng, light, depth, x, y, size)
        return
    mask = shape(rng, x, y, size)
    if rng.random() < 0.2:  # a flat disc: on paper, a sign, a lid
        angles = np.linspace(0, 2 * np.pi, 48)
        mask = polygon(np.stack([np.cos(angles), np.sin(angles)], -1) * size + [x, y])
    distance = np.full((HEIGHT, WIDTH), free_depth(rng, depth, x, y, size), np.float32)
    colour = albedo(rng, 0.85)[None, None]
    rows, columns = np.mgrid[0:HEIGHT, 0:WIDTH]
    turn = rng.uniform(0, 2 * np.pi)
    u = ((columns - x) * np.cos(turn) + (rows - y) * np.sin(turn)) / size
    if kind == 0:  # cylinder
        bulge = np.sqrt(np.clip(1 - u**2, 0, 1))
        colour = colour * (rng.uniform(0.15, 0.6) + bulge * rng.uniform(0.3, 1.0))[..., None]
        distance -= 0.05 * bulge
    elif kind == 1:  # shaded evenly
        colour = colour * np.clip(1 + rng.uniform(-0.6, 0.6) * u, 0.2, 2)[..., None]
    elif kind == 2:  # textured
        pattern = noise(rng, *rng.uniform(1.5, 15, 2))
        colour = colour * np.exp(rng.uniform(0.1, 0.6) * pattern)[..., None]
    paint(light, depth, mask, colour.astype(np.float32), distance)
    if rng.random() < 0.3:  # print on it
        end = (x + size, y + rng.normal(0, size))
        band = mask * line((x - size, y), end, rng.uniform(0.1, 0.7) * size)
        paint(light, depth, band, albedo(rng, 0.2)[None, None], depth.copy())


def lump(rng, light, depth, x, y, size):
    """Draws a rounded thing that is no sphere, or has a pattern: a cushion, fruit, a toy."""
    pattern = rng.random() < 0.5
    flat = rng.uniform(0.45, 0.95 if pattern else 0.84)
    turn = rng.normal(0, 0.4) if rng.random() < 0.6 else rng.uniform(0, np.pi)
    body = Ellipsoid(x, y, size, flat, turn)
    shade, glint = Lamp(rng).on(body.u, body.v)
    colour, other = albedo(rng, 0.9)[None, None], albedo(rng, 0.5)[None, None]
    if pattern:
        scale = rng.uniform(0.2, 1.0) * size
        blush = np.clip(noise(rng, scale, scale) + rng.uniform(-0.5, 0.8), 0, 1)[..., None]
        colour = colour * (1 - blush) + other * blush
    body.paint(rng, light, depth, colour * shade[..., None] + glint[..., None])


def fruit(rng, light, depth, x, y, size):
    """Draws a nearly round fruit of the ball's colour and another one."""
    body = Ellipsoid(x, y, size, rng.uniform(0.75, 1.0), rng.normal(0, 0.4))
    shade, glint = Lamp(rng).on(body.u, body.v)
    colour = ball_colour(rng)
    other = np.clip(rotate_hue(colour[None], rng.uniform(25, 110))[0], 0.01, 1)
    scale = rng.uniform(0.3, 1.2) * size
    blush = np.clip(rng.uniform(1, 3) * noise(rng, scale, scale) + rng.uniform(0, 1), 0, 1)
    mixed = colour * (1 - blush[..., None]) + rng.uniform(0.7, 1.6) * other * blush[..., None]
    body.paint(rng, light, depth, mixed * shade[..., None] + glint[..., None])


def look_alike(rng, light, depth, x, y, size, colours=None):
    """Draws a round thing that is no ball: an evenly lit disc, a round cushion, or a head. It may
    have one of the ball's `colours`."""
    kind = rng.integers(3)
    narrowest = [0.85, 0.8, 0.75][kind]
    body = Ellipsoid(x, y, size, rng.uniform(narrowest, 1.0), rng.uniform(0, np.pi))
    colour = (colours or ball_colour)(rng) if rng.random() < 0.6 else albedo(rng, 0.9)
    out = np.hypot(body.u, body.v)
    turn = rng.uniform(0, 2 * np.pi)
    even = 1 + rng.uniform(0, 0.25) * (np.cos(turn) * body.u + np.sin(turn) * body.v)
    if kind == 0:  # a sign, a lid, print on paper; some have a rim
        drawn = even[..., None] * colour * rng.uniform(0.3, 1.2)
        if rng.random() < 0.3:
            rim = (out > rng.uniform(0.75, 0.95))[..., None]
            drawn = np.where(rim, albedo(rng, 0.3), drawn)
    elif kind == 1:  # darker at the seam, with folds
        scale = rng.uniform(0.2, 0.8) * size
        fold = np.exp(rng.uniform(0.08, 0.4) * noise(rng, scale, scale))
        seam = 1 - rng.uniform(0, 0.5) * np.clip(out, 0, 1) ** rng.uniform(3, 10)
        drawn = (even * fold * seam)[..., None] * colour * rng.uniform(0.3, 1.2)
    else:
        shade, _ = Lamp(rng).on(body.u, body.v)
        fur = np.exp(rng.uniform(0.1, 0.5) * noise(rng, *rng.uniform(1.2, 5, 2)))
        drawn = (shade * fur)[..., None] * albedo(rng, 0.95)
        for _ in range(rng.integers(0, 4)):  # eyes, a nose, a muzzle
            place = rng.normal(0, 0.4, 2)
            spot = np.hypot(body.u - place[0], body.v - place[1]) < rng.uniform(0.08, 0.35)
            drawn = np.where(spot[..., None], shade[..., None] * albedo(rng, 0.3), drawn)
    body.paint(rng, light, depth, drawn)


def dull_thing(rng, light, depth, x, y, size):
    """Draws a round thing that is no ball, in a colour of any ball."""
    look_alike(rng, light, depth, x, y, size, any_ball_colour)


def hole(rng, light, depth, x, y, size):
    """Draws a dark round hole, a castor or a knob: black to brown, even or with a rim."""
    body = Ellipsoid(x, y, size, rng.uniform(0.8, 1.0), rng.uniform(0, np.pi))
    colour = albedo(rng, 0.6) * rng.uniform(0.02, 0.3)
    out = np.hypot(body.u, body.v)
    drawn = (1 + rng.uniform(-0.4, 0.4) * body.v)[..., None] * colour
    if rng.random() < 0.5:
        drawn = np.where((out > rng.uniform(0.6, 0.9))[..., None], albedo(rng, 0.4), drawn)
    body.paint(rng, light, depth, drawn)


def figure(rng, light, depth, x, y, size):
    """Draws a brown figure of round parts, of fur or clay: a body and a head on it."""
    brown = np.array([1.0, rng.uniform(0.15, 0.6), rng.uniform(0.03, 0.35)])
    brown = brown * rng.uniform(0.03, 0.45)
    coarse, rough = rng.uniform(1.2, 5), rng.uniform(0.03, 0.4)
    fur = np.exp(rough * noise(rng, coarse, coarse))[..., None]
    lamp, lean = Lamp(rng), rng.normal(0, 0.15)
    head = size * rng.uniform(0.5, 1.0)
    way = rng.uniform(0.75, 1.0) * (size + head)
    parts = [(x, y, size), (x + lean * way, y - way, head)]
    for px, py, part in parts if rng.random() < 0.8 else parts[:1]:
        body = Ellipsoid(px, py, part, rng.uniform(0.8, 1.0), rng.normal(0, 0.4))
        shade, _ = lamp.on(body.u, body.v)
        body.paint(rng, light, depth, brown * fur * shade[..., None])


class Ellipsoid:
    """A rounded thing, `size` pixels long and `flat` times as wide. `u` and `v` are the places on
    it of each pixel of the picture, -1 to 1 along and across."""

    def __init__(self, x, y, size, flat, turn):
        rows, columns = np.mgrid[0:HEIGHT, 0:WIDTH]
        across = np.array([np.cos(turn), np.sin(turn)])
        down = np.array([-np.sin(turn), np.cos(turn)])
        angles = np.linspace(0, 2 * np.pi, 48)
        ring = np.cos(angles)[:, None] * across + flat * np.sin(angles)[:, None] * down
        self.place, self.mask = (x, y, size), polygon(ring * size + [x, y])
        self.u = ((columns - x) * across[0] + (rows - y) * across[1]) / size
        self.v = ((columns - x) * down[0] + (rows - y) * down[1]) / (flat * size)

    def paint(self, rng, light, depth, drawn):
        """Paints it with the light `drawn`."""
        bulge = 0.03 * np.sqrt(np.clip(1 - self.u**2 - self.v**2, 0, 1))
        distance = free_depth(rng, depth, *self.place) - bulge
        paint(light, depth, self.mask, drawn.astype(np.float32), distance)


def sphere(rng, light, depth, place, radius, colour, blur=0.0, lamp=None, surface=None, narrow=1.0):
    """Draws a ball of `radius` metres at `place`: (column, row, pixels, metres to its centre). It
    has a `lamp` and a `surface`, and is `narrow` times as wide as long."""
    x, y, size, distance = place
    disc = BallDisc(x, y, size, size * distance / radius)
    squeeze = Squeeze(rng, narrow) if narrow < 1 else None
    reach = int(disc.reach() / np.sqrt(narrow) + blur / 2 + 3)
    left, right = max(0, int(x) - reach), min(WIDTH, int(x) + reach + 1)
    top, bottom = max(0, int(y) - reach), min(HEIGHT, int(y) + reach + 1)
    if right - left < 2 or bottom - top < 2:
        return
    window = slice(top, bottom), slice(left, right)
    samples, lamp = 3 if size < 12 else 2, lamp or Lamp(rng)
    taps = np.linspace(-blur / 2, blur / 2, 7 if size < 36 else 15) if blur > 0 else [0.0]
    turn = rng.uniform(0, np.pi)
    total = np.zeros((bottom - top, right - left, 3), np.float32)
    cover = np.zeros((bottom - top, right - left), np.float32)
    steps = (np.arange(samples) + 0.5) / samples - 0.5
    for tap in taps:
        for dy in steps:
            for dx in steps:
                columns = (np.arange(left, right) + dx - tap * np.cos(turn))[None]
                rows = (np.arange(top, bottom) + dy - tap * np.sin(turn))[:, None]
                u, v = disc.on(columns, rows)
                u, v = squeeze.on(u, v) if squeeze else (u, v)
                hit = u**2 + v**2 < 1
                shade, glint = lamp.on(u, v)
                if surface:
                    shade = shade * surface.on(u + 0 * v, v + 0 * u, window)
                total += hit[..., None] * (colour * shade[..., None] + glint[..., None])
                cover += hit
    count = len(taps) * samples**2
    here = light[top:bottom, left:right]
    here *= 1 - cover[..., None] / count
    here += total / count
    rows, columns = np.mgrid[top:bottom, left:right]
    u, v = disc.on(columns, rows)
    u, v = squeeze.on(u, v) if squeeze else (u, v)
    square = 1 - u**2 - v**2
    here = depth[top:bottom, left:right]
    here[:] = np.where(square > 0, distance - radius * np.sqrt(np.clip(square, 0, 1)), here)


def any_ball_colour(rng):
    """Returns a red of balls (linear light), from a bright one to a dark, dull one: the sRGB colour
    (60, 35, 38) is among them, and a pale one."""
    red = np.exp(rng.uniform(np.log(55), np.log(250)))
    pale = rng.uniform(0.06, 0.64)
    others = np.clip(pale + rng.normal(0, 0.05, 2), 0.02, 0.7)
    return to_linear(np.array([1.0, *others]) * red / 255).astype(np.float32)


def ball_colour(rng):
    """Returns a red of balls (linear light)."""
    red = rng.uniform(0.25, 0.85)
    colour = red * np.array([1.0, rng.uniform(0.01, 0.2), rng.uniform(0.01, 0.2)])
    return np.maximum(colour, 0.004).astype(np.float32)
