# SPDX-License-Identifier: BSD-3-Clause
"""The generator that fills the hole a removed object leaves, and the discriminator it learns against.

Region normalisation (paper, eqs. 13 to 17; T. Yu et al., "Region Normalization for Image Inpainting", AAAI 2020) keeps
what is in the hole from disturbing the statistics of what is around it. The encoder, which knows the hole, takes its
regions from the auxiliary descriptor (eqs. 12 and 18): the hole, the rest of the (l, l) square around it, and all
else. The decoder, where the hole is half filled, learns its regions.

Images are N x 3 x H x W, RGB from 0 to 1, sides a multiple of SIZE_MULTIPLE; holes and squares N x 1 x H x W, 1 inside.
"""
from dataclasses import dataclass

import torch
from torch import nn
from torch.nn import functional

SIZE_MULTIPLE = 8
CLASSES = ("person", "car", "bicycle", "unknown")  # of eq. 12; each has an encoder of its own
EPSILON = 1e-5  # of eq. 16
EXPORT_BLOCK = 8  # pixels: what is exported takes means of blocks first, and sides that are multiples of 8 blocks


@dataclass(frozen=True)
class GeneratorOptions:
    """What tells the variants apart; the defaults are what ships."""

    widths: tuple = (24, 48, 112)  # channels at a half, a quarter and an eighth of the side
    dilations: tuple = (1, 2, 4, 8, 1)  # of the residual blocks in the middle
    normalisation: str = "region"  # "region", or "instance" to measure what regions are worth
    encoders: str = "class"  # "class": one for each of CLASSES; "one": the same for all

    def validate(self):
        if len(self.widths) != 3 or min(self.widths) < 1:
            raise ValueError("widths must be three positive numbers of channels")
        if not self.dilations or min(self.dilations) < 1:
            raise ValueError("dilations must be positive")
        if self.normalisation not in ("region", "instance"):
            raise ValueError("normalisation must be region or instance")
        if self.encoders not in ("class", "one"):
            raise ValueError("encoders must be class or one")


def variants():
    """The default and what it is compared with, one change each."""
    return {
        "roslam-restorer": GeneratorOptions(),
        "instance": GeneratorOptions(normalisation="instance"),
        "one-encoder": GeneratorOptions(encoders="one"),
        "instance-one-encoder": GeneratorOptions(normalisation="instance", encoders="one"),
    }


def mean_of_image(x):
    if torch.onnx.is_in_onnx_export():  # OpenCV adds one value after the other: so many that digits of the sum are lost
        x = functional.avg_pool2d(x, EXPORT_BLOCK)
    return functional.adaptive_avg_pool2d(x, 1)


def normalised(x, regions, scale, shift):
    """Eqs. 13 to 17 with a scale and a shift for each region. regions: N x 1 x H x W each, between 0 and 1, 1 in sum.
    What is computed are one factor and one addend for each value: x is read as seldom as possible."""
    x = x.float()  # half precision has too few digits for a variance
    factor, addend = 0, 0
    squares = x * x
    # One copy for each channel, made by a convolution: OpenCV 4.6 multiplies tensors of the same channels only.
    spread = torch.ones(x.shape[1], 1, 1, 1, dtype=x.dtype, device=x.device)
    for region, region_scale, region_shift in zip(regions, scale, shift):
        region = functional.conv2d(region, spread)
        share = mean_of_image(region) + 1e-8  # of an empty region
        mean = mean_of_image(x * region) / share
        variance = functional.relu(mean_of_image(squares * region) / share - mean * mean)
        gain = 1 / torch.sqrt(variance + EPSILON) * region_scale
        factor = factor + gain * region
        addend = addend + (region_shift + mean * gain * -1) * region
    return x * factor + addend


class BasicRegionNorm(nn.Module):
    """Of regions that are known."""

    def __init__(self, channels, regions):
        super().__init__()
        self.scale = nn.ParameterList(nn.Parameter(torch.ones(1, channels, 1, 1)) for _ in range(regions))
        self.shift = nn.ParameterList(nn.Parameter(torch.zeros(1, channels, 1, 1)) for _ in range(regions))

    def forward(self, x, regions):
        return normalised(x, regions, self.scale, self.shift)


class LearnedRegionNorm(nn.Module):
    """Of two regions that a convolution tells from the features themselves."""

    def __init__(self, channels):
        super().__init__()
        self.tell = nn.Conv2d(channels, 1, 3, padding=1)
        self.norm = BasicRegionNorm(channels, 2)

    def forward(self, x, _=None):
        inside = torch.sigmoid(self.tell(x))
        return self.norm(x, (inside, 1 - inside))


class InstanceNorm(nn.Module):
    """Of the whole image: what regions are measured against."""

    def __init__(self, channels):
        super().__init__()
        self.norm = nn.InstanceNorm2d(channels, eps=EPSILON, affine=True)

    def forward(self, x, _=None):
        return self.norm(x)


def known_norm(channels, options):
    return BasicRegionNorm(channels, 3) if options.normalisation == "region" else InstanceNorm(channels)


def learned_norm(channels, options):
    return LearnedRegionNorm(channels) if options.normalisation == "region" else InstanceNorm(channels)


def regions_of(hole, square):
    """The hole, the rest of the square, all else, at a half, a quarter and an eighth of the side. A coarse pixel that
    the hole only touches belongs to the hole."""
    result = []
    for _ in range(3):
        hole = functional.max_pool2d(hole, 2)
        square = functional.max_pool2d(square, 2)
        rest = functional.relu(square - hole)
        result.append((hole, rest, 1 - hole - rest))
    return result


class Encoder(nn.Module):
    """Features at a half, a quarter and an eighth of the side."""

    def __init__(self, options):
        super().__init__()
        inputs = (5, *options.widths[:-1])
        self.convolutions = nn.ModuleList(nn.Conv2d(i, o, 3, 2, 1) for i, o in zip(inputs, options.widths))
        self.norms = nn.ModuleList(known_norm(o, options) for o in options.widths)

    def forward(self, x, regions):
        result = []
        for convolution, norm, at_scale in zip(self.convolutions, self.norms, regions):
            x = functional.relu(norm(convolution(x), at_scale))
            result.append(x)
        return result


class DilatedBlock(nn.Module):
    """What is around reaches into the hole."""

    def __init__(self, channels, dilation, options):
        super().__init__()
        self.convolution = nn.Conv2d(channels, channels, 3, padding=dilation, dilation=dilation)
        self.norm = learned_norm(channels, options)

    def forward(self, x):
        return x + functional.relu(self.norm(self.convolution(x)))


class Decoder(nn.Module):
    """Features of an encoder to a picture; all encoders share it."""

    def __init__(self, options):
        super().__init__()
        half, quarter, eighth = options.widths
        self.middle = nn.Sequential(*(DilatedBlock(eighth, d, options) for d in options.dilations))
        self.to_quarter = nn.Conv2d(eighth + quarter, quarter, 3, padding=1)
        self.norm_quarter = learned_norm(quarter, options)
        self.to_half = nn.Conv2d(quarter + half, half, 3, padding=1)
        self.norm_half = learned_norm(half, options)
        self.paint = nn.Conv2d(half, 12, 3, padding=1)

    def forward(self, half, quarter, eighth):
        x = self.middle(eighth)
        x = functional.relu(self.norm_quarter(self.to_quarter(torch.cat([twice(x), quarter], 1))))
        x = functional.relu(self.norm_half(self.to_half(torch.cat([twice(x), half], 1))))
        return torch.sigmoid(functional.pixel_shuffle(self.paint(x), 2))


def twice(x):
    return functional.interpolate(x, scale_factor=2.0, mode="bilinear", align_corners=False)


class Generator(nn.Module):
    """An encoder for each class of object, one decoder. Gives the whole picture as painted; what is known of it is for
    the caller to put back."""

    def __init__(self, options=GeneratorOptions()):
        super().__init__()
        options.validate()
        self.options = options
        count = len(CLASSES) if options.encoders == "class" else 1
        self.encoders = nn.ModuleList(Encoder(options) for _ in range(count))
        self.decoder = Decoder(options)

    def forward(self, image, hole, square, kind):
        """kind: index into CLASSES of what was removed from all images of the batch."""
        encoder = self.encoders[kind if len(self.encoders) > 1 else 0]
        seen = torch.cat([(image - 0.5) * (1 - hole), hole, square], 1)
        return self.decoder(*encoder(seen, regions_of(hole, square)))


def composed(image, painted, hole):
    return image + (painted - image) * hole


class Discriminator(nn.Module):
    """Tells for each patch of a picture whether it was taken or painted (patch discriminator, spectral norm)."""

    def __init__(self, width=32):
        super().__init__()
        widths = (4, width, 2 * width, 4 * width)
        layers = []
        for inputs, outputs in zip(widths, widths[1:]):
            layers += [nn.utils.spectral_norm(nn.Conv2d(inputs, outputs, 4, 2, 1)), nn.LeakyReLU(0.2, inplace=True)]
        self.layers = nn.Sequential(*layers, nn.utils.spectral_norm(nn.Conv2d(widths[-1], 1, 3, padding=1)))

    def forward(self, image, hole):
        return self.layers(torch.cat([image - 0.5, hole], 1))
