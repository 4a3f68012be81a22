# SPDX-License-Identifier: BSD-3-Clause
"""Trains variants of the network, or of its training, with the same samples and compares what each step brought."""
import dataclasses
import json
from pathlib import Path

from training.segmentation import checkpoint, cost, evaluation, losses, mixture, networks, train

SIZE = (320, 416)  # rows and columns of the input whose cost is compared


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
    """Trains and scores what is not yet, and writes ablation.json and ablation.md into out. Several calls with different
    names may share a folder; one with all names then joins their scores."""
    out = Path(out)
    unknown = set(names) - set(experiments())
    if unknown:
        raise ValueError(f"{', '.join(sorted(unknown))}: no such experiment; there are {', '.join(experiments())}")
    chosen = {name: e for name, e in experiments().items() if not names or name in names}
    is_scored = [(folder_of(out, name) / "scores.json").exists() for name in chosen]
    source = None if all(is_scored) else mixture.training_data(data_folder, only=options.only)
    rows = []
    for name, (variant, changes) in chosen.items():
        folder = folder_of(out, name)
        changed = dataclasses.replace(options, variant=variant, **changes)
        scores = trained_and_scored(source, folder, changed)
        if scores is None:
            break
        rows.append({"name": name, **scores, **cost.measure(checkpoint.load_network(folder / "last.pt"), SIZE)})
        (out / "ablation.json").write_text(json.dumps(rows, indent=1))
        (out / "ablation.md").write_text(markdown(rows))
    return rows


def folder_of(out, name):
    return out / name.replace(" ", "-")


def trained_and_scored(source, folder, options):
    """The scores of one experiment, from its folder if they are there; None if its training was stopped."""
    file = folder / "scores.json"
    if not file.exists():
        trainer = train.Trainer(dataclasses.replace(source, validation=()), folder, options)
        if trainer.step < options.steps:
            trainer.run()
        if trainer.stopped:
            return None
        scores = evaluation.score_all(checkpoint.load_network(folder / "last.pt"), source.validation)
        file.write_text(json.dumps(scores))
    demand_same_recipe(folder, options)
    return json.loads(file.read_text())


def demand_same_recipe(folder, options):
    """Scores of another recipe would be compared with those of this one."""
    trained = checkpoint.load(folder / "last.pt")["training_options"]
    asked = dataclasses.asdict(options)
    changed = [name for name in asked if trained.get(name) != asked[name]
               and name not in ("workers", "save_every", "validate_every")]
    if changed:
        raise checkpoint.DataError(f"{folder}: was trained with another {', '.join(changed)}; give another --out")


def markdown(rows):
    lines = ["| step | parameters | multiply-adds | OpenCV, one core | Cityscapes, 8 groups | CamVid, 11 | people | people from a drone |",
             "|---|---:|---:|---:|---:|---:|---:|---:|"]
    for r in rows:
        lines.append(f"| {r['name']} | {r['parameters'] / 1e6:.2f} M | {r['multiply_adds'] / 1e9:.2f} G | {r['milliseconds']:.0f} ms | "
                     f"{r['cityscapes256']:.3f} | {r['camvid']:.3f} | {r['people']:.3f} | {r['drone_people']:.3f} |")
    return "\n".join(lines) + "\n"
