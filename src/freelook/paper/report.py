"""The whole report: its sections in order, made one after another and written down."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from importlib.resources import files
from pathlib import Path

from ..errors import SinkError
from ..plots._style import save
from .exhibit import Exhibit, Section, Settings
from .page import FIGURES, NUMBERS, page

PAGE = "index.html"

# In the paper's order; each is a module here with `section(settings)`.
SECTIONS = (
    "projections",
    "focal",
    "principal_point",
    "polar",
    "points",
    "printed_curve",
    "agreement",
    "printed_models",
    "angles",
    "evidence",
    "distances",
    "views",
    "sensor",
    "parts",
)


def make_section(name: str, settings: Settings) -> Section:
    made = import_module(f".{name}", __package__).section(settings)
    assert isinstance(made, Section)
    return made


def open_folder(out: Path, *, overwrite: bool) -> None:
    """Make the folder and those it holds, without an old report's page.

    SinkError if it cannot be written to, or is not empty and `overwrite` is not given.
    """
    try:
        if out.is_dir() and any(out.iterdir()) and not overwrite:
            raise SinkError(
                f"{out} is not empty; name another folder, or give --overwrite to replace the "
                "files of an earlier report (others in it stay as they are)"
            )
        for folder in (out, out / FIGURES, out / NUMBERS):
            folder.mkdir(parents=True, exist_ok=True)
        (out / PAGE).unlink(missing_ok=True)
    except OSError as error:
        raise SinkError(f"cannot write into {out}: {error.strerror or error}") from None


def write_report(
    out: Path, settings: Settings, advance: Callable[[], None] = lambda: None
) -> list[Section]:
    """Everything into a folder that `open_folder` has made; `advance` after each section.

    The page comes last: where there is one, the report is whole. SinkError where the system does
    not let it write.
    """
    sections = []
    for name in SECTIONS:
        sections.append(make_section(name, settings))
        for exhibit in sections[-1].exhibits:
            write_exhibit(out, exhibit)
        advance()
    write_text(out / "style.css", (files(__package__) / "style.css").read_text("utf-8"))
    write_text(out / PAGE, page(sections, settings))
    return sections


def write_exhibit(out: Path, exhibit: Exhibit) -> None:
    """Its numbers as CSV and, if it is drawn, the figure as SVG and PNG."""
    write_text(out / NUMBERS / f"{exhibit.name}.csv", exhibit.table.csv())
    if exhibit.draw:
        figure = exhibit.draw(exhibit.table)
        save(figure, out / FIGURES / f"{exhibit.name}.svg")
        figure.set_layout_engine("none")  # its parts have their places now
        save(figure, out / FIGURES / f"{exhibit.name}.png")


def write_text(path: Path, text: str) -> None:
    try:
        path.write_text(text, "utf-8")
    except OSError as error:
        raise SinkError(f"cannot write {path}: {error.strerror or error}") from None
