"""From the numbers to lines, boxes and words on the view. web/static/hud.js makes the same ones.

Everything is in points from the view's top left corner; angles are those of docs/conventions.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import ceil, floor

import numpy as np
from numpy.typing import NDArray

from ..lens import Floats
from ..projections import Projection, projection_named
from ..rotations import RDF_FROM_FRD
from . import rays
from .definition import definition
from .place import Place, Rect
from .state import Dial, HudState, LensField
from .words import bearing, capitals, compass, shortened, signed, tenths, whole

FAR = 2.0  # of the longer side, from the middle: what is farther away is not drawn
LONGEST = 0.6  # of the longer side: a straight piece that is longer goes round the back
CUT_OFF = 20  # points outside the view where something may still show a part of itself


@dataclass(frozen=True)
class Lines:
    """Straight pieces (n, 4) as x0, y0, x1, y1."""

    pieces: Floats
    width: float
    role: str = "line"
    opacity: float = 1.0


@dataclass(frozen=True)
class Box:
    """Filled."""

    rect: Rect
    role: str = "box"
    opacity: float = 1.0


@dataclass(frozen=True)
class Text:
    """One line; (x, y) is the middle of its `anchor`: left, middle or right."""

    text: str
    x: float
    y: float
    size: float
    role: str = "line"
    anchor: str = "middle"
    opacity: float = 1.0


Shape = Lines | Box | Text
NONE = np.empty((0, 3))
HEAD_FROM_BODY: Floats = RDF_FROM_FRD.as_matrix()
Shapes = Iterator[Shape]


def shapes(state: HudState, place: Place) -> list[Shape]:
    """What is drawn, in this order. Nothing for what is not known or not among `place.parts`."""
    scene = Scene(state, place)
    return [shape for part in place.parts for shape in PARTS[part](scene)]


class Scene:
    """A state on its place, and what several parts need of it."""

    def __init__(self, state: HudState, place: Place) -> None:
        self.state, self.place = state, place
        self.kind: Projection = projection_named(state.projection)
        self.focal = place.width / 2 / self.kind.half_width(state.hfov_deg / 2)
        self.head_from_view: Floats = HEAD_FROM_BODY @ state.body_from_view.as_matrix()
        self.level_from_view, self.level_from_head = self.head_from_view, np.eye(3)
        self.world = state.world_from_body is not None
        if state.world_from_body is not None:
            world_from_body = state.world_from_body.as_matrix()
            self.level_from_head = HEAD_FROM_BODY @ world_from_body @ HEAD_FROM_BODY.T
            self.level_from_view = self.level_from_head @ self.head_from_view

    def seen(self, level: Floats, head: Floats = NONE) -> Floats:
        """Places (n, 2) of rays (n, 3): first those level in the world (or in the vehicle, where
        that is not known), then those of a head; NaN for those far away."""
        rays = np.concatenate([level @ self.level_from_view, head @ self.head_from_view])
        middle = np.array([self.place.width / 2, self.place.height / 2])
        with np.errstate(invalid="ignore", over="ignore"):
            away = self.focal * self.kind.place(rays)
            away[(np.abs(away) > FAR * self.longer).any(axis=-1)] = np.nan
        return away + middle

    @property
    def longer(self) -> float:
        return max(self.place.width, self.place.height)

    def pieces(self, starts: Floats, ends: Floats) -> Floats:
        """(n, 4), without those that are nowhere, outside the view, or go round the back."""
        both = np.concatenate([starts, ends], axis=-1)
        high = np.array([self.place.width, self.place.height]) + CUT_OFF
        with np.errstate(invalid="ignore"):  # NaN is nowhere: no comparison holds for it
            seen = (np.maximum(starts, ends) > -CUT_OFF) & (np.minimum(starts, ends) < high)
            both = both[seen.all(axis=-1)]
        long = np.hypot(both[:, 2] - both[:, 0], both[:, 3] - both[:, 1]) > LONGEST * self.longer
        return both[~long]

    def path(self, points: Floats) -> Floats:
        return self.pieces(points[:-1], points[1:])

    def label(self, point: Sequence[float], text: str, size: float, opacity: float = 1.0) -> Shapes:
        """Unless it is outside, or where the tape is."""
        x, y = point
        tape = self.place.tape
        inside_x = -CUT_OFF < x < self.place.width + CUT_OFF
        hidden = abs(x - tape.x - tape.width / 2) < tape.width / 2 and y < tape.y + tape.height
        if inside_x and -CUT_OFF < y < self.place.height + CUT_OFF and not hidden:
            yield Text(text, x, y, size, opacity=opacity)


def _horizon(scene: Scene) -> Shapes:
    """Lines of equal elevation, the level one with ticks, and the vehicle's nose."""
    if scene.kind.cut:
        return  # only the lens knows where
    look, nose = definition()["horizon"], definition()["nose"]
    grid = rays.grid()
    spots = scene.seen(grid.all, rays.nose())
    ladder, marks, level, feet, tops, names, starts, ends = grid.split(spots)
    nose_lines = scene.pieces(starts, ends)
    ladder = ladder.reshape(len(look["ladder_deg"]), -1, 2)
    starts, ends = ladder[:, :-1:2], ladder[:, 1::2]
    between = grid.between_labels
    dashes = scene.pieces(starts[:, between].reshape(-1, 2), ends[:, between].reshape(-1, 2))
    faint = look["ladder_opacity"]
    yield Lines(dashes, look["ladder_width"], opacity=faint)
    for text, point in zip(grid.elevations, marks.tolist(), strict=True):
        yield from scene.label(point, text, look["text"], faint)
    lines = np.concatenate([scene.path(level), scene.pieces(feet, tops)])
    yield Lines(lines, look["width"])
    bearings = grid.headings if scene.world else grid.bearings
    for text, point in zip(bearings, names.tolist(), strict=True):
        if text != "0":  # the nose is there
            yield from scene.label(point, text, look["text"])
    yield Lines(nose_lines, nose["width"], "chosen" if scene.world else "line")


def _edge(scene: Scene) -> Shapes:
    """Where the lens's field ends."""
    lens = scene.state.lens
    if lens is None or scene.kind.cut or lens.theta_max > np.pi * 0.98:
        return
    look = definition()["edge"]
    points = scene.seen(NONE, rays.circle(lens.theta_max) @ lens.camera_from_head)
    pieces = scene.pieces(points[:-1:2], points[1::2])
    if len(pieces):
        yield Lines(pieces, look["width"], "chosen", look["opacity"])


def _tape(scene: Scene) -> Shapes:
    """Where the view points: heading in the world, or bearing from the vehicle's nose."""
    look, place = definition()["tape"], scene.place.tape
    yaw, pitch, roll = angles_deg(scene.level_from_view)
    middle, per_deg = place.x + place.width / 2, place.width / look["span_deg"]
    half = look["span_deg"] / 2
    first = ceil((yaw - half) / 10) * 10
    shown = [
        (deg, middle + (deg - yaw) * per_deg) for deg in range(first, floor(yaw + half) + 1, 10)
    ]
    ticks = [
        (x, place.y + 1, x, place.y + look["long_tick" if deg % 30 == 0 else "tick"])
        for deg, x in shown
    ]
    yield Lines(np.array(ticks), look["width"])
    for deg, x in shown:
        inside = place.x + 14 < x < place.x + place.width - 14
        if deg % 30 == 0 and inside and abs(x - middle) > look["free"]:
            text = compass(deg) if scene.world else bearing(deg)
            yield Text(text, x, place.y + look["label_y"], look["text"])
    yield from _caret(scene, yaw, middle, per_deg)
    wide, high = look["readout"]
    box = Rect(middle - wide / 2, place.y + look["readout_y"] - high / 2, wide, high)
    yield Box(box)
    yield Lines(_border(box, look["width"]), look["width"])
    yield Lines(np.array([(middle, place.y + 0.5, middle, place.y + 9)]), 2.5)
    text = f"{whole(yaw % 360) % 360:03d}°" if scene.world else bearing(yaw, "°")
    yield Text(text, middle, place.y + look["readout_y"], look["readout_text"], "bright")
    yield from _readings(scene, pitch, roll, middle)


def _readings(scene: Scene, pitch: float, roll: float, middle: float) -> Shapes:
    known, y = definition(), scene.place.tape.y
    look = known["tape"]
    frame = known.say("world" if scene.world else "vehicle")
    text = known.say("angles", frame=frame, pitch=signed(pitch), roll=signed(roll))
    yield Text(text, middle, y + look["lines_y"][0], look["text"])
    if scene.world:
        yaw, pitch, _ = angles_deg(scene.head_from_view)
        text = known.say("head", yaw=bearing(yaw, "°"), pitch=signed(pitch))
        yield Text(text, middle, y + look["lines_y"][1], look["text"])


def _caret(scene: Scene, yaw: float, middle: float, per_deg: float) -> Shapes:
    """Under the tape: where the vehicle's nose is; at the tape's end where it is beyond."""
    look, place = definition()["tape"], scene.place.tape
    nose, _, _ = angles_deg(scene.level_from_head)
    away = (nose - yaw + 180) % 360 - 180
    size = look["caret"]
    y = place.y + look["long_tick"] + 1
    if abs(away) <= look["span_deg"] / 2:
        x = middle + away * per_deg
        pieces = [(x - size, y + size, x, y), (x, y, x + size, y + size)]
    else:
        way = 1 if away > 0 else -1
        x = middle + way * place.width / 2
        y += size
        pieces = [(x - way * size, y - size, x, y), (x, y, x - way * size, y + size)]
    yield Lines(np.array(pieces), 2, "chosen")


def _field(scene: Scene) -> Shapes:
    """The whole field of the lens as a ring, and the border of the view in it."""
    lens, known = scene.state.lens, definition()
    look, margin = known["field"], known.margin
    radius = look["radius"]
    left, bottom = scene.place.inset[0] + margin, scene.place.height - scene.place.inset[1] - margin
    x, y = left + radius, bottom - radius
    text_x = left
    if lens is not None:
        turn = np.linspace(0, 2 * np.pi, 37)
        ring = np.stack([x + radius * np.cos(turn), y + radius * np.sin(turn)], axis=-1)
        cross = [(x - 3, y, x + 3, y), (x, y - 3, x, y + 3)]
        pieces = np.concatenate([scene.path(ring), np.array(cross)])
        yield Lines(pieces, look["width"])
        if not scene.kind.cut:
            border = _on_ring(scene, lens, x, y, radius)
            yield Lines(scene.path(border), look["width"] + 0.5, "chosen")
        text_x = left + 2 * radius + 10
    text = f"{whole(scene.state.hfov_deg)}°"
    yield Text(text, text_x, y, look["text"], "bright", "left")


def _on_ring(scene: Scene, lens: LensField, x: float, y: float, radius: float) -> Floats:
    """The view's border, as far from the middle as its directions are from the lens's axis."""
    look = definition()["field"]
    half = np.array([scene.place.width, scene.place.height]) / 2 / scene.focal
    corners = rays.border(look["steps"]) * half
    ray = scene.kind.ray(corners[:, 0], corners[:, 1])
    there = ray @ scene.head_from_view.T @ lens.camera_from_head.T
    sine = np.hypot(there[:, 0], there[:, 1])
    share = np.minimum(np.arctan2(sine, there[:, 2]) / lens.theta_max, look["beyond"])
    scale = radius * share / np.maximum(sine, 1e-9)
    return np.array([x, y]) + there[:, :2] * scale[:, None]


def _state(scene: Scene) -> Shapes:
    """Link, tracker, mode, recording."""
    known, state = definition(), scene.state
    look, x = known["state"], known.margin + scene.place.inset[0]
    y = scene.place.sides_y + known.margin + look["line"] / 2
    for text in _state_lines(scene):
        yield Text(capitals(text), x, y, look["text"], anchor="left")
        y += look["line"]
    if state.recording is not None and state.recording.state == "live":
        dot = look["dot"]
        yield Lines(np.array([(x, y, x + dot, y)]), dot, "alert")
        text = known.say("rec", n=state.recording.shown)
        yield Text(text, x + dot + 6, y, look["text"], "alert", "left")


def _state_lines(scene: Scene) -> Iterator[str]:
    known, state = definition(), scene.state
    if state.link is not None:
        words = [known.say("link", state=state.link.state)]
        if state.link.lost:
            words.append(known.say("lost", n=state.link.lost))
        yield "  ".join(words)
    if state.tracker is not None:
        name, doing = state.tracker.name, state.tracker.state
        yield name if doing == "tracking" else f"{name} {doing}"
    if state.mode != "body":
        yield state.mode


def _dials(scene: Scene) -> Shapes:
    """How late the head and the video are, as arcs from the left over the top."""
    known = definition()
    look, radius = known["dials"], known["dials"]["radius"]
    y = scene.place.sides_y + known.margin + radius + 2
    right = scene.place.width - scene.place.inset[0] - known.margin
    x = right - radius - (len(look["full_ms"]) - 1) * look["step"]
    for name, full_ms in look["full_ms"].items():
        dial = scene.state.dials.get(name)
        if dial is not None:
            yield from _dial(x, y, name, dial, full_ms)
        x += look["step"]


def _dial(x: float, y: float, name: str, dial: Dial, full_ms: float) -> Shapes:
    known = definition()
    look = known["dials"]
    role = {"none": "line", "good": "line", "fair": "chosen", "poor": "alert"}[level(name, dial)]
    yield Lines(_arc(x, y, 1.0), 1, opacity=look["track_opacity"])
    for value, opacity in ((dial.p95_ms, 0.5), (dial.median_ms, 1.0)):
        share = min(1.0, (value or 0.0) / full_ms)
        if share > 0:
            yield Lines(_arc(x, y, share), look["width"], role, opacity)
    reading = known.say("none") if dial.median_ms is None else tenths(dial.median_ms)
    yield Text(reading, x, y - 1, look["text"], "bright")
    label = known.say(f"dial_{name}")
    yield Text(label, x, y + look["text"] - 1, look["label_text"])


def level(name: str, dial: Dial) -> str:
    """none, good, fair or poor."""
    good_ms = definition()["dials"]["good_ms"][name]
    if dial.median_ms is None:
        return "none"
    if (dial.p95_ms or 0.0) <= good_ms:
        return "good"
    return "fair" if dial.median_ms <= 2 * good_ms else "poor"


def _arc(x: float, y: float, share: float) -> Floats:
    look = definition()["dials"]
    count = max(2, ceil(look["steps"] * share) + 1)
    turn = np.pi * (1 + share * np.arange(count) / (count - 1))
    points = np.stack([x + look["radius"] * np.cos(turn), y + look["radius"] * np.sin(turn)], -1)
    return np.concatenate([points[:-1], points[1:]], axis=-1)


def _warnings(scene: Scene) -> Shapes:
    known, place = definition(), scene.place
    look, letter = known["warnings"], known["text"]["advance"]
    free = place.width - 2 * place.inset[0] - 2 * known.margin - 2 * look["pad"]
    most = max(8, floor(free / look["text"] / letter))
    y = place.middle_y + look["gap"]
    for warned in scene.state.warnings[: look["most"]]:
        text = shortened(capitals(warned.text), most)
        role = {"alert": "alert", "warn": "chosen"}.get(warned.level, "line")
        wide, high = len(text) * look["text"] * letter + 2 * look["pad"], look["line"] - 6
        box = Rect((place.width - wide) / 2, y - high / 2, wide, high)
        yield Box(box)
        if warned.level == "alert":
            yield Lines(_border(box, 1.5), 1.5, role)
        yield Text(text, place.width / 2, y, look["text"], role)
        y += look["line"]


def _border(rect: Rect, width: float) -> Floats:
    """Its lines, long enough for square corners."""
    left, top, right, bottom = rect.x, rect.y, rect.x + rect.width, rect.y + rect.height
    return np.array(
        [
            (left - width / 2, top, right + width / 2, top),
            (right, top, right, bottom),
            (right + width / 2, bottom, left - width / 2, bottom),
            (left, bottom, left, top),
        ]
    )


def angles_deg(matrix: NDArray[np.float64]) -> tuple[float, float, float]:
    """(yaw, pitch, roll) as `freelook.rotations.head_angles_deg` has them, of a matrix between
    two frames with x right, y down, z forward."""
    (xx, _xy, xz), (yx, yy, yz), (zx, _zy, zz) = matrix.tolist()
    pitch = float(np.degrees(np.arcsin(min(max(-yz, -1.0), 1.0))))
    if abs(yz) > 1 - 1e-9:
        return float(np.degrees(np.arctan2(-zx, xx))), pitch, 0.0
    return float(np.degrees(np.arctan2(xz, zz))), pitch, float(np.degrees(np.arctan2(yx, yy)))


PARTS: dict[str, Callable[[Scene], Shapes]] = {
    "horizon": _horizon,
    "edge": _edge,
    "tape": _tape,
    "field": _field,
    "state": _state,
    "dials": _dials,
    "warnings": _warnings,
}
