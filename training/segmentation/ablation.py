# SPDX-License-Identifier: BSD-3-Clause
"""Trains variants of the network, or of its training, with the same samples and compares what each step brought."""
import dataclasses
import json
from pathlib import Path

import torch

from training.segmentation import checkpoint, cost, evaluation, losses, mixture, networks, train

SIZE = (352, 480)  # what the network sees of a 640x480 camera by default


def experiments():
    """Name -> (variant of the network, changes to the training)."""
    ladder = {name: (name, {}) for name in networks.variants()}
    default = "roslam-pspnet"
    ladder["no deep supervision"] = (default, {"loss": losses.LossOptions(auxiliary=0.0)})
    ladder["auxiliary by class share"] = (default, {"loss": losses.LossOptions(by_class=True, auxiliary=1.0)})
    ladder["squared hinge"] = (default, {"loss": losses.LossOptions(form="squared-hinge")})
    ladder["no class balance"] = (default, {"loss": losses.LossOptions(balance=0.0)})
    ladder["no Jaccard"] = (default, {"loss": losses.LossOptions(jaccard=0.0)})
    ladder["Adam"] = (default, {"optimiser": "adam"})
    ladder["Adam at 0.01"] = (default, {"optimiser": "adam", "learning_rate": 0.01})
    return ladder


def run(data_folder, out, options, names=()):
    """Trains what is not trained yet and writes ablation.json and ablation.md into out."""
    out = Path(out)
    validation = mixture.validation_sets(data_folder)
    rows = []
    for name, (variant, changes) in experiments().items():
        if names and name not in names:
            continue
        folder = out / name.replace(" ", "-")
        trainer = train.Trainer(data_folder, folder, dataclasses.replace(options, variant=variant, **changes))
        if trainer.step < options.steps:
            trainer.run()
            if trainer.stopped:
                break
        network = checkpoint.load_network(folder / "last.pt")
        threads = torch.get_num_threads()
        torch.set_num_threads(1)
        rows.append({"name": name, "steps": options.steps, **cost.measure(network, SIZE), **evaluation.score_all(network, validation)})
        torch.set_num_threads(threads)
        (out / "ablation.json").write_text(json.dumps(rows, indent=1))
        (out / "ablation.md").write_text(markdown(rows))
    return rows


def markdown(rows):
    lines = ["| step | parameters | multiply-adds | OpenCV, one core | Cityscapes, 8 groups | CamVid, 11 | people | people from a drone |",
             "|---|---:|---:|---:|---:|---:|---:|---:|"]
    for r in rows:
        lines.append(f"| {r['name']} | {r['parameters'] / 1e6:.2f} M | {r['multiply_adds'] / 1e9:.2f} G | {r['milliseconds']:.0f} ms | "
                     f"{r['cityscapes256']:.3f} | {r['camvid']:.3f} | {r['people']:.3f} | {r['drone_people']:.3f} |")
    return "\n".join(lines) + "\n"
