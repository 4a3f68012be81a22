# SPDX-License-Identifier: BSD-3-Clause
"""What the commands of all trainings share: flags from options, errors in one line."""
import dataclasses
import sys

import cv2

from training.segmentation.datasets import DataError


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


def run(parser):
    """Runs the command that was chosen (its `run`, a function of the arguments); returns the exit code."""
    arguments = parser.parse_args()
    cv2.setNumThreads(1)  # a pool of threads does not survive the fork that makes the workers of a loader
    try:
        return arguments.run(arguments) or 0
    except (DataError, ValueError, ArithmeticError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
