# SPDX-License-Identifier: BSD-3-Clause
"""What the network is trained and validated on: several datasets, each with a share of the samples."""
import dataclasses
from dataclasses import dataclass, field

import numpy as np
from torch.utils import data

from training.segmentation import augmentation, datasets, label_set
from training.segmentation.clutter import Clutter

@dataclass(frozen=True)
class Share:
    """How often a dataset is drawn (relative), and what is done to it otherwise than by default."""

    weight: float
    changes: dict = field(default_factory=dict)


# The 256x256 copy of Cityscapes is squashed from 2:1, so it is stretched to anything from that to natural. What is seen
# indoors is seen from everywhere: close up, and with the camera turned about its axis.
SHARES = {
    "cityscapes256": Share(0.38, {"stretch": (0.9, 2.1), "paste": 0.12}),
    "cityscapes": Share(0.38, {"paste": 0.12}),
    "camvid": Share(0.17, {"paste": 0.12}),
    "people": Share(0.13, {"roll": 25.0, "things": 0.3}),
    "drone_people": Share(0.08),
    "coco128": Share(0.10, {"zoom": (0.9, 3.0), "roll": 30.0, "paste": 0.25, "decoys": 0.5, "things": 0.3}),
    "clutter": Share(0.16, {"zoom": (0.9, 2.5), "roll": 45.0, "paste": 0.3, "decoys": 0.4, "things": 0.6}),
    "rooms": Share(0.26, {"zoom": (0.9, 4.0), "roll": 45.0, "paste": 0.4, "decoys": 0.6, "things": 0.5}),
}


@dataclass(frozen=True)
class TrainingData:
    """What several runs may share: datasets to train on, people to paste into them, decoys that are none, and pairs
    of a dataset and a grouping to validate on."""

    sets: list
    people: list
    decoys: augmentation.Decoys
    validation: list = ()


def training_data(folder, official_cityscapes=None, only=()):
    """Reads it. only: names of datasets to train on; empty = all."""
    if unknown := set(only) - set(SHARES):
        raise ValueError(f"{', '.join(sorted(unknown))}: no such dataset; there are {', '.join(SHARES)}")
    readers = {name: lambda name=name: getattr(datasets, name)(folder, "train")
               for name in ("cityscapes256", "camvid", "people", "drone_people")}
    readers["coco128"] = lambda: datasets.coco128(folder)
    readers["rooms"] = lambda: datasets.rooms(folder)
    readers["clutter"] = Clutter
    if official_cityscapes:
        del readers["cityscapes256"]
        readers["cityscapes"] = lambda: datasets.cityscapes(official_cityscapes, "train")
    sets = [read() for name, read in readers.items() if not only or name in only]
    decoys = augmentation.Decoys(static_pictures(sets), datasets.static_things(folder))
    return TrainingData(sets, datasets.cutouts(folder, "train"), decoys, validation_sets(folder, official_cityscapes))


class Mixture(data.Dataset):
    """Sample i is a function of (seed, i) alone, so that training may stop and go on anywhere, with any number of
    workers or processes, and see the same samples."""

    def __init__(self, sets, people, decoys, seed, options=augmentation.AugmentationOptions()):
        self.sets, self.people, self.decoys, self.seed = sets, people, decoys, seed
        self.options = [dataclasses.replace(options, **SHARES[s.name].changes) for s in sets]
        weights = np.array([SHARES[s.name].weight for s in sets])
        self.probabilities = weights / weights.sum()

    def __len__(self):
        return 2 ** 40

    def __getitem__(self, index):
        rng = np.random.default_rng([self.seed, index])
        number = rng.choice(len(self.sets), p=self.probabilities)
        chosen = self.sets[number]
        picture, labels = chosen[rng.integers(len(chosen))]
        picture, labels = augmentation.augment(rng, picture, labels, self.people, self.decoys, self.options[number])
        return np.ascontiguousarray(picture), labels


def set_shares(mixture, samples=400):
    """Share of each label set among the known pixels of a mixture, measured on its first samples: the alpha of eq. 1."""
    counts = np.zeros(256, np.int64)
    for index in range(samples):
        counts += np.bincount(mixture[index][1].ravel(), minlength=256)
    counts = counts[:len(label_set.SETS)]
    return counts / max(counts.sum(), 1)


def static_pictures(sets):
    """The pictures known to show nothing that moves; before some house fronts stand cars."""
    static = label_set.set_number(label_set.STATIC)
    return [picture for s in sets if s.name == "rooms" for picture, labels in zip(s.pictures, s.labels)
            if (labels == static).all()]


def validation_sets(folder, official_cityscapes=None):
    """Pairs of a dataset and the grouping it is scored in."""
    streets = (datasets.cityscapes(official_cityscapes, "val") if official_cityscapes
               else datasets.cityscapes256(folder, "val"))
    return [(streets, label_set.GROUPS8),
            (datasets.camvid(folder, "val"), label_set.CAMVID11),
            (datasets.people(folder, "val"), label_set.PERSON1),
            (datasets.drone_people(folder, "val"), label_set.PERSON1)]
