# SPDX-License-Identifier: BSD-3-Clause
"""What a network costs: weights, multiply-adds, and processor time in OpenCV on one core."""
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np
import torch
from torch import nn

from training.segmentation import export, networks


def multiply_adds(network, size):
    """Of the convolutions, for one picture of (height, width)."""
    total = 0

    def count(layer, _, output):
        nonlocal total
        if isinstance(layer, nn.ConvTranspose2d):  # each output pixel of stride = kernel sees one input pixel
            total += output.numel() * layer.in_channels
        else:
            total += output.numel() * (layer.weight.numel() // layer.out_channels)

    hooks = [m.register_forward_hook(count) for m in network.modules() if isinstance(m, (nn.Conv2d, nn.ConvTranspose2d))]
    with torch.no_grad():
        network.eval()(torch.zeros(1, 3, *size))
    for hook in hooks:
        hook.remove()
    return total


def milliseconds(file, size, runs=30):
    """Least and median processor time of OpenCV for one picture, on one core. The least is the figure to trust on a
    busy machine."""
    cv2.setNumThreads(1)
    runner = cv2.dnn.readNetFromONNX(str(file))
    picture = np.random.default_rng(1).random((1, 3, *size), np.float32)
    times = []
    for _ in range(runs):
        start = time.process_time()
        runner.setInput(picture)
        runner.forward()
        times.append(1000 * (time.process_time() - start))
    return min(times), float(np.median(times))


def measure(network, size):
    """{"parameters", "multiply_adds", "milliseconds"} of a network at (height, width)."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "network.onnx"
        export.export(network, file, size)
        least, _ = milliseconds(file, size)
    return {"parameters": networks.parameters_in_inference(network), "multiply_adds": multiply_adds(network, size),
            "milliseconds": round(least, 1)}
