# SPDX-License-Identifier: BSD-3-Clause
"""Writes a trained generator as one complete ONNX file for each class of object."""
import copy
import os
import tempfile
from pathlib import Path

import torch
from torch import nn

from training.restoration.networks import CLASSES
from training.segmentation.export import check, write

SIDE = 256  # pixels


class OfOneClass(nn.Module):
    """The generator as the program runs it: N x 5 x H x W of RGB, hole and square in, N x 3 x H x W of RGB out."""

    def __init__(self, generator, kind):
        super().__init__()
        self.generator, self.kind = generator, kind

    def forward(self, seen):
        return self.generator(seen[:, :3], seen[:, 3:4], seen[:, 4:5], self.kind)


def file_name(name):
    return f"roslam-restorer-{name}.onnx"


def export(generator, folder, side=SIDE):
    """Writes a file for each of CLASSES, and none unless OpenCV paints with all of them what PyTorch does. The weights
    are rounded to half precision, as train.save_weights does. (OpenCV 4.6 reads no tensors of it: they are stored as
    full ones, which end in zeros and pack to half the size.) side: the only height and width the files run at."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    generator = copy.deepcopy(generator).to("cpu").half().float().eval()
    seen = example(side)
    with tempfile.TemporaryDirectory(dir=folder) as temporary, torch.no_grad():
        for kind, name in enumerate(CLASSES):
            network, file = OfOneClass(generator, kind).eval(), Path(temporary) / file_name(name)
            write(network, file, seen, "seen", "painted")
            check(network, file, seen)
        for name in CLASSES:
            os.replace(Path(temporary) / file_name(name), folder / file_name(name))


def example(side):
    """1 x 5 x side x side: noise with a hole, higher than wide, and its square."""
    seen = torch.zeros(1, 5, side, side)
    seen[:, :3] = torch.rand(1, 3, side, side, generator=torch.Generator().manual_seed(1))
    seen[:, 3, side // 4:side * 3 // 4, side * 3 // 8:side * 5 // 8] = 1
    seen[:, 4, side // 4:side * 3 // 4, side // 4:side * 3 // 4] = 1
    return seen
