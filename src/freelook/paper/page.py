"""The report as one HTML page: no scripts, nothing from elsewhere."""

from __future__ import annotations

import math
import re
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from .. import __version__
from . import printed
from .exhibit import Exhibit, Section, Settings, Table

FIGURES, NUMBERS = "figures", "numbers"
LONG = 14  # rows above which a table is folded away

INTRODUCTION = (
    "In 2011 Osamah Rawashdeh and Belal Sababha flew an R/C plane with a fixed fisheye camera and "
    "head-tracked goggles: a gimbal with no moving parts. freelook grew out of that idea. This "
    "page does their paper's figures, tables and equations again with freelook's own code, and "
    "says where the printed numbers hold and where they do not.",
    "Their measurements were not published, only two fitted equations. So a part of this page "
    "examines the printed numbers, and the rest repeats the experiments with a simulated camera "
    "whose truth is known. Each section says which, with its noise. Nothing here shows the "
    "authors' own data or pictures.",
)


def page(sections: list[Section], settings: Settings) -> str:
    root = Element("html", {"lang": "en"})
    head = SubElement(root, "head")
    SubElement(head, "meta", {"charset": "utf-8"})
    SubElement(head, "meta", {"name": "viewport", "content": "width=device-width, initial-scale=1"})
    SubElement(head, "meta", {"name": "color-scheme", "content": "light dark"})
    _add(head, "title", "A virtual gimbal of 2011, reproduced")
    SubElement(head, "link", {"rel": "stylesheet", "href": "style.css"})
    body = SubElement(root, "body")
    _add_header(body, sections)
    main = SubElement(body, "main")
    for section in sections:
        _add_section(main, section)
    _add_footer(body, settings)
    indent(root, " ")
    return "<!DOCTYPE html>\n" + tostring(root, encoding="unicode", method="html") + "\n"


def _add(parent: Element, tag: str, text: str, **attributes: str) -> Element:
    """A child with text; `class_` is the attribute class."""
    child = SubElement(parent, tag, {key.rstrip("_"): v for key, v in attributes.items()})
    child.text = text
    return child


def _add_header(body: Element, sections: list[Section]) -> None:
    header = SubElement(body, "header")
    _add(header, "h1", "A virtual gimbal of 2011, reproduced")
    for paragraph in INTRODUCTION:
        _add(header, "p", paragraph)
    _add(header, "p", f"The paper: {printed.REFERENCE}.", class_="small")
    contents = SubElement(SubElement(header, "nav"), "ol")
    for section in sections:
        line = SubElement(contents, "li")
        link = SubElement(line, "a", {"href": f"#{section.name}"})
        _add(link, "span", section.title, class_="what")
        _add(link, "span", section.verdict, class_=f"verdict {_slug(section)}")
        _add(line, "p", _sentence(section.because), class_="small")


def typeset(text: str) -> str:
    """Minus signs in front of numbers."""
    return re.sub(r"(?<![\w-])-(?=\d)", "−", text)


def _slug(section: Section) -> str:
    return section.verdict.replace(" ", "-")


def _sentence(text: str) -> str:
    return typeset(f"{text[0].upper()}{text[1:]}.")


def _add_section(main: Element, section: Section) -> None:
    box = SubElement(main, "section", {"id": section.name})
    _add(box, "h2", section.title)
    _add(box, "p", section.places, class_="places")
    _add(box, "h3", "What the paper shows")
    _add(box, "p", typeset(section.paper))
    _add(box, "h3", "What we get")
    for paragraph in section.ours:
        _add(box, "p", typeset(paragraph))
    for exhibit in section.exhibits:
        _add_figure(box, exhibit) if exhibit.draw else _add_table(box, exhibit)
    verdict = SubElement(box, "p", {"class": "conclusion"})
    _add(
        verdict, "span", section.verdict, class_=f"verdict {_slug(section)}"
    ).tail = f" {_sentence(section.because)}"
    _add(_add(box, "p", "", class_="small basis"), "b", "Rests on: ").tail = typeset(section.basis)


def _add_figure(box: Element, exhibit: Exhibit) -> None:
    kind = "picture" if exhibit.picture else "plot"
    figure = SubElement(box, "figure", {"class": kind})
    suffix = "png" if exhibit.picture else "svg"
    SubElement(
        figure,
        "img",
        {"src": f"{FIGURES}/{exhibit.name}.{suffix}", "alt": exhibit.caption, "loading": "lazy"},
    )
    caption = _add(figure, "figcaption", f"{exhibit.caption} ")
    for name, target in (
        ("PNG", f"{FIGURES}/{exhibit.name}.png"),
        ("SVG", f"{FIGURES}/{exhibit.name}.svg"),
        ("numbers", f"{NUMBERS}/{exhibit.name}.csv"),
    ):
        _add(caption, "a", name, href=target).tail = " "


def _add_table(box: Element, exhibit: Exhibit) -> None:
    figure = SubElement(box, "figure", {"class": "table"})
    caption = _add(figure, "figcaption", f"{exhibit.caption} ")
    _add(caption, "a", "numbers", href=f"{NUMBERS}/{exhibit.name}.csv")
    parent = figure
    if len(exhibit.table) > LONG:
        parent = SubElement(figure, "details")
        _add(parent, "summary", f"{len(exhibit.table)} rows")
    table = SubElement(SubElement(parent, "div", {"class": "scroll"}), "table")
    row = SubElement(SubElement(table, "thead"), "tr")
    for name in exhibit.table.names:
        _add(row, "th", name.strip(), scope="col", class_=_alignment(exhibit.table, name))
    body = SubElement(table, "tbody")
    for values in exhibit.table.rows():
        row = SubElement(body, "tr")
        for name, value in zip(exhibit.table.names, values, strict=True):
            text = value if isinstance(value, str) else number(value, exhibit.digits.get(name, 2))
            _add(row, "td", text, class_=_alignment(exhibit.table, name))


def _alignment(table: Table, name: str) -> str:
    return "word" if name in table.words else "number"


def number(value: float, digits: int) -> str:
    """As shown on the page; very small ones keep one significant digit."""
    if math.isnan(value):
        return "–"
    if value and abs(value) < 0.5 * 10.0**-digits and abs(value) < 1e-6:
        return f"{value:.0e}"
    text = f"{value:.{digits}f}"
    return text.lstrip("-") if float(text) == 0 else typeset(text)


def _add_footer(body: Element, settings: Settings) -> None:
    footer = SubElement(body, "footer")
    text = (
        f"Made by freelook {__version__} with seed {settings.seed} and {settings.draws} draws. "
        "The same again: "
    )
    command = f"freelook paper OUTDIR --seed {settings.seed} --draws {settings.draws}"
    _add(_add(footer, "p", text), "code", command)
