# SPDX-License-Identifier: BSD-3-Clause
"""Made-up pictures of table tops and shelves seen close up: a plain ground with sheets, boxes, screens, keyboards, cups
and cables at random. No dataset at hand shows such things, and a network that has never seen them takes them for
people, who are what else fills a picture taken indoors."""
import cv2
import numpy as np

from training.segmentation import label_set

SIDE = 320  # pixels
COUNT = 100_000  # different pictures


def colour(rng):
    """White and black things are as common as coloured ones."""
    kind = rng.integers(4)
    if kind == 0:
        return rng.integers(200, 256, 3)
    if kind == 1:
        return rng.integers(0, 50, 3)
    if kind == 2:
        return np.clip(rng.integers(30, 230) + rng.integers(-15, 16, 3), 0, 255)
    return rng.integers(0, 256, 3)


def shaded(rng, height, width, base):
    """A surface of one colour, lit from a side, with a little grain."""
    slope = rng.uniform(-0.35, 0.35, 2)
    light = 1 + slope[0] * np.linspace(-1, 1, height)[:, None] + slope[1] * np.linspace(-1, 1, width)[None]
    surface = light[..., None] * base + rng.normal(0, rng.uniform(0, 6), (height, width, 1))
    return np.clip(surface, 0, 255).astype(np.uint8)


def lines(rng, surface):
    """Print, the gaps of a keyboard, the grain of wood."""
    height, width = surface.shape[:2]
    pitch, ink = int(rng.integers(3, 14)), colour(rng).tolist()
    for y in range(int(rng.integers(2, 8)), height, pitch):
        cv2.line(surface, (int(rng.integers(0, width // 4 + 1)), y), (int(rng.integers(width // 2, width + 1)), y), ink, 1)
    if rng.random() < 0.4:
        for x in range(0, width, pitch):
            cv2.line(surface, (x, 0), (x, height), ink, 1)


def thing(rng, side):
    """(picture, mask) of one thing."""
    height, width = (int(v) for v in side * np.exp(rng.uniform(np.log(0.06), np.log(0.6), 2)) + 4)
    surface = shaded(rng, height, width, colour(rng))
    mask = np.full((height, width), 255, np.uint8)
    kind = rng.random()
    if kind < 0.35:
        lines(rng, surface)
    elif kind < 0.6:  # a screen, a drawer, a book: one surface within another
        edge = max(min(height, width) // int(rng.integers(6, 20)), 1)
        inner = surface[edge:height - edge, edge:width - edge]
        inner[:] = shaded(rng, *inner.shape[:2], colour(rng))
    elif kind < 0.8:
        mask[:] = 0
        cv2.ellipse(mask, (width // 2, height // 2), (width // 2, height // 2), 0, 0, 360, 255, -1)
    return surface, mask


def place(rng, picture, surface, mask):
    """Draws a thing anywhere, seen at a slant; returns where it lies, (side, side) booleans."""
    side = picture.shape[0]
    height, width = mask.shape
    corners = np.float32([(0, 0), (width, 0), (width, height), (0, height)])
    angle = rng.uniform(0, 2 * np.pi)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    slant = np.diag([1, rng.uniform(0.4, 1.0)])
    onto = (corners - corners.mean(0)) @ turn.T @ slant + rng.uniform(-0.1, 1.1, 2) * side
    onto += rng.uniform(-0.06, 0.06, onto.shape) * max(height, width)
    matrix = cv2.getPerspectiveTransform(corners, np.float32(onto))
    if rng.random() < 0.5:  # its shadow
        shadow = cv2.warpPerspective(mask, matrix, (side, side)).astype(np.float32) / 255
        shadow = cv2.GaussianBlur(np.roll(shadow, int(rng.integers(-8, 9)), int(rng.integers(2))), (0, 0), 5)
        picture[:] = picture * (1 - rng.uniform(0.1, 0.5) * shadow[..., None])
    drawn = cv2.warpPerspective(surface, matrix, (side, side))
    inside = cv2.warpPerspective(mask, matrix, (side, side), flags=cv2.INTER_NEAREST) > 0
    picture[inside] = drawn[inside]
    return inside


def cable(rng, picture):
    points = np.cumsum(rng.normal(0, picture.shape[0] / 8, (6, 2)), 0) + rng.uniform(0, picture.shape[0], 2)
    curve = cv2.approxPolyDP(np.int32(points)[:, None], 1, False)
    cv2.polylines(picture, [curve], False, colour(rng).tolist(), int(rng.integers(1, 5)), cv2.LINE_AA)


def clutter(rng, side):
    """RGB bytes (side, side, 3)."""
    picture = shaded(rng, side, side, colour(rng))
    if rng.random() < 0.3:
        lines(rng, picture)
    for _ in range(int(np.exp(rng.uniform(np.log(2), np.log(30))))):
        place(rng, picture, *thing(rng, side))
        if rng.random() < 0.1:
            cable(rng, picture)
    return picture


class Clutter:
    """A dataset of made-up pictures: each is a function of its number alone, and all of it is static."""

    name = "clutter"

    def __len__(self):
        return COUNT

    def __getitem__(self, index):
        picture = clutter(np.random.default_rng([1, index]), SIDE)
        return picture, np.full(picture.shape[:2], label_set.set_number(label_set.STATIC), np.uint8)
