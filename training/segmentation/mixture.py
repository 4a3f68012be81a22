# SPDX-License-Identifier: BSD-3-Clause
"""What the network is trained and validated on: several datasets, each with a share of the samples."""
from dataclasses import dataclass

import numpy as np
from torch.utils import data

from training.segmentation import augmentation, datasets, label_set

CITYSCAPES_STRETCH = (0.9, 2.1)  # the 256x256 copy is squashed from 2:1, so anything from there to natural
TRAINING_PARTS = ("cityscapes256", "camvid", "people", "drone_people", "coco128", "rooms")


@dataclass(frozen=True)
class Share:
    """How often a dataset is drawn (relative), how it is stretched and how often people are pasted into it."""

    weight: float
    stretch: tuple = None
    paste: float = 0.0


SHARES = {
    "cityscapes256": Share(0.48, CITYSCAPES_STRETCH, 0.12),
    "cityscapes": Share(0.48, None, 0.12),
    "camvid": Share(0.17, None, 0.12),
    "people": Share(0.08),
    "drone_people": Share(0.07),
    "coco128": Share(0.06, None, 0.2),
    "rooms": Share(0.14, None, 0.9),
}


def training_sets(folder, official_cityscapes=None, only=()):
    """Everything to train on, and the people to paste. only: names to keep; empty = all."""
    readers = {name: lambda name=name: getattr(datasets, name)(folder, "train")
               for name in ("cityscapes256", "camvid", "people", "drone_people")}
    readers["coco128"] = lambda: datasets.coco128(folder)
    readers["rooms"] = lambda: datasets.rooms(folder)
    if official_cityscapes:
        del readers["cityscapes256"]
        readers["cityscapes"] = lambda: datasets.cityscapes(official_cityscapes, "train")
    sets = [read() for name, read in readers.items() if not only or name in only]
    return sets, datasets.cutouts(folder, "train")


class Mixture(data.Dataset):
    """Sample i is a function of (seed, i) alone, so that training may stop and go on anywhere, with any number of
    workers or processes, and see the same samples."""

    def __init__(self, sets, people, seed, options=augmentation.AugmentationOptions()):
        self.sets, self.people, self.seed, self.options = sets, people, seed, options
        weights = np.array([SHARES[s.name].weight for s in sets])
        self.probabilities = weights / weights.sum()

    def __len__(self):
        return 2 ** 40

    def __getitem__(self, index):
        rng = np.random.default_rng([self.seed, index])
        chosen = self.sets[rng.choice(len(self.sets), p=self.probabilities)]
        picture, labels = chosen[rng.integers(len(chosen))]
        share = SHARES[chosen.name]
        picture, labels = augmentation.augment(rng, picture, labels, self.people, self.options, share.stretch, share.paste)
        return np.ascontiguousarray(picture), labels


def set_shares(mixture, samples=400):
    """Share of each label set among the known pixels of a mixture, measured on its first samples: the alpha of eq. 1."""
    counts = np.zeros(256, np.int64)
    for index in range(samples):
        counts += np.bincount(mixture[index][1].ravel(), minlength=256)
    counts = counts[:len(label_set.SETS)]
    return counts / max(counts.sum(), 1)


def validation_sets(folder):
    """Pairs of a dataset and the grouping it is scored in."""
    return [(datasets.cityscapes256(folder, "val"), label_set.GROUPS8),
            (datasets.camvid(folder, "val"), label_set.CAMVID11),
            (datasets.people(folder, "val"), label_set.PERSON1),
            (datasets.drone_people(folder, "val"), label_set.PERSON1)]
