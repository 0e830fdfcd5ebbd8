"""The converged picture and gradient that a benchmark measures errors against."""

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from vlnhijack import seeds
from vlnhijack.errors import CheckError
from vlnhijack.experiments.bench.costs import clear
from vlnhijack.experiments.bench.subject import Subject

# lit: the display transform is no linear one, so that each batch has to be converged by itself
SPP_AND_BATCHES = {"baked": (64, 16), "lit": (256, 4)}


@dataclass(frozen=True, eq=False)
class Errors:
    """Of an image and a gradient, without what the reference's own noise adds in the mean.

    RMSE in display values; cosine and norm ratio of the gradient; bias: the relative error of the
    gradient along the true one.
    """

    rmse: float
    grad_cosine: float
    grad_norm_ratio: float
    grad_bias: float


@dataclass(frozen=True, eq=False)
class Mean:
    """The mean of batches (any shape), and the squared length of its expected error."""

    value: Tensor
    noise: float

    @property
    def energy(self) -> float:
        """Squared length of the true value, estimated without the noise of this one."""
        return float(self.value.square().sum()) - self.noise


@dataclass(frozen=True, eq=False)
class Reference:
    """Images (V,3,h,w) and gradient (H,W,3) by `prb`, float64 means over batches of camera rays."""

    image: Mean
    gradient: Mean

    def errors(self, image: Tensor, gradient: Tensor) -> Errors:
        """Errors of images and gradient at other camera rays."""
        square = float((image.double() - self.image.value).square().sum()) - self.image.noise
        along = float((gradient.double() * self.gradient.value).sum()) / self.gradient.energy
        ratio = float(gradient.double().norm()) / self.gradient.energy**0.5
        rmse = (max(square, 0.0) / image.numel()) ** 0.5
        return Errors(rmse, along / ratio if ratio else 0.0, ratio, along - 1)

    def own_errors(self) -> dict[str, float]:
        """Expected RMSE of the image, and length of the gradient's error over the gradient's."""
        return {
            "rmse": (self.image.noise / self.image.value.numel()) ** 0.5,
            "grad_error": (self.gradient.noise / self.gradient.energy) ** 0.5,
        }


def converged(subject: Subject, advance: Callable[[], None]) -> Reference:
    """The reference of a subject; `advance` is called after every batch."""
    spp, batches = SPP_AND_BATCHES[subject.house.kind]
    clear()
    renderer = subject.renderer("prb", spp, 0)
    sums = [_Sum(), _Sum()]
    for batch in range(batches):
        renderer.seed = seeds.integer(0, "bench reference", batch)
        for total, value in zip(sums, subject.gradient(renderer), strict=True):
            total.add(value)
        advance()
    reference = Reference(*(total.mean() for total in sums))
    if reference.gradient.energy <= 0:
        raise CheckError(
            "the gradient of this view is lost in noise: choose another one, or a larger"
        )
    return reference


class _Sum:
    """A running sum of tensors and of their squared lengths."""

    def __init__(self) -> None:
        self._count, self._squares = 0, 0.0
        self._total: Tensor | float = 0.0

    def add(self, value: Tensor) -> None:
        value = value.double()
        self._count += 1
        self._total = self._total + value
        self._squares += float(value.square().sum())

    def mean(self) -> Mean:
        value = torch.as_tensor(self._total) / self._count
        variance = self._squares / self._count - float(value.square().sum())
        return Mean(value, max(variance, 0.0) / (self._count - 1))
