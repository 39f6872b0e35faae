"""OpenCV's lists of coefficients and its K, which ROS, Kalibr and Basalt use as well."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from ..camera import Camera
from ..errors import ProfileError
from ..lens import KannalaBrandt, Lens, OpenCVRational, model_name, parameters
from ._matrix import Matrix, matrix_of
from ._numbers import numbers

RATIONAL = (  # in OpenCV's order
    *("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
    *("s1", "s2", "s3", "s4", "tau_x", "tau_y"),
)
FISHEYE = ("k1", "k2", "k3", "k4")


def matrix_from_rows(rows: Sequence[float], where: str) -> Matrix:
    """K from its nine numbers, row by row; ProfileError unless it is one."""
    fx, skew, cx, below, fy, cy, *last = rows
    if below or last != [0, 0, 1]:
        raise ProfileError(
            f"{where} must be [fx, skew, cx, 0, fy, cy, 0, 0, 1] row by row, not {list(rows)}"
        )
    return Matrix(fx, fy, cx, cy, skew)


def rows_of(matrix: Matrix) -> list[float]:
    return [matrix.fx, matrix.skew, matrix.cx, 0.0, matrix.fy, matrix.cy, 0.0, 0.0, 1.0]


def matrix_data(value: Any, where: str) -> Any:
    """The numbers of a matrix as OpenCV and ROS write it, row by row; anything else as it is.

    ProfileError where there are not as many as the matrix claims.
    """
    if not isinstance(value, dict):
        return value
    claimed = value["sizes"] if "sizes" in value else [value.get("rows"), value.get("cols")]
    sides = numbers(claimed, range(1, 9), f"rows and cols of {where}")
    data = value.get("data")
    if not isinstance(data, list) or len(data) != math.prod(sides):
        raise ProfileError(
            f"{where} must have rows * cols = {math.prod(sides):.0f} numbers in data"
        )
    return data


def coefficients(values: object, counts: Sequence[int], where: str) -> list[float]:
    """A list of numbers as long as one of `counts`, or ProfileError.

    Zeros beyond the longest are dropped: some programs fill up a fixed length with them.
    """
    found = numbers(values, range(33), where)
    while len(found) > counts[-1] and found[-1] == 0:
        found.pop()
    if len(found) not in counts:
        wanted = " or ".join(map(str, counts))
        raise ProfileError(f"{where} must be a list of {wanted} numbers, not of {len(found)}")
    return found


def rational(fx: float, values: Sequence[float]) -> OpenCVRational:
    return OpenCVRational(fx, **dict(zip(RATIONAL, values, strict=False)))


def fisheye(fx: float, values: Sequence[float]) -> KannalaBrandt:
    return KannalaBrandt(fx, **dict(zip(FISHEYE, values, strict=True)))


def rational_terms(lens: Lens, counts: Sequence[int], what: str) -> list[float]:
    """The shortest list among `counts` that leaves nothing of the lens out, or ProfileError.

    A perspective lens is one whose coefficients are all 0.
    """
    values = [float(getattr(lens, name, 0.0)) for name in RATIONAL]
    used = max((i + 1 for i, value in enumerate(values) if value), default=0)
    for count in counts:
        if used <= count:
            return values[:count]
    left = [name for name in RATIONAL[counts[-1] :] if getattr(lens, name)]
    raise ProfileError(f"{what} has no place for {', '.join(left)} of this lens")


def fisheye_terms(lens: Lens) -> list[float]:
    """k1 to k4; an equidistant lens is one whose coefficients are all 0."""
    return [float(getattr(lens, name, 0.0)) for name in FISHEYE]


def held_matrix(camera: Camera, models: Sequence[str], what: str) -> Matrix:
    """K of a camera whose lens is of one of the models that `what` can hold, or ProfileError."""
    name = model_name(camera.lens)
    if name not in models:
        raise ProfileError(
            f"{what} has no lens model like '{name}'; it has {', '.join(models)}: "
            "convert to one of them with --model"
        )
    return matrix_of(camera, float(parameters(camera.lens)["f"]), what)  # type: ignore[arg-type]


def without_skew(matrix: Matrix, what: str) -> Matrix:
    """The same, or ProfileError if it has a skew that one would see: `what` cannot say one."""
    if abs(matrix.skew) > 1e-9 * matrix.fx:
        raise ProfileError(f"{what} cannot say skew, and this camera has {matrix.skew:.4g} pixels")
    return matrix
