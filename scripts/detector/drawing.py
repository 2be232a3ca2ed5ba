"""Masks, and how they are painted.

A picture is 320 x 240 pixels of linear light and depth. Everything that is drawn has its depth, so
that colour and depth agree.
"""

import cv2
import numpy as np

WIDTH, HEIGHT = 320, 240
# Column and row of the middle of a picture.
MIDDLE = (WIDTH - 1) / 2, (HEIGHT - 1) / 2

# Depths up to this count as unknown, metres: 0, and what is drawn nearer to the camera.
MIN_DEPTH = 0.1

cv2.setNumThreads(1)


def noise(rng, scale_x, scale_y):
    """Returns smooth noise of zero mean; a feature has about `scale_x` x `scale_y` pixels."""
    cells = rng.normal(0, 1, (int(HEIGHT / scale_y) + 3, int(WIDTH / scale_x) + 3))
    size = (int(cells.shape[1] * scale_x) + 1, int(cells.shape[0] * scale_y) + 1)
    smooth = cv2.resize(cells.astype(np.float32), size, interpolation=cv2.INTER_CUBIC)
    return smooth[:HEIGHT, :WIDTH]


def shape(rng, x, y, size, square=False):
    """Returns the mask (0 to 1) of a box, an ellipse, a flower or a polygon, `size` pixels wide
    from its middle."""
    kind = 0 if square else rng.integers(5)
    count = 40
    angles = np.linspace(0, 2 * np.pi, count, endpoint=False)
    stretch = rng.uniform(0.35, 1.0)
    if kind == 0:  # box
        points = np.array([[-1, -stretch], [1, -stretch], [1, stretch], [-1, stretch]])
    elif kind == 1:  # ellipse
        points = np.stack([np.cos(angles), min(stretch, 0.8) * np.sin(angles)], -1)
    elif kind == 2:  # flower
        radius = 1 + rng.uniform(0.1, 0.5) * np.cos(rng.integers(2, 8) * angles)
        points = np.stack([np.cos(angles), np.sin(angles)], -1) * radius[:, None] * 0.8
    elif kind == 3:  # cushion
        power = rng.uniform(0.2, 0.7)
        bulge = lambda k: np.sign(k) * abs(k) ** power
        points = np.stack([bulge(np.cos(angles)), stretch * bulge(np.sin(angles))], -1)
    else:  # polygon
        points = rng.normal(0, 0.6, (rng.integers(3, 7), 2))
        points = points[np.argsort(np.arctan2(points[:, 1], points[:, 0]))]
    turn = rng.uniform(0, 2 * np.pi)
    turned = points @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    return polygon(turned * size + [x, y])


def polygon(points):
    """Returns the antialiased mask (0 to 1) of a polygon."""
    mask = np.zeros((HEIGHT, WIDTH), np.uint8)
    points = np.clip(points * 16, -30000, 30000).astype(np.int32)
    cv2.fillPoly(mask, [points], 255, lineType=cv2.LINE_AA, shift=4)
    return mask.astype(np.float32) / 255


def line(start, end, width):
    """Returns the antialiased mask (0 to 1) of a line of `width` pixels."""
    (x, y), (u, v) = start, end
    length = max(np.hypot(u - x, v - y), 1e-6)
    across = np.array([-(v - y), u - x]) / length * width / 2
    ends = np.array([[x, y], [u, v]])
    return polygon(np.concatenate([ends + across, ends[::-1] - across]))


def paint(light, depth, mask, colour, distance):
    """Paints `colour` at `distance` where `mask` is set."""
    light += (colour - light) * mask[..., None]
    depth[:] = np.where(mask > 0.5, distance, depth)


class BallDisc:
    """The disc of a ball about column `x`, row `y`; a ball on the optical axis of a camera with
    the focal length `focal` (pixels) would have `size` pixels there. The axis meets the picture at
    the column and row `middle`.

    Off the axis a ball is seen as an ellipse. Places on the disc are to the right and down, in
    its radius; a row of them is a row of pixels.
    """

    def __init__(self, x, y, size, focal, middle=MIDDLE):
        self.x, self.y, self.size = x, y, size
        along, below = (x - middle[0]) / focal, (y - middle[1]) / focal
        self.down = np.sqrt(1 + below**2)
        self.shear = along * below / self.down
        self.right = np.sqrt(1 + along**2 - self.shear**2)

    def at(self, right, down):
        """Returns columns and rows of places on the disc."""
        column = self.x + self.size * (self.right * right + self.shear * down)
        return column, self.y + self.size * self.down * down

    def on(self, columns, rows):
        """Returns the places on the disc of columns and rows."""
        down = (rows - self.y) / (self.size * self.down)
        return ((columns - self.x) / self.size - self.shear * down) / self.right, down

    def reach(self):
        """Returns a distance, pixels, within which the border is from the middle."""
        return self.size * np.hypot(np.hypot(self.right, self.shear), self.down)


def depth_at(depth, x, y, reach):
    """Returns the known depths of a square about a place."""
    x, y, reach = int(x), int(y), max(1, int(reach))
    rows = slice(max(0, y - reach), max(0, y + reach + 1))
    part = depth[rows, max(0, x - reach) : max(0, x + reach + 1)]
    return part[part > MIN_DEPTH]
