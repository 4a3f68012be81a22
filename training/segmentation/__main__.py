# SPDX-License-Identifier: BSD-3-Clause
"""python3 -m training.segmentation COMMAND: see --help and training/README.md."""
import argparse
import os
import sys

import torch

from training.command_line import add_options, chosen, run
from training.segmentation import (ablation, checkpoint, cost, evaluation, export, figures, label_set,
                                   mixture, networks, processes, train)
from training.segmentation.losses import LossOptions


def training_options(arguments):
    return chosen(arguments, train.TrainingOptions, loss=chosen(arguments, LossOptions))


def run_train(arguments):
    if arguments.processes > 1 and "RANK" not in os.environ:
        return processes.start(arguments.processes, sys.argv[1:])
    options = training_options(arguments)
    source = mixture.training_data(arguments.data, arguments.cityscapes, options.only)
    train.Trainer(source, arguments.out, options, arguments.start_from).run()
    return 0


def run_evaluate(arguments):
    network = checkpoint.load_network(arguments.checkpoint)
    sets = mixture.validation_sets(arguments.data, arguments.cityscapes)
    sets.append((sets[0][0], label_set.CITYSCAPES19))
    for data, groups in sets:
        scored = evaluation.score(network, data, groups, arguments.side)
        print(f"{data.name}: mean IoU {scored['mean']:.4f} over {len(groups)} classes, {len(data)} pictures")
        for name, value in scored["classes"].items():
            print(f"  {name:14} IoU {'-' if value is None else format(value, '.3f'):>6}  recall {scored['recall'][name]:.3f}")


def run_export(arguments):
    network = checkpoint.averaged(arguments.checkpoint)
    export.export(network, arguments.out)
    if arguments.weights:
        checkpoint.save_weights(arguments.weights, network)


def run_cost(arguments):
    torch.set_num_threads(1)
    for name, options in networks.variants().items():
        torch.manual_seed(1)
        network = networks.PSPNet(options)
        for parameter in network.parameters():  # equal weights would be merged, which OpenCV cannot read
            torch.nn.init.normal_(parameter, std=0.05)
        measured = cost.measure(network, tuple(arguments.size))
        print(f"{name:18} {measured['parameters'] / 1e6:.2f} M parameters, {measured['multiply_adds'] / 1e9:.2f} G "
              f"multiply-adds, {measured['milliseconds']:.1f} ms", flush=True)


def run_ablation(arguments):
    print(ablation.markdown(ablation.run(arguments.data, arguments.out, training_options(arguments), arguments.names)))


def run_figures(arguments):
    if arguments.run_folder:
        figures.convergence(arguments.run_folder, arguments.out)
    else:
        models = [m.split("=", 1) if "=" in m else (m, m) for m in arguments.models]
        figures.side_by_side(models, arguments.pictures, arguments.out)


def main():
    parser = argparse.ArgumentParser(prog="python3 -m training.segmentation", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)

    def command(name, run, text, data=False):
        added = commands.add_parser(name, help=text, description=text)
        added.set_defaults(run=run)
        if data:
            added.add_argument("--data", required=True, help="folder with segmentation/, cutouts/ and backgrounds/")
        return added

    added = command("train", run_train, "train a variant, or go on with a run that was stopped", data=True)
    added.add_argument("--out", required=True, help="folder of the run: log.jsonl and last.pt; a run in it goes on")
    added.add_argument("--cityscapes", help="Cityscapes in its official layout, in place of the 256x256 copy")
    added.add_argument("--start-from", help="checkpoint whose weights a new run starts with")
    added.add_argument("--processes", type=int, default=1, help="processes that share each batch, on this machine")
    add_options(added, train.TrainingOptions)
    add_options(added, LossOptions)

    added = command("evaluate", run_evaluate, "score a checkpoint on the validation sets", data=True)
    added.add_argument("--checkpoint", required=True)
    added.add_argument("--cityscapes", help="Cityscapes in its official layout, in place of the 256x256 copy")
    added.add_argument("--side", type=int, default=evaluation.WORKING_SIDE, help="longer side the network sees, pixels")

    added = command("export", run_export, "write a checkpoint as an ONNX file and check it with OpenCV")
    added.add_argument("--checkpoint", required=True, nargs="+", help="of several of one variant the mean is written")
    added.add_argument("--out", required=True, help="the ONNX file")
    added.add_argument("--weights", help="also write the weights alone, in half precision, to start other runs from")

    added = command("cost", run_cost, "weights, multiply-adds and milliseconds of every variant, untrained")
    added.add_argument("--size", type=int, nargs=2, default=ablation.SIZE, metavar=("HEIGHT", "WIDTH"))

    added = command("ablation", run_ablation, "train variants alike and compare them", data=True)
    added.add_argument("--out", required=True, help="folder of the runs, ablation.json and ablation.md")
    added.add_argument("--names", nargs="*", default=(), help=f"of: {', '.join(ablation.experiments())}; default all")
    add_options(added, train.TrainingOptions)
    add_options(added, LossOptions)

    added = command("figures", run_figures, "draw the convergence of a run, or labels of models side by side")
    added.add_argument("--out", required=True, help="the PNG or JPEG file")
    added.add_argument("--run-folder", help="of a training run: draws its convergence")
    added.add_argument("--models", nargs="*", default=(), help="TITLE=FILE.onnx")
    added.add_argument("--pictures", nargs="*", default=())

    return run(parser)


if __name__ == "__main__":
    sys.exit(main())
