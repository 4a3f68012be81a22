# SPDX-License-Identifier: BSD-3-Clause
"""Checkpoints that a crash cannot damage, and a moving average of the weights."""
import copy
import dataclasses
import os
from pathlib import Path

import torch

from training.segmentation import networks
from training.segmentation.datasets import DataError


def save(file, content):
    """Writes to a temporary name and renames: the old checkpoint stays until the new one is whole."""
    file = Path(file)
    file.parent.mkdir(parents=True, exist_ok=True)
    temporary = file.with_suffix(".tmp")
    torch.save(content, temporary)
    os.replace(temporary, file)


def load(file):
    try:
        return torch.load(file, map_location="cpu")
    except FileNotFoundError:
        raise DataError(f"{file}: no such checkpoint") from None
    except Exception as error:
        raise DataError(f"{file}: not a readable checkpoint ({type(error).__name__})") from error


def load_network(file, key="network_options", make=lambda options: networks.PSPNet(networks.NetworkOptions(**options))):
    """The averaged network of a checkpoint, in evaluation mode: made of the options it holds under the key."""
    content = load(file)
    try:
        network = make(content[key])
        network.load_state_dict(content["average"])
    except (KeyError, TypeError, RuntimeError) as error:
        raise DataError(f"{file}: holds no network of this version ({type(error).__name__})") from error
    return network.eval()


def averaged(files):
    """The mean of the averaged networks of several checkpoints of one variant, in evaluation mode. Where they are runs
    of one origin, their mean holds what each learned and errs less on what none has seen (M. Wortsman et al., "Model
    soups", 2022). A file named several times counts several times."""
    networks_of_files = [load_network(file) for file in files]
    result = networks_of_files[0]
    for file, network in zip(files, networks_of_files):
        if network.options != result.options:
            raise DataError(f"{file}: is of another variant than {files[0]}")
    states = [network.state_dict() for network in networks_of_files]
    result.load_state_dict({name: torch.stack([s[name] for s in states]).mean(0) if w.is_floating_point() else w
                            for name, w in states[0].items()})
    return result


def save_weights(file, network, key="network_options"):
    """A checkpoint of the averaged weights alone, in half precision: what load_network, with the same key, and
    --start-from need."""
    weights = {name: w.half() if w.is_floating_point() else w for name, w in network.state_dict().items()}
    save(file, {"average": weights, key: dataclasses.asdict(network.options)})


class Average:
    """Exponential moving average of a network's weights and normalisation statistics."""

    def __init__(self, network, decay):
        self.decay = decay
        self.network = copy.deepcopy(network).eval()
        for parameter in self.network.parameters():
            parameter.requires_grad_(False)

    @torch.no_grad()
    def update(self, network, step):
        decay = min(self.decay, (1 + step) / (10 + step))  # forgets the random start quickly
        for mine, theirs in zip(self.network.state_dict().values(), network.state_dict().values()):
            if mine.dtype.is_floating_point:
                mine.lerp_(theirs.detach().to(mine.dtype), 1 - decay)
            else:
                mine.copy_(theirs)
