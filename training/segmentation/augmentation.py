# SPDX-License-Identifier: BSD-3-Clause
"""Makes a training crop of a labelled picture: geometry, people pasted in, then what a flying camera does to it.

All randomness comes from the numpy Generator handed in. Pictures are RGB bytes; labels are label set numbers.
"""
from dataclasses import dataclass

import cv2
import numpy as np

from training.segmentation import clutter, label_set


@dataclass(frozen=True)
class AugmentationOptions:
    crop: int = 256  # pixels, side of the square crop
    zoom: tuple = (0.9, 2.0)  # size of the picture's shorter side in crops
    stretch: tuple = (0.85, 1.2)  # width against height
    roll: float = 8.0  # degrees to each side
    paste: float = 0.0  # probability that people are pasted in
    paste_up_to: int = 3  # people
    near: float = 0.5  # share of pasted people that are larger than the crop is high or cut by its border
    decoys: float = 0.0  # probability that things are pasted in that are no people, so that an edge makes no person
    things: float = 0.0  # probability that made-up things stand in front of everything
    hide: float = 0.35  # probability that something hides a part of a pasted person
    grey: float = 0.05  # probabilities of what the camera does
    blur: float = 0.3
    noise: float = 0.3
    compression: float = 0.2


def uniform(rng, low_high):
    return float(rng.uniform(*low_high))


def log_uniform(rng, low_high):
    return float(np.exp(rng.uniform(np.log(low_high[0]), np.log(low_high[1]))))


def crop(rng, picture, labels, options):
    """Scales, turns, mirrors and cuts out a square. What lies outside the picture is void."""
    side = options.crop
    height, width = labels.shape
    scale = side / min(height, width) * log_uniform(rng, options.zoom)
    aspect = np.sqrt(log_uniform(rng, options.stretch))
    scale_x, scale_y = scale * aspect, scale / aspect
    if scale < 0.6:  # shrink by areas first, or fine structure turns into noise
        size = (max(round(width * scale_x), 1), max(round(height * scale_y), 1))
        picture = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
        labels = cv2.resize(labels, size, interpolation=cv2.INTER_NEAREST)
        scale_x, scale_y = 1.0, 1.0
        height, width = labels.shape
    angle = np.deg2rad(rng.uniform(-options.roll, options.roll))
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    linear = turn @ np.diag([scale_x * (-1 if rng.random() < 0.5 else 1), scale_y])
    # The point of the picture that comes to lie in the centre of the crop: anywhere that leaves the crop filled.
    margin = (min(side / 2 / scale_x, width / 2), min(side / 2 / scale_y, height / 2))
    centre = np.array([rng.uniform(margin[0], width - margin[0]), rng.uniform(margin[1], height - margin[1])])
    matrix = np.hstack([linear, (side / 2 - linear @ centre)[:, None]])
    picture = cv2.warpAffine(picture, matrix, (side, side), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT_101)
    labels = cv2.warpAffine(labels, matrix, (side, side), flags=cv2.INTER_NEAREST, borderValue=label_set.VOID)
    return picture, labels


def visible_part(rng, shape, options):
    """1 where a pasted person may be seen, 0 where furniture, cars or walls would hide it."""
    visible = np.ones(shape, np.float32)
    if rng.random() < options.hide:
        height, width = shape
        if rng.random() < 0.6:  # something in front of the legs, with a slanted upper edge
            left, right = rng.uniform(0.4, 1.0, 2) * height
            cv2.fillPoly(visible, [np.int32([(0, left), (width, right), (width, height), (0, height)])], 0)
        else:
            x, y = rng.uniform(0, width), rng.uniform(0, height)
            size = rng.uniform(0.1, 0.5, 2) * (width, height)
            cv2.rectangle(visible, np.int32((x, y)).tolist(), np.int32((x + size[0], y + size[1])).tolist(), 0, -1)
    return visible


def paste_cutout(rng, picture, labels, person, mask, label, options):
    """Puts a cut-out person, or what else it is, into the crop (in place), near or far, lit as may be, perhaps partly
    hidden. label: set number of what it is."""
    side = labels.shape[0]
    is_near = rng.random() < options.near
    height = side * log_uniform(rng, (0.7, 3.0) if is_near else (0.12, 0.8))
    scale = height / person.shape[0]
    if is_near:
        x = rng.uniform(-0.1, 1.1) * side
        y = rng.uniform(-0.35, 0.35) * (height - side) + side / 2
    else:
        x, y = rng.uniform(0, 1) * side, rng.uniform(0.3, 0.8) * side
    mirror = -1 if rng.random() < 0.5 else 1
    angle = np.deg2rad(rng.uniform(-8, 8))
    width = scale * log_uniform(rng, (0.85, 1.2))
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]) @ np.diag([width * mirror, scale])
    matrix = np.hstack([turn, (np.array([x, y]) - turn @ np.array(mask.shape[::-1]) / 2)[:, None]])
    interpolation = cv2.INTER_AREA if scale < 0.5 else cv2.INTER_LINEAR
    if scale < 0.5:
        small = (max(round(mask.shape[1] * scale), 1), max(round(mask.shape[0] * scale), 1))
        person, mask = (cv2.resize(p, small, interpolation=interpolation) for p in (person, mask))
        matrix[:, :2] /= scale
    drawn = cv2.warpAffine(person, matrix, (side, side), flags=cv2.INTER_LINEAR)
    alpha = cv2.warpAffine(mask, matrix, (side, side), flags=cv2.INTER_LINEAR).astype(np.float32) / 255
    alpha *= visible_part(rng, alpha.shape, options)
    inside = alpha > 0.5
    if rng.random() < 0.7:
        alpha = cv2.GaussianBlur(alpha, (3, 3), 0)
    if not inside.any():
        return
    rows, columns = np.where(alpha > 0)
    window = np.s_[rows.min():rows.max() + 1, columns.min():columns.max() + 1]
    alpha = alpha[window][..., None]
    light = np.float32(uniform(rng, (0.55, 1.1)) * rng.uniform(0.92, 1.08, 3))
    behind = picture[window].astype(np.float32)
    picture[window] = np.clip(behind + (drawn[window] * light - behind) * alpha, 0, 255)
    labels[inside] = label


def decoy(rng, picture):
    """A piece of a picture in the shape of a box, a slanted box, an ellipse or a blob, as a cutout."""
    height, width = picture.shape[:2]
    rows, columns = (max(int(side * rng.uniform(0.3, 0.9)), 8) for side in (height, width))
    top, left = rng.integers(height - rows + 1), rng.integers(width - columns + 1)
    mask = np.zeros((rows, columns), np.uint8)
    shape = rng.integers(3)
    if shape == 0:
        mask[:] = 255
    elif shape == 1:
        cv2.ellipse(mask, (columns // 2, rows // 2), (columns // 2, rows // 2), 0, 0, 360, 255, -1)
    else:
        angles = np.sort(rng.uniform(0, 2 * np.pi, int(rng.integers(4, 10))))
        radius = rng.uniform(0.5, 1.0, angles.size)
        outline = np.stack([(1 + radius * np.cos(angles)) * columns / 2, (1 + radius * np.sin(angles)) * rows / 2], 1)
        cv2.fillPoly(mask, [np.int32(outline)], 255)
    return picture[top:top + rows, left:left + columns], mask


def motion_blur(rng, picture):
    length = int(log_uniform(rng, (3, 25)))  # pixels: a camera that turns fast blurs over a tenth of the picture
    kernel = np.zeros((length, length), np.float32)
    angle = rng.uniform(0, np.pi)
    offset = np.array([np.cos(angle), np.sin(angle)]) * (length - 1) / 2
    centre = (length - 1) / 2
    cv2.line(kernel, np.int32(np.round(centre - offset)).tolist(), np.int32(np.round(centre + offset)).tolist(), 1)
    return cv2.filter2D(picture, -1, kernel / kernel.sum())


def camera(rng, picture, options):
    """Light, colour, focus, motion, noise and compression."""
    saturation = 0.0 if rng.random() < options.grey else rng.uniform(0.5, 1.5)
    gains = rng.uniform(0.6, 1.4) * rng.uniform(0.88, 1.12, 3)
    mix = (saturation * np.eye(3) + (1 - saturation) / 3) * gains
    picture = cv2.transform(picture, mix)
    mean = float(picture.mean())
    levels = np.clip((np.arange(256) - mean) * rng.uniform(0.7, 1.35) + mean + rng.uniform(-20, 20), 0, 255)
    if rng.random() < 0.3:
        levels = 255 * (levels / 255) ** log_uniform(rng, (0.6, 1.7))
    picture = cv2.LUT(picture, levels.astype(np.uint8))
    if rng.random() < options.blur:
        if rng.random() < 0.6:
            picture = motion_blur(rng, picture)
        else:
            picture = cv2.GaussianBlur(picture, (0, 0), rng.uniform(0.4, 1.8))
    if rng.random() < options.noise:
        noise = (rng.standard_normal(picture.shape[:2], np.float32) * np.float32(rng.uniform(2, 12))).astype(np.int16)
        picture = cv2.add(picture, cv2.merge([noise] * 3), dtype=cv2.CV_8U)
    if rng.random() < options.compression:
        quality = int(rng.integers(25, 90))
        picture = cv2.imdecode(cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])[1], cv2.IMREAD_COLOR)
    return picture


@dataclass(frozen=True)
class Decoys:
    """What is pasted in and is no person: pieces of pictures without anything movable, and cutouts of things."""

    pictures: list
    things: list

    def draw(self, rng):
        """A cutout; None where there is nothing to draw from."""
        sources = [s for s in (self.pictures, self.things) if s]
        if not sources:
            return None
        source = sources[rng.integers(len(sources))]
        drawn = source[rng.integers(len(source))]
        return decoy(rng, drawn) if source is self.pictures else drawn


def augment(rng, picture, labels, people, decoys, options):
    """A training crop: RGB bytes (crop, crop, 3) and label sets (crop, crop).

    people: cutouts to paste; decoys: Decoys."""
    picture, labels = crop(rng, picture, labels, options)
    pasted = []
    if rng.random() < options.decoys:
        static = label_set.set_number(label_set.STATIC)
        drawn = [decoys.draw(rng) for _ in range(int(rng.integers(1, 4)))]
        pasted += [(*d, static) for d in drawn if d is not None]
    if people and rng.random() < options.paste:
        count = int(rng.integers(1, options.paste_up_to + 1))
        pasted += [(*people[rng.integers(len(people))], label_set.PERSON[0]) for _ in range(count)]
    for number in rng.permutation(len(pasted)):
        paste_cutout(rng, picture, labels, *pasted[number], options)
    if rng.random() < options.things:
        for _ in range(int(rng.integers(1, 6))):
            labels[clutter.place(rng, picture, *clutter.thing(rng, options.crop))] = label_set.set_number(label_set.STATIC)
    return camera(rng, picture, options), labels
