# SPDX-License-Identifier: BSD-3-Clause
"""PSPNet on a backbone of depthwise separable bottlenecks (paper, section 3.2 and table 2), and its variants.

Every variant is a `NetworkOptions`; `VARIANTS` names them in the order of the ablation, from the printed network to
the one that ships. Images are N x 3 x H x W, RGB from 0 to 1; scores are N x classes x H/4 x W/4 with the decoder and
N x classes x H/8 x W/8 without; sub-pixel scores double that.
"""
from dataclasses import dataclass, replace

import torch
from torch import nn
from torch.nn import functional

# What the sides of an image must be a multiple of, so that every level of the fixed pyramid fits.
SIZE_MULTIPLE = 32
# Means and deviations of the three channels over the training pictures; the network normalises for itself.
IMAGE_MEAN = (0.35, 0.37, 0.34)
IMAGE_DEVIATION = (0.25, 0.25, 0.25)


@dataclass(frozen=True)
class NetworkOptions:
    """What tells the variants apart; the defaults are the printed network."""

    classes: int = 19
    stem_width: int = 8  # channels of block 1
    stride4_width: int = 0  # channels of a separable convolution in place of block 2's pooling; 0 = pooling
    stride4_units: int = 0  # bottlenecks after it
    widths: tuple = (64, 128, 256)  # outer channels of blocks 3, 4, 5
    narrow: tuple = (16, 32, 64)  # inner channels of their bottlenecks
    units: tuple = (4, 8, 4)  # bottlenecks in each
    block5_stride: int = 32  # of the image; 8 is reached by dilation
    context_units: int = 0  # bottlenecks at twice block 5's stride, whose features are added to block 5's
    pyramid: str = "bins"  # "bins": 1, 2, 3, 6 cells a side as in PSPNet; "any-size": windows of fixed size; "none"
    pyramid_width: int = 64  # channels of each level
    head: str = "full"  # 3x3 convolution that joins the pyramid: "full" or "separable"
    head_width: int = 128
    decoder: bool = False  # joins features of strides 8 and 4
    refine_units: int = 0  # residual separable convolutions after each join of the decoder
    sub_pixel: bool = False  # 2x2 scores a cell: twice the resolution for the price of channels

    def validate(self):
        if self.block5_stride not in (8, 16, 32):
            raise ValueError("block5_stride must be 8, 16 or 32")
        if self.context_units and self.block5_stride == 32:
            raise ValueError("context_units need block5_stride 8 or 16")
        if self.pyramid not in ("bins", "any-size", "none"):
            raise ValueError("pyramid must be bins, any-size or none")
        if self.head not in ("full", "separable"):
            raise ValueError("head must be full or separable")


def variants():
    """The ladder from the printed network to the default, one change a step."""
    table2 = NetworkOptions()
    stride16 = replace(table2, block5_stride=16)
    separable = replace(stride16, head="separable")
    any_size = replace(separable, pyramid="any-size")
    stem = replace(any_size, stem_width=16, stride4_width=32)
    decoder = replace(stem, decoder=True)
    sub_pixel = replace(decoder, stride4_units=1, sub_pixel=True)
    wide = replace(sub_pixel, narrow=(32, 64, 128), head_width=96)
    context = replace(wide, context_units=4)
    refined = replace(context, refine_units=1)
    return {
        "table2": table2,
        "table2-plain-pool": replace(table2, pyramid="none"),
        "stride16": stride16,
        "separable-head": separable,
        "any-size-pyramid": any_size,
        "wide-stem": stem,
        "decoder": decoder,
        "sub-pixel": sub_pixel,
        "wide-bottlenecks": wide,
        "context": context,
        "roslam-pspnet": refined,
    }


def conv(inputs, outputs, kernel=1, stride=1, groups=1, dilation=1, relu=True):
    """Convolution, batch normalisation and, if wanted, ReLU; "same" padding."""
    padding = dilation * (kernel // 2)
    layers = [nn.Conv2d(inputs, outputs, kernel, stride, padding, dilation, groups, bias=False), nn.BatchNorm2d(outputs)]
    if relu:
        layers.append(nn.ReLU(inplace=True))
    return nn.Sequential(*layers)


def separable(inputs, outputs, stride=1, relu=True):
    """Depthwise 3x3, then pointwise."""
    return nn.Sequential(conv(inputs, inputs, 3, stride, groups=inputs, relu=False), conv(inputs, outputs, relu=relu))


class Bottleneck(nn.Module):
    """Depthwise, pointwise (narrow), depthwise, pointwise (wide): a bracket of table 2. The residual joins the wide
    ends where both have the same shape."""

    def __init__(self, inputs, narrow, outputs, stride=1, dilation=1):
        super().__init__()
        self.layers = nn.Sequential(
            conv(inputs, inputs, 3, stride, inputs, dilation, relu=False),
            conv(inputs, narrow),
            conv(narrow, narrow, 3, 1, narrow, dilation, relu=False),
            conv(narrow, outputs, relu=False),
        )
        self.has_residual = stride == 1 and inputs == outputs

    def forward(self, x):
        y = self.layers(x)
        return functional.relu(x + y if self.has_residual else y)


class Residual(nn.Module):
    """Adds to its input what layers make of it. At first that is nothing: a trained network that is given one goes on
    from where it was."""

    def __init__(self, layers):
        super().__init__()
        self.layers = layers
        last = [m for m in layers.modules() if isinstance(m, nn.BatchNorm2d)][-1]
        nn.init.zeros_(last.weight)

    def forward(self, x):
        return functional.relu(x + self.layers(x))


def context(width, units):
    """What surrounds each cell, seen at half the size."""
    return Residual(nn.Sequential(block(width, width, width, units, 2), conv(width, width, relu=False),
                                  nn.Upsample(scale_factor=2.0, mode="bilinear", align_corners=False)))


def refine(inputs, outputs, units):
    more = (Residual(separable(outputs, outputs, relu=False)) for _ in range(units))
    return nn.Sequential(*separable(inputs, outputs), *more)


def block(inputs, narrow, outputs, units, stride, dilation=1):
    first = Bottleneck(inputs, narrow, outputs, stride, dilation)
    return nn.Sequential(first, *(Bottleneck(outputs, narrow, outputs, 1, dilation) for _ in range(units - 1)))


class BinPyramid(nn.Module):
    """Pyramid pooling of PSPNet: the features averaged in 1, 2, 3 and 6 bins a side, narrowed and spread again.
    Bins are windows of one size that overlap where the size does not divide: this exports to ONNX, adaptive pooling
    does not."""

    BINS = (1, 2, 3, 6)

    def __init__(self, inputs, width):
        super().__init__()
        self.levels = nn.ModuleList(conv(inputs, width) for _ in self.BINS)
        self.outputs = inputs + width * len(self.BINS)

    def forward(self, x):
        height, width = int(x.shape[2]), int(x.shape[3])
        joined = [x]
        for bins, level in zip(self.BINS, self.levels):
            stride = (max(height // bins, 1), max(width // bins, 1))
            size = (max(height - (bins - 1) * stride[0], 1), max(width - (bins - 1) * stride[1], 1))
            pooled = level(functional.avg_pool2d(x, size, stride))
            joined.append(functional.interpolate(pooled, size=(height, width), mode="bilinear", align_corners=False))
        return torch.cat(joined, 1)


class AnySizePyramid(nn.Module):
    """Pyramid pooling whose windows have a fixed size in cells, beside the mean of all: one exported graph serves
    every image size, since nothing in it depends on the size."""

    WINDOWS = (1, 3, 5)  # pairs of cells a side

    def __init__(self, inputs, width):
        super().__init__()
        self.whole = conv(inputs, inputs)
        self.levels = nn.ModuleList(conv(inputs, width) for _ in self.WINDOWS)
        self.outputs = inputs + width * len(self.WINDOWS)

    def forward(self, x):
        joined = [x + self.whole(functional.adaptive_avg_pool2d(x, 1))]
        pairs = functional.avg_pool2d(x, 2)
        for window, level in zip(self.WINDOWS, self.levels):
            pooled = pairs if window == 1 else functional.avg_pool2d(pairs, window, 1, window // 2)
            joined.append(upsample(level(pooled), 2))
        return torch.cat(joined, 1)


class NoPyramid(nn.Module):
    """In place of the pyramid where its worth is measured."""

    def __init__(self, inputs, _):
        super().__init__()
        self.outputs = inputs

    def forward(self, x):
        return x


class SubPixelClassifier(nn.ConvTranspose2d):
    """2x2 scores for each cell: a transposed convolution, which exports for every size, computed in training as what
    it equals, a pointwise convolution whose channels are set side by side, which is several times faster there."""

    def __init__(self, inputs, classes):
        super().__init__(inputs, classes, 2, 2)

    def forward(self, x, output_size=None):
        if not self.training:
            return super().forward(x, output_size)
        weight = self.weight.permute(1, 2, 3, 0).reshape(-1, self.in_channels, 1, 1)
        return functional.pixel_shuffle(functional.conv2d(x, weight, self.bias.repeat_interleave(4)), 2)


class PSPNet(nn.Module):
    """The network. In training mode it returns (scores, scores of block 4, scores of block 5), the last two from
    auxiliary heads for deep supervision; in evaluation mode the scores alone."""

    PYRAMIDS = {"bins": BinPyramid, "any-size": AnySizePyramid, "none": NoPyramid}

    def __init__(self, options):
        super().__init__()
        options.validate()
        self.options = options
        w3, w4, w5 = options.widths
        n3, n4, n5 = options.narrow
        stem = options.stem_width
        self.block1 = conv(3, stem, 3, 2)
        if options.stride4_width:
            width = options.stride4_width
            self.block2 = nn.Sequential(separable(stem, width, 2),
                                        *(Bottleneck(width, width // 2, width) for _ in range(options.stride4_units)))
        else:
            self.block2 = nn.MaxPool2d(3, 2, 1)
        width4 = options.stride4_width or stem
        dilation = 2 if options.block5_stride == 8 else 1
        self.block3 = block(width4, n3, w3, options.units[0], 2)
        self.block4 = block(w3, n4, w4, options.units[1], 1)
        # Table 2 prints stride 32 after stride 8: the first two bottlenecks halve the size each.
        halvings = {8: 0, 16: 1, 32: 2}[options.block5_stride]
        self.block5 = nn.Sequential(
            *(Bottleneck(w4 if i == 0 else w5, n5, w5, 2 if i < halvings else 1, dilation)
              for i in range(options.units[2])))
        if options.context_units:
            self.block5.add_module("context", context(w5, options.context_units))
        self.pyramid = self.PYRAMIDS[options.pyramid](w5, options.pyramid_width)
        joined = self.pyramid.outputs
        if options.head == "full":
            self.head = conv(joined, options.head_width, 3)
        else:
            self.head = nn.Sequential(conv(joined, options.head_width), separable(options.head_width, options.head_width))
        if options.decoder:
            self.join8 = conv(w4, options.head_width, relu=False)
            self.refine8 = refine(options.head_width, options.head_width // 2, options.refine_units)
            self.join4 = conv(width4, options.head_width // 2, relu=False)
            self.refine4 = refine(options.head_width // 2, options.head_width // 2, options.refine_units)
        last = options.head_width // 2 if options.decoder else options.head_width
        if options.sub_pixel:
            self.classifier = SubPixelClassifier(last, options.classes)
        else:
            self.classifier = nn.Conv2d(last, options.classes, 1)
        self.auxiliary4 = nn.Sequential(separable(w4, 64), nn.Conv2d(64, options.classes, 1))
        self.auxiliary5 = nn.Sequential(separable(w5, 64), nn.Conv2d(64, options.classes, 1))
        self.register_buffer("mean", torch.tensor(IMAGE_MEAN).view(1, 3, 1, 1), persistent=False)
        self.register_buffer("deviation", torch.tensor(IMAGE_DEVIATION).view(1, 3, 1, 1), persistent=False)

    def forward(self, image):
        x4 = self.block2(self.block1((image - self.mean) / self.deviation))
        x8 = self.block4(self.block3(x4))
        x = self.block5(x8)
        y = self.head(self.pyramid(x))
        if self.options.decoder:
            y = self.refine8(functional.relu(self.join8(x8) + upsample(y, self.options.block5_stride // 8)))
            y = self.refine4(functional.relu(self.join4(x4) + upsample(y, 2)))
        else:
            y = upsample(y, self.options.block5_stride // 8)
        scores = self.classifier(y)
        if self.training:
            return scores, self.auxiliary4(x8), self.auxiliary5(x)
        return scores


def upsample(x, factor):
    if factor == 1:
        return x
    return functional.interpolate(x, scale_factor=float(factor), mode="bilinear", align_corners=False)


def load_matching(network, weights):
    """Takes over the weights that have a place of the same name and shape; returns how many did not."""
    mine = network.state_dict()
    taken = {name: w for name, w in weights.items() if name in mine and mine[name].shape == w.shape}
    network.load_state_dict(taken, strict=False)
    return len(mine) - len(taken)


def parameters_in_inference(network):
    """Number of weights that ship: all but the auxiliary heads'."""
    return sum(p.numel() for name, p in network.named_parameters() if not name.startswith("auxiliary"))
