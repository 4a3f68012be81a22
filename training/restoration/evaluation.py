# SPDX-License-Identifier: BSD-3-Clause
"""How close what was painted comes to the truth: PSNR, SSIM and absolute error inside the hole."""
import cv2
import numpy as np
import torch

from training.restoration.networks import CLASSES
from training.segmentation import label_set
from training.segmentation.evaluation import predict

INPAINT_RADIUS = 5  # pixels, of OpenCV's methods


def psnr(truth, estimate, where):
    """Peak signal-to-noise ratio in dB of bytes, over the pixels where it is asked for."""
    difference = truth[where].astype(np.float64) - estimate[where]
    return 10 * np.log10(255 ** 2 / max((difference ** 2).mean(), 1e-10))


def ssim(truth, estimate, where):
    """Structural similarity (Wang et al. 2004) of grey pictures, Gaussian window of deviation 1.5, mean over the pixels
    asked for."""
    a, b = (cv2.cvtColor(p, cv2.COLOR_RGB2GRAY).astype(np.float64) for p in (truth, estimate))

    def blur(x):
        return cv2.GaussianBlur(x, (11, 11), 1.5)

    mean_a, mean_b = blur(a), blur(b)
    variance_a, variance_b = blur(a * a) - mean_a ** 2, blur(b * b) - mean_b ** 2
    covariance = blur(a * b) - mean_a * mean_b
    c1, c2 = (0.01 * 255) ** 2, (0.03 * 255) ** 2
    similarity = ((2 * mean_a * mean_b + c1) * (2 * covariance + c2)
                  / ((mean_a ** 2 + mean_b ** 2 + c1) * (variance_a + variance_b + c2)))
    return similarity[where].mean()


@torch.no_grad()
def paint(generator, sample):
    """The picture with the hole filled, bytes."""
    device = next(generator.parameters()).device
    image = torch.from_numpy(sample.picture).permute(2, 0, 1)[None].float().div(255).to(device)
    hole, square = (torch.from_numpy(m)[None, None].float().to(device) for m in (sample.hole, sample.square))
    painted = generator(image, hole, square, sample.kind)[0].permute(1, 2, 0).mul(255).round().byte().cpu().numpy()
    return np.where(sample.hole[..., None], painted, sample.picture)


def classic(method):
    def inpaint(sample):
        return cv2.inpaint(sample.picture, sample.hole.astype(np.uint8), INPAINT_RADIUS, method)
    return inpaint


def movable_share(segmenter, estimate, where):
    """Share of the pixels asked for that a segmentation network takes for what may move."""
    return np.isin(predict(segmenter, estimate)[where], label_set.MOVABLE).mean()


def score(samples, methods, segmenter=None):
    """methods: name -> function of a sample that gives a picture. Returns name -> {"psnr", "ssim", "l1", and the same of
    the pixels whose truth is static; with a segmenter "movable"}: means over the samples, absolute error in grey
    levels."""
    result = {}
    for name, method in methods.items():
        rows = []
        for sample in samples:
            estimate = method(sample)
            row = {}
            for suffix, where in (("", sample.hole), ("_static", sample.hole & sample.is_static)):
                if np.count_nonzero(where) < 100:
                    continue
                error = np.abs(sample.picture[where].astype(np.float64) - estimate[where])
                row |= {"psnr" + suffix: psnr(sample.picture, estimate, where),
                        "ssim" + suffix: ssim(sample.picture, estimate, where), "l1" + suffix: error.mean()}
            if segmenter is not None:
                row["movable"] = movable_share(segmenter, estimate, sample.hole)
            rows.append(row)
        keys = {k for row in rows for k in row}
        result[name] = {k: float(np.mean([row[k] for row in rows if k in row])) for k in sorted(keys)}
    return result


def classic_methods():
    return {"telea": classic(cv2.INPAINT_TELEA), "navier-stokes": classic(cv2.INPAINT_NS)}


def by_class(samples):
    return {name: [s for s in samples if CLASSES[s.kind] == name] for name in CLASSES}
