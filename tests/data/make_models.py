# SPDX-License-Identifier: BSD-3-Clause
"""Makes the small networks that tests use in place of trained ones; run from this folder.

colours.onnx        19 classes: red is person, green vegetation, blue sky, white car, black road; a quarter of the size
eleven.onnx         the same with 11 classes
nan.onnx            gives no numbers
grey.onnx           wants pictures of one channel
"""
import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper


def network(file, classes, channels=3, extra=0):
    """Averages 4x4 pixels, then scores each class by the colour."""
    weights = np.zeros((classes, channels, 1, 1), np.float32)
    bias = np.full(classes, -10, np.float32)
    wanted = {0: (-1, -1, -1), 8: (-1, 1, -1), 10: (-1, -1, 1), 11: (1, -1, -1), 13: (1, 1, 1)}
    for label, colour in wanted.items():
        if label < classes:
            weights[label, :, 0, 0] = 4 * np.array(colour)[:channels]
            bias[label] = -2 * sum(colour)
    bias += np.float32(extra)
    nodes = [helper.make_node("AveragePool", ["image"], ["coarse"], kernel_shape=[4, 4], strides=[4, 4]),
             helper.make_node("Conv", ["coarse", "weights", "bias"], ["scores"], kernel_shape=[1, 1])]
    graph = helper.make_graph(
        nodes, "colours",
        [helper.make_tensor_value_info("image", TensorProto.FLOAT, [1, channels, 288, 384])],
        [helper.make_tensor_value_info("scores", TensorProto.FLOAT, [1, classes, 72, 96])],
        [numpy_helper.from_array(weights, "weights"), numpy_helper.from_array(bias, "bias")])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 11)], producer_name="roslam-tests")
    model.ir_version = 6
    onnx.save(model, file)


network("colours.onnx", 19)
network("eleven.onnx", 11)
network("nan.onnx", 19, extra=np.nan)
network("grey.onnx", 19, 1)
