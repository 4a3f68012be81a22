# SPDX-License-Identifier: BSD-3-Clause
import dataclasses
import json
import multiprocessing
import os
import re
import signal
import subprocess
import tempfile
import unittest
from pathlib import Path

os.environ["CUDA_VISIBLE_DEVICES"] = ""  # a GPU adds in any order, and no two runs are alike

import cv2
import numpy as np
import torch

from training.segmentation import (ablation, checkpoint, evaluation, export, figures, label_set, losses, mixture,
                                   networks, train)
from training.tests.test_data import NO_DECOYS, SHARED, one_picture_set, red_person

MODELS = Path(__file__).parents[2] / "models"
PROGRAM = os.environ.get("ROSLAM_PROGRAM", "")


def random_network(variant="roslam-pspnet"):
    """Untrained, but with no two weights alike and normalisations that do something."""
    torch.manual_seed(3)
    network = networks.PSPNet(networks.variants()[variant])
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.add_(torch.randn_like(parameter) * 0.05)
        for name, buffer in network.named_buffers():
            if name.endswith("running_var"):
                buffer.uniform_(0.5, 1.5)
    return network.eval()


class Networks(unittest.TestCase):
    def test_shapes_of_every_variant(self):
        for name, options in networks.variants().items():
            network = networks.PSPNet(options)
            scores = network.eval()(torch.zeros(1, 3, 96, 128))
            side = (2 if options.sub_pixel else 4) if options.decoder else 8
            self.assertEqual(scores.shape, (1, 19, 96 // side, 128 // side), name)
            main, block4, block5 = network.train()(torch.zeros(2, 3, 96, 128))
            self.assertEqual(block4.shape[2:], (12, 16), name)
            self.assertEqual(block5.shape[2], 96 // options.block5_stride, name)

    def test_table2_has_33_depthwise_layers_with_the_printed_widths(self):
        network = networks.PSPNet(networks.variants()["table2"])
        blocks = (network.block3, network.block4, network.block5)
        depthwise = [m for b in blocks for m in b.modules()
                     if isinstance(m, torch.nn.Conv2d) and m.groups == m.in_channels > 1]
        self.assertEqual(len(depthwise), 2 * (4 + 8 + 4))  # and block 1 makes 33
        self.assertEqual([b[-1].layers[-1][0].out_channels for b in blocks], [64, 128, 256])
        self.assertEqual([b[-1].layers[1][0].out_channels for b in blocks], [16, 32, 64])

    def test_the_shipped_variant_is_small(self):
        network = networks.PSPNet(networks.variants()["roslam-pspnet"])
        self.assertLess(networks.parameters_in_inference(network), 1.5e6)

    def test_what_is_added_starts_as_nothing(self):
        small = random_network("wide-bottlenecks")
        grown = networks.PSPNet(networks.variants()["roslam-pspnet"])
        self.assertGreater(networks.load_matching(grown, small.state_dict()), 0)
        picture = torch.rand(1, 3, 64, 96)
        with torch.no_grad():
            torch.testing.assert_close(grown.eval()(picture), small(picture), rtol=0, atol=0)

    def test_what_is_added_learns(self):
        network = networks.PSPNet(networks.variants()["roslam-pspnet"]).train()
        network(torch.rand(2, 3, 64, 96))[0].square().sum().backward()
        for part in (network.block5.context, network.refine8[-1], network.refine4[-1]):
            last = [m for m in part.modules() if isinstance(m, torch.nn.BatchNorm2d)][-1]
            self.assertGreater(float(last.weight.grad.abs().sum()), 0)

    def test_sub_pixel_scores_are_the_same_in_training(self):
        classifier = networks.SubPixelClassifier(8, 19)
        x = torch.randn(2, 8, 5, 7)
        torch.testing.assert_close(classifier.train()(x), classifier.eval()(x))

    def test_absurd_options_are_refused(self):
        with self.assertRaisesRegex(ValueError, "block5_stride"):
            networks.PSPNet(networks.NetworkOptions(block5_stride=4))
        with self.assertRaisesRegex(ValueError, "variant"):
            train.TrainingOptions(variant="resnet").validate()
        for wrong in ({"warm_up": 0}, {"save_every": 0}, {"precision": "single"}, {"average": 1.0}, {"workers": -1},
                      {"decay_share": 2.0}):
            with self.assertRaisesRegex(ValueError, next(iter(wrong))):
                train.TrainingOptions(**wrong).validate()
        with self.assertRaisesRegex(ValueError, "balance"):
            train.TrainingOptions(loss=losses.LossOptions(balance=0.5)).validate()
        with self.assertRaisesRegex(ValueError, "kitti: no such dataset"):
            mixture.training_data("", only=("kitti",))


class Export(unittest.TestCase):
    def test_folding_and_opencv_keep_the_scores_at_every_size(self):
        network = random_network()
        with tempfile.TemporaryDirectory() as folder:
            export.export(network, Path(folder) / "net.onnx")
            runner = cv2.dnn.readNetFromONNX(f"{folder}/net.onnx")
            for size in ((32, 32), (96, 160), (288, 384)):
                picture = torch.rand(1, 3, *size)
                runner.setInput(picture.numpy())
                expected = network(picture).detach().numpy()
                np.testing.assert_allclose(runner.forward(), expected, atol=1e-4 * np.abs(expected).max())

    def test_a_network_that_gives_no_numbers_is_refused(self):
        network = random_network("wide-stem")
        with torch.no_grad():
            network.classifier.bias.fill_(float("nan"))
        with tempfile.TemporaryDirectory() as folder:
            with self.assertRaisesRegex(RuntimeError, "differ"):
                export.export(network, Path(folder) / "net.onnx")
            self.assertFalse((Path(folder) / "net.onnx").exists())

    def test_weights_alone_are_a_checkpoint_of_half_the_size(self):
        network = random_network()
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "network.pt"
            checkpoint.save_weights(file, network)
            again = checkpoint.load_network(file)
            picture = torch.rand(1, 3, 64, 64)
            torch.testing.assert_close(again(picture), network(picture), rtol=0.05, atol=0.05)
            self.assertLess(file.stat().st_size, 3 * sum(p.numel() for p in network.parameters()))

    def test_the_mean_of_checkpoints(self):
        with tempfile.TemporaryDirectory() as folder:
            files = [Path(folder) / "a.pt", Path(folder) / "b.pt", Path(folder) / "other.pt"]
            first, second = random_network(), random_network()
            with torch.no_grad():
                second.classifier.bias += 3
            for file, network in zip(files, (first, second, random_network("wide-stem"))):
                checkpoint.save(file, {"average": network.state_dict(),
                                       "network_options": dataclasses.asdict(network.options)})
            mean = checkpoint.averaged([files[0], files[1], files[1]])
            torch.testing.assert_close(mean.classifier.bias, first.classifier.bias + 2)
            torch.testing.assert_close(mean.block1[0].weight, first.block1[0].weight)
            with self.assertRaisesRegex(checkpoint.DataError, "other.pt: is of another variant"):
                checkpoint.averaged(files)

    def test_a_pyramid_of_bins_exports_for_one_size(self):
        with tempfile.TemporaryDirectory() as folder:
            export.export(random_network("table2"), Path(folder) / "net.onnx")
            self.assertEqual(os.listdir(folder), ["net.onnx"])


class Scores(unittest.TestCase):
    def test_confusion_and_iou_by_hand(self):
        truth = np.array([0, 0, 0, 1, 1, 255], np.uint8)
        labels = np.array([0, 0, 1, 1, 9, 0], np.uint8)
        values = evaluation.iou(evaluation.confusion(truth, labels, 3))
        np.testing.assert_allclose(values, [2 / 3, 1 / 3, np.nan])

    def test_sets_that_span_groups_are_not_scored(self):
        table = evaluation.truth_table(label_set.GROUPS8)
        self.assertEqual(table[label_set.set_number(label_set.PERSON)], 5)
        self.assertEqual(table[label_set.set_number(label_set.STATIC)], label_set.VOID)
        self.assertEqual(table[label_set.set_number((8, 9))], 3)

    def test_working_size(self):
        self.assertEqual(evaluation.working_size(480, 640, 384), (288, 384))
        self.assertEqual(evaluation.working_size(1, 7680, 384), (32, 384))


class Schedule(unittest.TestCase):
    def test_rises_stays_and_falls_to_zero(self):
        options = train.TrainingOptions(steps=1000, warm_up=100, decay_share=0.2, learning_rate=0.01)
        self.assertAlmostEqual(train.rate_at(49, options), 0.005)
        self.assertAlmostEqual(train.rate_at(500, options), 0.01)
        self.assertAlmostEqual(train.rate_at(900, options), 0.005)
        self.assertLess(train.rate_at(999, options), 1e-4)


class Ablation(unittest.TestCase):
    def test_unknown_experiments_are_named(self):
        with self.assertRaisesRegex(ValueError, "resnet: no such experiment"):
            ablation.run("", "", train.TrainingOptions(), ["table2", "resnet"])

    def test_scores_of_another_recipe_are_not_taken(self):
        with tempfile.TemporaryDirectory() as folder:
            recipe = train.TrainingOptions(steps=3)
            (Path(folder) / "scores.json").write_text('{"people": 0.5}')
            checkpoint.save(Path(folder) / "last.pt", {"training_options": dataclasses.asdict(recipe)})
            same = dataclasses.replace(recipe, save_every=7)
            self.assertEqual(ablation.trained_and_scored(None, Path(folder), same), {"people": 0.5})
            with self.assertRaisesRegex(checkpoint.DataError, "another learning_rate"):
                ablation.trained_and_scored(None, Path(folder), dataclasses.replace(recipe, learning_rate=0.01))


class Figures(unittest.TestCase):
    def test_colours_are_those_of_the_program(self):
        source = (Path(__file__).parents[2] / "roslam/semantics/label_set.cpp").read_text()
        table = source[source.index("kColours{"):source.index("};", source.index("kColours{"))]
        colours = [tuple(map(int, bgr))[::-1] for bgr in re.findall(r"Vec3b\((\d+), (\d+), (\d+)\)", table)]
        self.assertEqual(colours, [tuple(map(int, colour)) for colour in figures.COLOURS])


class Training(unittest.TestCase):
    """Tiny runs on one made-up picture."""

    def trainer(self, folder, steps):
        options = train.TrainingOptions(variant="wide-stem", steps=steps, batch=4, crop=64, workers=0, warm_up=2,
                                        save_every=3, validate_every=1000, precision="float", average=0.9,
                                        loss=losses.LossOptions())
        source = mixture.TrainingData([one_picture_set("camvid")], [red_person()], NO_DECOYS)
        return train.Trainer(source, folder, options)

    def test_loss_falls(self):
        with tempfile.TemporaryDirectory() as folder:
            self.trainer(folder, 100).run()
            entries = [json.loads(line) for line in (Path(folder) / "log.jsonl").read_text().splitlines()]
            values = [e["loss"] for e in entries if "loss" in e]
            self.assertLess(values[-1], 0.7 * values[0])
            network = checkpoint.load_network(Path(folder) / "last.pt")
            scored = evaluation.score(network, one_picture_set(), label_set.GROUPS8, 64)
            self.assertGreater(scored["classes"]["flat"], 0.7)

    def test_a_run_that_was_stopped_goes_on_as_if_it_had_not_been(self):
        with tempfile.TemporaryDirectory() as whole, tempfile.TemporaryDirectory() as parts:
            self.trainer(whole, 8).run()
            first = self.trainer(parts, 8)
            step = first.train_step

            def stop_after_five(*batch):
                first.stopped = first.step == 4
                return step(*batch)

            first.train_step = stop_after_five
            first.run()
            self.assertEqual(first.step, 5)
            second = self.trainer(parts, 8)
            self.assertEqual(second.step, 5)
            second.run()
            a = checkpoint.load(Path(whole) / "last.pt")["network"]
            b = checkpoint.load(Path(parts) / "last.pt")["network"]
            for name in a:
                torch.testing.assert_close(a[name], b[name], rtol=1e-4, atol=1e-5)

    def test_a_request_to_stop_during_validation_waits_for_the_next_step(self):
        with tempfile.TemporaryDirectory() as folder:
            trainer = self.trainer(folder, 8)
            trainer.options = dataclasses.replace(trainer.options, validate_every=4)
            trainer.validate = lambda: setattr(trainer, "stopped", True)
            trainer.run()
            self.assertEqual(trainer.step, 5)
            self.assertEqual(checkpoint.load(Path(folder) / "last.pt")["step"], 5)

    def test_what_signals_did_before_they_do_again(self):
        with tempfile.TemporaryDirectory() as folder:
            before = [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)]
            self.trainer(folder, 1).run()
            self.assertEqual([signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)], before)

    def test_a_request_to_stop_leaves_the_workers_alone(self):
        with tempfile.TemporaryDirectory() as folder:
            trainer = self.trainer(folder, 8)
            trainer.options = dataclasses.replace(trainer.options, workers=1)
            step = trainer.train_step

            def stop_all(*batch):
                if trainer.step == 4:  # what a terminal or `timeout` does: every process of the group is asked
                    for child in multiprocessing.active_children():
                        os.kill(child.pid, signal.SIGTERM)
                    os.kill(os.getpid(), signal.SIGTERM)
                return step(*batch)

            trainer.train_step = stop_all
            trainer.run()
            self.assertEqual(checkpoint.load(Path(folder) / "last.pt")["step"], 5)

    def test_checkpoints_of_another_variant_are_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            self.trainer(folder, 1).run()
            source = mixture.TrainingData([one_picture_set("camvid")], [], NO_DECOYS)
            with self.assertRaisesRegex(checkpoint.DataError, "another variant than decoder"):
                train.Trainer(source, folder, train.TrainingOptions(variant="decoder", crop=64))

    def test_a_loss_that_is_no_number_ends_the_run_before_it_is_saved(self):
        with tempfile.TemporaryDirectory() as folder:
            trainer = self.trainer(folder, 8)
            with torch.no_grad():
                trainer.network.classifier.bias.fill_(float("nan"))
            with self.assertRaisesRegex(ArithmeticError, "loss of step 0 is nan"):
                trainer.run()
            self.assertFalse((Path(folder) / "last.pt").exists())

    def test_damaged_checkpoints_are_named(self):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "last.pt"
            file.write_bytes(b"no checkpoint")
            with self.assertRaisesRegex(checkpoint.DataError, "last.pt"):
                self.trainer(folder, 1)
            with self.assertRaisesRegex(checkpoint.DataError, "none.pt: no such"):
                checkpoint.load(Path(folder) / "none.pt")


@unittest.skipUnless(os.path.exists(PROGRAM), "the program is not built")
class Program(unittest.TestCase):
    """The C++ program against this code."""

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.root = Path(self.folder.name)

    def run_program(self, *arguments):
        return subprocess.run([PROGRAM, *map(str, arguments)], check=True, capture_output=True, text=True).stdout

    def pictures(self):
        rng = np.random.default_rng(2)
        for i, size in enumerate(((480, 640), (256, 256), (360, 480), (100, 333), (720, 1280))):
            coarse = rng.integers(0, 256, (size[0] // 30 + 2, size[1] // 30 + 2, 3), np.uint8)
            yield f"{i}", cv2.resize(coarse, size[::-1], interpolation=cv2.INTER_CUBIC)

    def assert_same_labels(self, network, pictures, *arguments):
        """Demands that `roslam segment` labels pictures as PyTorch does; returns the labels of PyTorch."""
        (self.root / "in").mkdir()
        for name, picture in pictures.items():
            cv2.imwrite(str(self.root / "in" / f"{name}.png"), picture)
        self.run_program("segment", self.root / "in", "--out", self.root / "out", "--quiet", *arguments)
        expected = {name: evaluation.predict(network, picture[..., ::-1].copy()) for name, picture in pictures.items()}
        equal, total = 0, 0
        for name in pictures:
            labels = cv2.imread(str(self.root / "out" / f"{name}.png"), cv2.IMREAD_UNCHANGED)
            equal += (labels == expected[name]).sum()
            total += labels.size
        self.assertGreaterEqual(equal / total, 0.995)
        return list(expected.values())

    def test_labels_are_those_of_pytorch(self):
        network = random_network()
        with torch.no_grad():  # the classes made alike on average, or one would win nearly everywhere
            mean = network(evaluation.network_input(next(self.pictures())[1])).mean((0, 2, 3))
            network.classifier.bias -= mean
        export.export(network, self.root / "net.onnx")
        pictures = dict(self.pictures())
        for expected in self.assert_same_labels(network, pictures, "--model", self.root / "net.onnx"):
            self.assertGreater(len(np.unique(expected)), 2)  # or the comparison would say nothing

    def test_the_shipped_file_has_the_shipped_weights(self):
        network = checkpoint.load_network(MODELS / "roslam-pspnet.pt")
        data = SHARED / "segmentation/camvid/val/images"
        files = sorted(data.glob("*"))[::2] if data.exists() else []
        pictures = {f.stem: cv2.imread(str(f)) for f in files} or dict(self.pictures())
        expected = self.assert_same_labels(network, pictures)
        self.assertGreater(len(set().union(*map(np.unique, expected))), 2)

    def test_scores_are_those_of_this_code(self):
        rng = np.random.default_rng(4)
        classes = len(label_set.GROUPS8)
        counts = np.zeros((classes, classes + 1), np.int64)
        for part in ("truth", "labels"):
            (self.root / part).mkdir()
        for i in range(3):
            truth, labels = (rng.choice([0, 2, 5, 11, 13, 18, 255], (40, 50)).astype(np.uint8) for _ in range(2))
            labels = np.where(rng.random((40, 50)) < 0.6, truth, labels)
            cv2.imwrite(str(self.root / "truth" / f"{i}.png"), truth)
            cv2.imwrite(str(self.root / "labels" / f"{i}.png"), labels)
            table = label_set.grouping(label_set.GROUPS8)
            counts += evaluation.confusion(table[truth], table[labels], classes)
        values = evaluation.iou(counts)
        report = json.loads(self.run_program("evaluate", "segmentation", "--truth", self.root / "truth", "--estimate",
                                             self.root / "labels", "--classes", "groups8", "--json"))
        self.assertAlmostEqual(report["mean_iou"], float(np.nanmean(values)), places=9)
        for name, value in zip(label_set.GROUPS8, values):
            found = report["by_class"][name]["iou"]
            self.assertTrue(found is None if np.isnan(value) else abs(found - value) < 1e-9, name)


if __name__ == "__main__":
    unittest.main()
