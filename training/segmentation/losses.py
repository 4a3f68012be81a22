# SPDX-License-Identifier: BSD-3-Clause
"""The loss of the paper (section 3.2, eqs. 1-10), for labels that are sets of classes (label_set.py).

Scores are N x classes x h x w, labels N x h x w numbers of sets, VOID where nothing is known.
"""
from dataclasses import dataclass

import torch
from torch.nn import functional

from training.segmentation import label_set

IMPOSSIBLE = -1e4  # a score that no class can have
SMALLEST = 1e-30  # probability that a set has at least, so that its logarithm is finite


@dataclass(frozen=True)
class LossOptions:
    """form: "cross-entropy" (eq. 2) or "squared-hinge" (eqs. 9-10). auxiliary: weight of each auxiliary head.
    by_class: split the auxiliary loss by class, weighted by the classes' shares alpha (eq. 1); otherwise it is the mean
    over pixels. floor: gamma, below which the auxiliary loss of a class does not train any more (eq. 6).
    head_decay: factor of the squared norms of the output weights (eqs. 4 and 6). balance: c in the class weights
    1 / log(c + share) of the main loss; 0 = all equal. jaccard: weight of a soft Jaccard loss of the output, which
    asks for what is measured in the end; 0 = none."""

    form: str = "cross-entropy"
    auxiliary: float = 0.4
    by_class: bool = False
    floor: float = 0.0
    head_decay: float = 0.0
    balance: float = 1.05
    jaccard: float = 0.5

    def validate(self):
        if self.form not in ("cross-entropy", "squared-hinge"):
            raise ValueError("form must be cross-entropy or squared-hinge")
        if min(self.auxiliary, self.floor, self.head_decay, self.jaccard) < 0:
            raise ValueError("auxiliary, floor, head_decay and jaccard must not be negative")
        if self.balance != 0 and self.balance <= 1:
            raise ValueError("balance must be 0 or more than 1")


def labels_at(labels, size):
    """Labels at a coarser size: the pixel at the centre of each cell."""
    height, width = labels.shape[1:]
    rows = torch.div((2 * torch.arange(size[0], device=labels.device) + 1) * height, 2 * size[0], rounding_mode="floor")
    columns = torch.div((2 * torch.arange(size[1], device=labels.device) + 1) * width, 2 * size[1], rounding_mode="floor")
    return labels[:, rows][:, :, columns]


class SetCrossEntropy(torch.autograd.Function):
    """Eq. 2 for sets: -log of the probability that a set's classes have together. Scores and members are P x classes.

    With p = softmax(scores) and q = p within the set, scaled to sum 1, the gradient is p - q. Written out, since
    automatic differentiation of the same takes several times as long, and the loss is a large part of a step."""

    @staticmethod
    def forward(context, scores, members):
        probabilities = torch.softmax(scores, 1)
        within = probabilities * members
        of_set = within.sum(1).clamp_(min=SMALLEST)
        context.save_for_backward(probabilities.sub_(within.div_(of_set[:, None])))
        return -of_set.log()

    @staticmethod
    def backward(context, gradient):
        (difference,) = context.saved_tensors
        return difference * gradient[:, None], None


def members_by_label():
    """256 x classes: for each label 1 where a class is in its set; void has them all."""
    table = torch.from_numpy(label_set.membership())
    return torch.cat([table, torch.ones(256 - len(table), table.shape[1])])


class PixelLoss(torch.nn.Module):
    """Loss of each pixel against a set of classes, zero where void: N x h x w."""

    def __init__(self, form="cross-entropy"):
        super().__init__()
        self.form = form
        self.register_buffer("members", members_by_label(), persistent=False)

    def forward(self, scores, labels):
        members = self.members[labels.reshape(-1).long()]
        scores = scores.permute(0, 2, 3, 1).reshape(members.shape)
        if self.form == "cross-entropy":
            losses = SetCrossEntropy.apply(scores, members)
        else:  # eqs. 9-10: every class outside the set should score 1 less than the best inside
            best = (scores + (1 - members) * IMPOSSIBLE).max(1, keepdim=True).values
            losses = (functional.relu(1 - (best - scores)) ** 2 * (1 - members)).sum(1)
        return losses.reshape(labels.shape)


class SoftJaccard(torch.nn.Module):
    """1 - intersection over union by probabilities, the mean over the classes that a batch has (M. A. Rahman, Y. Wang,
    "Optimizing intersection-over-union in deep neural networks for image segmentation", 2016), for label sets.

    What a pixel gives to the classes within its set are hits, outside it false alarms; what its set lacks is a miss of
    its classes, in proportion to what they have. Sets of more classes than LARGEST say too little of each: their
    pixels count for false alarms only. Every second row and column is read, which serves as well."""

    LARGEST = 5  # classes of a set
    RAREST = 8  # pixels of a class that a batch must have

    def __init__(self):
        super().__init__()
        self.register_buffer("members", members_by_label(), persistent=False)

    def forward(self, scores, labels):
        labels = labels[:, ::2, ::2].reshape(-1).long()
        probabilities = torch.softmax(scores[:, :, ::2, ::2], 1).permute(0, 2, 3, 1).reshape(len(labels), -1)
        members = self.members[labels]
        within = probabilities * members
        of_set = within.sum(1, keepdim=True)
        tells = (members.sum(1, keepdim=True) <= self.LARGEST).to(within.dtype)
        parts = tells * within.detach() / of_set.detach().clamp(min=SMALLEST)
        hits = (within * tells).sum(0)
        false_alarms = (probabilities - within).sum(0)  # void has all classes, hence none
        misses = (parts * (1 - of_set)).sum(0)
        present = (parts.sum(0) >= self.RAREST).to(within.dtype)
        quality = hits / (hits + false_alarms + misses).clamp(min=SMALLEST)
        return (present * (1 - quality)).sum() / present.sum().clamp(min=1)


def class_weights(shares, balance):
    """One weight a label set, by its share of the pixels, with mean 1 over the pixels."""
    shares = torch.as_tensor(shares, dtype=torch.float32)
    if balance == 0:
        return torch.ones_like(shares)
    weights = 1 / torch.log(balance + shares)
    return weights / (weights * shares).sum()


class DeepSupervision(torch.nn.Module):
    """Eq. 1 in the form of eq. 8: main loss of the output and auxiliary losses of hidden blocks.

    shares: share of each label set among the training pixels (alpha)."""

    def __init__(self, shares, options=LossOptions()):
        super().__init__()
        options.validate()
        self.options = options
        self.pixel_loss = PixelLoss(options.form)
        self.jaccard = SoftJaccard()
        shares = torch.as_tensor(shares, dtype=torch.float32)
        extra = torch.zeros(256 - len(shares))
        self.register_buffer("shares", torch.cat([shares, extra]), persistent=False)
        self.register_buffer("weights", torch.cat([class_weights(shares, options.balance), extra]), persistent=False)

    def main(self, scores, labels):
        """Mean over the known pixels, weighted by class (L_p). labels: of the size of the scores."""
        weights = self.weights[labels.long()]
        return (self.pixel_loss(scores, labels) * weights).sum() / weights.sum().clamp(min=1e-6)

    def hidden(self, scores, labels):
        """L_a of one auxiliary head, less the floor."""
        labels = labels_at(labels, scores.shape[2:])
        losses = self.pixel_loss(scores, labels)
        if not self.options.by_class:
            known = (labels != label_set.VOID).sum().clamp(min=1)
            return functional.relu(losses.sum() / known - self.options.floor)
        flat = labels.reshape(-1).long()
        zeros = losses.new_zeros(256)
        means = zeros.scatter_add(0, flat, losses.reshape(-1)) / zeros.scatter_add(
            0, flat, torch.ones_like(losses).reshape(-1)).clamp(min=1)
        return (self.shares * functional.relu(means - self.options.floor)).sum()

    def forward(self, outputs, labels, heads=()):
        """outputs: (scores, auxiliary scores ...) as the network gives them in training. heads: the weights that
        head_decay holds small."""
        main, *hidden = (o.float() for o in outputs)
        labels_of_main = labels_at(labels, main.shape[2:])
        loss = self.main(main, labels_of_main)
        # Also with a weight of 0: processes that train together need a gradient for every weight.
        loss = loss + self.options.auxiliary * sum(self.hidden(h, labels) for h in hidden)
        if self.options.jaccard:
            loss = loss + self.options.jaccard * self.jaccard(main, labels_of_main)
        if self.options.head_decay:
            loss = loss + self.options.head_decay * sum((w ** 2).sum() for w in heads)
        return loss
