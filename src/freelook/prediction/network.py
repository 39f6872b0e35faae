"""A few small networks whose answers are averaged; weights in `head_motion.npz` beside this file.

They were trained by `scripts/train_prediction.py`, which says how. In NumPy a call takes some tens
of microseconds.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

from ..lens import Floats

WEIGHTS = "head_motion.npz"


@dataclass(frozen=True)
class Networks:
    """mean, spread  of the inputs, (n,)
    layers        (weights (members, n, m), biases (members, m)) of each layer"""

    mean: Floats
    spread: Floats
    layers: tuple[tuple[Floats, Floats], ...]

    def __call__(self, inputs: Floats) -> Floats:
        """The mean of the members' outputs, for inputs (n,)."""
        values = (inputs - self.mean) / self.spread
        for number, (weights, biases) in enumerate(self.layers):
            values = np.matmul(values[..., None, :], weights)[..., 0, :] + biases
            if number < len(self.layers) - 1:
                values = silu(values)
        mean: Floats = values.mean(axis=0)
        return mean


def silu(values: Floats) -> Floats:
    """x / (1 + exp(-x))."""
    smooth: Floats = values * (0.5 + 0.5 * np.tanh(0.5 * values))
    return smooth


@cache
def trained() -> Networks:
    """The networks that come with freelook."""
    with (files(__package__) / WEIGHTS).open("rb") as file, np.load(file) as stored:
        arrays = {name: stored[name].astype(np.float64) for name in stored.files}
    count = sum(name.startswith("weights") for name in arrays)
    layers = tuple((arrays[f"weights{n}"], arrays[f"biases{n}"]) for n in range(count))
    return Networks(arrays["mean"], arrays["spread"], layers)
