# SPDX-License-Identifier: BSD-3-Clause
"""Outlines of things that move, by class of the auxiliary descriptor: the shapes that holes have."""
import cv2
import numpy as np

from training.restoration.networks import CLASSES
from training.segmentation import datasets, label_set

SMALLEST_SIDE = 24  # pixels an outline must have, so that its shape is one
LABELS = {"car": (13, 14, 15, 16), "bicycle": (12, 17, 18)}  # train ids; riders sit on what they ride
ASPECTS = {"cityscapes256": 2, "camvid": 1}  # of sets with such labels: by which their pictures are to be stretched
COCO = {"car": (2, 5, 6, 7), "bicycle": (1, 3)}


def silhouettes(folder, split, sets):
    """For each of CLASSES a list of 8-bit masks, 255 inside, cropped to the outline. People are cutouts, cars and
    bicycles what the datasets label as such and is whole in its picture; what is unknown may have any shape. sets:
    labelled pictures of the split, of which those in ASPECTS are used."""
    result = {"person": [mask for _, mask in datasets.cutouts(folder, split)], "car": [], "bicycle": []}
    for name, classes in LABELS.items():
        # A label may stand for several train ids (CamVid's do): it is of the class if all of them are.
        numbers = [n for n, members in enumerate(label_set.SETS) if set(members) <= set(classes)]
        for data in (s for s in sets if s.name in ASPECTS):
            for labels in data.labels:
                result[name] += outlines(np.isin(labels, numbers), ASPECTS[data.name])
    if split == "train":
        for picture, polygons in datasets.coco_outlines(folder):
            for number, polygon in polygons:
                for name in (name for name, numbers in COCO.items() if number in numbers):
                    mask = np.zeros(picture.shape[:2], np.uint8)
                    cv2.fillPoly(mask, [polygon], 1)
                    result[name] += outlines(mask > 0, 1)
    result["unknown"] = result["person"] + result["car"] + result["bicycle"]
    for name in CLASSES:
        if not result[name]:
            raise datasets.DataError(f"{folder}: no outline of the class {name}; check the data folder")
    return result


def outlines(mask, aspect):
    """Connected parts of a mask that do not touch the border, large enough and without holes of their own. aspect: by
    which their pictures are stretched to be as they were."""
    count, parts, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    result = []
    for part in range(1, count):
        x, y, width, height, area = stats[part]
        inside = 0 < x and 0 < y and x + width < mask.shape[1] and y + height < mask.shape[0]
        if not inside or min(width * aspect, height) < SMALLEST_SIDE or area < 0.3 * width * height:
            continue
        shape = (parts[y:y + height, x:x + width] == part).astype(np.uint8) * 255
        shape = cv2.resize(shape, (width * aspect, height), interpolation=cv2.INTER_LINEAR)
        contours, _ = cv2.findContours((shape > 127).astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        result.append(cv2.drawContours(np.zeros_like(shape), contours, -1, 255, cv2.FILLED))
    return result


def place(rng, shape, share, side, margin=4):
    """A hole of about the given share of a side x side picture, in the form of the shape, somewhere in it; what would be
    cut off is at most a third. Returns (hole, square), booleans: the square of eq. 12 has the side max(height, width)
    of the hole and its centre."""
    scale = np.sqrt(share * side * side / max(np.count_nonzero(shape), 1))
    size = [max(round(s * scale), 3) for s in shape.shape[::-1]]
    mask = cv2.resize(shape, size, interpolation=cv2.INTER_AREA) > 127
    if rng.random() < 0.5:
        mask = mask[:, ::-1]
    height, width = mask.shape
    x = int(rng.integers(-width // 3, side - width + width // 3 + 1)) if width < side else (side - width) // 2
    y = int(rng.integers(-height // 3, side - height + height // 3 + 1)) if height < side else (side - height) // 2
    hole = np.zeros((side, side), np.uint8)
    left, top, right, bottom = max(x, 0), max(y, 0), min(x + width, side), min(y + height, side)
    hole[top:bottom, left:right] = mask[top - y:bottom - y, left - x:right - x]
    hole = cv2.dilate(hole, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (margin + 1, margin + 1)))
    return hole > 0, square_around(hole > 0)


def square_around(hole):
    square = np.zeros_like(hole)
    rows, columns = np.where(hole)
    if rows.size:
        length = max(np.ptp(rows), np.ptp(columns)) + 1
        top = (rows.min() + rows.max() + 1 - length) // 2
        left = (columns.min() + columns.max() + 1 - length) // 2
        square[max(top, 0):top + length, max(left, 0):left + length] = True
    return square
