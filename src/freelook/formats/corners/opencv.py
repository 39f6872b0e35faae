"""OpenCV's FileStorage (YAML, JSON, XML) with image_points, as its calibration programs write it.

`image_points`: a matrix with a row for each view and two channels, or a list with one matrix or
list for each view. Where they are on the target: `object_points` in the same form; else
`grid_points`, the same for all views; else the user's target; else a chessboard of `board_width` x
`board_height` corners and `square_size`. The size of the pictures: `image_width`, `image_height`.
Names of fields from saveCameraParams() in OpenCV's samples/cpp/calibration.cpp and
tutorial_code/calib3d/camera_calibration.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from ...calibration.views import View
from ...errors import CalibrationError, ProfileError
from ...lens import Floats
from .._document import Document
from .._filestorage import found, needed, storage
from .._numbers import number, picture_size
from .._yaml import plain_value
from ._corners import Choice, Corners
from ._lines import MOST_VALUE, text_of

SUFFIXES = (".yml", ".yaml", ".json", ".xml")
IMAGE_POINTS = ("imagepoints", "imgpoints", "imagecorners")
OBJECT_POINTS = ("objectpoints", "objpoints", "worldpoints")
GRID = ("gridpoints",)
MOST_VIEWS = 10_000


def read(name: str, choice: Choice) -> Corners:
    """Its views; what the file says about the target gives way to what the user says."""
    document = Document(text_of(Path(name)), name)
    try:
        data = _data(document)
        pixels = _views(*needed(data, IMAGE_POINTS, "image points"), 2)
        points = _points(data, name, choice, pixels)
        size = _size(data, name, choice)
    except ProfileError as error:
        raise CalibrationError(f"{name}: {_of_corners(error)}") from None
    views = []
    for i, (at, on) in enumerate(zip(pixels, points, strict=True), 1):
        if len(at) != len(on):
            raise CalibrationError(
                f"{name}: view {i} has {len(at)} corners, the target {len(on)}; is it the right "
                "target?"
            )
        views.append(View(f"{name} view {i}", on, at))
    return Corners(views, size)


def _of_corners(error: ProfileError) -> str:
    """The reader of lens profiles says what they are."""
    return str(error).replace("lens profile", "file of corners")


def _data(document: Document) -> dict[str, Any]:
    root = document.xml
    if root is not None:
        return {child.tag: _xml_value(child) for child in root}
    data = storage(document)
    if not data:
        why = document.why_not_json if document.looks_like_json else document.why_not_yaml
        why = document.why_not_xml if document.looks_like_xml else why
        raise ProfileError(f"not OpenCV's FileStorage{': ' if why else ''}{why}")
    return data


def _xml_value(element: Element) -> Any:
    """A matrix as a mapping, a sequence as a list, numbers as a list."""
    if "type_id" in element.attrib:
        return {child.tag: _words(child) for child in element} | element.attrib
    if len(element):
        return [_xml_value(child) for child in element]
    words = _words(element)
    return words[0] if len(words) == 1 else words


def _words(element: Element) -> list[Any]:
    return [plain_value(word.strip('"')) for word in (element.text or "").split()]


def _views(key: str, value: Any, width: int) -> list[Floats]:
    """(n, width) for each view, from a matrix of all or a list with one of each."""
    if isinstance(value, dict):
        whole = _array(value, key)
        if whole.ndim == 2 and whole.shape[1] == width:
            return [whole]
        views = list(whole) if whole.ndim > 2 else []
    elif isinstance(value, list):
        views = [_array(one, f"{key}[{i}]") for i, one in enumerate(value[:MOST_VIEWS])]
    else:
        views = []
    if not views:
        raise ProfileError(f"{key} must be a matrix or a list with points for each view")
    return [_rows(view, width, f"{key}[{i}]") for i, view in enumerate(views)]


def _rows(view: Floats, width: int, where: str) -> Floats:
    if view.size % width or (view.ndim > 1 and view.shape[-1] != width) or not view.size:
        raise ProfileError(f"{where} must be points of {width} numbers, not {view.shape}")
    return view.reshape(-1, width)


def _array(value: Any, where: str) -> Floats:
    """A matrix, channels last, or nested lists of numbers."""
    shape: tuple[int, ...] | None = None
    if isinstance(value, dict):
        shape, value = _shape(value, where), value.get("data")
        if not isinstance(value, list) or len(value) != math.prod(shape):
            raise ProfileError(f"{where} must have {math.prod(shape)} numbers in data")
    try:
        array = np.array(value)
    except ValueError:  # lists of different lengths
        array = np.array(None)
    if array.dtype.kind not in "if" or not (np.abs(array) < MOST_VALUE).all():
        raise ProfileError(f"{where} must be numbers of pixels or points, all of one length")
    return np.asarray(array.reshape(array.shape if shape is None else shape), np.float64)


def _shape(matrix: dict[str, Any], where: str) -> tuple[int, ...]:
    sides = matrix["sizes"] if "sizes" in matrix else [matrix.get("rows"), matrix.get("cols")]
    sides = [side[0] if isinstance(side, list) and side else side for side in _listed(sides)]
    whole = [int(number(side, f"a size of {where}")) for side in sides]
    kind = _listed(matrix.get("dt"))
    text = str(kind[0]) if kind else ""
    channels = int(text[:-1]) if text[:-1].isascii() and text[:-1].isdigit() else 1
    if min(whole, default=0) < 1 or not 1 <= channels <= 4:
        raise ProfileError(f"{where} has no size of a matrix: {sides!r:.40}, dt {text!r:.10}")
    return (*whole, channels) if channels > 1 else tuple(whole)


def _listed(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [value]


def _points(data: dict[str, Any], name: str, choice: Choice, pixels: list[Floats]) -> list[Floats]:
    """(n, 3) for each view."""
    key, value = found(data, OBJECT_POINTS)
    if key:
        points = _views(key, value, 3)
        points = points * len(pixels) if len(points) == 1 else points
        if len(points) != len(pixels):
            raise ProfileError(f"{key} has {len(points)} views, the image points {len(pixels)}")
        return points
    key, value = found(data, GRID)
    if key:
        return [_rows(_array(value, key), 3, key)] * len(pixels)
    return [_target_points(data, name, choice, len(pixels[0]))] * len(pixels)


def _target_points(data: dict[str, Any], name: str, choice: Choice, count: int) -> Floats:
    """(count, 3) of the user's target, or the file's."""
    from ...calibration.targets import Chessboard

    sizes = [found(data, (key,))[1] for key in ("boardwidth", "boardheight")]
    target = choice.target
    open_size = target is None or (isinstance(target, Chessboard) and target.inner is None)
    if not open_size or None in sizes:
        return choice.points(name)
    columns, rows = picture_size(sizes, "board_width and board_height")
    if columns * rows != count:
        raise ProfileError(
            f"its board is {columns} x {rows}, but its first view has {count} corners; if it is "
            "no chessboard, give --target"
        )
    square = 1.0
    if isinstance(target, Chessboard) and target.square != 1.0:
        square = target.square
    elif (said := found(data, ("squaresize",))[1]) is not None:
        square = number(said, "square_size")
    return Chessboard(square, (columns, rows)).points


def _size(data: dict[str, Any], name: str, choice: Choice) -> tuple[int, int]:
    sides = [found(data, (key,))[1] for key in ("imagewidth", "imageheight")]
    if None in sides:
        return choice.size_of(name, "a picture of it")
    return picture_size(sides, "image_width and image_height")
