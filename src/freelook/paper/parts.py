"""Table 1, and the other numbers of sections 5 and 6 that can be checked."""

from __future__ import annotations

from . import printed
from .exhibit import Exhibit, Section, Settings, Table


def total_dollars() -> float:
    return sum(price for _, _, price in printed.PARTS)


def parts_table() -> Table:
    rows = [*printed.PARTS, ("Sum", "", total_dollars())]
    names = ("part", "product", "dollars")
    return Table(dict(zip(names, zip(*rows, strict=True), strict=True)))


def window_share() -> float:
    (width, height), (across, down) = printed.PICTURE_SIZE, printed.WINDOW_SIZE
    return across * down / (width * height)


def section(settings: Settings) -> Section:
    goggles = max(price for _, _, price in printed.PARTS)
    width = printed.PICTURE_SIZE[0]
    resolved = printed.TV_LINES * 4 / 3
    return Section(
        name="parts",
        title="Parts, prices, resolution",
        places="Sections 5 and 6, Table 1",
        paper="Six parts for $724, most of it for the goggles (about $400); a camera of 22 grams "
        "and 420 TV lines; a window of 180 × 144 out of 720 × 576 pixels.",
        ours=(
            f"The sum is ${total_dollars():.2f} (printed without the cents), of which the goggles "
            f"are {100 * goggles / total_dollars():.0f} %. The laptop and the "
            "aircraft are not in it. Only the camera's weight is given, neither the other parts' "
            "nor that of the gimbal it replaces: “less weight” cannot be checked.",
            f"The window is {100 * window_share():.2f} % of the picture, one pixel in sixteen. TV "
            f"lines are counted over a width equal to the height, so {printed.TV_LINES} of them "
            f"are {resolved:.0f} over the whole width: the camera resolves "
            f"{100 * resolved / width:.0f} % of the {width} columns, and "
            f"some {resolved / 4:.0f} of the window's 180.",
            "“The operator does not notice a delay” was not measured. What freelook adds can be: "
            "see freelook bench latency.",
        ),
        verdict="holds",
        because="the sum is right; weight, delay and power are claims without numbers",
        basis="The paper's printed numbers.",
        exhibits=(Exhibit("table1_parts", "Table 1, in US dollars of 2010.", parts_table()),),
    )
