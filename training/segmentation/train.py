# SPDX-License-Identifier: BSD-3-Clause
"""The training loop: one code path for a CPU, a GPU, or several processes started by torchrun."""
import contextlib
import dataclasses
import json
import math
import os
import platform
import signal
import time
from dataclasses import dataclass, field
from pathlib import Path

import torch
from torch import distributed
from torch.nn.parallel import DistributedDataParallel
from torch.utils import data

from training.segmentation import checkpoint, evaluation, losses, mixture, networks, optimiser


@dataclass(frozen=True)
class TrainingOptions:
    variant: str = "roslam-pspnet"  # of networks.variants()
    steps: int = 20000  # of one batch each
    batch: int = 16  # crops, over all processes
    optimiser: str = "orthogonal"  # orthogonal or adam
    learning_rate: float = 2.5e-3  # after the warm-up
    warm_up: int = 300  # steps
    decay_share: float = 0.3  # last share of the steps, over which the rate falls to zero
    weight_decay: float = 0.01
    average: float = 0.999  # decay of the moving average of the weights, which is what ships
    seed: int = 1
    crop: int = 256  # pixels
    workers: int = 1  # processes that make samples
    save_every: int = 200  # steps
    validate_every: int = 1000  # steps
    precision: str = "auto"  # auto, float, half
    only: tuple = ()  # names of datasets to train on; empty = all
    loss: losses.LossOptions = field(default_factory=losses.LossOptions)

    def validate(self):
        if self.variant not in networks.variants():
            raise ValueError(f"variant {self.variant}: one of {', '.join(networks.variants())}")
        if self.optimiser not in ("orthogonal", "adam"):
            raise ValueError("optimiser must be orthogonal or adam")
        if min(self.steps, self.batch, self.crop, self.warm_up, self.save_every, self.validate_every) < 1:
            raise ValueError("steps, batch, crop, warm_up, save_every and validate_every must be positive")
        if not 0 < self.learning_rate < 1 or not 0 <= self.average < 1 or not 0 <= self.decay_share <= 1:
            raise ValueError("learning_rate, average and decay_share must be between 0 and 1")
        if self.weight_decay < 0 or self.workers < 0:
            raise ValueError("weight_decay and workers must not be negative")
        if self.precision not in ("auto", "float", "half"):
            raise ValueError("precision must be auto, float or half")
        self.loss.validate()
        if self.crop % networks.SIZE_MULTIPLE:
            raise ValueError(f"crop must be a multiple of {networks.SIZE_MULTIPLE} pixels")


def rate_at(step, options):
    """Warm-up, a plateau that later runs may lengthen, and a linear fall to zero."""
    fall = max(round(options.decay_share * options.steps), 1)
    return options.learning_rate * min((step + 1) / options.warm_up, 1, (options.steps - step) / fall)


def half_precision(device, precision):
    """A context that computes in half precision where that is asked for and pays."""
    if precision == "float":
        return contextlib.nullcontext()
    if device.type == "cuda":
        kind = torch.bfloat16 if torch.cuda.is_bf16_supported() else torch.float16
        return torch.autocast("cuda", dtype=kind)
    if precision == "half" or cpu_has_bfloat16():
        return torch.autocast("cpu", dtype=torch.bfloat16)
    return contextlib.nullcontext()


def cpu_has_bfloat16():
    """Without the instructions, half precision is emulated and slower."""
    try:
        return "avx512_bf16" in Path("/proc/cpuinfo").read_text()
    except OSError:
        return False


class Processes:
    """The processes that train together: one, or as many as torchrun started."""

    def __init__(self):
        self.count = int(os.environ.get("WORLD_SIZE", 1))
        self.rank = int(os.environ.get("RANK", 0))
        local = int(os.environ.get("LOCAL_RANK", 0))
        self.device = torch.device("cuda", local) if torch.cuda.is_available() else torch.device("cpu")
        # One tensor for the whole run: a thread of PyTorch 1.13 that lets the last reference to one go while the
        # processes part waits for them for ever.
        self.flag = torch.zeros(1, device=self.device)
        if self.count > 1:
            distributed.init_process_group("nccl" if self.device.type == "cuda" else "gloo")

    def wrap(self, network):
        if self.count == 1:
            return network
        return DistributedDataParallel(network, [self.device.index] if self.device.type == "cuda" else None)

    def any(self, flag):
        """True if the flag is set in any process, so that all stop after the same step."""
        if self.count == 1:
            return flag
        self.flag.fill_(float(flag))
        distributed.all_reduce(self.flag, distributed.ReduceOp.MAX)
        return bool(self.flag.item())

    def close(self):
        if self.count > 1:
            distributed.destroy_process_group()


def sample_loader(samples, first_step, options, processes):
    """Batches from first_step on. Sample numbers depend on the step and the process alone."""
    share = options.batch // processes.count
    numbers = (step * options.batch + processes.rank * share + i
               for step in range(first_step, options.steps) for i in range(share))
    return data.DataLoader(samples, batch_size=share, sampler=_Numbers(numbers, (options.steps - first_step) * share),
                           num_workers=options.workers, drop_last=True, pin_memory=processes.device.type == "cuda",
                           worker_init_fn=_single_threaded)


class _Numbers(data.Sampler):
    def __init__(self, numbers, count):
        self.numbers, self.count = numbers, count

    def __iter__(self):
        return self.numbers

    def __len__(self):
        return self.count


def _single_threaded(_):
    import cv2

    cv2.setNumThreads(1)
    torch.set_num_threads(1)
    for number in (signal.SIGINT, signal.SIGTERM):  # the main process decides when to stop
        signal.signal(number, signal.SIG_IGN)


class Log:
    """Appends JSON lines to a file and prints them short; silent in all processes but the first."""

    def __init__(self, file, is_first):
        self.file = file if is_first else None

    def write(self, **entry):
        if self.file:
            with open(self.file, "a", encoding="utf-8") as out:
                out.write(json.dumps(entry) + "\n")
            print(" ".join(f"{k} {v:.5g}" if isinstance(v, float) else f"{k} {v}" for k, v in entry.items()), flush=True)


class Loop:
    """Steps of training that may stop and go on anywhere. What is trained has options, processes, samples, log, step,
    stopped, save() and validate(), and begin(), which gives a function of a batch that does a step and returns values to
    log."""

    def run(self):
        """Trains to the last step. Ctrl-C or a termination request saves and stops; the same call goes on."""
        before = {number: signal.signal(number, lambda *_: setattr(self, "stopped", True))
                  for number in (signal.SIGINT, signal.SIGTERM)}
        try:
            self.run_to_the_end()
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def run_to_the_end(self):
        self.log.write(event="start", step=self.step, variant=self.options.variant, device=str(self.processes.device),
                       processes=self.processes.count, host=platform.machine(), torch=torch.__version__)
        learn = self.begin()
        begin, since = time.monotonic(), []
        for batch in sample_loader(self.samples, self.step, self.options, self.processes):
            since.append(learn(batch))
            if self.step % 50 == 0:
                means = {name: sum(values.get(name, 0.0) for values in since) / len(since) for name in since[-1]}
                self.log.write(step=self.step, **means, rate=rate_at(self.step - 1, self.options),
                               seconds=(time.monotonic() - begin) / len(since))
                begin, since = time.monotonic(), []
            # Asked once a step: all processes have to agree, and a request that comes later waits for the next step.
            is_stopped = self.processes.any(self.stopped)
            is_last = is_stopped or self.step == self.options.steps
            if is_last or self.step % self.options.save_every == 0:
                self.save()
            if self.step % self.options.validate_every == 0 or self.step == self.options.steps:
                self.validate()
                begin = time.monotonic()
            if is_stopped:
                break
        self.log.write(event="stopped" if self.step < self.options.steps else "end", step=self.step)
        self.processes.close()


class Trainer(Loop):
    """Everything a run holds: made anew or from the checkpoint in its folder. source: mixture.TrainingData."""

    def __init__(self, source, out, options, start_from=None):
        options.validate()
        self.options, self.out = options, Path(out)
        self.processes = Processes()
        if options.batch % self.processes.count:
            raise ValueError(f"batch must be a multiple of the {self.processes.count} processes")
        self.out.mkdir(parents=True, exist_ok=True)
        self.log = Log(self.out / "log.jsonl", self.processes.rank == 0)
        crops = dataclasses.replace(mixture.augmentation.AugmentationOptions(), crop=options.crop)
        self.samples = mixture.Mixture(source.sets, source.people, source.decoys, options.seed, crops)
        self.validation = source.validation if self.processes.rank == 0 else ()
        torch.manual_seed(options.seed)
        network = networks.PSPNet(networks.variants()[options.variant])
        self.network = network.to(self.processes.device, memory_format=torch.channels_last)
        self.shares = mixture.set_shares(self.samples)
        self.loss = losses.DeepSupervision(self.shares, options.loss).to(self.processes.device)
        self.optimisers = optimiser.optimisers(self.network, options.optimiser, options.learning_rate,
                                               options.weight_decay)
        self.average = checkpoint.Average(self.network, options.average)
        self.scaler = torch.cuda.amp.GradScaler(
            enabled=self.processes.device.type == "cuda" and not torch.cuda.is_bf16_supported())
        self.step = 0
        self.stopped = False
        if (self.out / "last.pt").exists():
            self.restore(checkpoint.load(self.out / "last.pt"))
        elif start_from:
            missing = networks.load_matching(self.network, checkpoint.load(start_from)["average"])
            if missing == len(self.network.state_dict()):
                raise checkpoint.DataError(f"{start_from}: no weight of it has a place in {options.variant}")
            self.log.write(event="weights taken over", of=str(start_from), new=missing)
            self.average = checkpoint.Average(self.network, options.average)

    def restore(self, content):
        if content.get("network_options") != dataclasses.asdict(self.network.options):
            raise checkpoint.DataError(f"{self.out / 'last.pt'}: is of another variant than {self.options.variant}; give "
                                       "another --out")
        self.network.load_state_dict(content["network"])
        self.average.network.load_state_dict(content["average"])
        # Another optimiser cannot use what the one before it remembered, and starts afresh.
        if content["training_options"].get("optimiser") == self.options.optimiser:
            for mine, saved in zip(self.optimisers, content["optimisers"]):
                mine.load_state_dict(saved)
        self.step = content["step"]

    def save(self, name="last.pt"):
        if self.processes.rank == 0:
            checkpoint.save(self.out / name, {
                "network": self.network.state_dict(), "average": self.average.network.state_dict(),
                "optimisers": [o.state_dict() for o in self.optimisers], "step": self.step,
                "network_options": dataclasses.asdict(self.network.options),
                "training_options": dataclasses.asdict(self.options)})

    def validate(self):
        if not self.validation:
            return
        result = evaluation.score_all(self.average.network, self.validation)
        self.log.write(step=self.step, **{f"iou_{k}": round(v, 4) for k, v in result.items()})

    def train_step(self, network, pictures, labels):
        options, device = self.options, self.processes.device
        rate = rate_at(self.step, options)
        for group in (group for o in self.optimisers for group in o.param_groups):
            group["lr"] = rate
        images = pictures.to(device, non_blocking=True).permute(0, 3, 1, 2).float().div(255)
        images = images.contiguous(memory_format=torch.channels_last)
        with half_precision(device, options.precision):
            outputs = network(images)
        loss = self.loss(outputs, labels.to(device, non_blocking=True), self.head_weights())
        value = float(loss.detach())
        if not math.isfinite(value):
            raise ArithmeticError(f"the loss of step {self.step} is {value}; go on from {self.out / 'last.pt'} with a "
                                  "lower --learning-rate")
        self.network.zero_grad(set_to_none=True)
        self.scaler.scale(loss).backward()
        for each in self.optimisers:
            self.scaler.unscale_(each)
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), 5.0)
        for each in self.optimisers:
            self.scaler.step(each)
        self.scaler.update()
        self.average.update(self.network, self.step)
        self.step += 1
        return value

    def head_weights(self):
        return [self.network.classifier.weight, self.network.auxiliary4[-1].weight, self.network.auxiliary5[-1].weight]

    def begin(self):
        network = self.processes.wrap(self.network).train()
        return lambda batch: {"loss": self.train_step(network, *batch)}
