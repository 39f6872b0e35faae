"""One HTML file with its pictures inside: no scripts, nothing from elsewhere."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement, tostring

import cv2
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from .. import __version__

STYLE = """
:root { color-scheme: light dark; }
body { font: 16px/1.5 system-ui, sans-serif; max-width: 72rem; margin: 0 auto; padding: 1rem; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.2rem; margin-top: 2rem; }
.key { font-size: 1.25rem; font-weight: 600; }
.weak { border-left: 4px solid #d55e00; padding-left: .8rem; }
figure { margin: 1rem 0; } figcaption { font-size: .9rem; opacity: .8; }
img { max-width: 100%; height: auto; background: white; border-radius: 4px; }
.pair { display: grid; gap: 1rem; grid-template-columns: repeat(auto-fit, minmax(18rem, 1fr)); }
table { border-collapse: collapse; } .scroll { overflow-x: auto; }
td, th { padding: .15rem .8rem; text-align: right; border-bottom: 1px solid #8884; }
td:first-child, th:first-child { text-align: left; }
"""


class Page:
    """Built from top to bottom; `text()` is the file."""

    def __init__(self, title: str) -> None:
        self._root = Element("html", {"lang": "en"})
        head = SubElement(self._root, "head")
        SubElement(head, "meta", {"charset": "utf-8"})
        viewport = {"name": "viewport", "content": "width=device-width, initial-scale=1"}
        SubElement(head, "meta", viewport)
        SubElement(head, "title").text = title
        SubElement(head, "style").text = STYLE
        self._body = SubElement(self._root, "body")
        SubElement(self._body, "h1").text = title

    def heading(self, text: str) -> None:
        SubElement(self._body, "h2").text = text

    def paragraph(self, text: str, kind: str = "") -> None:
        SubElement(self._body, "p", {"class": kind} if kind else {}).text = text

    def figure(self, figure: Figure, caption: str) -> None:
        data = io.BytesIO()
        figure.savefig(data, format="png", metadata={"Software": None})
        self._image(SubElement(self._body, "figure"), data.getvalue(), "png", caption)

    def pictures(self, pictures: Sequence[tuple[NDArray[np.uint8], str]]) -> None:
        """Pictures (gray or RGB) with captions, side by side where there is room."""
        row = SubElement(self._body, "div", {"class": "pair"})
        for picture, caption in pictures:
            bgr = picture[..., ::-1] if picture.ndim == 3 else picture
            ok, data = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, 88])
            assert ok
            self._image(SubElement(row, "figure"), data.tobytes(), "jpeg", caption)

    def table(self, head: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        table = SubElement(SubElement(self._body, "div", {"class": "scroll"}), "table")
        line = SubElement(table, "tr")
        for text in head:
            SubElement(line, "th").text = text
        for row in rows:
            line = SubElement(table, "tr")
            for text in row:
                SubElement(line, "td").text = text

    def text(self) -> str:
        footer = SubElement(self._body, "footer")
        SubElement(footer, "p").text = f"freelook {__version__}"
        return "<!DOCTYPE html>\n" + tostring(self._root, encoding="unicode", method="html") + "\n"

    def _image(self, parent: Element, data: bytes, kind: str, caption: str) -> None:
        source = f"data:image/{kind};base64,{base64.b64encode(data).decode()}"
        SubElement(parent, "img", {"src": source, "alt": caption})
        SubElement(parent, "figcaption").text = caption
