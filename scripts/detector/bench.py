"""Reads what the example `pictures` of plumb-bench writes."""

import json

import numpy as np

from inputs import Picture


def pictures(file):
    """Yields (header, picture) of each frame."""
    while line := file.readline():
        header = json.loads(line)
        size = header["height"], header["width"]
        count = size[0] * size[1]
        colour = np.frombuffer(file.read(3 * count), np.uint8).reshape(*size, 3)[..., ::-1]
        depth = np.frombuffer(file.read(2 * count), "<u2").reshape(size)
        # Without depth the scale is 0.
        metres = depth.astype(np.float32) / (header["depth_scale"] or 1)
        lens = (header[name] for name in ("focal", "ball_radius", "hue", "middle"))
        yield header, Picture(np.ascontiguousarray(colour), metres, *lens)


def true_ball(header):
    """Returns the ball of a frame: column, row, radius (pixels), visible part; zeros for none. All
    of a ball counts as visible: the bench covers at most half of it."""
    return (*header["ball"], 1.0) if header["ball"] else (0.0, 0.0, 0.0, 0.0)
