# SPDX-License-Identifier: BSD-3-Clause
"""What the generator is trained and measured on: pictures whose truth is known, with holes in the shape of what moves."""
from dataclasses import dataclass

import numpy as np
from torch.utils import data

from training.restoration.networks import CLASSES
from training.restoration.silhouettes import place, silhouettes
from training.segmentation import augmentation, datasets, label_set

# How often each set of pictures is drawn, and how its crops are made. The copy of Cityscapes is squashed from 2:1.
SHARES = {"cityscapes256": (0.5, {"stretch": (1.0, 2.0), "zoom": (1.0, 1.6)}),
          "camvid": (0.2, {"zoom": (1.0, 1.8)}),
          "rooms": (0.2, {"zoom": (1.0, 2.5)}),
          "coco128": (0.1, {"zoom": (1.0, 2.0)})}
KIND_SHARES = (0.4, 0.3, 0.2, 0.1)  # of CLASSES
HOLE_SHARES = (0.02, 0.35)  # of the picture
SECOND_HOLE = 0.3  # probability of a second, smaller hole: people come in groups


@dataclass(frozen=True)
class Sample:
    picture: np.ndarray  # H x W x 3 bytes, RGB
    hole: np.ndarray  # H x W booleans
    square: np.ndarray
    is_static: np.ndarray  # H x W: what is there does not move, so that it is what should be painted
    kind: int  # of CLASSES


def is_static(labels):
    """Where nothing is known, what is there is taken to stay."""
    static = np.ones(256, bool)
    for number, classes in enumerate(label_set.SETS):
        static[number] = not set(classes) <= set(label_set.MOVABLE)
    return static[labels]


class TrainingSamples(data.Dataset):
    """Sample i is a function of (seed, i) alone. All samples of a batch have one class, so that one encoder serves
    them."""

    def __init__(self, folder, seed, batch, side=256):
        readers = {"cityscapes256": lambda: datasets.cityscapes256(folder, "train"),
                   "camvid": lambda: datasets.camvid(folder, "train"),
                   "rooms": lambda: datasets.rooms(folder), "coco128": lambda: datasets.coco128(folder)}
        self.sets = [read() for read in readers.values()]
        self.shapes = silhouettes(folder, "train", self.sets)
        self.seed, self.batch, self.side = seed, batch, side
        weights = np.array([SHARES[s.name][0] for s in self.sets])
        self.probabilities = weights / weights.sum()

    def __len__(self):
        return 2 ** 40

    def __getitem__(self, index):
        kind = int(np.random.default_rng([self.seed, 1, index // self.batch]).choice(len(CLASSES), p=KIND_SHARES))
        rng = np.random.default_rng([self.seed, 0, index])
        chosen = self.sets[rng.choice(len(self.sets), p=self.probabilities)]
        picture, labels = chosen[rng.integers(len(chosen))]
        options = augmentation.AugmentationOptions(crop=self.side, **SHARES[chosen.name][1])
        picture, labels = augmentation.crop(rng, picture, labels, options)
        light = rng.uniform(0.95, 1.05, 3) * rng.uniform(0.8, 1.15)
        picture = np.clip(picture * light, 0, 255).astype(np.uint8)
        hole, square = self.hole(rng, CLASSES[kind])
        return (np.ascontiguousarray(picture), hole, square, is_static(labels), kind)

    def hole(self, rng, name):
        shapes = self.shapes[name]
        share = float(np.exp(rng.uniform(*np.log(HOLE_SHARES))))
        hole, square = place(rng, shapes[rng.integers(len(shapes))], share, self.side)
        if rng.random() < SECOND_HOLE:
            more, more_square = place(rng, shapes[rng.integers(len(shapes))], share * rng.uniform(0.1, 0.6), self.side)
            hole, square = hole | more, square | more_square
        return hole, square


def validation_samples(folder, count=250, seed=7):
    """Held-out streets as they are stored, with held-out silhouettes of people and cars that cover 10 to 30 %."""
    streets = datasets.cityscapes256(folder, "val")
    shapes = silhouettes(folder, "val", (streets, datasets.camvid(folder, "val")))
    result = []
    for i in range(min(count, len(streets))):
        rng = np.random.default_rng([seed, i])
        kind = i % 2  # person, car
        picture, labels = streets[i]
        while True:
            shape = shapes[CLASSES[kind]][rng.integers(len(shapes[CLASSES[kind]]))]
            hole, square = place(rng, shape, rng.uniform(0.1, 0.3), picture.shape[0])
            if 0.1 <= hole.mean() <= 0.3:
                break
        result.append(Sample(picture, hole, square, is_static(labels), kind))
    return result
