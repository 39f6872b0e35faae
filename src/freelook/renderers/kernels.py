"""The compiled loops of the CPU renderer: the shared projection (see `freelook.camera`)."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from ..projections import FORMULAS

F32 = NDArray[np.float32]
FAR = np.float32(4.0)  # rays are followed to this many times t_max, then held: all black anyway

TOLERANCE_PX = np.float32(0.005)
COARSEST, FINEST = 16, 2  # view pixels between nodes
PIECE = 512  # view pixels
RIM = np.float32(0.98)  # of t_max: below it, no pixel of the view is feathered

PERSPECTIVE, PANNINI, STEREOGRAPHIC, CYLINDRICAL, EQUIRECTANGULAR = (
    FORMULAS.index(name)
    for name in ("perspective", "pannini", "stereographic", "cylindrical", "equirectangular")
)


@numba.njit(cache=True, nogil=True, fastmath=True)
def fill_band(
    first_row: int,
    camera_from_view: F32,
    size: tuple[int, int],
    focal_px: float,
    formula: int,
    g: F32,
    t_max: Any,
    center: F32,
    stretch: F32,
    offsets: F32,
    p_max: Any,
    luma: F32,
    chroma: F32,
) -> bool:
    """Coordinates for a band of a view of `size` (width, height) that starts at `first_row`.

    formula is that of the view's rays, its place in `freelook.projections.FORMULAS`.

    luma (3, rows, columns) gets where each pixel looks, x and y in pixels of the picture, and
    its t; chroma the same for planes half as large, in their pixels; chroma may be empty. offsets
    (n, n, 2) is the grid of a lens that is not round, and empty for others. t is
    left alone unless the return value is true: then the rim of the field is in the band.

    The exact projection is made at nodes 16 view pixels apart, or less where cubics between
    them would stray by more than the tolerance.
    """
    step = COARSEST
    rows = luma.shape[1]
    while True:
        nodes = np.empty((3, (rows - 1) // step + 4, (size[0] - 1) // step + 4), np.float32)
        project_nodes(nodes, first_row, step, size, focal_px, formula, camera_from_view, g, t_max)
        if len(offsets):
            add_offsets(nodes, g, t_max, offsets, p_max)
        place_nodes(nodes, center, stretch)
        told = nodes.shape[1] >= 5 and nodes.shape[2] >= 5  # fewer have no fourth difference
        if step == FINEST or (told and interpolation_error(nodes, t_max) <= TOLERANCE_PX):
            break
        step //= 2
    rim = nodes[2].max() > t_max * RIM
    expand(nodes, step, 3 if rim else 2, luma, chroma)
    return bool(rim)


@numba.njit(cache=True, nogil=True, fastmath=True)
def project_nodes(
    nodes: F32,
    first_row: int,
    step: int,
    size: tuple[int, int],
    focal_px: float,
    formula: int,
    camera_from_view: F32,
    g: F32,
    t_max: float,
) -> None:
    """Fill nodes (3, rows, columns) with the round image's x and y, from the axis, and t.

    Node (j, i) stands at view pixel x = step * (i - 1), y = first_row + step * (j - 1): one
    ring of nodes more than the band, for cubic interpolation.
    """
    place_on_plane(nodes, first_row, step, size, focal_px, formula, camera_from_view)
    stretch_by_table(nodes, g, t_max)


@numba.njit(cache=True, nogil=True, fastmath=True)
def place_on_plane(
    nodes: F32,
    first_row: int,
    step: int,
    size: tuple[int, int],
    focal_px: float,
    formula: int,
    camera_from_view: F32,
) -> None:
    """Fill nodes with the stereographic plane's p, and t = |p|^2, of the rays through them."""
    f32 = np.float32
    per_px = f32(1) / f32(focal_px)
    left = f32(-step - (size[0] - 1) / 2) * per_px
    r = camera_from_view
    for row in range(nodes.shape[1]):
        y = f32(first_row + (row - 1) * step - (size[1] - 1) / 2) * per_px
        if formula == PERSPECTIVE:  # a loop of its own, as fast as it can be
            for column in range(nodes.shape[2]):
                x = left + f32(np.int32(column)) * f32(step) * per_px
                dx = r[0, 0] * x + r[0, 1] * y + r[0, 2]
                dy = r[1, 0] * x + r[1, 1] * y + r[1, 2]
                dz = r[2, 0] * x + r[2, 1] * y + r[2, 2]
                px, py = on_plane(dx, dy, dz)
                nodes[0, row, column], nodes[1, row, column] = px, py
                nodes[2, row, column] = px * px + py * py
        else:
            for column in range(nodes.shape[2]):
                x = left + f32(np.int32(column)) * f32(step) * per_px
                rx, ry, rz = view_ray(formula, x, y)
                dx = r[0, 0] * rx + r[0, 1] * ry + r[0, 2] * rz
                dy = r[1, 0] * rx + r[1, 1] * ry + r[1, 2] * rz
                dz = r[2, 0] * rx + r[2, 1] * ry + r[2, 2] * rz
                px, py = on_plane(dx, dy, dz)
                nodes[0, row, column], nodes[1, row, column] = px, py
                nodes[2, row, column] = px * px + py * py


@numba.njit(cache=True, nogil=True, fastmath=True)
def view_ray(formula: int, x: Any, y: Any) -> tuple[Any, Any, Any]:
    """The ray through a place of a view that is not perspective (see `freelook.projections`)."""
    one, four = np.float32(1), np.float32(4)
    if formula == PANNINI:
        return x, y, one - x * x / four
    if formula == STEREOGRAPHIC:
        return x, y, one - (x * x + y * y) / four
    if formula == CYLINDRICAL:
        return np.sin(x), y, np.cos(x)
    return np.sin(x) * np.cos(y), np.sin(y), np.cos(x) * np.cos(y)


@numba.njit(cache=True, nogil=True, fastmath=True, inline="always")
def on_plane(dx: Any, dy: Any, dz: Any) -> tuple[Any, Any]:
    """p of a ray in the camera frame: (dx, dy) over the length plus dz."""
    length = np.sqrt(dx * dx + dy * dy + dz * dz)
    inverse = np.float32(1) / max(length + dz, np.float32(1e-6) * length)
    return dx * inverse, dy * inverse


@numba.njit(cache=True, nogil=True, fastmath=True)
def stretch_by_table(nodes: F32, g: F32, t_max: float) -> None:
    """From p to the round image, x and y times the table's gain, in place.

    Rays beyond FAR times t_max are held there. A pass of its own: that it can be vectorised is
    half its speed.
    """
    far = FAR * t_max
    per_place = np.float32(len(g) - 1) / (np.sqrt(t_max) + t_max)
    for row in range(nodes.shape[1]):
        u, v, t = nodes[0, row], nodes[1, row], nodes[2, row]
        for i in range(len(t)):
            held = min(t[i], far)
            gain = look_up(g, (np.sqrt(held) + held) * per_place)
            gain *= np.sqrt(held / max(t[i], np.float32(1e-30)))
            u[i], v[i], t[i] = u[i] * gain, v[i] * gain, held


@numba.njit(cache=True, nogil=True, fastmath=True)
def add_offsets(nodes: F32, g: F32, t_max: float, offsets: F32, p_max: float) -> None:
    """Add what is not round in a lens: `offsets` (n, n, 2) over [-p_max, p_max]^2.

    Beyond the grid its last cells go on as they are, for the reason given at `look_up`.
    """
    f32 = np.float32
    last = len(offsets) - 1
    per_place = f32(len(g) - 1) / (np.sqrt(t_max) + t_max)
    per_cell = f32(last) / (f32(2) * p_max)
    for row in range(nodes.shape[1]):
        for column in range(nodes.shape[2]):
            t = nodes[2, row, column]
            gain = look_up(g, (np.sqrt(t) + t) * per_place)
            x = (nodes[0, row, column] / gain + p_max) * per_cell
            y = (nodes[1, row, column] / gain + p_max) * per_cell
            i = min(max(int(x), 0), last - 1)
            j = min(max(int(y), 0), last - 1)
            fx, fy = x - f32(i), y - f32(j)
            for k in range(2):
                top = offsets[j, i, k] * (1 - fx) + offsets[j, i + 1, k] * fx
                below = offsets[j + 1, i, k] * (1 - fx) + offsets[j + 1, i + 1, k] * fx
                nodes[k, row, column] += top * (1 - fy) + below * fy


@numba.njit(cache=True, nogil=True, fastmath=True)
def place_nodes(nodes: F32, center: F32, stretch: F32) -> None:
    """From pixels around the axis to pixels of the picture."""
    for row in range(nodes.shape[1]):
        for column in range(nodes.shape[2]):
            x, y = nodes[0, row, column], nodes[1, row, column]
            nodes[0, row, column] = center[0] + stretch[0, 0] * x + stretch[0, 1] * y
            nodes[1, row, column] = center[1] + stretch[1, 0] * x + stretch[1, 1] * y


@numba.njit(cache=True, nogil=True, fastmath=True, inline="always")
def look_up(g: F32, at: Any) -> Any:
    """The table at a fractional index; beyond its end it goes on as a parabola.

    Out there all is black, but a kink would spoil the interpolation next to the rim. Without
    branches, for the sake of loops around it.
    """
    last = len(g) - 1
    inside = min(at, np.float32(last))
    entry = min(np.int32(inside), np.int32(last - 1))
    low, high = g[np.uintp(entry)], g[np.uintp(entry) + np.uintp(1)]
    bend = (g[last] - np.float32(2) * g[last - 1] + g[last - 2]) * np.float32(0.5)
    beyond = at - inside
    past = beyond * (g[last] - g[last - 1] + bend + bend * beyond)
    return low + (high - low) * (inside - np.float32(entry)) + past


@numba.njit(cache=True, nogil=True, fastmath=True)
def interpolation_error(nodes: F32, t_max: float) -> float:
    """How far cubic interpolation between nodes strays, in pixels, where the lens sees.

    In the middle of four equally spaced nodes a smooth function strays from their cubic by
    3/128 of its fourth difference; both directions add up. On the border it is that of the
    nearest node that has one.
    """
    rows, columns = nodes.shape[1:]
    last = columns - 3  # that has a fourth difference along the row
    worst = np.float32(0)
    for k in range(2):
        for row in range(1, rows - 1):
            seen = nodes[2, row]
            j = min(max(row, 2), rows - 3)
            for i in range(2, last + 1):
                strays = fourth_differences(nodes[k], row, j, i, i)
                worst = max(worst, strays if seen[i] <= t_max else np.float32(0))
            for i, border in ((2, 1), (last, last + 1)):
                strays = fourth_differences(nodes[k], row, j, i, border)
                worst = max(worst, strays if seen[border] <= t_max else np.float32(0))
    return float(worst) * 3 / 128


@numba.njit(cache=True, nogil=True, fastmath=True, inline="always")
def fourth_differences(n: F32, row: Any, j: Any, i: Any, column: Any) -> Any:
    """Their sizes along a row around column i, and down a column around row j, added up."""
    four, six = np.float32(4), np.float32(6)
    across = n[row, i - 2] + n[row, i + 2] + six * n[row, i]
    across -= four * (n[row, i - 1] + n[row, i + 1])
    down = n[j - 2, column] + n[j + 2, column] + six * n[j, column]
    down -= four * (n[j - 1, column] + n[j + 1, column])
    return abs(across) + abs(down)


@numba.njit(cache=True, nogil=True, fastmath=True)
def expand(nodes: F32, step: int, values: int, luma: F32, chroma: F32) -> None:
    """From nodes to the middle of every pixel; the first `values` of x, y and t.

    Along the rows of nodes first, then down between them: the long inner loops run over
    contiguous memory. Chroma pixels lie in the middle of 2 x 2 luma pixels.
    """
    cells = (luma.shape[1] - 1) // step + 1
    wide = np.empty((cells + 3, luma.shape[2]), np.float32)
    half = np.empty((cells + 3, chroma.shape[2]), np.float32)
    for k in range(values):
        for j in range(cells + 3):
            widen(nodes[k, j], step, wide[j])
            halve(wide[j], k < 2, half[j])
        blend_rows(wide, step, np.float32(0), luma[k])
        blend_rows(half, step // 2, np.float32(0.5 / step), chroma[k])


@numba.njit(cache=True, nogil=True, fastmath=True)
def widen(nodes: F32, step: int, out: F32) -> None:
    """Expand one row of nodes along the row, by the cubic through four of them (Lagrange)."""
    per_step = np.float32(1) / np.float32(step)
    for cell in range((len(out) - 1) // step + 1):
        a, b, c, d = nodes[cell], nodes[cell + 1], nodes[cell + 2], nodes[cell + 3]
        c3 = (d - a) / np.float32(6) + (b - c) / np.float32(2)
        c2 = (a + c) / np.float32(2) - b
        c1 = c - b - c2 - c3
        between = out[cell * step : (cell + 1) * step]
        for k in range(len(between)):
            f = np.float32(np.int32(k)) * per_step
            between[k] = ((c3 * f + c2) * f + c1) * f + b


@numba.njit(cache=True, nogil=True, fastmath=True)
def halve(wide: F32, coordinates: bool, out: F32) -> None:
    """Values between pairs of columns; coordinates become those of the plane half as large."""
    gain, offset = np.float32(0.5), np.float32(0)
    if coordinates:
        gain, offset = np.float32(0.25), np.float32(-0.25)
    pairs = len(wide) // 2 if len(out) else 0
    for i in range(pairs):
        out[i] = (wide[2 * i] + wide[2 * i + 1]) * gain + offset
    if pairs < len(out):  # an odd width: half a step beyond the last column
        last = len(wide) - 1
        out[pairs] = (np.float32(3) * wide[last] - wide[last - 1]) * gain + offset


@numba.njit(cache=True, nogil=True, fastmath=True)
def blend_rows(wide: F32, per_cell: int, shift: Any, out: F32) -> None:
    """Rows between widened rows, by the cubic through four of them (Lagrange).

    In pieces so short that the four stay in the nearest cache for all rows between them.
    """
    for cell in range((out.shape[0] - 1) // per_cell + 1):
        rows = out[cell * per_cell : (cell + 1) * per_cell]
        for start in range(0, out.shape[1], PIECE):
            piece = slice(start, start + PIECE)
            a, b = wide[cell, piece], wide[cell + 1, piece]
            c, d = wide[cell + 2, piece], wide[cell + 3, piece]
            for row in range(len(rows)):
                f = np.float32(row) / np.float32(per_cell) + shift
                blend(a, b, c, d, f, rows[row, piece])


@numba.njit(cache=True, nogil=True, fastmath=True)
def blend(a: F32, b: F32, c: F32, d: F32, f: Any, out: F32) -> None:
    """The cubic through a, b, c, d at -1, 0, 1, 2, at f."""
    one, two, six = np.float32(1), np.float32(2), np.float32(6)
    wa = -f * (f - one) * (f - two) / six
    wb = (f + one) * (f - one) * (f - two) / two
    wc = -(f + one) * f * (f - two) / two
    wd = (f + one) * f * (f - one) / six
    for i in range(len(out)):
        out[i] = wa * a[i] + wb * b[i] + wc * c[i] + wd * d[i]


@numba.njit(cache=True, nogil=True, fastmath=True)
def feather(view: NDArray[np.uint8], t: F32, t_max: float, black: Any) -> None:
    """Blend view (rows, columns, channels) to `black` where t (rows, columns) passes t_max.

    Half seen exactly at t_max, over about one view pixel: t over its slope is a distance.
    """
    rows, columns = t.shape
    for row in range(rows):
        down = t[min(row + 1, rows - 1)] - t[max(row - 1, 0)]
        for column in range(columns):
            here = t[row, column]
            right = t[row, min(column + 1, columns - 1)] - t[row, max(column - 1, 0)]
            slope = np.sqrt(right * right + down[column] * down[column]) / 2 + np.float32(1e-9)
            seen = (t_max - here) / slope + np.float32(0.5)
            if seen < 1:
                seen = max(seen, np.float32(0))
                for k in range(view.shape[2]):
                    value = black + seen * (view[row, column, k] - black)
                    view[row, column, k] = np.uint8(value + np.float32(0.5))


@numba.njit(cache=True, nogil=True, fastmath=True)
def fill_window(
    first_row: int,
    corner: F32,
    slopes: F32,
    center: F32,
    round_from_picture: F32,
    t_per_px2: Any,
    t_max: Any,
    luma: F32,
    chroma: F32,
) -> bool:
    """As `fill_band`, for a crop: corner + slopes @ (x, y) is where view pixel (x, y) looks.

    In place of t it gets what is as large as that on the rim: `t_per_px2` times the square of the
    distance from the axis in the round image.
    """
    rim = False
    for maps, scale in ((luma, 1), (chroma, 2)):
        between = np.float32((scale - 1) / 2)
        for row in range(maps.shape[1]):
            y = np.float32(first_row + row * scale) + between
            for column in range(maps.shape[2]):
                x = np.float32(column * scale) + between
                u = corner[0] + slopes[0, 0] * x + slopes[0, 1] * y
                v = corner[1] + slopes[1, 0] * x + slopes[1, 1] * y
                maps[0, row, column] = (u - between) / scale
                maps[1, row, column] = (v - between) / scale
                u, v = u - center[0], v - center[1]
                away_x = round_from_picture[0, 0] * u + round_from_picture[0, 1] * v
                away_y = round_from_picture[1, 0] * u + round_from_picture[1, 1] * v
                t = (away_x * away_x + away_y * away_y) * t_per_px2
                maps[2, row, column] = t
                rim |= t > t_max * RIM
    return rim
