# SPDX-License-Identifier: BSD-3-Clause
import dataclasses
import io
import os
import tempfile
import unittest
from contextlib import redirect_stdout
from pathlib import Path
from unittest import mock

os.environ["CUDA_VISIBLE_DEVICES"] = ""  # a GPU adds in any order, and no two runs are alike

import cv2
import numpy as np
import torch

from training.restoration import __main__ as program
from training.restoration import evaluation, export, losses, networks, silhouettes, train
from training.restoration.samples import Sample
from training.segmentation import checkpoint
from training.segmentation import networks as segmentation_networks
from training.segmentation.datasets import DataError
from training.segmentation.export import write


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


def random_generator(variant="roslam-restorer", **options):
    """Small, with weights of which no two are equal: equal ones would be merged, which OpenCV cannot read."""
    torch.manual_seed(1)
    options = {"widths": (6, 8, 10), "dilations": (1, 2)} | options
    generator = networks.Generator(dataclasses.replace(networks.variants()[variant], **options)).eval()
    for parameter in generator.parameters():
        torch.nn.init.normal_(parameter, mean=0.02, std=0.15)
    return generator


def checkpoint_of(generator):
    return {"average": generator.state_dict(), "generator_options": dataclasses.asdict(generator.options)}


def painted_by(file, seen):
    runner = cv2.dnn.readNetFromONNX(str(file))
    runner.setInput(seen.numpy(), "seen")
    return runner.forward("painted")


def files_in(folder):
    return [Path(folder) / f"roslam-restorer-{name}.onnx" for name in networks.CLASSES]


class Export(unittest.TestCase):
    def seen(self, side=64):
        """Not what the export checks itself with."""
        hole, square = hole_and_square(side)
        picture = torch.rand(1, 3, side, side, generator=torch.Generator().manual_seed(2))
        return torch.cat([picture, as_tensor(hole), as_tensor(square)], 1)

    def test_the_command_writes_a_network_for_each_class_and_the_weights(self):
        generator = random_generator()
        with tempfile.TemporaryDirectory() as folder:
            folder = Path(folder)
            checkpoint.save(folder / "last.pt", checkpoint_of(generator))
            arguments = ["", "export", "--checkpoint", f"{folder}/last.pt", "--out", f"{folder}/onnx", "--weights",
                         f"{folder}/weights.pt"]
            with mock.patch("sys.argv", arguments):
                self.assertEqual(program.main(), 0)
            self.assertEqual(sorted((folder / "onnx").iterdir()), sorted(files_in(folder / "onnx")))
            again, seen = train.load_generator(folder / "weights.pt"), self.seen(256)
            with torch.no_grad():
                expected = [again(seen[:, :3], seen[:, 3:4], seen[:, 4:], kind).numpy() for kind in range(4)]
            for number, file in enumerate(files_in(folder / "onnx")):
                np.testing.assert_allclose(painted_by(file, seen), expected[number], atol=1e-4, err_msg=file.name)
                for other in expected[:number]:
                    self.assertGreater(np.abs(expected[number] - other).max(), 0.01)
            self.assertEqual(again.options, generator.options)
            for name, weights in generator.state_dict().items():
                self.assertTrue(torch.equal(again.state_dict()[name], weights.half().float()), name)

    def test_every_variant_is_exported(self):
        seen = self.seen()
        for name, options in networks.variants().items():
            generator = random_generator(name)
            with tempfile.TemporaryDirectory() as folder:
                export.export(generator, folder, 64)
                found = [painted_by(file, seen) for file in files_in(folder)]
            with torch.no_grad():
                expected = generator(seen[:, :3], seen[:, 3:4], seen[:, 4:], 1).numpy()
            np.testing.assert_allclose(found[1], expected, atol=0.02, err_msg=name)  # of weights that are not rounded
            self.assertEqual([not np.array_equal(found[0], f) for f in found[1:]], [options.encoders == "class"] * 3)

    def test_what_the_hole_hides_is_not_seen(self):
        seen = self.seen()
        inside = seen.clone()
        inside[:, :3] = networks.composed(seen[:, :3], torch.rand(1, 3, 64, 64), seen[:, 3:4])
        outside = seen.clone()
        outside[:, :3] = networks.composed(seen[:, :3], torch.rand(1, 3, 64, 64), 1 - seen[:, 3:4])
        with tempfile.TemporaryDirectory() as folder:
            export.export(random_generator(), folder, 64)
            for file in files_in(folder):
                painted = painted_by(file, seen)
                np.testing.assert_array_equal(painted_by(file, inside), painted)
                self.assertGreater(np.abs(painted_by(file, outside) - painted).max(), 0.01)

    def test_what_ships_is_small(self):
        shipped = networks.GeneratorOptions()
        with tempfile.TemporaryDirectory() as folder:
            export.export(random_generator(widths=shipped.widths, dilations=shipped.dilations), folder, 64)
            self.assertLess(sum(file.stat().st_size for file in files_in(folder)), 13e6)

    def test_a_network_that_gives_no_numbers_leaves_no_file(self):
        generator = random_generator()
        with torch.no_grad():
            generator.encoders[3].convolutions[0].bias.fill_(float("nan"))
        with tempfile.TemporaryDirectory() as folder:
            with self.assertRaisesRegex(RuntimeError, "unknown.onnx: .*differ"):
                export.export(generator, folder, 64)
            self.assertEqual(os.listdir(folder), [])

    def test_means_of_large_pictures_keep_their_digits(self):
        class Mean(torch.nn.Module):
            def forward(self, x):
                return networks.mean_of_image(x)

        x = torch.rand(1, 8, 512, 512, generator=torch.Generator().manual_seed(1))
        with tempfile.TemporaryDirectory() as folder:
            write(Mean(), f"{folder}/mean.onnx", x, "seen", "painted")
            difference = painted_by(f"{folder}/mean.onnx", x) - x.double().mean((2, 3), keepdim=True).numpy()
        self.assertLess(np.abs(difference).max(), 2e-6)


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


    def test_what_may_move_is_counted_in_the_hole_only(self):
        class PersonOnTheLeft(torch.nn.Module):
            def __init__(self):
                super().__init__()
                self.weight = torch.nn.Parameter(torch.zeros(1))

            def forward(self, image):
                scores = torch.zeros(1, 19, image.shape[2] // 2, image.shape[3] // 2)
                scores[:, 0] = 1
                scores[:, 11, :, :scores.shape[3] // 2] = 2
                return scores

        hole = np.zeros((64, 64), bool)
        hole[16:48, 24:40] = True  # half of it on the left
        sample = Sample(self.picture[:64, :64], hole, hole, np.ones_like(hole), 0)
        scored = evaluation.score([sample], {"same": lambda s: s.picture}, PersonOnTheLeft().eval())
        self.assertAlmostEqual(scored["same"]["movable"], 0.5, delta=0.1)


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
    def trained(self, folder, *steps, **more):
        for last in steps:
            trainer = self.trainer(folder, steps=last, **more)
            trainer.run()
        return trainer

    def trainer(self, folder, start_from=None, **more):
        options = train.TrainingOptions(batch=2, crop=64, workers=0, warm_up=1, decay_share=0.0, adversary_from=2,
                                        precision="float")
        torch.manual_seed(5)
        segmenter = segmentation_networks.PSPNet(segmentation_networks.variants()["roslam-pspnet"])
        return train.Trainer(FewSamples(), [], folder, dataclasses.replace(options, **more), segmenter, start_from)

    def assert_same_weights(self, a, b):
        for name, weights in a.state_dict().items():
            self.assertTrue(torch.equal(weights, b.state_dict()[name]), name)

    def test_a_run_that_stops_goes_on_where_it_was(self):
        with tempfile.TemporaryDirectory() as a, tempfile.TemporaryDirectory() as b, redirect_stdout(io.StringIO()):
            straight, resumed = self.trained(a, 6), self.trained(b, 3, 6)
            self.assert_same_weights(straight.generator, resumed.generator)
            self.assert_same_weights(straight.discriminator, resumed.discriminator)
            generator = train.load_generator(Path(b) / "last.pt")
            self.assertEqual(generator.options, networks.GeneratorOptions())

    def test_a_checkpoint_of_another_variant_is_refused(self):
        with tempfile.TemporaryDirectory() as folder, redirect_stdout(io.StringIO()):
            self.trained(folder, 1)
            with self.assertRaisesRegex(DataError, "another variant"):
                self.trainer(folder, variant="instance")

    def test_a_run_starts_from_the_averaged_weights_of_another(self):
        with tempfile.TemporaryDirectory() as folder, redirect_stdout(io.StringIO()):
            first = self.trained(f"{folder}/first", 4)
            second = self.trainer(f"{folder}/second", f"{folder}/first/last.pt", seed=2)
            self.assertEqual(second.step, 0)
            self.assert_same_weights(first.average.network, second.generator)
            self.assert_same_weights(first.average.network, second.average.network)
            self.assert_same_weights(first.discriminator, second.discriminator)
            second.save()
            third = self.trainer(f"{folder}/second", f"{folder}/no such file")  # goes on with what the folder holds
            self.assert_same_weights(third.generator, second.generator)

    def test_a_run_starts_from_weights_alone(self):
        with tempfile.TemporaryDirectory() as folder, redirect_stdout(io.StringIO()):
            generator = networks.Generator()
            train.save_weights(f"{folder}/weights.pt", generator)
            plain = self.trainer(f"{folder}/plain")
            started = self.trainer(f"{folder}/started", f"{folder}/weights.pt")
            self.assert_same_weights(generator.half().float(), started.generator)
            self.assert_same_weights(plain.discriminator, started.discriminator)

    def test_what_does_not_fit_is_no_start(self):
        with tempfile.TemporaryDirectory() as folder, redirect_stdout(io.StringIO()):
            start = f"{folder}/start.pt"
            train.save_weights(start, networks.Generator())
            for variant in ("one-encoder", "instance"):
                with self.assertRaisesRegex(DataError, f"start.pt: is of another variant than {variant}; give"):
                    self.trainer(f"{folder}/{variant}", start, variant=variant)
            strange = {"discriminator": {"layers": torch.zeros(1)}}
            checkpoint.save(start, checkpoint_of(networks.Generator()) | strange)
            with self.assertRaisesRegex(DataError, "start.pt: its discriminator is of another version; start"):
                self.trainer(f"{folder}/strange", start)
            segmenter = segmentation_networks.PSPNet(segmentation_networks.variants()["roslam-pspnet"])
            checkpoint.save_weights(start, segmenter)
            with self.assertRaisesRegex(DataError, "start.pt: holds no network of this version"):
                self.trainer(f"{folder}/segmenter", start)


if __name__ == "__main__":
    unittest.main()
