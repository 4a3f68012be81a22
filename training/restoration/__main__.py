# SPDX-License-Identifier: BSD-3-Clause
"""python3 -m training.restoration COMMAND: see --help and training/README.md."""
import argparse
import sys

from training.command_line import add_options, chosen, run
from training.restoration import evaluation, export, samples, train
from training.restoration.losses import LossOptions
from training.segmentation import checkpoint


def run_train(arguments):
    options = chosen(arguments, train.TrainingOptions, loss=chosen(arguments, LossOptions))
    options.validate()
    training = samples.TrainingSamples(arguments.data, options.seed, options.batch, options.crop)
    train.Trainer(training, samples.validation_samples(arguments.data), arguments.out, options,
                  checkpoint.load_network(arguments.segmenter), arguments.start_from).run()


def run_evaluate(arguments):
    methods = evaluation.classic_methods()
    for item in arguments.checkpoint:
        name, file = item.split("=", 1) if "=" in item else (item, item)
        generator = train.load_generator(file)
        methods[name] = lambda sample, generator=generator: evaluation.paint(generator, sample)
    held_out = samples.validation_samples(arguments.data)
    segmenter = checkpoint.load_network(arguments.segmenter)
    print(f"{len(held_out)} held-out streets, holes of 10 to 30 %; in brackets where the truth does not move")
    for kind, of_kind in [("all", held_out), *evaluation.by_class(held_out).items()]:
        for name, s in (evaluation.score(of_kind, methods, segmenter) if of_kind else {}).items():
            print(f"{kind:8} {name:20} PSNR {s['psnr']:.2f} ({s['psnr_static']:.2f}) dB  SSIM {s['ssim']:.3f} "
                  f"({s['ssim_static']:.3f})  L1 {s['l1']:.1f} ({s['l1_static']:.1f}) grey levels  "
                  f"taken for movable {100 * s['movable']:.2f} %")


def run_export(arguments):
    generator = train.load_generator(arguments.checkpoint)
    export.export(generator, arguments.out)
    if arguments.weights:
        train.save_weights(arguments.weights, generator)


def add_segmenter(command, use):
    command.add_argument("--segmenter", default="models/roslam-pspnet.pt",
                         help=f"checkpoint of the segmentation network, {use}")


def main():
    parser = argparse.ArgumentParser(prog="python3 -m training.restoration", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)

    def command(name, run, text, data=False):
        added = commands.add_parser(name, help=text, description=text)
        added.set_defaults(run=run)
        if data:
            added.add_argument("--data", required=True, help="folder with segmentation/, cutouts/ and backgrounds/")
        return added

    added = command("train", run_train, "train a generator, or go on with a run that was stopped", data=True)
    added.add_argument("--out", required=True, help="folder of the run: log.jsonl and last.pt; a run in it goes on")
    add_segmenter(added, "whose features are compared")
    added.add_argument("--start-from", help="checkpoint of the same variant whose weights a new run starts with")
    add_options(added, train.TrainingOptions)
    add_options(added, LossOptions)

    added = command("evaluate", run_evaluate, "compare generators with OpenCV's methods on held-out streets", data=True)
    added.add_argument("--checkpoint", nargs="*", default=[], metavar="NAME=FILE")
    add_segmenter(added, "which says what of the painted may move")

    added = command("export", run_export, "write a checkpoint as an ONNX file for each class and check them with OpenCV")
    added.add_argument("--checkpoint", required=True)
    added.add_argument("--out", required=True, help="folder of the files roslam-restorer-CLASS.onnx")
    added.add_argument("--weights", help="also write the weights alone, in half precision, to start other runs from")

    return run(parser)


if __name__ == "__main__":
    sys.exit(main())
