"""A duel in four pictures: a lively stretch, the error in it, how often which error, one turn."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..clock import NS_PER_MS, NS_PER_S
from ..duel.chains import Shown
from ..duel.contest import Duel
from ..duel.head import TURN_DEG, HeadMotion, turn_starts_s
from ..duel.measure import yaw_deg
from ..lens import Floats
from ._style import BLUE, INK, ORANGE, new_figure, panel, style

WINDOW_S = 6.0
COLOR_OF = {"freelook": BLUE, "gimbal": ORANGE}
LEAST_DEG = 0.01  # left end of the distribution's axis


@style()
def duel_figure(duel: Duel, title: str) -> Figure:
    """Time runs where the gimbal errs most; the distribution is that of the whole motion."""
    figure = new_figure(12, 8)
    figure.suptitle(title, x=0.01, ha="left")
    seconds, errors = duel.errors_deg()
    first_s = liveliest_s(seconds, errors["gimbal"])
    draw_stretch(figure.add_subplot(2, 2, 1), duel, first_s)
    draw_errors(figure.add_subplot(2, 2, 2), seconds, errors, first_s)
    draw_distribution(figure.add_subplot(2, 2, 3), errors)
    draw_turn(figure.add_subplot(2, 2, 4), duel.turns, duel.turned)
    return figure


def liveliest_s(seconds: Floats, error_deg: Floats) -> float:
    """Where the window of `WINDOW_S` begins in which the error's mean square is largest."""
    width = min(round(WINDOW_S * 1000), len(error_deg))
    total = np.concatenate([[0.0], np.cumsum(error_deg**2)])
    return float(seconds[int(np.argmax(total[width:] - total[:-width]))])


def draw_stretch(axes: Axes, duel: Duel, first_s: float) -> None:
    panel(axes, "Where the head looks, and what it is shown", "time, seconds", "azimuth, degrees")
    last_s = min(first_s + WINDOW_S, duel.head.duration_ns / NS_PER_S)
    t_ns = np.arange(round(first_s * NS_PER_S), round(last_s * NS_PER_S), NS_PER_MS, dtype=np.int64)
    looks = np.degrees(np.unwrap(np.radians(yaw_deg(duel.head.at(t_ns)))))
    axes.plot(t_ns / NS_PER_S, looks, color=INK, label="head", linewidth=1.2)
    for name, shown in duel.shown.items():
        away = (yaw_deg(shown.at(t_ns)) - looks + 180) % 360 - 180
        axes.plot(t_ns / NS_PER_S, looks + away, color=COLOR_OF[name], label=name, linewidth=1.4)
    axes.legend(loc="best")


def draw_errors(axes: Axes, seconds: Floats, errors: dict[str, Floats], first_s: float) -> None:
    panel(axes, "Angle between the two", "time, seconds", "error, degrees")
    inside = (seconds >= first_s) & (seconds <= first_s + WINDOW_S)
    for name, error in errors.items():
        axes.plot(seconds[inside], error[inside], color=COLOR_OF[name], label=name, linewidth=1.4)
    axes.set_ylim(bottom=0)
    axes.legend(loc="upper right")


def draw_distribution(axes: Axes, errors: dict[str, Floats]) -> None:
    """The share of the time in which the error is above a value; both scales logarithmic."""
    panel(axes, "How much of the time the error is larger", "error, degrees", "share of time, %")
    for name, error in errors.items():
        ordered = np.sort(error)[::-1]
        share = 100 * np.arange(1, len(ordered) + 1) / len(ordered)
        keep = np.unique(np.geomspace(1, len(ordered), 600).astype(np.int64)) - 1
        label = f"{name}: 5 % above {np.percentile(error, 95):.2g}°"
        axes.plot(
            np.maximum(ordered[keep], LEAST_DEG), share[keep], color=COLOR_OF[name], label=label
        )
    axes.set(xscale="log", yscale="log", ylim=(0.1, 110), xlim=(LEAST_DEG, None))
    axes.axhline(5, color=INK, linewidth=0.8, linestyle=(0, (4, 3)))
    axes.legend(loc="lower left")


def draw_turn(axes: Axes, turns: HeadMotion, turned: dict[str, Shown]) -> None:
    """The median of all turns, those to the left turned over, and where 9 of 10 of them lie."""
    panel(
        axes,
        "A turn of 60° in 0.4 s, twelve times",
        "time since it began, ms",
        "azimuth, degrees",
    )
    since_ms = np.arange(-50, 700, 2)
    starts = np.rint(turn_starts_s() * NS_PER_S).astype(np.int64)
    t_ns = (starts[:, None] + since_ms * NS_PER_MS).ravel()
    looks = _all_to_the_right(yaw_deg(turns.at(t_ns)).reshape(len(starts), -1))
    axes.plot(since_ms, np.median(looks, axis=0), color=INK, label="head", linewidth=1.2)
    for name, shown in turned.items():
        sees = _all_to_the_right(yaw_deg(shown.at(t_ns)).reshape(len(starts), -1))
        low, middle, high = np.percentile(sees, [5, 50, 95], axis=0)
        axes.fill_between(since_ms, low, high, color=COLOR_OF[name], alpha=0.2, linewidth=0)
        axes.plot(since_ms, middle, color=COLOR_OF[name], label=name)
    axes.legend(loc="upper left")


def _all_to_the_right(yaws_deg: Floats) -> Floats:
    """Every other turn goes back."""
    yaws_deg[1::2] = TURN_DEG - yaws_deg[1::2]
    return yaws_deg
