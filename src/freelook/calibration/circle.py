"""Finds the image circle of a fisheye lens in its pictures, and makes a camera of it.

The edge is where brightness falls fastest outwards: for a rim that is merely blurred, half way
between the levels inside and outside.

1. From outside in, along rays through the picture's middle: where does it get brighter than a few
   levels? The circle through most of these places (RANSAC) is a rough answer. Nothing inside the
   image disturbs it, and text, glare or a dark scene at the rim disturb some of the rays.
2. Around it, where does brightness fall along rays? Many lenses have a ring of stray light around
   the image; the image ends inside it. The circle with most edges on it and fewest outside wins.
3. A circle is fitted to the edges near that one, robustly; an ellipse, where the edges say so
   clearly. Doing so again without each part of the rim in turn tells how sure it is.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import NoReturn

import numpy as np

from ..camera import Camera, make_camera
from ..errors import ProfileError
from ..lens import MODELS
from ..types import Plane
from ._ellipse import Ellipse, Floats
from ._rim import unroll
from ._search import Found, arcs_found_deg, best_circle, errors_of, used

SMALLEST_SIDE = 64
FLATTEST = 6.0  # grey levels between dark and bright parts of a picture that shows something
LEAST_ARC_DEG = 60.0
LEAST_SHARE = 0.35  # of the rim that is in the picture must have been found,
LEAST_SHARE_OF_LITTLE = 0.85  # and of less than LITTLE_DEG this much
LITTLE_DEG = 90.0
MOST_ERROR = 0.02  # standard error of centre and radius, as a share of the radius
BLACK = 80.0  # grey levels: nothing brighter is dark
BRIGHTEST_OUTSIDE = 0.33  # of the brightness inside


@dataclass(frozen=True)
class ImageCircle:
    """Where a lens's image ends in the picture.

    size          (width, height) of the picture, pixels
    center        (x, y); (0, 0) is the middle of the top-left pixel
    radius_px     along x
    aspect        radius along y / radius along x; exactly 1 unless the pixels clearly are not
                  square. Where less than half of the rim is in the picture it is always 1.
    center_error_px, radius_error_px  standard errors: how much the answer changes without one
                  part of the rim or another
    rim_px        how soft the rim is: brightness falls from 90 to 10 percent over so many pixels
    seen_deg      how much of the rim is inside the picture
    found_deg     how much of it has an edge that was used
    used, unused  edge points (n, 2) that the circle was fitted to, and the others around it
    rival         x, y and radius of another circle that fits nearly as well, if there is one; the
                  errors are half the way to it then
    """

    size: tuple[int, int]
    center: tuple[float, float]
    radius_px: float
    aspect: float
    center_error_px: float
    radius_error_px: float
    rim_px: float
    seen_deg: float
    found_deg: float
    used: Floats
    unused: Floats
    rival: tuple[float, float, float] | None = None


class Brightness:
    """The mean and the maximum of many pictures of one camera, without keeping them."""

    def __init__(self) -> None:
        self.count = 0
        self._sum: Floats | None = None
        self._most: Plane | None = None

    def add(self, luma: Plane) -> None:
        """One more picture (rows, columns), uint8; ProfileError if it has another size."""
        if self._sum is None or self._most is None:
            self._sum, self._most = luma.astype(np.float64), luma.copy()
        elif self._sum.shape != luma.shape:
            (rows, columns), (rows_now, columns_now) = self._sum.shape, luma.shape
            raise ProfileError(
                f"pictures of {columns} x {rows} and of {columns_now} x {rows_now} pixels; "
                "a lens profile is for one size"
            )
        else:
            self._sum += luma
            np.maximum(self._most, luma, out=self._most)
        self.count += 1

    @property
    def mean(self) -> Floats:
        """(rows, columns). One white or broken picture among many hardly shows in it."""
        if self._sum is None:
            raise ProfileError("there are no pictures to find an image circle in")
        return self._sum / self.count

    @property
    def most(self) -> Floats:
        """(rows, columns). Shows what was bright only once, as a lamp in the night."""
        if self._most is None:
            raise ProfileError("there are no pictures to find an image circle in")
        return self._most.astype(np.float64)


def find_circle(pictures: Brightness | Iterable[Plane]) -> ImageCircle:
    """The image circle in pictures of one camera: luma (rows, columns), uint8.

    One picture may do; many, of a moving camera or a changing scene, are better. Looks at their
    mean and, if that shows no circle, at their maximum. ProfileError where there is none, with
    the reason: nothing to see, not dark outside, nothing round, too little of it in the picture.
    """
    if isinstance(pictures, Brightness):
        seen = pictures
    else:
        seen = Brightness()
        for luma in pictures:
            seen.add(luma)
    try:
        return circle_in(seen.mean)
    except ProfileError as error:
        if seen.count == 1:
            raise
        try:
            return circle_in(seen.most)
        except ProfileError:
            raise error from None


def circle_in(picture: Floats) -> ImageCircle:
    """The image circle in one picture (rows, columns) of levels 0 to 255. ProfileError as above."""
    dark, bright = np.percentile(picture, [0.5, 95]).tolist()
    if min(picture.shape) < SMALLEST_SIDE:
        _refuse(f"a side of {min(picture.shape)} pixels is too small to tell")
    if bright - dark < FLATTEST:
        _refuse(
            f"the pictures are uniform, {dark:.0f} to {bright:.0f} of 255: no light, or no lens"
        )
    found = best_circle(picture, dark, bright)
    if found is None:
        _refuse("nowhere does it get dark towards the borders")
    return _checked(picture, found, dark)


def _checked(picture: Floats, found: Found, dark: float) -> ImageCircle:
    """What was found as an answer, or ProfileError when it is no image circle."""
    circle, edges, rival = found.circle, found.edges, found.rival
    size = (picture.shape[1], picture.shape[0])
    seen_deg, found_deg = arcs_found_deg(circle, edges, size)
    share = LEAST_SHARE if found_deg > LITTLE_DEG else LEAST_SHARE_OF_LITTLE
    if found_deg < max(LEAST_ARC_DEG, share * seen_deg):
        _refuse(
            f"the likeliest rim has edges along {found_deg:.0f} of the {seen_deg:.0f} degrees of "
            "it that are in the picture, which is too little"
        )
    errors = errors_of(circle, edges)
    if max(errors.x, errors.y, errors.radius) > MOST_ERROR * circle.radius:
        _refuse(f"too little of the rim is in the picture, {found_deg:.0f} degrees")
    inside, outside, rim_px = _levels(picture, circle)
    if outside > BLACK or outside - dark > BRIGHTEST_OUTSIDE * (inside - dark):
        _refuse(
            f"outside of the likeliest circle it is not dark ({outside:.0f} of 255, and inside "
            f"{inside:.0f})"
        )
    doubt = np.zeros(3) if rival is None else (rival.as_row() - circle.as_row())[:3] / 2
    chosen = used(circle, edges)
    return ImageCircle(
        size,
        (circle.x, circle.y),
        circle.radius,
        circle.aspect,
        float(max(np.hypot(errors.x, errors.y), np.hypot(*doubt[:2]))),
        float(max(errors.radius, abs(doubt[2]))),
        rim_px,
        seen_deg,
        found_deg,
        edges.points[chosen],
        edges.points[~chosen],
        (rival.x, rival.y, rival.radius) if rival else None,
    )


def _levels(picture: Floats, circle: Ellipse) -> tuple[float, float, float]:
    """How bright it is inside and outside, and over how many pixels the one becomes the other."""
    rays = unroll(picture, circle, 0.86 * circle.radius, 1.14 * circle.radius, 0.5)
    inner = rays.radius < 0.97 * circle.radius
    outer = rays.radius > 1.03 * circle.radius
    if not rays.there[:, outer].any():
        _refuse("nothing of what is outside the likeliest circle is in the picture")
    inside = float(np.percentile(rays.level[:, inner][rays.there[:, inner]], 90))
    outside = float(np.percentile(rays.level[:, outer][rays.there[:, outer]], 75))
    some = rays.there.any(axis=0)
    mean = (rays.level * rays.there).sum(axis=0)[some] / rays.there.sum(axis=0)[some]
    radius, lowest = rays.radius[some], mean.min()
    share = (mean - lowest) / max(mean[radius < 0.97 * circle.radius].mean() - lowest, 1e-9)
    begins = radius[(share > 0.9) & (radius < circle.radius)].max(initial=radius[0])
    ends = radius[(share < 0.1) & (radius > circle.radius)].min(initial=radius[-1])
    return inside, outside, float(ends - begins)


def _refuse(why: str) -> NoReturn:
    raise ProfileError(
        f"no image circle found: {why}. More pictures of a changing scene, or more light, may show "
        "it; a lens whose image fills the whole picture has none and must be calibrated "
        "(freelook calibrate)"
    )


def one_parameter_models() -> list[str]:
    """Names of the lens models that have a scale and nothing else: what a circle determines."""
    return [name for name, kind in MODELS.items() if len(fields(kind)) == 1]  # type: ignore[arg-type]


def unit_radius(model: str, fov_deg: float) -> float:
    """Where the field of view ends in the image of such a lens with the scale 1.

    ProfileError for other models, and for a field of view that the model cannot have.
    """
    if model not in one_parameter_models():
        raise ProfileError(
            "a circle gives one number, so the lens model must have one parameter; "
            f"'{model}' is none of: {', '.join(one_parameter_models())}"
        )
    lens = MODELS[model](1.0)  # type: ignore[call-arg]
    half = np.radians(fov_deg) / 2
    inside = 0 < half <= lens.hard_limit
    radius = float(lens.radius(np.array([half]))[0]) if inside else np.inf
    if not radius < 1e3:  # the tangent of 90 degrees is large, not infinite
        most = 2 * np.degrees(lens.hard_limit)
        raise ProfileError(
            f"no {model} lens has a field of view of {fov_deg:g} degrees; it is above 0 and at "
            f"most {most:.0f}, or less where the image would have no end"
        )
    return radius


def camera_from_circle(circle: ImageCircle, fov_deg: float, model: str = "equidistant") -> Camera:
    """The camera whose field of view, `fov_deg` across, ends at the image circle.

    `model` is one of `one_parameter_models()`. ProfileError for others, and for a field of view
    that the model or a camera cannot have.
    """
    scale = circle.radius_px / unit_radius(model, fov_deg)
    return make_camera(
        circle.size,
        MODELS[model](scale),  # type: ignore[call-arg]
        center=circle.center,
        field_deg=fov_deg,
        stretch=np.diag([1.0, circle.aspect]),
    )
