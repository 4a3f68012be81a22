# SPDX-License-Identifier: BSD-3-Clause
import math
import unittest

import numpy as np
import torch

from training.segmentation import label_set, losses

VOID = label_set.VOID


def scores_of(*pixels):
    """1 x 19 x 1 x N scores: for each pixel a dict of class and score, 0 elsewhere."""
    scores = torch.zeros(1, 19, 1, len(pixels))
    for x, pixel in enumerate(pixels):
        for c, value in pixel.items():
            scores[0, c, 0, x] = value
    return scores


def labels_of(*labels):
    return torch.tensor([[list(labels)]], dtype=torch.uint8)


class CrossEntropy(unittest.TestCase):
    """Eq. 2: -log softmax of the true class."""

    def test_single_class(self):
        loss = losses.PixelLoss()(scores_of({3: 2.0}, {}), labels_of(3, 3))
        self.assertAlmostEqual(float(loss[0, 0, 0]), -math.log(math.exp(2) / (math.exp(2) + 18)), places=5)
        self.assertAlmostEqual(float(loss[0, 0, 1]), math.log(19), places=5)

    def test_a_set_asks_for_the_sum_of_its_probabilities(self):
        person = label_set.set_number(label_set.PERSON)
        loss = losses.PixelLoss()(scores_of({11: 1.0, 12: 2.0}), labels_of(person))
        total = math.exp(1) + math.exp(2) + 17
        self.assertAlmostEqual(float(loss), -math.log((math.exp(1) + math.exp(2)) / total), places=5)

    def test_void_costs_nothing_and_pulls_nowhere(self):
        scores = scores_of({0: 3.0}).requires_grad_()
        loss = losses.PixelLoss()(scores, labels_of(VOID))
        loss.sum().backward()
        self.assertAlmostEqual(float(loss), 0.0, places=6)
        self.assertLess(float(scores.grad.abs().max()), 1e-6)


    def test_gradient_is_that_of_finite_differences(self):
        labels = torch.tensor([[[3, label_set.set_number(label_set.PERSON)], [VOID, label_set.set_number((8, 9))]]],
                              dtype=torch.uint8)
        scores = torch.randn(1, 19, 2, 2, dtype=torch.float64, generator=torch.Generator().manual_seed(2))
        weights = torch.tensor([[[1.0, 2.0], [3.0, 4.0]]], dtype=torch.float64)
        loss = losses.PixelLoss().double()
        self.assertTrue(torch.autograd.gradcheck(lambda s: (loss(s, labels) * weights).sum(), scores.requires_grad_()))

    def test_hopeless_scores_stay_finite(self):
        scores = scores_of({0: 500.0}).requires_grad_()
        loss = losses.PixelLoss()(scores, labels_of(3))
        loss.sum().backward()
        self.assertTrue(torch.isfinite(loss).all() and torch.isfinite(scores.grad).all())
        self.assertGreater(float(loss.detach()), 60)


class SquaredHinge(unittest.TestCase):
    """Eqs. 9-10: every other class should score 1 less."""

    def test_single_class(self):
        # true class 2.0; one class at 1.5 misses the margin by 0.5, one at 0.5 keeps it, the others at 0 too
        loss = losses.PixelLoss("squared-hinge")(scores_of({3: 2.0, 4: 1.5, 5: 0.5}), labels_of(3))
        self.assertAlmostEqual(float(loss), 0.5 ** 2, places=5)

    def test_wrong_class(self):
        loss = losses.PixelLoss("squared-hinge")(scores_of({4: 1.0}), labels_of(3))
        self.assertAlmostEqual(float(loss), (1 + 1) ** 2 + 17 * 1 ** 2, places=4)

    def test_within_a_set_classes_do_not_compete(self):
        person = label_set.set_number(label_set.PERSON)
        loss = losses.PixelLoss("squared-hinge")(scores_of({11: 1.0, 12: 1.0}), labels_of(person))
        self.assertAlmostEqual(float(loss), 0.0, places=5)


class Deep(unittest.TestCase):
    """Eqs. 1 and 8."""

    def setUp(self):
        self.shares = np.zeros(len(label_set.SETS), np.float32)
        self.shares[0], self.shares[11] = 0.75, 0.25
        self.scores = scores_of({0: 2.0}, {11: 1.0})
        self.labels = labels_of(0, 11)
        self.at_0 = math.log(math.exp(2) + 18) - 2
        self.at_11 = math.log(math.exp(1) + 18) - 1

    def loss(self, **options):
        return losses.DeepSupervision(self.shares, losses.LossOptions(**{"jaccard": 0, **options}))

    def test_main_loss_without_balance_is_the_mean(self):
        loss = self.loss(balance=0, auxiliary=0)((self.scores, self.scores, self.scores), self.labels)
        self.assertAlmostEqual(float(loss), (self.at_0 + self.at_11) / 2, places=5)

    def test_class_shares_weigh_the_auxiliary_loss(self):
        hidden = self.loss(by_class=True).hidden(self.scores, self.labels)
        self.assertAlmostEqual(float(hidden), 0.75 * self.at_0 + 0.25 * self.at_11, places=5)

    def test_the_floor_stops_what_is_good_enough(self):
        floor = (self.at_0 + self.at_11) / 2  # between the two
        hidden = self.loss(by_class=True, floor=floor).hidden(self.scores, self.labels)
        self.assertAlmostEqual(float(hidden), 0.25 * (self.at_11 - floor), places=5)
        scores = self.scores.clone().requires_grad_()
        self.loss(by_class=True, floor=100.0).hidden(scores, self.labels).backward()
        self.assertEqual(float(scores.grad.abs().max()), 0.0)

    def test_heads_are_held_small(self):
        outputs = (self.scores,) * 3
        plain = self.loss(balance=0)(outputs, self.labels)
        held = self.loss(balance=0, head_decay=0.1)(outputs, self.labels, [torch.full((2, 1), 3.0)])
        self.assertAlmostEqual(float(held - plain), 0.1 * 18, places=4)

    def test_the_jaccard_loss_is_added_with_its_weight(self):
        scores = self.scores.repeat_interleave(8, 2)  # 8 pixels of each class, read in every second row and column
        scores = scores.repeat_interleave(4, 3)
        labels = self.labels.repeat_interleave(8, 1).repeat_interleave(4, 2)
        outputs = (scores,) * 3
        added = self.loss(jaccard=2)(outputs, labels) - self.loss()(outputs, labels)
        self.assertAlmostEqual(float(added), 2 * float(losses.SoftJaccard()(scores, labels)), places=5)
        self.assertGreater(float(added), 0.1)

    def test_balance_lifts_rare_classes_and_keeps_the_mean(self):
        weights = losses.class_weights(self.shares, 1.05)
        self.assertGreater(float(weights[11]), float(weights[0]))
        self.assertAlmostEqual(float((weights * torch.from_numpy(self.shares)).sum()), 1.0, places=5)

    def test_two_auxiliary_heads_count_each(self):
        outputs = (self.scores,) * 3
        mean = (self.at_0 + self.at_11) / 2
        loss = self.loss(balance=0, auxiliary=0.4)(outputs, self.labels)
        self.assertAlmostEqual(float(loss), mean + 0.4 * 2 * mean, places=5)


class SoftJaccard(unittest.TestCase):
    @staticmethod
    def loss(*counted):
        """counted: (predicted class, true set, pixels). Every pixel fills 2x2, of which one is read."""
        predicted = [p for p, _, count in counted for _ in range(count)]
        true = [t for _, t, count in counted for _ in range(count)]
        scores = scores_of(*({p: 60.0} for p in predicted)).repeat_interleave(2, 2).repeat_interleave(2, 3)
        labels = labels_of(*true).repeat_interleave(2, 1).repeat_interleave(2, 2)
        return float(losses.SoftJaccard()(scores, labels))

    def test_is_one_less_the_mean_intersection_over_union_of_certain_labels(self):
        # class 3: 30 hits, 10 false alarms; class 4: 10 misses
        self.assertAlmostEqual(self.loss((3, 3, 30), (3, 4, 10)), 1 - (0.75 + 0) / 2, places=5)

    def test_a_set_is_hit_by_any_of_its_classes(self):
        person = label_set.set_number(label_set.PERSON)
        self.assertAlmostEqual(self.loss((11, person, 20), (3, 3, 20)), 0.0, places=5)

    def test_a_set_that_says_little_counts_for_false_alarms_alone(self):
        person, other = label_set.set_number(label_set.PERSON), label_set.set_number(label_set.NOT_PERSON)
        self.assertAlmostEqual(self.loss((11, person, 20), (11, other, 20), (0, other, 50)), 0.5, places=5)

    def test_void_and_classes_that_are_hardly_there_do_not_count(self):
        self.assertAlmostEqual(self.loss((3, 3, 20), (3, VOID, 20), (4, 4, 7)), 0.0, places=5)


class LabelSampling(unittest.TestCase):
    def test_takes_the_pixel_at_the_centre_of_each_cell(self):
        labels = torch.arange(64, dtype=torch.uint8).reshape(1, 8, 8)
        self.assertEqual(losses.labels_at(labels, (2, 2)).flatten().tolist(), [18, 22, 50, 54])
        self.assertTrue(torch.equal(losses.labels_at(labels, (8, 8)), labels))


if __name__ == "__main__":
    unittest.main()
