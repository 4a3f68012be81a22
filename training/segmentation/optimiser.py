# SPDX-License-Identifier: BSD-3-Clause
"""The optimisers: Adam with decoupled weight decay, and momentum made orthogonal for the matrices among the weights.

A step of the latter changes every direction of a matrix alike, where gradients are ruled by a few directions; it
learns from fewer samples (K. Jordan et al., "Muon: an optimizer for hidden layers in neural networks", 2024)."""
import torch
from torch import distributed

# Coefficients of the odd polynomial p(s) = a s + b s^3 + c s^5 that takes singular values in (0, 1] close to 1 in few
# iterations (Jordan et al.).
POLYNOMIAL = (3.4445, -4.7750, 2.0315)


def orthogonalised(matrix, iterations=5):
    """A matrix with the singular vectors of the one given and singular values between about 0.7 and 1.2."""
    a, b, c = POLYNOMIAL
    x = matrix / matrix.norm().clamp(min=1e-12)
    is_tall = x.shape[0] > x.shape[1]
    x = x.T if is_tall else x
    for _ in range(iterations):
        square = x @ x.T
        x = torch.addmm(x, torch.addmm(square, square, square, beta=b, alpha=c), x, beta=a)
    return x.T if is_tall else x


class OrthogonalMomentum(torch.optim.Optimizer):
    """Nesterov momentum, orthogonalised for every weight as an (outputs, inputs) matrix, and decoupled weight decay.

    A step has the root mean square that one of Adam's has (0.2 of the rate), so that both take the same rate. With
    several processes each computes a part of the matrices."""

    STEP_SIZE = 0.2

    def __init__(self, parameters, rate, momentum=0.95, weight_decay=0.0):
        super().__init__(parameters, {"lr": rate, "momentum": momentum, "weight_decay": weight_decay})

    @torch.no_grad()
    def step(self, closure=None):
        count, rank = (distributed.get_world_size(), distributed.get_rank()) if distributed.is_initialized() else (1, 0)
        for group in self.param_groups:
            parameters = [p for p in group["params"] if p.grad is not None]
            directions = [self.direction(p, group["momentum"], number % count == rank)
                          for number, p in enumerate(parameters)]
            if count > 1:
                directions = all_sums(directions)
            for parameter, direction in zip(parameters, directions):
                parameter.mul_(1 - group["lr"] * group["weight_decay"]).add_(direction, alpha=-group["lr"])

    def direction(self, parameter, momentum, is_mine):
        """What the parameter moves along; zeros where another process computes it."""
        state = self.state[parameter]
        if "velocity" not in state:
            state["velocity"] = torch.zeros_like(parameter)
        velocity = state["velocity"].mul_(momentum).add_(parameter.grad)
        if not is_mine:
            return torch.zeros_like(parameter)
        matrix = (parameter.grad + momentum * velocity).flatten(1)
        scale = self.STEP_SIZE * max(matrix.shape) ** 0.5
        return orthogonalised(matrix).mul_(scale).reshape(parameter.shape)


def all_sums(tensors):
    """Sums of tensors over the processes, in one exchange."""
    flat = torch.cat([t.reshape(-1) for t in tensors])
    distributed.all_reduce(flat)
    return [part.view(t.shape) for part, t in zip(flat.split([t.numel() for t in tensors]), tensors)]


def is_hidden_matrix(name, parameter):
    """Pointwise and full convolutions inside the network; neither its first layer nor those that give scores."""
    return (parameter.ndim == 4 and parameter.shape[1] > 1
            and not name.startswith(("block1", "classifier", "auxiliary")))


def optimisers(network, kind, rate, weight_decay):
    """What trains the network: kind "adam", or "orthogonal" for the hidden matrices with Adam for the rest. No decay
    for biases, normalisation and depthwise filters, which have few weights and no excess to remove."""
    matrices, decayed, free = [], [], []
    for name, parameter in network.named_parameters():
        if kind == "orthogonal" and is_hidden_matrix(name, parameter):
            matrices.append(parameter)
        elif parameter.ndim == 4 and parameter.shape[1] > 1:
            decayed.append(parameter)
        else:
            free.append(parameter)
    adam = torch.optim.AdamW([{"params": decayed, "weight_decay": weight_decay}, {"params": free, "weight_decay": 0.0}],
                             rate)
    return [adam] + ([OrthogonalMomentum(matrices, rate, weight_decay=weight_decay)] if matrices else [])
