"""OCamCalib's calib_results.txt: direct and inverse polynomial, centre, affine part, size.

Comment lines begin with `#`; the numbers between them are, in this order,

    N  a0 a1 ... aN-1     the direct polynomial, ascending, in pixels; a0 < 0 and a1 = 0
    M  b0 b1 ... bM-1     the inverse polynomial, ascending
    row col               the centre, counted from 0: (0, 0) is the middle of the top-left pixel
    c d e                 the affine part
    height width

The toolbox's x is the row, its y the column and its z backward. A ray (x, y, z) has t =
atan(z / |xy|), rho = b0 + b1 t + ..., and with (x, y) = rho (x, y) / |xy|

    row = c x + d y + row0        column = e x + y + col0

Source: `ocam_functions.c` of the toolbox (cam2world, world2cam, get_ocam_model). The direct
polynomial is what was calibrated, and what is used here.
"""

from __future__ import annotations

from itertools import islice

import numpy as np

from ..camera import make_camera
from ..errors import ProfileError
from ._document import Document
from ._field import field_notes
from ._numbers import picture_size
from ._ocam import MOST_TERMS, check_inverse, expect_ocam, fit_inverse, lens_of, scaled
from ._profile import Choice, Profile
from ._words import NUMBER, without_comments, word_numbers

SUFFIX = ".txt"
MODELS = ("ocamcalib",)
SHIFT = -np.pi / 2  # t is counted from the picture's plane, our theta from the axis
MOST_WORDS = 2 * MOST_TERMS + 9


def recognises(document: Document) -> bool:
    """Whether it begins with two lines of numbers that say how many they are."""
    lines = [line.split() for line in islice(without_comments(document.text), 2)]
    return len(lines) == 2 and all(
        words[0] == str(len(words) - 1) and all(map(NUMBER.fullmatch, words)) for words in lines
    )


def read(document: Document, choice: Choice) -> Profile:
    """The camera of the direct polynomial; a note says how good the inverse one is."""
    words = _Words(" ".join(without_comments(document.text)).split(maxsplit=MOST_WORDS))
    direct = words.counted("the direct polynomial")
    inverse = words.counted("the inverse polynomial")
    row, column = words.next(2, "the centre (row, column)")
    c, d, e = words.next(3, "the affine part (c, d, e)")
    height, width = words.next(2, "the picture's size (height, width)")
    words.end()
    if direct[0] >= 0:
        raise ProfileError(
            f"a0 of the direct polynomial must be negative here, not {direct[0]:g}: the toolbox "
            "looks along -z; py-OCamCalib writes positive ones, in JSON"
        )
    camera = make_camera(
        picture_size([width, height], "width and height"),
        lens_of(direct),
        center=(column, row),
        stretch=np.array([[1.0, e], [d, c]]),
    )
    return Profile(camera, notes=check_inverse(camera, inverse, SHIFT) + field_notes(camera))


def write(profile: Profile) -> str:
    """The text, with an inverse polynomial fitted as the toolbox does: the lowest degree that is
    good to 0.01 px over the field, or the best up to 25; its comment says how good."""
    camera = profile.camera
    scale = float(camera.stretch[0, 0])
    if scale <= 0:
        raise ProfileError(f"OCamCalib cannot turn the picture: {camera.stretch.tolist()}")
    lens = scaled(expect_ocam(camera, "OCamCalib"), scale)
    (_, e), (d, c) = (camera.stretch / scale).tolist()
    inverse = fit_inverse(camera, SHIFT)
    column, row = camera.center
    width, height = camera.size
    parts = (
        ("polynomial coefficients for the DIRECT mapping function (used by cam2world)",
         _counted([0.0 - a for a in lens.coefficients])),
        ("polynomial coefficients for the inverse mapping function (used by world2cam); "
         + inverse.words, _counted([b * scale for b in inverse.coefficients])),
        ('center: "row" and "column", starting from 0 (C convention)', _spelled([row, column])),
        ('affine parameters "c", "d", "e"', _spelled([c, d, e])),
        ('image size: "height" and "width"', f"{height} {width}"),
    )  # fmt: skip
    return "\n\n".join(f"#{comment}\n\n{numbers}" for comment, numbers in parts) + "\n"


class _Words:
    """The numbers of a file, taken one after the other."""

    def __init__(self, words: list[str]) -> None:
        self._words = words

    def next(self, count: int, what: str) -> list[float]:
        taken, self._words = self._words[:count], self._words[count:]
        if len(taken) < count:
            raise ProfileError(f"the file ends before {what}")
        return word_numbers(taken, what)

    def counted(self, what: str) -> list[float]:
        (count,) = self.next(1, f"the number of terms of {what}")
        if count != int(count) or not 1 <= count <= MOST_TERMS:
            raise ProfileError(f"{what} has {count:g} terms; 1 to {MOST_TERMS} can be read")
        return self.next(int(count), what)

    def end(self) -> None:
        if self._words:
            raise ProfileError(f"more numbers behind the picture's size: {self._words[0]:.40}")


def _spelled(numbers: list[float]) -> str:
    return " ".join(repr(float(n)) for n in numbers)


def _counted(numbers: list[float]) -> str:
    return f"{len(numbers)} {_spelled(numbers)}"
