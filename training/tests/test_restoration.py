# SPDX-License-Identifier: BSD-3-Clause
import dataclasses
import io
import os
import tempfile
import unittest
from contextlib import redirect_stdout
from pathlib import Path

os.environ["CUDA_VISIBLE_DEVICES"] = ""  # a GPU adds in any order, and no two runs are alike

import cv2
import numpy as np
import torch

from training.restoration import evaluation, losses, networks, silhouettes, train
from training.restoration.samples import Sample
from training.segmentation import networks as segmentation_networks
from training.segmentation.datasets import DataError


def person_shape(height=60, width=24):
    shape = np.zeros((height, width), np.uint8)
    cv2.ellipse(shape, (width // 2, height // 2), (width // 2 - 1, height // 2 - 1), 0, 0, 360, 255, cv2.FILLED)
    return shape


def hole_and_square(side=64):
    hole = np.zeros((side, side), bool)
    hole[20:50, 30:42] = True
    return hole, silhouettes.square_around(hole)


def as_tensor(mask):
    return torch.from_numpy(mask)[None, None].float()


class RegionNormalisation(unittest.TestCase):
    def test_each_region_is_normalised_by_itself(self):
        """Eqs. 13 to 17, computed region by region."""
        generator = torch.Generator().manual_seed(1)
        x = torch.randn(2, 3, 16, 16, generator=generator) * 3 + 1
        inside = torch.zeros(2, 1, 16, 16)
        inside[:, :, 4:11, 2:9] = 1
        x = x + 50 * inside
        norm = networks.BasicRegionNorm(3, 2)
        with torch.no_grad():
            norm.scale[1].fill_(2.0)
            norm.shift[1].fill_(-1.0)
        y = norm(x, (inside, 1 - inside))
        for image in range(2):
            for channel in range(3):
                values = x[image, channel].double().numpy()
                where = inside[image, 0].numpy() > 0
                expected = np.empty_like(values)
                for mask, scale, shift in ((where, 1.0, 0.0), (~where, 2.0, -1.0)):
                    mean, deviation = values[mask].mean(), np.sqrt(values[mask].var() + networks.EPSILON)
                    expected[mask] = (values[mask] - mean) / deviation * scale + shift
                np.testing.assert_allclose(y[image, channel].detach().numpy(), expected, atol=2e-3)

    def test_the_hole_does_not_touch_what_is_around(self):
        torch.manual_seed(1)
        x = torch.randn(1, 4, 16, 16)
        inside = torch.zeros(1, 1, 16, 16)
        inside[:, :, 5:9, 5:9] = 1
        norm = networks.BasicRegionNorm(4, 2)
        changed = x * (1 - inside) + 7 * inside
        difference = (norm(x, (inside, 1 - inside)) - norm(changed, (inside, 1 - inside))) * (1 - inside)
        self.assertEqual(float(difference.abs().max()), 0.0)
        plain = networks.InstanceNorm(4)
        self.assertGreater(float(((plain(x) - plain(changed)) * (1 - inside)).abs().max()), 0.1)

    def test_regions_are_a_partition_at_every_size(self):
        hole, square = hole_and_square()
        for regions in networks.regions_of(as_tensor(hole), as_tensor(square)):
            total = sum(regions)
            self.assertTrue(torch.equal(total, torch.ones_like(total)))
            self.assertTrue(all(set(r.unique().tolist()) <= {0.0, 1.0} for r in regions))

    def test_empty_and_full_holes_give_numbers(self):
        torch.manual_seed(1)
        for value in (0.0, 1.0):
            mask = torch.full((1, 1, 64, 64), value)
            painted = networks.Generator()(torch.rand(1, 3, 64, 64), mask, mask, 0)
            self.assertTrue(bool(torch.isfinite(painted).all()))


class TheGenerator(unittest.TestCase):
    def test_what_the_hole_hides_is_not_seen(self):
        torch.manual_seed(1)
        hole, square = map(as_tensor, hole_and_square())
        image = torch.rand(1, 3, 64, 64)
        generator = networks.Generator().eval()
        with torch.no_grad():
            a = generator(image, hole, square, 0)
            b = generator(networks.composed(image, torch.rand(1, 3, 64, 64), hole), hole, square, 0)
        self.assertTrue(torch.equal(a, b))

    def test_each_class_has_an_encoder_of_its_own(self):
        torch.manual_seed(1)
        hole, square = map(as_tensor, hole_and_square())
        image = torch.rand(1, 3, 64, 64)
        for name, differs in (("roslam-restorer", True), ("one-encoder", False)):
            generator = networks.Generator(networks.variants()[name]).eval()
            with torch.no_grad():
                pictures = [generator(image, hole, square, kind) for kind in range(len(networks.CLASSES))]
            self.assertEqual([not torch.equal(pictures[0], p) for p in pictures[1:]], [differs] * 3)

    def test_every_variant_runs_in_opencv(self):
        hole, square = map(as_tensor, hole_and_square())
        seen = torch.cat([torch.rand(1, 3, 64, 64), hole, square], 1)

        class Whole(torch.nn.Module):
            def __init__(self, generator):
                super().__init__()
                self.generator = generator

            def forward(self, x):
                return self.generator(x[:, :3], x[:, 3:4], x[:, 4:5], 1)

        for name, options in networks.variants().items():
            torch.manual_seed(1)
            generator = networks.Generator(options).eval()
            for parameter in generator.parameters():  # equal weights would be merged, which OpenCV cannot read
                torch.nn.init.normal_(parameter, mean=0.02, std=0.05)
            with tempfile.TemporaryDirectory() as folder, torch.no_grad():
                file = str(Path(folder) / "generator.onnx")
                torch.onnx.export(Whole(generator), seen, file, opset_version=11)
                runner = cv2.dnn.readNetFromONNX(file)
                runner.setInput(seen.numpy())
                np.testing.assert_allclose(runner.forward(), Whole(generator)(seen).numpy(), atol=1e-3, err_msg=name)


class Holes(unittest.TestCase):
    def test_a_placed_shape_has_about_the_share_asked_for(self):
        rng = np.random.default_rng(1)
        shares = [silhouettes.place(rng, person_shape(), 0.15, 128)[0].mean() for _ in range(200)]
        self.assertLess(max(shares), 0.2)
        self.assertGreater(np.median(shares), 0.12)  # some are cut off by the border
        self.assertGreater(min(shares), 0.05)

    def test_the_square_is_that_of_equation_12(self):
        hole = np.zeros((100, 100), bool)
        hole[40:60, 50:54] = True
        square = silhouettes.square_around(hole)
        rows, columns = np.where(square)
        self.assertEqual((rows.min(), rows.max(), columns.min(), columns.max()), (40, 59, 42, 61))
        self.assertFalse(silhouettes.square_around(np.zeros((10, 10), bool)).any())

    def test_outlines_are_whole_large_and_closed(self):
        mask = np.zeros((100, 100), bool)
        mask[10:50, 10:50] = True
        mask[20:30, 20:30] = False  # a hole of its own
        mask[60:70, 60:70] = True  # too small
        mask[60:100, 10:50] = True  # cut by the border
        found = silhouettes.outlines(mask, 1)
        self.assertEqual([o.shape for o in found], [(40, 40)])
        self.assertTrue((found[0] == 255).all())


class Measures(unittest.TestCase):
    def setUp(self):
        rng = np.random.default_rng(1)
        self.picture = cv2.GaussianBlur(rng.integers(0, 256, (64, 64, 3), dtype=np.uint8), (0, 0), 2)
        self.hole, self.square = hole_and_square()

    def test_psnr_of_a_known_error(self):
        other = self.picture.astype(int)
        other[self.hole] += 10
        other[~self.hole] += 50  # outside it does not count
        self.assertAlmostEqual(evaluation.psnr(self.picture, other, self.hole), 20 * np.log10(25.5), places=6)

    def test_ssim_is_1_for_the_same_and_less_for_noise(self):
        self.assertAlmostEqual(evaluation.ssim(self.picture, self.picture, self.hole), 1.0)
        noise = np.random.default_rng(2).integers(-40, 40, self.picture.shape)
        noisy = np.clip(self.picture + noise, 0, 255).astype(np.uint8)
        self.assertLess(evaluation.ssim(self.picture, noisy, self.hole), 0.7)

    def test_a_perfect_painter_beats_the_classic_ones(self):
        sample = Sample(self.picture, self.hole, self.square, np.ones_like(self.hole), 0)
        methods = evaluation.classic_methods() | {"truth": lambda s: s.picture}
        scored = evaluation.score([sample], methods)
        self.assertEqual(scored["truth"]["l1"], 0.0)
        for name in ("telea", "navier-stokes"):
            self.assertLess(scored[name]["psnr"], scored["truth"]["psnr"])


class FlatEyes(torch.nn.Module):
    """Stands for the segmentation network: features are the picture, bright red moves."""

    def features(self, image):
        return (torch.nn.functional.avg_pool2d(image, 4),)

    def movable(self, image):
        return torch.nn.functional.avg_pool2d((image[:, :1] > 0.9).float() * image[:, :1], 2)


class Losses(unittest.TestCase):
    def setUp(self):
        self.hole, square = map(as_tensor, hole_and_square())
        torch.manual_seed(1)
        self.image = torch.rand(1, 3, 64, 64) * 0.8
        self.static = torch.ones(1, 1, 64, 64)

    def test_the_truth_costs_nothing(self):
        parts, restored = losses.generator_losses(self.image, self.image, self.hole, self.static, FlatEyes())
        self.assertTrue(torch.equal(restored, self.image))
        self.assertEqual([float(p) for p in parts.values()], [0.0] * 4)

    def test_what_moves_in_the_truth_is_no_model(self):
        static = self.static - self.hole
        painted = self.image * (1 - self.hole) + 0.5 * self.hole
        parts, _ = losses.generator_losses(self.image, painted, self.hole, static, FlatEyes())
        self.assertEqual(float(parts["hole"]), 0.0)
        self.assertLess(float(parts["perceptual"]), 1e-6)

    def test_painting_what_may_move_costs(self):
        painted = self.image.clone()
        painted[:, 0] = 1.0
        parts, _ = losses.generator_losses(self.image, painted, self.hole, self.static, FlatEyes())
        self.assertGreater(float(parts["semantic"]), 0.3)


class FewSamples(torch.utils.data.Dataset):
    """Noise with a hole: enough to see that a run goes on as if it had never stopped."""

    def __len__(self):
        return 2 ** 40

    def __getitem__(self, index):
        picture = np.random.default_rng(index).integers(0, 256, (64, 64, 3), dtype=np.uint8)
        hole, square = hole_and_square()
        return picture, hole, square, np.ones_like(hole), index // 2 % len(networks.CLASSES)


class Training(unittest.TestCase):
    def trained(self, folder, *steps):
        options = train.TrainingOptions(steps=6, batch=2, crop=64, workers=0, warm_up=1, decay_share=0.0, adversary_from=2,
                                        precision="float")
        torch.manual_seed(5)
        segmenter = segmentation_networks.PSPNet(segmentation_networks.variants()["roslam-pspnet"])
        for last in steps:
            trainer = train.Trainer(FewSamples(), [], folder, dataclasses.replace(options, steps=last), segmenter)
            trainer.run()
        return trainer

    def test_a_run_that_stops_goes_on_where_it_was(self):
        with tempfile.TemporaryDirectory() as a, tempfile.TemporaryDirectory() as b, redirect_stdout(io.StringIO()):
            straight, resumed = self.trained(a, 6), self.trained(b, 3, 6)
            for name in ("generator", "discriminator"):
                expected, found = (getattr(t, name).state_dict() for t in (straight, resumed))
                for key, value in expected.items():
                    self.assertTrue(torch.equal(value, found[key]), f"{name} {key}")
            generator = train.load_generator(Path(b) / "last.pt")
            self.assertEqual(generator.options, networks.GeneratorOptions())

    def test_a_checkpoint_of_another_variant_is_refused(self):
        with tempfile.TemporaryDirectory() as folder, redirect_stdout(io.StringIO()):
            self.trained(folder, 1)
            options = train.TrainingOptions(variant="instance", crop=64)
            segmenter = segmentation_networks.PSPNet(segmentation_networks.variants()["roslam-pspnet"])
            with self.assertRaisesRegex(DataError, "another variant"):
                train.Trainer(FewSamples(), [], folder, options, segmenter)


if __name__ == "__main__":
    unittest.main()
