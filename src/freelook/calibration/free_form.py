"""A free-form lens from views: the surface that is left when the best other lens is subtracted.

The surface (`SplinedStereographic`, mrcal's) has hundreds of control points, and few corners say
anything about most of them. So they are pulled: not, as in mrcal, towards a stereographic lens
(0.0025 of the points' number in squared pixels for a typical correction of 0.2, ten times as
stiffly across as along the radius: its `mrcal.c`, "Regularization"), but towards what the best lens
of a few parameters says. Where no corner was seen, the result is near that lens. Expected beside
it are polynomials over the surface, for what it misses at large (`LARGE_PX`), and anything else,
point by point, far smaller (`SMALL_PX`). The pull is a normal prior of that covariance, so that the
stated uncertainty takes it in.

Centre, aspect and focal length stay: the surface says them itself. A turn of the camera and of all
poses against it is left to the pull, and to `uncertainty`, which takes out what nobody sees.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..errors import CalibrationError
from ..lens import Floats, SplinedStereographic, growth_limit, image_point, radius_slope
from ._surface import ORDER, Surface, stereographic
from .bundle import BoardProblem, Solution, fit, solve
from .equations import Equations, Pull, State
from .field import MARGIN, seen_angle
from .left_out import FOLDS, camera_without, predicted_px
from .minimise import NEAR
from .parameters import Freedom
from .views import View

FREE_FORM = "splined_stereographic"
MOST = (16, 12)  # control points, across and down, at most, unless asked for
# Fewer can hardly follow a fisheye's difference from a stereographic lens. Also for a first look.
COARSE = (10, 8)
POINTS_EACH = 4  # as many points seen for each control point
FEWEST_CONTROL = ORDER + 2
WIDEST_DEG = 355
LARGE_PX, LARGE_DEGREE = 5.0, 4
SMALL_PX = 1.0
STEPS, ENOUGH = 20, 1e-6
ROUGHLY = 1e-4  # relative gain of the last step, where a camera is only asked what it predicts
DENSE = 4  # places along each side of a cell, to fit a surface to a lens

Control = tuple[int, int]  # across, down
Counted = Sequence[NDArray[np.bool_]]


def free_form(
    start: Solution,
    views: Sequence[View],
    counted: Counted | None = None,
    control: Control | None = None,
) -> Solution:
    """A splined camera adjusted to the points that are true in `counted` ((n,) of each view; None:
    those that count in `start`), pulled towards the camera of `start`.

    control  (across, down); None: as many as the points can carry. CalibrationError where these
             are too few, or views do not determine it
    """
    counted = start.inliers if counted is None else counted
    control = control or usual_control(start, views)
    check_control(control)
    camera, pull = pulled_to(start, views, control)
    return solve(
        camera,
        start.poses,
        views,
        robust=False,
        counted=counted,
        steps=STEPS,
        enough=ENOUGH,
        pull=pull,
        damping=NEAR,
    )


def free_form_predicts_px(
    start: Solution, views: Sequence[View], freedom: Freedom, control: Control | None = None
) -> float:
    """As `left_out.cross_validate`: without some views, what the surface is pulled towards is
    solved without them too."""
    control = control or usual_control(start, views)
    start_without = camera_without(start, views, freedom)

    def camera_of(kept: list[int]) -> Camera:
        rest = replace(
            start,
            camera=start_without(kept),
            poses=tuple(start.poses[i] for i in kept),
            residuals=tuple(start.residuals[i] for i in kept),
            inliers=tuple(start.inliers[i] for i in kept),
        )
        some = [views[i] for i in kept]
        camera, pull = pulled_to(rest, some, control)
        return fit(
            camera,
            rest.poses,
            some,
            robust=False,
            counted=rest.inliers,
            steps=STEPS,
            enough=ROUGHLY,
            pull=pull,
            damping=NEAR,
        ).camera

    return predicted_px(start, views, camera_of)


def promised_gain(start: Solution, views: Sequence[View]) -> float:
    """By how much of themselves a free-form lens would lessen the squared distances on views left
    out, to first order: a quick look, on a coarse surface, that costs no solution.

    From the normal equations at `start`: one step from the views that are kept, and what it does
    to those left out once their poses have followed. Errors that are a view's own (a bent board,
    motion) promise nothing so. 0 where the equations say nothing.
    """
    used = [i for i, ok in enumerate(start.inliers) if ok.any()]
    if len(used) < 3:
        return 0.0
    camera, pull = pulled_to(start, views, _no_more(usual_control(start, views), COARSE))
    problem = BoardProblem(views, camera, Freedom(), pull)
    state = State.of(pull.expected, start.poses)
    counted = np.concatenate(start.inliers).astype(np.float64)
    with np.errstate(all="ignore"):
        # not of the coarse surface, which would promise to mend itself
        residuals = np.concatenate(start.residuals)
        equations = Equations.of(problem, state, residuals, counted)
        try:
            each, right = equations.eliminated()
        except np.linalg.LinAlgError:
            return 0.0
    if not np.isfinite(each).all():
        return 0.0
    gain, folds = 0.0, min(FOLDS, len(used))
    for fold in range(folds):
        held = used[fold::folds]
        kept = [i for i in used if i not in held]
        step = np.linalg.solve(each[kept].sum(0) + pull.information, right[kept].sum(0))
        gain += float(2 * step @ right[held].sum(0) - step @ each[held].sum(0) @ step)
    return gain / max(float(counted @ np.sum(residuals**2, axis=1)), 1e-300)


def _no_more(control: Control, most: Control) -> Control:
    return min(control[0], most[0]), min(control[1], most[1])


def check_control(control: Control) -> None:
    """CalibrationError for numbers of control points that make no surface."""
    if min(control) < FEWEST_CONTROL or max(control) > 60:
        raise CalibrationError(
            f"{control[0]} x {control[1]} control points: take {FEWEST_CONTROL} to 60 each way"
        )


def usual_control(start: Solution, views: Sequence[View]) -> Control:
    """(across, down): one for four points seen, in the shape of what was seen, as many as 10 x 8 at
    least and as 16 x 12 at most."""
    points = sum(int(ok.sum()) for ok in start.inliers)
    number = float(np.clip(points / POINTS_EACH, np.prod(COARSE), np.prod(MOST)))
    wide, high = _reach(start, views)
    # (n - 3) cells of one size cover what was seen
    shape = np.sqrt(wide / high)
    cells = np.sqrt(number) - ORDER
    across, down = (max(FEWEST_CONTROL, round(ORDER + cells * s)) for s in (shape, 1 / shape))
    return across, down


def pulled_to(start: Solution, views: Sequence[View], control: Control) -> tuple[Camera, Pull]:
    """The splined camera that is nearest to a solution's, and the pull towards it."""
    camera = start.camera
    lens = _covering(camera, _reach(start, views), control)
    limit = min(growth_limit(camera.lens), seen_angle(start, views) + MARGIN)
    expected = _nearest(lens, camera, limit)
    lens = replace(lens, control=tuple(map(float, expected)))
    stiff = (start.noise_px * lens.f) ** 2 * np.linalg.inv(_expected_px(lens))
    return replace(camera, lens=lens), Pull(expected, np.kron(stiff, np.eye(2)))


def _expected_px(lens: SplinedStereographic) -> Floats:
    """The covariance (nx ny, nx ny) of control points beside what is expected, pixels squared, the
    same in x and y."""
    down, across = (np.linspace(-1, 1, n) for n in (lens.ny, lens.nx))
    some = range(LARGE_DEGREE + 1)
    degrees = [(i, j) for i in some for j in some if 0 < i + j <= LARGE_DEGREE]
    # without the constant: a shift of everything is a turn of the camera, which nobody sees
    smooth = [np.outer(down**j, across**i).ravel() for i, j in degrees]
    shapes = np.linalg.qr(np.stack(smooth, axis=-1))[0]  # as good as each other, none counted twice
    large = LARGE_PX**2 * len(shapes) / shapes.shape[1]
    return np.asarray(large * shapes @ shapes.T + SMALL_PX**2 * np.eye(len(shapes)))


def _reach(start: Solution, views: Sequence[View]) -> Floats:
    """How far (x, y) from the axis points that count were seen, in u = 2 tan(theta/2), and
    `MARGIN` more."""
    seen = [
        pose.apply(view.points)[ok]
        for pose, view, ok in zip(start.poses, views, start.inliers, strict=True)
    ]
    farthest = np.abs(stereographic(np.concatenate(seen))).max(axis=0)
    return np.asarray(2 * np.tan(np.arctan(farthest / 2) + MARGIN / 2))


def _covering(camera: Camera, reach: Floats, control: Control) -> SplinedStereographic:
    """A flat surface over |u| <= reach (x, y)."""
    cells = np.array(control) - ORDER
    spacing = float((2 * reach / cells).max())
    fov_x_deg = float(np.ceil(np.degrees(4 * np.arctan(spacing * cells[0] / 4))))
    f = float(radius_slope(camera.lens, np.zeros(1))[0])
    nothing = (0.0,) * (2 * control[0] * control[1])
    return SplinedStereographic(f, ORDER, *control, min(fov_x_deg, WIDEST_DEG), nothing)


def _nearest(lens: SplinedStereographic, camera: Camera, limit: float) -> Floats:
    """The control points (2 nx ny,) that follow a camera's lens, where there are any."""
    sides = [np.linspace(-(n - 1) / 2, (n - 1) / 2, DENSE * n) for n in (lens.nx, lens.ny)]
    u = lens.spacing * np.stack(np.meshgrid(*sides), axis=-1).reshape(-1, 2)
    design = Surface.of(lens, u).spread(lens.nx * lens.ny)
    wanted = _straightened(camera, u, limit) / lens.f - u
    return np.asarray(np.linalg.lstsq(design, wanted, rcond=None)[0]).ravel()


def _straightened(camera: Camera, u: Floats, limit: float) -> Floats:
    """Where a lens lands u (n, 2), before the stretch; beyond an angle, straight on."""
    distance = np.hypot(u[:, 0], u[:, 1])
    theta, phi = 2 * np.arctan(distance / 2), np.arctan2(u[:, 1], u[:, 0])
    within = np.minimum(theta, limit * (1 - 1e-6))
    slope = radius_slope(camera.lens, np.array([limit * (1 - 1e-4)]))
    way = np.stack([np.cos(phi), np.sin(phi)], axis=-1)
    return image_point(camera.lens, within, phi) + ((theta - within) * slope)[:, None] * way
