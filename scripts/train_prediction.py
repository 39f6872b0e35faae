"""Train the networks of freelook.prediction on recorded head motion.

    python scripts/train_prediction.py --check FILE ...   each predicted by what the others teach
    python scripts/train_prediction.py FILE ...           writes freelook/prediction/head_motion.npz

FILEs are recordings as `freelook bench predict` reads them. Takes some minutes on one core.

What is made small is what is asked for: the error that 5 % of predictions exceed. Least squares
spends its effort elsewhere, on the middle and on the few hopeless cases. So the loss is the share
of predictions beyond the present 95th percentile q, made smooth so that it can be descended,

    mean of 1 / (1 + (q / error)^(1/s)),

with s falling from 0.5 to 0.15, plus a little pseudo-Huber so that nothing gets out of hand.

Every recording is also used faster and slower than it was (`PACES`), and noise is added to the
inputs: two people are few.
"""

from __future__ import annotations

import argparse
import os
import sys
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Slerp

from freelook.bench.predict import Recording, read_recording
from freelook.clock import NS_PER_S
from freelook.prediction import network
from freelook.prediction.features import SLOW_DEG_S, Features, features
from freelook.prediction.history import PoseHistory
from freelook.prediction.learned import POWERS, SCALE_S
from freelook.prediction.network import silu
from freelook.types import Pose

Floats = NDArray[np.float32]

AHEAD_S = np.array([0.02, 0.035, 0.05, 0.075, 0.1, 0.15])
WEIGHT_OF_AHEAD = np.array([1.0, 0.5, 1.5, 0.5, 1.0, 0.5]) / 5.0
PACES = (0.8, 0.9, 1.0, 1.1, 1.25)
WARM_UP = 40

HIDDEN = (48, 32)
STEPS = 1500
BATCH = 3072
RATE = 3e-3
NOISE = 0.3
DECAY = 1e-4
SHARPNESS = (0.5, 0.15)
HUBER = 0.15
LEAST_SPEED_DEG_S = 10.0 + SLOW_DEG_S  # slower ones never are among the 5 %


@dataclass
class Samples:
    """inputs (n, i), speed (n,), rate (n, 3) and truth (n, horizons, 3) in the movement's frame."""

    inputs: Floats
    speed: Floats
    rate: Floats
    truth: Floats

    def __len__(self) -> int:
        return len(self.inputs)

    def __getitem__(self, which: NDArray[np.bool_] | NDArray[np.int64]) -> Samples:
        return Samples(self.inputs[which], self.speed[which], self.rate[which], self.truth[which])

    def constant_rate_deg(self) -> Floats:
        return length(self.rate[:, None] * AHEAD_S[:, None] - self.truth)


def length(vectors: Floats) -> Floats:
    return np.sqrt((vectors**2).sum(axis=-1) + 1e-8)


def joined(parts: list[Samples]) -> Samples:
    names = ("inputs", "speed", "rate", "truth")
    return Samples(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def samples(recording: Recording, pace: float) -> Samples:
    """What the predictor would have seen at every sample, and what came."""
    t_ns = np.round(recording.t_ns / pace).astype(np.int64)
    history = PoseHistory()
    seen: dict[int, Features] = {}
    for index, now_ns in enumerate(t_ns.tolist()):
        history.push(Pose(recording.body_from_view[index], now_ns))
        if now_ns / NS_PER_S + AHEAD_S[-1] > t_ns[-1] / NS_PER_S:
            break
        if index >= WARM_UP and (found := features(history)) is not None:
            seen[index] = found
    which = np.array(list(seen))
    view_from_body = recording.body_from_view[which].inv()
    truth = Slerp(t_ns / NS_PER_S, recording.body_from_view)
    axes = np.array([found.axes for found in seen.values()])
    came = [
        np.degrees((view_from_body * truth(t_ns[which] / NS_PER_S + ahead_s)).as_rotvec())
        for ahead_s in AHEAD_S
    ]
    columns = (
        np.array([found.inputs for found in seen.values()]),
        np.array([found.speed_deg_s for found in seen.values()]),
        np.array([found.axes @ found.rate_deg_s for found in seen.values()]),
        np.einsum("nab,hnb->nha", axes, np.array(came)),
    )
    return Samples(*(column.astype(np.float32) for column in columns))


POWERS_OF_AHEAD = ((AHEAD_S / SCALE_S)[:, None] ** np.arange(POWERS)).astype(np.float32)


class Member:
    """One network, with Adam and the gradient by hand."""

    def __init__(self, rng: np.random.Generator, inputs: int) -> None:
        sizes = [inputs, *HIDDEN, 3 * POWERS]
        self.values: list[Floats] = []
        for number, (m, n) in enumerate(pairwise(sizes)):
            gain = 0.1 if number == len(HIDDEN) else 1.0
            start = gain * rng.standard_normal((m, n)) / np.sqrt(m)
            self.values += [start.astype(np.float32), np.zeros(n, np.float32)]
        self.first = [np.zeros_like(value) for value in self.values]
        self.second = [np.zeros_like(value) for value in self.values]

    def layers(self, inputs: Floats) -> tuple[list[Floats], list[Floats], Floats]:
        """(inputs of each layer, sums before each silu, outputs (n, POWERS, 3))."""
        into, sums, x = [], [], inputs
        for weights, biases in zip(self.values[0:-2:2], self.values[1:-2:2], strict=True):
            into.append(x)
            sums.append(x @ weights + biases)
            x = silu(sums[-1])
        into.append(x)
        return into, sums, (x @ self.values[-2] + self.values[-1]).reshape(-1, POWERS, 3)

    def predict(self, batch: Samples) -> Floats:
        return predicted(self.layers(batch.inputs)[2], batch)

    def step(self, batch: Samples, q: Floats, sharpness: float, rate: float, count: int) -> None:
        into, sums, out = self.layers(batch.inputs)
        off = predicted(out, batch) - batch.truth
        error = length(off)
        by_error = slope(error, q, sharpness) * WEIGHT_OF_AHEAD / len(batch)
        by_turn = (by_error / error)[..., None] * off
        scaled = by_turn * (AHEAD_S[:, None] * batch.speed[:, None, None])
        back = np.einsum("hk,nha->nka", POWERS_OF_AHEAD, scaled).reshape(len(batch), -1)
        gradients: list[Floats] = []
        for layer in reversed(range(len(into))):
            gradients[:0] = [
                into[layer].T @ back + 2 * DECAY * self.values[2 * layer],
                back.sum(axis=0),
            ]
            if layer:
                gate = 0.5 + 0.5 * np.tanh(0.5 * sums[layer - 1])
                slope_of_silu = gate * (1.0 + sums[layer - 1] * (1.0 - gate))
                back = (back @ self.values[2 * layer].T) * slope_of_silu
        self._adam(gradients, rate, count)

    def _adam(self, gradients: list[Floats], rate: float, count: int) -> None:
        for value, gradient, first, second in zip(
            self.values, gradients, self.first, self.second, strict=True
        ):
            first += 0.1 * (gradient - first)
            second += 0.001 * (gradient**2 - second)
            mean, square = first / (1 - 0.9**count), second / (1 - 0.999**count)
            value -= (rate * mean / (np.sqrt(square) + 1e-8)).astype(np.float32)


def predicted(out: Floats, batch: Samples) -> Floats:
    correction = np.einsum("hk,nka->nha", POWERS_OF_AHEAD, out) * batch.speed[:, None, None]
    return (batch.rate[:, None] + correction) * AHEAD_S[:, None]


def slope(error: Floats, q: Floats, sharpness: float) -> Floats:
    """Of the loss, by the error."""
    share = 0.5 + 0.5 * np.tanh(0.5 * np.log(error / q) / sharpness)
    of_share = 6.0 * share * (1.0 - share) / (sharpness * error)
    return of_share + HUBER * (error / q**2) / np.sqrt(1.0 + (error / q) ** 2)


def train(parts: list[Samples], members: int, seed: int = 0) -> network.Networks:
    everything = joined(parts)
    mean, spread = everything.inputs.mean(axis=0), everything.inputs.std(axis=0) + 1e-3
    fast = everything[everything.speed > LEAST_SPEED_DEG_S]
    percent = 100.0 * (1.0 - 0.05 * len(everything) / len(fast))
    fast.inputs = (fast.inputs - mean) / spread
    trained = [train_member(fast, percent, seed + k) for k in range(members)]
    layers = tuple(
        (
            np.stack([member.values[2 * k] for member in trained]),
            np.stack([member.values[2 * k + 1] for member in trained]),
        )
        for k in range(len(HIDDEN) + 1)
    )
    return network.Networks(mean, spread, layers)


def train_member(fast: Samples, percent: float, seed: int) -> Member:
    rng = np.random.default_rng(seed)
    member = Member(rng, fast.inputs.shape[1])
    q = np.percentile(fast.constant_rate_deg(), percent, axis=0).astype(np.float32)
    for count in range(1, STEPS + 1):
        batch = fast[rng.integers(0, len(fast), BATCH)]
        noise = rng.standard_normal(batch.inputs.shape, dtype=np.float32)
        batch.inputs = batch.inputs + NOISE * noise
        done = count / STEPS
        sharpness = SHARPNESS[0] * (SHARPNESS[1] / SHARPNESS[0]) ** min(1.0, done / 0.8)
        member.step(batch, q, sharpness, RATE * 0.5 * (1.0 + np.cos(np.pi * done)), count)
        if count % 50 == 0:
            some = fast[rng.integers(0, len(fast), 6000)]
            error = length(member.predict(some) - some.truth)
            q = np.percentile(error, percent, axis=0).astype(np.float32)
    return member


def gains_percent(networks: network.Networks, test: Samples) -> Floats:
    """How far p95 lies below that of the constant rate, for each of `AHEAD_S`."""
    out = np.stack([networks(row) for row in test.inputs]).reshape(-1, POWERS, 3)
    ours = np.percentile(length(predicted(out, test) - test.truth), 95, axis=0)
    return 100.0 * (1.0 - ours / np.percentile(test.constant_rate_deg(), 95, axis=0))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE")
    parser.add_argument("--check", action="store_true", help="predict each from the others")
    parser.add_argument("--members", type=int, default=8, metavar="N", help="networks to average")
    args = parser.parse_args()
    by_file = []
    for path in args.files:
        print(f"looking at {path} at {len(PACES)} paces ...", file=sys.stderr)
        recording = read_recording(path)
        by_file.append({pace: samples(recording, pace) for pace in PACES})
    if args.check:
        for number, path in enumerate(args.files):
            others = [
                part for k, paces in enumerate(by_file) if k != number for part in paces.values()
            ]
            gains = gains_percent(train(others, args.members), by_file[number][1.0])
            said = ", ".join(
                f"{gain:.1f} % at {1000 * s:.0f} ms" for gain, s in zip(gains, AHEAD_S, strict=True)
            )
            print(f"{path.name}: p95 below the constant rate's by {said}")
        return 0
    networks = train([part for paces in by_file for part in paces.values()], args.members)
    arrays = {"mean": networks.mean, "spread": networks.spread}
    for number, (weights, biases) in enumerate(networks.layers):
        arrays |= {f"weights{number}": weights, f"biases{number}": biases}
    target = Path(network.__file__).with_name(network.WEIGHTS)
    np.savez_compressed(
        target, **{name: value.astype(np.float32) for name, value in arrays.items()}
    )
    print(f"{target}: {target.stat().st_size} bytes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
