"""The documentation says what the code does: rows, links, commands, examples, numbers."""

from __future__ import annotations

import os
import re
import shlex
from dataclasses import fields
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

import numpy as np
import pytest

import test_layers
from freelook import cli, formats, lens
from freelook.camera import make_table
from freelook.formats import freelook as our_format
from freelook.formats import parse_camera
from lens_examples import ALL, Example

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted(DOCS.glob("*.md"))]
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.M | re.S)


def text_of(page: str) -> str:
    return (DOCS / page).read_text("utf-8")


def blocks(text: str, language: str) -> list[str]:
    return [body for name, body in FENCE.findall(text) if name == language]


def command_lines(text: str) -> list[str]:
    """Lines of shell blocks, with continued lines joined and comments cut off."""
    lines = "".join(blocks(text, "sh")).replace("\\\n", " ").splitlines()
    return [cut for line in lines if (cut := re.sub(r"(^|\s)#.*", "", line).strip())]


def freelook_commands() -> list[tuple[str, str]]:
    return [
        (page.name, line)
        for page in PAGES
        for line in command_lines(page.read_text("utf-8"))
        if line.startswith("freelook ")
    ]


def role_rows(package: str) -> list[tuple[str, str]]:
    """(KIND, first line of the docstring) of every module of a role."""
    folder = import_module(f"freelook.{package}").__path__
    names = [m.name for m in iter_modules(folder) if not m.name.startswith("_")]
    modules = [import_module(f"freelook.{package}.{name}") for name in names]
    return [(module.KIND, (module.__doc__ or "").strip().splitlines()[0]) for module in modules]


@pytest.mark.parametrize(
    ("role", "page"),
    [
        ("sources", "sources.md"),
        ("trackers", "trackers.md"),
        ("attitudes", "stabilisation.md"),
        ("sinks", "rendering.md"),
    ],
)
def test_everything_of_a_role_has_its_row(role: str, page: str) -> None:
    rows = role_rows(role)
    assert rows
    missing = [kind for kind, row in rows if f"| `{kind}` | {row} |" not in text_of(page)]
    assert not missing, f"docs/{page} lacks rows (KIND | first line of the docstring)"


def test_lens_formats_have_their_rows() -> None:
    for name in formats.FORMATS:
        row = (formats.format_module(name).__doc__ or "").strip().splitlines()[0]
        assert f"| `{name}` | {row} |" in text_of("lenses.md")


def test_built_in_profiles_have_their_rows() -> None:
    for name in formats.builtin_names():
        assert f"| `{name}` |" in text_of("lenses.md")


@pytest.mark.parametrize("name", lens.MODELS)
def test_lens_model_has_its_row_with_its_parameters(name: str) -> None:
    model = lens.MODELS[name]
    formula = (model.__doc__ or "").strip().removeprefix("r = ").splitlines()[0]
    formula = re.split(r", (?:below|until|to) |:|\.$", formula)[0]
    parameters = " ".join(field.name for field in fields(model))  # type: ignore[arg-type]
    assert f"| `{name}` | {formula} | {parameters} |" in text_of("lenses.md")


def test_profile_keys_are_all_described() -> None:
    for key in our_format.REQUIRED | our_format.OPTIONAL:
        assert f"`{key}`" in text_of("lenses.md")


def test_profile_example_is_a_profile() -> None:
    (example,) = blocks(text_of("lenses.md"), "json")
    camera = parse_camera(example)
    assert camera.size == (1440, 1440)
    assert np.degrees(camera.theta_max) == pytest.approx(95)


TABLE_ROW = re.compile(r"\| `(\w+)` ((?:\w+=[-\d.]+ ?)+) \| ([\d.]+) \| ([\d.]+) \|")


def test_table_errors_in_the_docs_are_the_real_ones() -> None:
    rows = TABLE_ROW.findall(text_of("lenses.md"))
    assert len(rows) > 5
    for name, parameters, half_deg, error_px in rows:
        values = {key: float(value) for key, value in re.findall(r"(\w+)=([-\d.]+)", parameters)}
        table = make_table(lens.MODELS[name](**values), float(np.radians(float(half_deg))))
        assert table.residual_px == pytest.approx(float(error_px), abs=6e-5), name


REAL = [example for example in ALL if not example.source.startswith("made up")]


@pytest.mark.parametrize("example", REAL, ids=str)
def test_errors_over_real_calibrations_are_the_real_ones(example: Example) -> None:
    name = lens.model_name(example.lens)
    camera, whose = example.camera, re.escape(example.source.split(":")[0])
    row = rf"\| `{name}` \| {whose} \| {example.field_deg / 2:g} \| ([\d.]+) \| ([\d.]*) ?\|"
    found = re.search(row, text_of("lenses.md"))
    assert found, f"docs/lenses.md lacks a row like {row}"
    table, grid = found.groups()
    assert camera.table.residual_px == pytest.approx(float(table), abs=6e-5)
    assert bool(grid) == (camera.grid is not None)
    if camera.grid is not None:
        assert camera.grid.residual_px == pytest.approx(float(grid), abs=6e-5)


def test_layers_in_the_docs_are_those_of_the_code() -> None:
    text = text_of("design.md").split("## Layers")[1]
    rows = re.findall(r"^\| (\d) \| (.*?) \|", text, re.M)
    documented = {int(number): set(re.findall(r"`(\w+)`", names)) for number, names in rows}
    assert documented == dict(enumerate(test_layers.LAYERS))


def test_conventions_are_pinned_by_tests_that_exist() -> None:
    rows = re.findall(r"^\|.*\|(.*)\|$", text_of("conventions.md").split("## ")[0], re.M)[2:]
    assert len(rows) > 10
    for row in rows:
        names = re.findall(r"`([\w.:]+)`", row)
        assert names, "a row without a test"
        for name in names:
            file, _, test = name.rpartition("::")
            test = test if file else f"test_convention_{test}"
            code = (ROOT / "tests" / (file or "test_conventions.py")).read_text("utf-8")
            assert f"def {test}(" in code, name


def slug(heading: str) -> str:
    """The anchor that Markdown viewers make of a heading."""
    return re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)\s]+)\)", FENCE.sub("", page.read_text("utf-8"))):
        if "://" in target:
            continue
        name, _, anchor = target.partition("#")
        file = (page.parent / name) if name else page
        assert file.exists(), f"{page.name} links to {target}"
        if anchor:
            headings = re.findall(r"^#+ (.*)$", file.read_text("utf-8"), re.M)
            assert anchor in {slug(h) for h in headings}, f"{page.name} links to {target}"


def test_every_page_is_reached_from_the_index() -> None:
    for page in DOCS.glob("*.md"):
        assert page.name == "index.md" or f"({page.name})" in text_of("index.md")


def test_readme_has_exactly_two_commands_on_its_first_screen() -> None:
    first_screen = (ROOT / "README.md").read_text("utf-8").split("\n## ")[0]
    commands = command_lines(first_screen)
    assert commands == ["scripts/demo", "scripts/test"]
    assert all(os.access(ROOT / command, os.X_OK) for command in commands)


def test_there_are_commands_to_check() -> None:
    assert len(freelook_commands()) > 10


@pytest.mark.parametrize(("page", "line"), freelook_commands())
def test_command_lines_are_understood(page: str, line: str) -> None:
    command = re.split(r"\s(?:\||&&|>|2>)\s", line)[0]
    cli.parse(shlex.split(command)[1:])


def test_commands_named_in_the_text_exist() -> None:
    for page in PAGES:
        prose = FENCE.sub("", page.read_text("utf-8"))
        for name in re.findall(r"`freelook (\w+)", prose):
            assert name in cli.COMMANDS, f"{page.name} speaks of 'freelook {name}'"
