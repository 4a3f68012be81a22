# SPDX-License-Identifier: BSD-3-Clause
"""The training loop of generator and discriminator: a CPU, a GPU, or several processes; may stop and go on anywhere."""
import dataclasses
import math
from dataclasses import dataclass, field
from pathlib import Path

import torch

from training.restoration import evaluation, losses, networks
from training.segmentation import checkpoint
from training.segmentation.train import Log, Loop, Processes, half_precision, rate_at


@dataclass(frozen=True)
class TrainingOptions:
    variant: str = "roslam-restorer"  # of networks.variants()
    steps: int = 20000  # of one batch each
    batch: int = 8  # crops of one class, over all processes
    learning_rate: float = 5e-4  # after the warm-up
    discriminator_rate: float = 2e-4
    warm_up: int = 200  # steps
    decay_share: float = 0.3  # last share of the steps, over which the rates fall to zero
    adversary_from: int = 1500  # step from which the discriminator's opinion counts
    average: float = 0.999  # decay of the moving average of the weights, which is what ships
    seed: int = 1
    crop: int = 256  # pixels
    workers: int = 1  # processes that make samples
    save_every: int = 200  # steps
    validate_every: int = 1000  # steps
    precision: str = "auto"  # auto, float, half
    loss: losses.LossOptions = field(default_factory=losses.LossOptions)

    def validate(self):
        if self.variant not in networks.variants():
            raise ValueError(f"variant {self.variant}: one of {', '.join(networks.variants())}")
        if min(self.steps, self.batch, self.crop, self.warm_up, self.save_every, self.validate_every) < 1:
            raise ValueError("steps, batch, crop, warm_up, save_every and validate_every must be positive")
        if not 0 < self.learning_rate < 1 or not 0 < self.discriminator_rate < 1:
            raise ValueError("learning_rate and discriminator_rate must be between 0 and 1")
        if not 0 <= self.average < 1 or not 0 <= self.decay_share <= 1:
            raise ValueError("average and decay_share must be between 0 and 1")
        if self.crop % 32 or self.workers < 0:
            raise ValueError("crop must be a multiple of 32 pixels, workers not negative")
        if self.precision not in ("auto", "float", "half"):
            raise ValueError("precision must be auto, float or half")
        self.loss.validate()


def load_generator(file):
    """The averaged generator of a checkpoint, in evaluation mode."""
    return checkpoint.load_network(file, "generator_options",
                                   lambda options: networks.Generator(networks.GeneratorOptions(**options)))


def save_weights(file, generator):
    """A checkpoint that load_generator and --start-from read: the weights alone, in half precision."""
    checkpoint.save_weights(file, generator, "generator_options")


class Trainer(Loop):
    """Everything a run holds: made anew or from the checkpoint in its folder. training: a dataset as
    samples.TrainingSamples is, in batches of the options' size; validation: a list of samples.Sample; segmenter: a
    network of training.segmentation, whose features are compared."""

    def __init__(self, training, validation, out, options, segmenter, start_from=None):
        options.validate()
        self.options, self.out = options, Path(out)
        self.processes = Processes()
        if self.processes.count > 1:
            raise ValueError("restoration trains in one process")
        self.out.mkdir(parents=True, exist_ok=True)
        self.log = Log(self.out / "log.jsonl", True)
        self.samples, self.validation = training, validation
        device = self.processes.device
        torch.manual_seed(options.seed)
        self.generator = networks.Generator(networks.variants()[options.variant]).to(device)
        self.discriminator = networks.Discriminator().to(device)
        self.eyes = losses.SegmentationEyes(segmenter).to(device)
        self.optimisers = (torch.optim.Adam(self.generator.parameters(), options.learning_rate, betas=(0.8, 0.99)),
                           torch.optim.Adam(self.discriminator.parameters(), options.discriminator_rate, betas=(0, 0.9)))
        self.average = checkpoint.Average(self.generator, options.average)
        self.step, self.stopped = 0, False
        if (self.out / "last.pt").exists():
            self.restore(checkpoint.load(self.out / "last.pt"))
        elif start_from:
            self.take_over(start_from)

    def expect_variant(self, file, options, remedy):
        if options != dataclasses.asdict(self.generator.options):
            raise checkpoint.DataError(f"{file}: is of another variant than {self.options.variant}; {remedy}")

    def take_over(self, file):
        """Starts with the averaged weights of a checkpoint, and its discriminator if it holds one."""
        generator = load_generator(file)
        self.expect_variant(file, dataclasses.asdict(generator.options), "give the --variant that it is of")
        self.generator.load_state_dict(generator.state_dict())
        self.average = checkpoint.Average(self.generator, self.options.average)
        discriminator = checkpoint.load(file).get("discriminator")
        if discriminator:
            try:
                self.discriminator.load_state_dict(discriminator)
            except RuntimeError as error:
                raise checkpoint.DataError(f"{file}: its discriminator is of another version; start from its weights "
                                           "alone (export --weights)") from error
        self.log.write(event="weights taken over", of=str(file), discriminator=bool(discriminator))

    def restore(self, content):
        self.expect_variant(self.out / "last.pt", content.get("generator_options"), "give another --out")
        self.generator.load_state_dict(content["generator"])
        self.discriminator.load_state_dict(content["discriminator"])
        self.average.network.load_state_dict(content["average"])
        for mine, saved in zip(self.optimisers, content["optimisers"]):
            mine.load_state_dict(saved)
        self.step = content["step"]

    def save(self, name="last.pt"):
        checkpoint.save(self.out / name, {
            "generator": self.generator.state_dict(), "discriminator": self.discriminator.state_dict(),
            "average": self.average.network.state_dict(), "optimisers": [o.state_dict() for o in self.optimisers],
            "step": self.step, "generator_options": dataclasses.asdict(self.generator.options),
            "training_options": dataclasses.asdict(self.options)})

    def validate(self):
        if not self.validation:
            return
        methods = {"gan": lambda sample: evaluation.paint(self.average.network, sample)}
        scored = evaluation.score(self.validation, methods)["gan"]
        self.log.write(step=self.step, **{k: round(v, 4) for k, v in scored.items()})

    def train_step(self, pictures, holes, squares, static, kinds):
        options, device = self.options, self.processes.device
        for optimiser, rate in zip(self.optimisers, (options.learning_rate, options.discriminator_rate)):
            for group in optimiser.param_groups:
                group["lr"] = rate_at(self.step, dataclasses.replace(options, learning_rate=rate))
        image = pictures.to(device).permute(0, 3, 1, 2).float().div(255).contiguous()
        hole, square, static = (m.to(device)[:, None].float() for m in (holes, squares, static))
        adversarial = options.loss.adversarial if self.step >= options.adversary_from else 0.0
        with half_precision(device, options.precision):
            painted = self.generator(image, hole, square, int(kinds[0])).float()
            parts, restored = losses.generator_losses(image, painted, hole, static, self.eyes)
            if adversarial > 0:
                parts["adversarial"] = losses.adversarial_loss(self.discriminator, restored, hole)
        weights = dataclasses.asdict(options.loss)
        loss = sum(weights[name] * part for name, part in parts.items())
        self.apply(loss, self.generator, self.optimisers[0])
        if adversarial > 0:
            with half_precision(device, options.precision):
                opinion = losses.discriminator_loss(self.discriminator, image, restored, hole, static)
            self.apply(opinion, self.discriminator, self.optimisers[1])
            parts["discriminator"] = opinion
        self.average.update(self.generator, self.step)
        self.step += 1
        return {name: float(part.detach()) for name, part in parts.items()}

    def apply(self, loss, network, optimiser):
        if not math.isfinite(float(loss.detach())):
            raise ArithmeticError(f"the loss of step {self.step} is {float(loss)}; go on from {self.out / 'last.pt'} with "
                                  "a lower --learning-rate")
        network.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimiser.step()

    def begin(self):
        return lambda batch: self.train_step(*batch)
