# SPDX-License-Identifier: BSD-3-Clause
"""What the generator is asked for."""
from dataclasses import dataclass

import torch
from torch.nn import functional

from training.restoration.networks import composed
from training.segmentation import label_set


@dataclass(frozen=True)
class LossOptions:
    hole: float = 6.0  # weight of the mean absolute error in the hole
    known: float = 0.5  # outside of it
    perceptual: float = 0.3  # of the difference of the segmentation network's features
    semantic: float = 0.3  # of the probability that what was painted may move
    adversarial: float = 0.02  # of the patch discriminator's opinion

    def validate(self):
        if min(self.hole, self.known, self.perceptual, self.semantic, self.adversarial) < 0:
            raise ValueError("weights of losses must not be negative")


class SegmentationEyes(torch.nn.Module):
    """Features of the segmentation network at a quarter and an eighth of the side, and where it sees what may move.
    Its weights are fixed."""

    def __init__(self, network):
        super().__init__()
        self.network = network.eval()
        for parameter in self.network.parameters():
            parameter.requires_grad_(False)

    def features(self, image):
        x = (image - self.network.mean) / self.network.deviation
        quarter = self.network.block2(self.network.block1(x))
        return quarter, self.network.block3(quarter)

    def movable(self, image):
        """N x 1 x H/2 x W/2: probability that the pixel shows a person, a car or another thing that may move."""
        return self.network(image).float().softmax(1)[:, list(label_set.MOVABLE)].sum(1, keepdim=True)


def mean_where(values, where):
    return (values * where).sum() / (where.sum() * values.shape[1] + 1.0)


def generator_losses(image, painted, hole, is_static, eyes):
    """Each loss by name, without its weight. Where the truth itself may move, nobody knows what is behind it: what is
    painted there is free, but for being static. hole, is_static: N x 1 x H x W, 0 or 1."""
    error = (painted - image).abs()
    restored = composed(image, painted, hole)
    wanted = hole * is_static
    losses = {"hole": mean_where(error, wanted), "known": mean_where(error, 1 - hole)}
    with torch.no_grad():
        truth = eyes.features(image)
    seen = eyes.features(restored)
    # A feature sees around its place: it counts where all of that is free of what may move.
    free = 1 - functional.max_pool2d(hole * (1 - is_static), 9, 1, 4)
    losses["perceptual"] = sum(
        mean_where((s.float() - t.float()).abs(), functional.interpolate(hole * free, size=s.shape[2:], mode="area"))
        for s, t in zip(seen, truth))
    movable = eyes.movable(restored)
    losses["semantic"] = mean_where(movable, functional.interpolate(hole, size=movable.shape[2:], mode="area"))
    return losses, restored


def discriminator_loss(discriminator, image, restored, hole, is_static):
    """Hinge loss; only patches that hold some of the hole are painted, and truth is believed only where it is static."""
    taken, painted = discriminator(image, hole), discriminator(restored.detach(), hole)
    near = functional.adaptive_max_pool2d(hole, taken.shape[2:])
    static = -functional.adaptive_max_pool2d(-is_static, taken.shape[2:])
    return (mean_where(functional.relu(1 - taken.float()), near * static)
            + mean_where(functional.relu(1 + painted.float()), near))


def adversarial_loss(discriminator, restored, hole):
    opinion = discriminator(restored, hole).float()
    return -mean_where(opinion, functional.adaptive_max_pool2d(hole, opinion.shape[2:]))
