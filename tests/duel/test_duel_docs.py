"""docs/duel.md has every figure of every preset, as it is in the code, with its source."""

from __future__ import annotations

from pathlib import Path

import pytest

from freelook.duel.figures import GIMBALS, HEAD, LINKS, Preset

TEXT = (Path(__file__).parents[2] / "docs" / "duel.md").read_text("utf-8")
PRESETS = {
    "Head tracker and station, always": HEAD,
    **{f"`--gimbal {name}`": preset for name, preset in GIMBALS.items()},
    **{f"`--link {name}`": preset for name, preset in LINKS.items()},
}


@pytest.mark.parametrize("title", PRESETS)
def test_the_table_of_a_preset_is_that_of_the_code(title: str) -> None:
    preset: Preset = PRESETS[title]
    table = TEXT.split(f"### {title}\n")[1].split("\n#")[0]
    rows = [line for line in table.splitlines() if line.startswith("| `")]
    assert rows == [
        f"| `{name}` | {figure.value:g} | {figure.source} |" for name, figure in preset.items()
    ]
