# SPDX-License-Identifier: BSD-3-Clause
"""python3 -m training.segmentation COMMAND: see --help and training/README.md."""
import argparse
import dataclasses
import sys

from training.segmentation import train
from training.segmentation.datasets import DataError
from training.segmentation.losses import LossOptions


def add_options(parser, options_class):
    """One flag a field of an options dataclass, with its default."""
    for field in dataclasses.fields(options_class):
        if dataclasses.is_dataclass(field.type) or field.name == "loss":
            continue
        flag = "--" + field.name.replace("_", "-")
        if field.type is bool or isinstance(field.default, bool):
            parser.add_argument(flag, action="store_true", default=field.default)
        elif isinstance(field.default, tuple):
            parser.add_argument(flag, nargs="*", default=field.default)
        else:
            parser.add_argument(flag, type=type(field.default), default=field.default, help=f"default {field.default}")


def chosen(arguments, options_class, **more):
    names = {f.name for f in dataclasses.fields(options_class)} - set(more)
    values = {n: getattr(arguments, n) for n in names}
    return options_class(**{k: tuple(v) if isinstance(v, list) else v for k, v in values.items()}, **more)


def run_train(arguments):
    options = chosen(arguments, train.TrainingOptions, loss=chosen(arguments, LossOptions))
    train.Trainer(arguments.data, arguments.out, options, arguments.cityscapes, arguments.start_from).run()


def main():
    parser = argparse.ArgumentParser(prog="python3 -m training.segmentation", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    command = commands.add_parser("train", help="train a variant, or go on with a run that was stopped")
    command.add_argument("--data", required=True, help="folder with segmentation/, cutouts/ and backgrounds/")
    command.add_argument("--out", required=True, help="folder of the run: log.jsonl and last.pt; a run in it goes on")
    command.add_argument("--cityscapes", help="Cityscapes in its official layout, in place of the 256x256 copy")
    command.add_argument("--start-from", help="checkpoint whose weights a new run starts with")
    add_options(command, train.TrainingOptions)
    add_options(command, LossOptions)
    command.set_defaults(run=run_train)
    arguments = parser.parse_args()
    try:
        arguments.run(arguments)
    except (DataError, ValueError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
