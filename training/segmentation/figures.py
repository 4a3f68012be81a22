# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of training and of what came of it, in the manner of the paper's figures 5 and 6."""
import json
from pathlib import Path

import cv2
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from training.segmentation import datasets, evaluation, label_set
from training.segmentation.datasets import DataError

NAMES = {"cityscapes256": "Cityscapes at 256x256, mean of 8 groups", "cityscapes": "Cityscapes, mean of 8 groups",
         "camvid": "CamVid, mean of 11 classes", "people": "people", "drone_people": "people from a drone",
         "car": "car (Cityscapes)"}


def read_log(file):
    try:
        lines = Path(file).read_text().splitlines()
    except FileNotFoundError:
        raise DataError(f"{file}: no such log; give the folder of a training run") from None
    entries = []
    for number, line in enumerate(lines, 1):
        try:
            entries += [json.loads(line)] if line.strip() else []
        except json.JSONDecodeError:
            raise DataError(f"{file}: line {number} is damaged; remove it") from None
    return entries


def convergence(run, out):
    """Loss and validation scores over the steps of a run (figure 5)."""
    entries = read_log(Path(run) / "log.jsonl")
    losses = [(e["step"], e["loss"]) for e in entries if "loss" in e]
    scores = [e for e in entries if any(k.startswith("iou_") for k in e)]
    if not losses:
        raise DataError(f"{run}/log.jsonl: holds no losses yet")
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4), constrained_layout=True)
    steps, values = np.array(losses).T
    left.plot(steps, values, color="0.75", linewidth=0.8)
    width = max(len(values) // 40, 1)
    smooth = np.convolve(values, np.ones(width) / width, "valid")
    left.plot(steps[width - 1:], smooth, color="tab:blue")
    left.set(xlabel="step", ylabel="loss", title="Training loss")
    for name, title in NAMES.items():
        points = [(e["step"], e[f"iou_{name}"]) for e in scores if e.get(f"iou_{name}") is not None]
        if points:
            right.plot(*np.array(points).T, label=title, marker=".")
    right.set(xlabel="step", ylabel="intersection over union", title="On held-out pictures", ylim=(0, 1))
    right.legend(fontsize=8, loc="lower right")
    for axes in (left, right):
        axes.grid(alpha=0.3)
    figure.savefig(out, dpi=90)
    plt.close(figure)


COLOURS = np.array([  # RGB; as the program draws them
    (110, 90, 110), (190, 150, 190), (95, 95, 95), (100, 110, 120), (150, 120, 90), (160, 160, 160), (240, 190, 60),
    (230, 230, 60), (60, 150, 60), (150, 210, 130), (90, 180, 220), (235, 40, 50), (190, 30, 90), (30, 90, 230),
    (60, 60, 180), (0, 120, 200), (110, 40, 170), (170, 40, 230), (250, 140, 30)], np.float32)


def overlay(picture, labels):
    """Movable things strongly tinted, static ones faintly."""
    share = np.where(labels >= label_set.MOVABLE[0], 0.6, 0.35)[..., None]
    return (picture * (1 - share) + COLOURS[labels] * share).astype(np.uint8)


class OnnxNetwork:
    """An exported network, run by OpenCV."""

    def __init__(self, file):
        self.runner = cv2.dnn.readNetFromONNX(str(file))

    def labels(self, picture, side=evaluation.WORKING_SIDE):
        self.runner.setInput(evaluation.network_input(picture, side).numpy())
        scores = self.runner.forward()[0]
        planes = [cv2.resize(plane, picture.shape[1::-1], interpolation=cv2.INTER_LINEAR) for plane in scores]
        return np.argmax(np.stack(planes), 0).astype(np.uint8)


def side_by_side(models, pictures, out, height=180):
    """Rows of a picture and the labels of each model over it (figure 6). models: (title, ONNX file)."""
    networks = [(title, OnnxNetwork(file)) for title, file in models]
    rows = []
    for file in pictures:
        picture = datasets.read_picture(file)
        width = round(picture.shape[1] * height / picture.shape[0])
        panels = [picture] + [overlay(picture, network.labels(picture)) for _, network in networks]
        rows.append(np.hstack([cv2.resize(p, (width, height), interpolation=cv2.INTER_AREA) for p in panels]))
    width = max(r.shape[1] for r in rows)
    rows = [cv2.copyMakeBorder(r, 0, 4, 0, width - r.shape[1], cv2.BORDER_CONSTANT, value=(255, 255, 255)) for r in rows]
    title = np.full((26, width, 3), 255, np.uint8)
    step = width // (len(networks) + 1)
    for i, text in enumerate(["picture"] + [t for t, _ in networks]):
        cv2.putText(title, text, (i * step + 6, 18), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (0, 0, 0), 1, cv2.LINE_AA)
    cv2.imwrite(str(out), np.vstack([title, *rows])[..., ::-1])
