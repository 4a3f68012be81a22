# SPDX-License-Identifier: BSD-3-Clause
"""Writes a trained network as an ONNX file that OpenCV 4.5 and later, and ONNX Runtime, can run."""
import copy
import inspect
import os
from pathlib import Path

import cv2
import numpy as np
import torch
from torch import nn
from torch.nn.utils.fusion import fuse_conv_bn_eval

from training.segmentation.networks import SIZE_MULTIPLE

OPSET = 11  # the newest that OpenCV 4.6 reads in full
TOLERANCE = 1e-3  # largest difference of values between PyTorch and OpenCV, relative to the largest value


def folded(network):
    """A copy whose normalisations are part of the convolutions before them: fewer layers, the same scores."""
    network = copy.deepcopy(network).eval()
    for parent in list(network.modules()):
        if isinstance(parent, nn.Sequential) and len(parent) > 1 and isinstance(parent[1], nn.BatchNorm2d):
            parent[0] = fuse_conv_bn_eval(parent[0], parent[1])
            parent[1] = nn.Identity()
    return network


def export(network, file, size=(320, 416)):
    """Writes the network and checks that OpenCV computes the same scores. size: height and width the file is traced
    with; with a pyramid of any-size windows it runs at every multiple of SIZE_MULTIPLE all the same. (Sizes left open in
    the file would be more honest, but OpenCV 4.6 cannot read those.)"""
    file = Path(file)
    network = folded(network).to("cpu")
    picture = torch.rand(1, 3, *size, generator=torch.Generator().manual_seed(1))
    temporary = file.with_suffix(".tmp")
    with torch.no_grad():
        write(network, temporary, picture, "image", "scores")
        check(network, temporary, picture)
        if network.options.pyramid != "bins":
            check(network, temporary, picture[:, :, :SIZE_MULTIPLE * 2, :SIZE_MULTIPLE * 5])
    os.replace(temporary, file)


def write(network, file, example, input_name, output_name):
    """Writes what the network does with the example."""
    torch.onnx.export(network, example, str(file), opset_version=OPSET, input_names=[input_name],
                      output_names=[output_name], **classic_exporter())


def classic_exporter():
    """PyTorch 2.9 changed the default to an exporter that writes opsets OpenCV 4.6 cannot read."""
    return {"dynamo": False} if "dynamo" in inspect.signature(torch.onnx.export).parameters else {}


def check(network, file, example):
    runner = cv2.dnn.readNetFromONNX(str(file))
    runner.setInput(example.numpy())
    found, expected = runner.forward(), network(example).numpy()
    difference = np.abs(found - expected).max() / np.abs(expected).max()
    if not difference <= TOLERANCE:  # nor if the network gives no numbers
        raise RuntimeError(f"{file}: OpenCV's values differ from PyTorch's by {difference:.1e} of the largest")
