"""The report as a whole: every file is there, every figure shows its numbers, the page is sound."""

from __future__ import annotations

import math
from html.parser import HTMLParser
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from matplotlib.figure import Figure

from freelook.errors import SinkError
from freelook.paper import page, report
from freelook.paper.exhibit import Section, Settings, Table, read_table

QUICK = Settings(seed=3, draws=50, pictures=2, threads=1)
VOID = {"meta", "link", "img", "br", "hr", "input"}


class Made(NamedTuple):
    out: Path
    sections: list[Section]
    html: str


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Made:
    out = tmp_path_factory.mktemp("report") / "new" / "folder"
    report.open_folder(out, overwrite=False)
    steps: list[int] = []
    with np.errstate(all="raise"):
        sections = report.write_report(out, QUICK, lambda: steps.append(1))
    assert len(steps) == len(report.SECTIONS)
    return Made(out, sections, (out / "index.html").read_text("utf-8"))


class Page(HTMLParser):
    """Checks nesting, and collects what the page refers to."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.links: list[str] = []
        self.ids: list[str] = []
        self.images: list[dict[str, str | None]] = []
        self.wrong: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        self.links += [str(values[key]) for key in ("href", "src") if key in values]
        if "id" in values:
            self.ids.append(str(values["id"]))
        if tag == "img":
            self.images.append(values)
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open.pop() != tag:
            self.wrong.append(tag)


def parsed(html: str) -> Page:
    found = Page()
    found.feed(html)
    found.close()
    return found


def exhibits(made: Made) -> list[str]:
    return [exhibit.name for section in made.sections for exhibit in section.exhibits]


def test_html_is_well_formed(made: Made) -> None:
    found = parsed(made.html)
    assert not found.wrong
    assert not found.open
    assert made.html.startswith("<!DOCTYPE html>")
    assert len(set(found.ids)) == len(found.ids) == len(report.SECTIONS)


def test_well_formedness_is_really_checked() -> None:
    assert parsed("<p><b>x</p></b>").wrong
    assert parsed("<p>x").open == ["p"]


def test_everything_the_page_refers_to_exists(made: Made) -> None:
    found = parsed(made.html)
    assert len(found.links) > 60
    for link in found.links:
        if link.startswith("#"):
            assert link[1:] in found.ids
        else:
            assert "//" not in link, "nothing from elsewhere"
            assert (made.out / link).is_file(), link
    assert all(image["alt"] for image in found.images)


def test_page_runs_no_scripts_and_fits_phones(made: Made) -> None:
    assert "<script" not in made.html
    assert 'name="viewport"' in made.html
    style = (made.out / "style.css").read_text("utf-8")
    assert "prefers-color-scheme: dark" in style
    assert "url(" not in style
    assert "@import" not in style


def test_every_file_is_on_the_page(made: Made) -> None:
    found = set(parsed(made.html).links)
    files = [path for path in made.out.rglob("*") if path.is_file() and path.name != "index.html"]
    assert len(files) > 60
    assert {path.relative_to(made.out).as_posix() for path in files} <= found


def test_every_figure_is_png_and_svg_and_every_exhibit_has_numbers(made: Made) -> None:
    names = exhibits(made)
    assert len(set(names)) == len(names)
    for section in made.sections:
        for exhibit in section.exhibits:
            assert (made.out / "numbers" / f"{exhibit.name}.csv").stat().st_size > 20
            if exhibit.draw:
                png = (made.out / "figures" / f"{exhibit.name}.png").read_bytes()
                svg = (made.out / "figures" / f"{exhibit.name}.svg").read_text("utf-8")
                assert png.startswith(b"\x89PNG")
                assert svg.startswith("<?xml")
                assert "</svg>" in svg


def shown(figure: Figure) -> list[np.ndarray]:
    """Everything a figure shows as coordinates: lines, bands, stems, patches."""
    found = []
    for axes in figure.axes:
        found += [np.asarray(line.get_xydata(), dtype=float) for line in axes.lines]
        for collection in axes.collections:
            found += [np.asarray(path.vertices, dtype=float) for path in collection.get_paths()]
        found += [np.asarray(patch.get_path().vertices, dtype=float) for patch in axes.patches]
    return found


def test_figures_drawn_from_the_csv_files_show_the_same(made: Made) -> None:
    """A figure gets nothing but its table; so the CSV must be enough to draw it again."""
    drawn = 0
    for section in made.sections:
        for exhibit in section.exhibits:
            if exhibit.draw is None:
                continue
            text = (made.out / "numbers" / f"{exhibit.name}.csv").read_text("utf-8")
            ours, again = exhibit.draw(exhibit.table), exhibit.draw(read_table(text))
            for one, other in zip(shown(ours), shown(again), strict=True):
                # CSV has 12 digits
                np.testing.assert_allclose(one, other, rtol=1e-11, atol=1e-9)
            assert shown(ours) or exhibit.picture
            drawn += 1
    assert drawn == 20


@pytest.mark.parametrize(
    ("name", "x", "y"),
    [
        ("fig04_projections", "theta_deg", "equisolid"),
        ("fig08_printed", "theta_deg", "quintic_px"),
        ("fig08_simulated", "theta_deg", "read_px"),
        ("fig09_printed", "theta_deg", "line_minus_quintic_px"),
        ("eq7_model_residuals", "theta_deg", "orthographic"),
        ("views_resolution", "theta_deg", "across_px_per_deg"),
        ("principal_point", "x_px", "y_px"),
    ],
)
def test_columns_of_the_csv_are_in_the_figure(made: Made, name: str, x: str, y: str) -> None:
    table = read_table((made.out / "numbers" / f"{name}.csv").read_text("utf-8"))
    exhibit = next(e for s in made.sections for e in s.exhibits if e.name == name)
    assert exhibit.draw is not None
    wanted = np.stack([table[x], table[y]], axis=-1)
    lines = [line for line in shown(exhibit.draw(exhibit.table)) if line.shape == wanted.shape]
    assert any(np.allclose(line, wanted, rtol=1e-11, equal_nan=True) for line in lines)


def test_every_section_says_what_it_rests_on(made: Made) -> None:
    for section in made.sections:
        assert section.basis
        assert section.ours
        assert section.places
        if "imulation" in section.basis:
            assert any(word in section.basis for word in ("px", "noise", "error", "rounding"))
    assert f"seed {QUICK.seed}" in made.html
    assert {s.verdict for s in made.sections} == {"holds", "holds in part", "does not hold"}


def test_every_section_module_is_in_the_report() -> None:
    folder = Path(report.__file__).parent
    having = {p.stem for p in folder.glob("*.py") if "\ndef section(" in p.read_text("utf-8")}
    assert having == set(report.SECTIONS)


def test_the_same_seed_gives_the_same_numbers_and_another_does_not() -> None:
    first, again, other = (
        report.make_section("distances", Settings(seed=seed)).exhibits[0].table.csv()
        for seed in (3, 3, 4)
    )
    assert first == again
    assert first != other


class TestFolder:
    def test_is_made(self, tmp_path: Path) -> None:
        report.open_folder(tmp_path / "a" / "b", overwrite=False)
        assert (tmp_path / "a" / "b" / "figures").is_dir()

    def test_an_empty_one_will_do(self, tmp_path: Path) -> None:
        report.open_folder(tmp_path, overwrite=False)

    def test_one_with_something_in_it_is_refused(self, tmp_path: Path) -> None:
        (tmp_path / "mine.txt").write_text("precious")
        with pytest.raises(SinkError, match=r"not empty.*--overwrite"):
            report.open_folder(tmp_path, overwrite=False)
        assert [p.name for p in tmp_path.iterdir()] == ["mine.txt"]
        (tmp_path / "index.html").write_text("of an earlier report")
        report.open_folder(tmp_path, overwrite=True)
        assert not (tmp_path / "index.html").exists()  # until the new one is whole
        assert (tmp_path / "mine.txt").read_text() == "precious"

    def test_a_file_is_no_folder(self, tmp_path: Path) -> None:
        (tmp_path / "file").write_text("x")
        for overwrite in (False, True):
            with pytest.raises(SinkError, match="cannot write into"):
                report.open_folder(tmp_path / "file", overwrite=overwrite)

    def test_what_cannot_be_written_is_named(self, tmp_path: Path) -> None:
        with pytest.raises(SinkError, match="nowhere"):
            report.write_text(tmp_path / "nowhere" / "x.csv", "x")


class TestTable:
    def test_round_trip(self) -> None:
        table = Table({"name": ["a, b", "c"], "x": [1.5, math.nan], "y": [1e-9, -2e7]})
        again = read_table(table.csv())
        assert again.words == {"name": ("a, b", "c")}
        np.testing.assert_array_equal(again["x"], [1.5, np.nan])
        np.testing.assert_array_equal(again["y"], [1e-9, -2e7])
        assert len(again) == 2

    def test_columns_must_be_equally_long(self) -> None:
        with pytest.raises(ValueError, match="different lengths"):
            Table({"x": [1.0], "y": [1.0, 2.0]})

    def test_where(self) -> None:
        table = Table({"name": ["a", "b", "a"], "x": [1.0, 2.0, 3.0]})
        assert table.where("name", "a")["x"].tolist() == [1, 3]


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (1.236, 2, "1.24"),
        (-1.236, 1, "−1.2"),
        (-0.001, 2, "0.00"),
        (3e-14, 2, "3e-14"),
        (0.0, 1, "0.0"),
        (math.nan, 2, "–"),
        (720.0, 0, "720"),
    ],
)
def test_numbers_on_the_page(value: float, digits: int, text: str) -> None:
    assert page.number(value, digits) == text


def test_minus_signs_in_front_of_numbers_only() -> None:
    assert page.typeset("-5 to 1e-9, from-circle, 10-90, (-3)") == (
        "−5 to 1e-9, from-circle, 10-90, (−3)"
    )
