"""What the pilot must be told now, most urgent first, in the words of hud.json, as on the page
(web/static/conditions.js). Pure: everything comes in as values."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from .definition import definition
from .state import Warned
from .words import whole

NAMES = {"hand": "Head", "phone": "Phone sensor"}


@dataclass(frozen=True)
class Situation:
    """How a flight goes.

    `video_age_s`: since the newest picture was shown (None: none yet); `video_late_ms`: how old
    pictures are when they are shown. `head` is who is in command ("hand": mouse and keys),
    `head_age_ms` since its newest pose. `limited`: whether the lens's edge holds the view back.
    `mode_trouble`: what is wrong with the gimbal's mode. `broken`: what ended recordings. `keys`
    end eyes front.
    """

    video_age_s: float | None = None
    video_late_ms: float | None = None
    source_state: str = "live"
    source_message: str = ""
    head: str = "hand"
    head_state: str = "tracking"
    head_age_ms: float | None = None
    limited: bool = False
    mode: str = "body"
    mode_trouble: str = ""
    broken: tuple[str, ...] = ()
    keys: str = "Space or T"


def conditions(now: Situation) -> tuple[Warned, ...]:
    return (*_video(now), *_head(now), *_others(now))


def _video(now: Situation) -> Iterator[Warned]:
    known = definition()
    limits, say = known["warnings"], known.say
    live = now.source_state == "live"
    why = "" if live else f": {now.source_message or now.source_state}"
    if now.video_age_s is None:
        yield Warned("info", say("video_waiting", why=why))
    elif now.video_age_s >= limits["lost_s"]:
        yield Warned("alert", say("video_lost", s=int(now.video_age_s), why=why))
    else:
        late_ms = whole(max(1000 * now.video_age_s, now.video_late_ms or 0.0))
        if late_ms >= 1000 * limits["old_s"]:
            yield Warned("warn", say("video_old", ms=late_ms))


def _head(now: Situation) -> Iterator[Warned]:
    say, name, state = definition().say, NAMES.get(now.head, now.head), now.head_state
    if state == "waiting":
        yield Warned("info", say("head_waiting", name="a head" if name == "Head" else name))
    elif state in ("holding", "easing", "centred"):
        silent = say("silent")
        if now.head_age_ms is not None:
            silent = say("silent_for", s=max(0, whole(now.head_age_ms / 1000)))
        yield Warned("warn", say(state, name=name, silent=silent))
    elif state == "front":
        yield Warned("warn", say("front", keys=now.keys))
    elif state in ("disabled", "failed"):
        yield Warned("warn", say(state, name=name))


def _others(now: Situation) -> Iterator[Warned]:
    say = definition().say
    if now.limited:
        yield Warned("warn", say("limit"))
    for why in now.broken:
        yield Warned("alert", say("recording_failed", why=f": {why}" if why else ""))
    if now.source_state == "live" and now.source_message:
        yield Warned("warn", now.source_message)
    if now.mode_trouble:
        yield Warned("warn", say("mode", mode=now.mode, why=now.mode_trouble))
