# SPDX-License-Identifier: BSD-3-Clause
import unittest

import torch

from training.segmentation import networks, optimiser


class Orthogonalised(unittest.TestCase):
    def test_keeps_the_singular_vectors_and_levels_the_singular_values(self):
        generator = torch.Generator().manual_seed(3)
        for shape in ((6, 20), (20, 6)):
            u, _, v = torch.linalg.svd(torch.randn(shape, generator=generator), full_matrices=False)
            values = torch.logspace(0, -1.5, 6)
            matrix = optimiser.orthogonalised(u @ torch.diag(values) @ v)
            levelled = u.T @ matrix @ v.T
            self.assertLess((levelled - torch.diag(torch.diagonal(levelled))).abs().max(), 1e-4)
            self.assertGreater(torch.diagonal(levelled).min(), 0.6)
            self.assertLess(torch.diagonal(levelled).max(), 1.3)

    def test_a_gradient_of_zeros_moves_nothing(self):
        self.assertEqual(optimiser.orthogonalised(torch.zeros(3, 4)).abs().max(), 0)


class OrthogonalMomentum(unittest.TestCase):
    def test_a_step_has_the_size_that_the_rate_says(self):
        weight = torch.nn.Parameter(torch.zeros(8, 32, 1, 1))
        weight.grad = torch.randn(weight.shape, generator=torch.Generator().manual_seed(1))
        optimiser.OrthogonalMomentum([weight], 0.1).step()
        size = weight.detach().square().mean().sqrt().item()
        self.assertAlmostEqual(size, 0.1 * 0.2, delta=0.25 * 0.1 * 0.2)

    def test_finds_a_matrix_by_its_distance(self):
        generator = torch.Generator().manual_seed(2)
        target = torch.randn((5, 7, 1, 1), generator=generator)
        weight = torch.nn.Parameter(torch.zeros_like(target))
        descent = optimiser.OrthogonalMomentum([weight], 0.1)
        for step in range(400):
            descent.param_groups[0]["lr"] = 0.1 * (1 - step / 400)
            weight.grad = weight.detach() - target
            descent.step()
        self.assertLess((weight.detach() - target).abs().max(), 0.05)


class Choice(unittest.TestCase):
    def test_every_weight_is_trained_once_and_scores_by_adam(self):
        network = networks.PSPNet(networks.variants()["roslam-pspnet"])
        for kind, count in (("adam", 1), ("orthogonal", 2)):
            chosen = optimiser.optimisers(network, kind, 1e-3, 0.01)
            self.assertEqual(len(chosen), count)
            trained = [p for o in chosen for g in o.param_groups for p in g["params"]]
            self.assertEqual(len(trained), len({id(p) for p in trained}))
            self.assertEqual(len(trained), len(list(network.parameters())))
        matrices = {id(p) for g in chosen[1].param_groups for p in g["params"]}
        self.assertNotIn(id(network.classifier.weight), matrices)
        self.assertIn(id(network.block5[1].layers[1][0].weight), matrices)


if __name__ == "__main__":
    unittest.main()
