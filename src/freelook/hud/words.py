"""Numbers as a HUD writes them. web/static/hud_words.js writes them alike."""

from __future__ import annotations

from math import floor

from .definition import definition

QUARTERS = {0: "N", 90: "E", 180: "S", 270: "W"}


def whole(value: float) -> int:
    """The nearest whole number; halves go up, as in JavaScript."""
    return floor(value + 0.5)


def signed(degrees: float) -> str:
    number = whole(abs(degrees))
    return f"{'' if number == 0 else '+' if degrees > 0 else '−'}{number}"


def bearing(yaw_deg: float, unit: str = "") -> str:
    """Of a direction, relative to the vehicle's nose: 30R, or 30°R."""
    away = (yaw_deg + 180) % 360 - 180
    number = whole(abs(away))
    if number in (0, 180):
        return f"{number}{unit}"
    return f"{number}{unit}{'L' if away < 0 else 'R'}"


def compass(heading_deg: float) -> str:
    number = whole(heading_deg) % 360
    return QUARTERS.get(number, str(number))


def tenths(value: float) -> str:
    """Milliseconds, 0 where clocks disagree by more: with a decimal below 10; from a second on,
    seconds."""
    value = max(value, 0.0)
    if value >= 999.5:
        return f"{tenths(value / 1000)}S"
    if value >= 10:
        return str(whole(value))
    number = whole(10 * value)
    return f"{number // 10}.{number % 10}"


def capitals(text: str) -> str:
    """As far as there are letters for it."""
    known = definition()["letters"]
    return "".join(letter if letter == " " or letter in known else "?" for letter in text.upper())


def shortened(text: str, most: int) -> str:
    return text if len(text) <= most else f"{text[: most - 1].rstrip()}…"
