# SPDX-License-Identifier: BSD-3-Clause
"""Reads what is known about pictures: each dataset gives pairs of an RGB picture and an image of label sets
(label_set.py), held in memory as bytes.

A data folder is laid out as
  segmentation/{cityscapes256,camvid,people,drone_people}/{train,val}/{images,labels}   cutouts/   backgrounds/
  segmentation/coco128/{images,labels}
and Cityscapes may also lie in its official layout (leftImg8bit/, gtFine/).
"""
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np

from training.segmentation import label_set

HOLD_BACK_EVERY = 5  # of sets without a validation split, every fifth picture is held back


class DataError(Exception):
    """A dataset that is missing or malformed; the message names the file and the remedy."""


@dataclass
class LabelledPictures:
    """name, and for each picture RGB bytes (H, W, 3) and label set numbers (H, W)."""

    name: str
    pictures: list = field(default_factory=list)
    labels: list = field(default_factory=list)

    def __len__(self):
        return len(self.pictures)

    def __getitem__(self, index):
        return self.pictures[index], self.labels[index]


def read_picture(file):
    picture = cv2.imread(str(file), cv2.IMREAD_COLOR)
    if picture is None:
        raise DataError(f"{file}: missing or not a picture; check the data folder")
    return cv2.cvtColor(picture, cv2.COLOR_BGR2RGB)


def read_labels(file, table):
    labels = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
    if labels is None or labels.ndim != 2 or labels.dtype != np.uint8:
        raise DataError(f"{file}: missing or not an 8-bit grey PNG of labels; check the data folder")
    return table[labels]


def files_in(folder, pattern="*"):
    files = sorted(p for p in Path(folder).glob(pattern) if p.is_file())
    if not files:
        raise DataError(f"{folder}: no files; give --data the folder that holds the datasets")
    return files


def read_pairs(name, pairs, table, limit_side=0):
    """limit_side: pictures larger than this are shrunk to it, to save memory; 0 = as they are."""
    data = LabelledPictures(name)
    for picture_file, label_file in pairs:
        picture, labels = read_picture(picture_file), read_labels(label_file, table)
        if picture.shape[:2] != labels.shape:
            raise DataError(f"{label_file}: its size differs from that of {picture_file}")
        side = max(labels.shape)
        if limit_side and side > limit_side:
            size = tuple(round(s * limit_side / side) for s in labels.shape[::-1])
            picture = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
            labels = cv2.resize(labels, size, interpolation=cv2.INTER_NEAREST)
        data.pictures.append(picture)
        data.labels.append(labels)
    return data


def pairs_in(folder):
    """Pictures and labels of the same stem in images/ and labels/."""
    return [(p, Path(folder) / "labels" / f"{p.stem}.png") for p in files_in(Path(folder) / "images")]


def held_back(items, is_validation):
    return [x for i, x in enumerate(items) if (i % HOLD_BACK_EVERY == HOLD_BACK_EVERY - 1) == is_validation]


def cityscapes256(data, split):
    return read_pairs("cityscapes256", pairs_in(Path(data) / "segmentation/cityscapes256" / split),
                      label_set.FROM_TRAIN_IDS)


def cityscapes(folder, split):
    """The official layout: leftImg8bit/SPLIT/CITY/*_leftImg8bit.png and gtFine/SPLIT/CITY/*_gtFine_labelIds.png."""
    pictures = files_in(Path(folder) / "leftImg8bit" / split, "*/*_leftImg8bit.png")
    pairs = [(p, Path(folder) / "gtFine" / split / p.parent.name
              / p.name.replace("_leftImg8bit.png", "_gtFine_labelIds.png")) for p in pictures]
    return read_pairs("cityscapes", pairs, label_set.FROM_CITYSCAPES_IDS, 1024)


def camvid(data, split):
    return read_pairs("camvid", pairs_in(Path(data) / "segmentation/camvid" / split), label_set.FROM_CAMVID)


def people(data, split):
    pairs = held_back(pairs_in(Path(data) / "segmentation/people/train"), split == "val")
    return read_pairs("people", pairs, label_set.FROM_PERSON_MASK)


def drone_people(data, split):
    return read_pairs("drone_people", pairs_in(Path(data) / "segmentation/drone_people" / split),
                      label_set.FROM_PERSON_MASK)


def coco_outlines(data):
    """For each picture of COCO128: the picture and a list of (COCO's number of the class, polygon in pixels)."""
    folder = Path(data) / "segmentation/coco128"
    for file in files_in(folder / "images"):
        picture = read_picture(file)
        size = picture.shape[1::-1]
        outlines = folder / "labels" / f"{file.stem}.txt"
        lines = [line.split() for line in outlines.read_text().splitlines()] if outlines.exists() else []
        yield picture, [(int(number), np.round(np.array(points, np.float32).reshape(-1, 2) * size).astype(np.int32))
                        for number, *points in lines]


def coco128(data):
    """Polygons of things that may move over pictures of all kinds; the rest is static."""
    result = LabelledPictures("coco128")
    for picture, outlines in coco_outlines(data):
        labels = np.full(picture.shape[:2], label_set.set_number(label_set.STATIC), np.uint8)
        for number, polygon in outlines:
            if number in label_set.COCO:
                cv2.fillPoly(labels, [polygon], label_set.set_number(label_set.COCO[number]))
        result.pictures.append(picture)
        result.labels.append(labels)
    return result


def static_things(data, smallest=40):
    """Furniture, screens, cups and what else COCO128 has outlines of that does not move, cut out as cutouts() does
    people. smallest: pixels of both sides that a thing must have."""
    result = []
    for picture, outlines in coco_outlines(data):
        for number, polygon in outlines:
            x, y, width, height = cv2.boundingRect(polygon)
            if number in label_set.COCO or min(width, height) < smallest:
                continue
            mask = np.zeros(picture.shape[:2], np.uint8)
            cv2.fillPoly(mask, [polygon], 255)
            window = np.s_[y:y + height, x:x + width]
            result.append((picture[window].copy(), mask[window].copy()))
    return result


def cutouts(data, split):
    """People cut out of photographs: (RGB picture, mask 0 to 255), cropped to the person."""
    result = []
    for file in held_back(files_in(Path(data) / "cutouts", "*_mask.png"), split == "val"):
        mask = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
        if mask is None:
            raise DataError(f"{file}: not a mask; check the data folder")
        picture = read_picture(file.with_name(file.name.replace("_mask.png", ".jpg")))
        rows, columns = np.where(mask > 127)
        if rows.size:
            window = np.s_[rows.min():rows.max() + 1, columns.min():columns.max() + 1]
            result.append((picture[window], mask[window]))
    return result


def rooms(data):
    """Rooms and house fronts without people. Cars may stand before the fronts: there only people are excluded."""
    result = LabelledPictures("rooms")
    for file in files_in(Path(data) / "backgrounds/houses"):
        picture = read_picture(file)
        known = label_set.NOT_PERSON if "frontal" in file.stem else label_set.STATIC
        result.pictures.append(picture)
        result.labels.append(np.full(picture.shape[:2], label_set.set_number(known), np.uint8))
    return result
