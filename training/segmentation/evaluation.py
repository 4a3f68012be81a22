# SPDX-License-Identifier: BSD-3-Clause
"""Labels pictures with a network exactly as the C++ program does, and scores the labels: intersection over union."""
import cv2
import numpy as np
import torch
from torch.nn import functional

from training.segmentation import label_set
from training.segmentation.networks import SIZE_MULTIPLE

WORKING_SIDE = 480  # pixels, longer side of the picture the network sees


def working_size(height, width, side=WORKING_SIDE):
    """Size of the picture the network sees: the longer side becomes `side`, both are multiples of SIZE_MULTIPLE."""
    scale = side / max(height, width)
    return tuple(max(SIZE_MULTIPLE, SIZE_MULTIPLE * int(s * scale / SIZE_MULTIPLE + 0.5)) for s in (height, width))


def network_input(picture, side=WORKING_SIDE):
    """RGB bytes (H, W, 3) to a 1 x 3 x h x w tensor from 0 to 1."""
    height, width = working_size(*picture.shape[:2], side)
    shrinks = height * width < picture.shape[0] * picture.shape[1]
    small = cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR)
    return torch.from_numpy(small).permute(2, 0, 1)[None].float() / 255


@torch.no_grad()
def predict(network, picture, side=WORKING_SIDE):
    """Class of each pixel, (H, W) bytes. The network must be in evaluation mode."""
    device = next(network.parameters()).device
    scores = network(network_input(picture, side).to(device).contiguous(memory_format=torch.channels_last)).float()
    full = functional.interpolate(scores, size=picture.shape[:2], mode="bilinear", align_corners=False)
    return full[0].argmax(0).to(torch.uint8).cpu().numpy()


def truth_table(groups):
    """A table of 256 entries from label set numbers to positions in a grouping; VOID where a set spans groups."""
    table = np.full(256, label_set.VOID, np.uint8)
    for number, classes in enumerate(label_set.SETS):
        for position, group in enumerate(groups.values()):
            if set(classes) <= set(group):
                table[number] = position
    return table


def confusion(truth, predicted, classes):
    """classes x classes counts of pixels, truth in rows. Truth outside 0..classes-1 is left out; a prediction outside
    is wrong for its true class."""
    known = truth < classes
    wrong = predicted >= classes
    index = truth[known].astype(np.int64) * (classes + 1) + np.where(wrong, classes, predicted)[known]
    return np.bincount(index, minlength=classes * (classes + 1)).reshape(classes, classes + 1)


def iou(counts):
    """Intersection over union of each class from confusion(); NaN for a class that neither truth nor labels have."""
    hits = np.diag(counts[:, :-1]).astype(float)
    union = counts.sum(1) + counts[:, :-1].sum(0) - hits
    return np.where(union > 0, hits / np.maximum(union, 1), np.nan)


def score(network, data, groups, side=WORKING_SIDE):
    """IoU and recall by class over a dataset: {"mean": .., "classes": {name: ..}, "recall": {name: ..}}."""
    was_training = network.training
    network.eval()
    classes = len(groups)
    from_sets, from_classes = truth_table(groups), label_set.grouping(groups)
    counts = np.zeros((classes, classes + 1), np.int64)
    for picture, labels in zip(data.pictures, data.labels):
        counts += confusion(from_sets[labels], from_classes[predict(network, picture, side)], classes)
    network.train(was_training)
    by_class = iou(counts)
    recall = np.diag(counts[:, :-1]) / np.maximum(counts.sum(1), 1)
    return {"mean": float(np.nanmean(by_class)),
            "classes": {n: None if np.isnan(v) else round(float(v), 4) for n, v in zip(groups, by_class)},
            "recall": {n: round(float(v), 4) for n, v in zip(groups, recall)}}


def score_all(network, validation):
    """IoU by the name of the dataset: of the person where only people are known, else the mean over the classes;
    that of cars in Cityscapes beside it."""
    result = {}
    for data_set, groups in validation:
        scored = score(network, data_set, groups)
        result[data_set.name] = scored["classes"]["person"] if groups is label_set.PERSON1 else scored["mean"]
        if groups is label_set.GROUPS8:
            result["car"] = scored["classes"]["car"]
    return result
