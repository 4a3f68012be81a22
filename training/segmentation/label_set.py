# SPDX-License-Identifier: BSD-3-Clause
"""The classes the network tells apart, their groupings, and what the labels of each dataset say about them.

The network has the 19 Cityscapes classes. A dataset whose labels are coarser (a tree may be vegetation or terrain)
or know only people still teaches them: each of its labels stands for a set of classes, and the loss asks for the
probability of the set (losses.py). Label images are therefore stored as numbers of sets: 0 to 18 are the classes
themselves, further sets follow, and VOID means that nothing is known.
"""
import numpy as np

CLASSES = ("road", "sidewalk", "building", "wall", "fence", "pole", "traffic light", "traffic sign", "vegetation",
           "terrain", "sky", "person", "rider", "car", "truck", "bus", "train", "motorcycle", "bicycle")
VOID = 255

PERSON = (11, 12)
MOVABLE = tuple(range(11, 19))
STATIC = tuple(range(11))
NOT_PERSON = tuple(c for c in range(19) if c not in PERSON)

CITYSCAPES19 = {name: (c,) for c, name in enumerate(CLASSES)}

GROUPS8 = {"flat": (0, 1), "building": (2, 3, 4), "pole": (5, 6, 7), "nature": (8, 9), "sky": (10,), "person": (11, 12),
           "car": (13, 14, 15, 16, 17), "bicycle": (18,)}

CAMVID11 = {"sky": (10,), "building": (2, 3), "pole": (5,), "road": (0,), "pavement": (1,), "tree": (8, 9),
            "sign": (6, 7), "fence": (4,), "car": (13, 14, 15, 16), "pedestrian": (11,), "bicyclist": (12, 17, 18)}

PERSON1 = {"other": NOT_PERSON, "person": PERSON}

# COCO's numbers of what may move; everything else it knows is static.
COCO = {0: PERSON, 1: (18,), 2: (13,), 3: (17,), 5: (15,), 6: (16,), 7: (14,)}

SETS = [(c,) for c in range(19)]
for group in (*CAMVID11.values(), *GROUPS8.values(), PERSON, NOT_PERSON, STATIC):
    if group not in SETS:
        SETS.append(group)


def set_number(classes):
    return SETS.index(tuple(classes))


def membership():
    """Sets x classes, 1 where the class is in the set."""
    table = np.zeros((len(SETS), len(CLASSES)), np.float32)
    for number, classes in enumerate(SETS):
        table[number, list(classes)] = 1
    return table


def lookup(mapping):
    """A table of 256 entries from a dataset's labels to numbers of sets; labels without an entry are VOID."""
    table = np.full(256, VOID, np.uint8)
    for label, classes in mapping.items():
        table[label] = set_number(classes)
    return table


FROM_TRAIN_IDS = lookup({c: (c,) for c in range(19)})
FROM_CAMVID = lookup(dict(enumerate(CAMVID11.values())))
FROM_PERSON_MASK = lookup({0: NOT_PERSON, 255: PERSON})

# Cityscapes' own label ids (gtFine *_labelIds.png) to its 19 train ids.
CITYSCAPES_IDS = (7, 8, 11, 12, 13, 17, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 31, 32, 33)
FROM_CITYSCAPES_IDS = lookup({label: (c,) for c, label in enumerate(CITYSCAPES_IDS)})


def grouping(groups):
    """A table of 256 entries from classes to positions in a grouping (GROUPS8, CAMVID11, PERSON1); VOID elsewhere."""
    table = np.full(256, VOID, np.uint8)
    for position, classes in enumerate(groups.values()):
        table[list(classes)] = position
    return table
