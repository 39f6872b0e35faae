"""What there is: built-in profiles, lens models, profile formats, or the profiles in a folder.

freelook lens list                  what comes with the program
freelook lens list profiles/        every profile in a folder and below it: its lens, or why
                                    it is refused; and how many of them for which reason
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import FreelookError
from .._arguments import size
from ._report import first_line, print_json, rounded

if TYPE_CHECKING:
    from rich.table import Table

    from ...camera import Camera
    from ._folder import Found


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", metavar="FOLDER", nargs="?", help="list the profiles in it")
    parser.add_argument(
        "--lens-size",
        type=size,
        metavar="WxH",
        help="picture size, for profiles in FOLDER that do not say it themselves",
    )
    parser.add_argument("--json", action="store_true", help="print the list as JSON")


def run(args: argparse.Namespace) -> int:
    return _list_folder(args) if args.folder is not None else _list_program(args)


def _list_program(args: argparse.Namespace) -> int:
    from rich.console import Console

    what = {"profiles": _profiles(), "models": _models(), "formats": _formats()}
    if args.json:
        print_json(what)
        return 0
    console = Console()
    console.print(_entries("profiles that come with it", map(_profile_words, what["profiles"])))
    console.print(_entries("lens models", map(_model_words, what["models"])))
    console.print(_entries("profile formats", map(_format_words, what["formats"])))
    console.print(
        "Wherever a lens is asked for, any file of these formats works; "
        "'freelook lens show PROFILE' shows one.",
        highlight=False,
    )
    return 0


def _profiles() -> list[dict[str, Any]]:
    from ...formats import builtin_names, load_profile

    loaded = [(name, load_profile(name)) for name in builtin_names()]
    return [
        {"profile": name, "name": p.name, **_camera_row(p.camera), "source": p.source}
        for name, p in loaded
    ]


def _camera_row(camera: Camera) -> dict[str, Any]:
    from ...lens import model_name

    return {
        "model": model_name(camera.lens),
        "size": list(camera.size),
        "field_deg": rounded(float(np.degrees(2 * camera.theta_max))),
    }


def _models() -> list[dict[str, Any]]:
    from dataclasses import fields

    from ...lens import MODELS

    return [
        {
            "model": name,
            "formula": first_line(model),
            "parameters": [f.name for f in fields(model)],  # type: ignore[arg-type]
            "holds_to_deg": _hard_limit(model),
        }
        for name, model in MODELS.items()
    ]


def _hard_limit(model: type) -> float | None:
    """Degrees from the axis; None where that depends on the parameters."""
    limit = getattr(model, "hard_limit", None)
    return rounded(float(np.degrees(limit))) if isinstance(limit, float) else None


def _formats() -> list[dict[str, Any]]:
    from ...formats import FORMATS, format_module

    return [
        {
            "format": name,
            "what": first_line(format_module(name)),
            "suffix": format_module(name).SUFFIX,
            "models": list(format_module(name).MODELS),
        }
        for name in FORMATS
    ]


def _entries(title: str, entries: Iterable[tuple[str, list[str]]]) -> Table:
    """A name and lines about it, each."""
    from rich.markup import escape
    from rich.table import Table

    table = Table(title=title, title_justify="left", show_header=False)
    table.add_column(no_wrap=True)
    table.add_column()
    for name, lines in entries:
        first, *others = map(escape, filter(None, lines))
        table.add_row(name, "\n".join([first, *(f"[dim]{line}[/dim]" for line in others)]))
    return table


def _profile_words(row: dict[str, Any]) -> tuple[str, list[str]]:
    width, height = row["size"]
    camera = f"{row['model']}, {width} x {height}, field {row['field_deg']:.4g} degrees"
    return row["profile"], [row["name"], camera, row["source"]]


def _model_words(row: dict[str, Any]) -> tuple[str, list[str]]:
    limit = row["holds_to_deg"]
    holds = "where it ends depends on them" if limit is None else f"ends at {limit:g} degrees"
    return row["model"], [row["formula"], f"{' '.join(row['parameters'])}; {holds}"]


def _format_words(row: dict[str, Any]) -> tuple[str, list[str]]:
    from ...lens import MODELS

    models = "all models" if set(row["models"]) == set(MODELS) else " ".join(row["models"])
    return row["format"], [row["what"], f"*{row['suffix']}; can hold {models}"]


def _list_folder(args: argparse.Namespace) -> int:
    from rich.console import Console

    from .._bars import bar
    from ._folder import candidates, read_folder

    folder = Path(args.folder)
    if not folder.is_dir():
        raise FreelookError(
            f"{folder} is no folder; 'freelook lens show FILE' shows a single profile"
        )
    files, others = candidates(folder)
    if not files:
        raise FreelookError(f"no lens profile in {folder}: {others} files of other kinds")
    with bar("reading profiles", len(files), "files", quiet=args.json) as advance:
        found = read_folder(folder, files, args.lens_size, advance)
    if args.json:
        print_json({"folder": args.folder, **_summary(found, others), **_rows(found)})
        return 0
    console = Console()
    console.print(_folder_table(found))
    console.print(_reason_table(found))
    console.print(_totals(_summary(found, others)), highlight=False)
    return 0


def _summary(found: list[Found], others: int) -> dict[str, Any]:
    from ._folder import NO_PROFILE, reasons

    return {
        "cameras": sum(each.profile is not None for each in found),
        "with_notes": sum(bool(each.profile and each.profile.notes) for each in found),
        "refused": sum(each.profile is None and each.format != NO_PROFILE for each in found),
        "no_profiles": sum(each.format == NO_PROFILE for each in found),
        "other_files": others,
        "reasons": [
            {"reason": reason, "count": count, "first": first.path}
            for reason, count, first in reasons(found)
        ],
    }


def _totals(summary: dict[str, Any]) -> str:
    words = [f"{summary['cameras']} cameras ({summary['with_notes']} of them with notes)"]
    words.append(f"{summary['refused']} refused")
    if summary["no_profiles"]:
        words.append(f"{summary['no_profiles']} files that are no profiles")
    if summary["other_files"]:
        words.append(f"{summary['other_files']} files of other kinds, not looked at")
    return ", ".join(words) + "."


def _rows(found: list[Found]) -> dict[str, Any]:
    return {
        "profiles": [
            {
                "profile": each.path,
                "format": each.format,
                "name": each.profile.name,
                **_camera_row(each.profile.camera),
                "notes": list(each.profile.notes),
            }
            if each.profile
            else {"profile": each.path, "format": each.format, "refused": each.reason}
            for each in found
        ]
    }


def _folder_table(found: list[Found]) -> Table:
    from rich.markup import escape
    from rich.table import Table

    from ._folder import NO_PROFILE

    table = Table()
    table.add_column("profile", overflow="fold", ratio=3)
    table.add_column("picture", no_wrap=True)
    table.add_column("field", justify="right", no_wrap=True)
    table.add_column("model and notes, or why refused", overflow="fold", ratio=4)
    for each in found:
        if each.profile:
            row = _camera_row(each.profile.camera)
            size = f"{row['size'][0]}x{row['size'][1]}"
            words = "; ".join([f"{each.format} {row['model']}", *_first(each.profile.notes)])
            table.add_row(escape(each.path), size, f"{row['field_deg']:.1f}", escape(words))
        elif each.format == NO_PROFILE:
            words = each.reason.split("; ")[0]
            table.add_row(escape(each.path), "", "", f"[dim]{escape(words)}[/dim]")
        else:
            words = f"{each.format}: {each.reason}"
            table.add_row(escape(each.path), "", "", f"[red]{escape(words)}[/red]")
    return table


def _first(notes: tuple[str, ...]) -> list[str]:
    """The first note up to its advice, and how many more there are."""
    more = f"{len(notes) - 1} more note{'s' if len(notes) > 2 else ''}"
    return [notes[0].split("; ")[0], *([more] if len(notes) > 1 else [])] if notes else []


def _reason_table(found: list[Found]) -> Table | str:
    from rich.markup import escape
    from rich.table import Table

    from ._folder import reasons

    rows = reasons(found)
    if not rows:
        return "Every one is read."
    table = Table(title="not read, and why", title_justify="left")
    table.add_column("files", justify="right", no_wrap=True)
    table.add_column("reason, # for its numbers and names", overflow="fold")
    table.add_column("the first", overflow="fold")
    for reason, count, first in rows:
        table.add_row(str(count), escape(reason), escape(first.path))
    return table
