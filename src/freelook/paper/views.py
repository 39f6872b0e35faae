"""Figs. 15 to 19: the full view, the paper's crop of it and today's rectified view."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..clock import NS_PER_S
from ..lens import Floats
from ..plots._style import BLUE, COLORS, ORANGE, new_figure, panel, style
from ..renderers.cpu import CpuRenderer
from ..resolution import resolution_at
from ..rotations import body_from_view
from ..simulation.camera import SimulatedCamera, pixel_deg
from ..simulation.world import World
from ..sinks.picture import rgb24
from ..types import Picture
from ..view_cost import ViewCost, view_cost
from ..viewport import Viewport
from . import printed, rig
from .drawing import WIDTH_IN, chart
from .exhibit import Exhibit, Section, Settings, Table

RECTIFIED = Viewport((480, 360), 60.0)
FIRST_S, SECOND_S = 0.0, 68.4  # of the simulated flight
# A 62 inch screen of shape 4:3 seen from nine feet: the goggles' maker, quoted in Linux Journal,
# "The Goggles, They Do Something" (2008).
GOGGLES_DEG = float(2 * np.degrees(np.arctan(62 * 0.8 / 2 / 108)))

Pixels = NDArray[np.uint8]


@dataclass(frozen=True)
class Look:
    """Where the pilot's head points, degrees."""

    name: str
    yaw: float
    pitch: float = 0.0
    roll: float = 0.0

    @property
    def camera_from_view(self) -> Rotation:
        return rig.camera().camera_from_body * body_from_view(self.yaw, self.pitch, self.roll)

    @property
    def axis_px(self) -> Floats:
        """Where the camera sees what the pilot looks at."""
        ahead: Floats = self.camera_from_view.apply([0.0, 0.0, 1.0])
        return rig.camera().project(ahead)


FORWARD = Look("forward", 0)
LEFT = Look("left", -60)
TILTED = Look("head tilted", 0, 0, 30)
LOOKS = (FORWARD, LEFT, TILTED)


def window_corner(look: Look) -> tuple[int, int]:
    """Top left pixel of the paper's window round what is looked at; it stays in the picture."""
    room = np.array(printed.PICTURE_SIZE) - printed.WINDOW_SIZE
    corner = np.rint(look.axis_px - (np.array(printed.WINDOW_SIZE) - 1) / 2)
    x, y = np.clip(corner, 0, room).astype(int)
    return int(x), int(y)


def crop(image: Pixels, look: Look) -> Pixels:
    """The paper's view: pixels (144, 180, 3) as they are."""
    x, y = window_corner(look)
    width, height = printed.WINDOW_SIZE
    return image[y : y + height, x : x + width]


def rectified(picture: Picture, look: Look) -> Pixels:
    """Today's view, (360, 480, 3)."""
    view = CpuRenderer().render(picture, rig.camera(), look.camera_from_view, RECTIFIED)
    return rgb24(view)


def window_outline(look: Look) -> Floats:
    """(5, 2) pixels round the crop's outer edge."""
    width, height = printed.WINDOW_SIZE
    round_it = np.array([(0, 0), (width, 0), (width, height), (0, height), (0, 0)])
    return round_it + np.array(window_corner(look)) - 0.5


def view_outline(look: Look) -> Floats:
    """(n, 2) pixels under the border of the rectified view; NaN outside the lens's field."""
    rays = RECTIFIED.rays()[::6, ::6]
    border = np.vstack([rays[0], rays[:, -1], rays[-1, ::-1], rays[::-1, 0]])
    return rig.camera().project(look.camera_from_view.apply(border))


def outlines(looks: tuple[Look, ...]) -> Table:
    rows = [
        (look.name, kind, *point)
        for look in looks
        for kind, points in (("crop", window_outline(look)), ("rectified", view_outline(look)))
        for point in points
    ]
    return Table(dict(zip(("look", "kind", "x_px", "y_px"), zip(*rows, strict=True), strict=True)))


def window_rays(look: Look) -> Floats:
    """(145, 181, 3) rays through the corners of the crop's pixels; NaN beyond the rim."""
    (x, y), (width, height) = window_corner(look), printed.WINDOW_SIZE
    across, down = np.arange(width + 1) + x - 0.5, np.arange(height + 1) + y - 0.5
    return rig.camera().ray(np.stack(np.meshgrid(across, down), axis=-1))


def window_fields_deg(look: Look) -> tuple[float, float]:
    """(across, down) how many degrees of the world the crop's middle row and column show."""
    rays = window_rays(look)
    rows, columns = rays.shape[:2]
    return _span_deg(rays[rows // 2]), _span_deg(rays[:, columns // 2])


def _span_deg(rays: Floats) -> float:
    """From the first ray that is seen to the last."""
    seen = rays[np.isfinite(rays[:, 0])]
    return float(np.degrees(np.arccos(np.clip(seen[0] @ seen[-1], -1, 1))))


def window_seen(look: Look) -> float:
    """The share of the crop that the lens lights."""
    return float(np.isfinite(window_rays(look)[..., 0]).mean())


def false_roll_deg(look: Look) -> float:
    """How far upright things stand from upright in a crop, when the head is not tilted."""
    step = 1e-4
    up = look.camera_from_view.apply([[0.0, step, 1.0], [0.0, -step, 1.0]])
    below, above = rig.camera().project(up) * [rig.PIXEL_ASPECT, 1.0]
    right, down = above - below
    return float(np.degrees(np.arctan2(right, -down)))


def windows() -> Table:
    """What the crop does for each look."""
    corners = [window_corner(look) for look in LOOKS]
    fields = [window_fields_deg(look) for look in LOOKS]
    return Table(
        {
            "look": [look.name for look in LOOKS],
            "yaw_deg": [look.yaw for look in LOOKS],
            "pitch_deg": [look.pitch for look in LOOKS],
            "roll_deg": [look.roll for look in LOOKS],
            "crop_left_px": [float(x) for x, _ in corners],
            "crop_top_px": [float(y) for _, y in corners],
            "crop_across_deg": [across for across, _ in fields],
            "crop_down_deg": [down for _, down in fields],
        }
    )


def costs() -> tuple[Table, list[ViewCost]]:
    """Crop and rectified view in numbers, for looks to the left."""
    looks = [Look(f"{left} left", -left) for left in (0, 30, 60, 90)]
    views = [view_cost(rig.camera(), look.camera_from_view, RECTIFIED) for look in looks]
    there = [
        resolution_at(rig.camera(), look.camera_from_view.apply([0.0, 0, 1])) for look in looks
    ]
    radial = np.array([float(at.radial) for at in there])
    tangential = np.array([float(at.tangential) for at in there])
    table = Table(
        {
            "look": [look.name for look in looks],
            "px/deg across": radial,
            "px/deg down": tangential,
            "crop's width, deg": [window_fields_deg(look)[0] for look in looks],
            "crop squeezes to": radial * rig.PIXEL_ASPECT / tangential,
            "crop seen, %": [100 * window_seen(look) for look in looks],
            "pixels under view": [view.source_pixels for view in views],
            "view seen, %": [100 * view.seen for view in views],
        }
    )
    return table, views


def along_the_horizon() -> Table:
    """Pixels per degree against the angle to the left; a gimbal's camera beside it."""
    degrees = np.arange(0.0, 94.0)
    theta = np.radians(degrees)
    rays = np.stack([-np.sin(theta), np.zeros_like(theta), np.cos(theta)], axis=-1)
    found = resolution_at(rig.camera(), rays)
    return Table(
        {
            "theta_deg": degrees,
            "across_px_per_deg": found.radial,
            "down_px_per_deg": found.tangential,
            "gimbal_px_per_deg": np.full_like(degrees, gimbal_px_per_deg()),
        }
    )


def gimbal_px_per_deg() -> float:
    """In the middle of the same 720 columns behind a plain lens with the view's field."""
    return float(Viewport(printed.PICTURE_SIZE, RECTIFIED.hfov_deg).focal_px * np.radians(1))


@style()
def draw_costs(table: Table) -> Figure:
    figure, axes = chart(
        "What a view has to work with", "looking to the left, degrees", "pixels per degree"
    )
    theta = table["theta_deg"]
    gimbal = table["gimbal_px_per_deg"]
    axes.plot(theta, gimbal, color=ORANGE, label="the same sensor on a gimbal, 60° lens")
    axes.plot(theta, table["down_px_per_deg"], color=BLUE, label="fisheye, rows (up and down)")
    axes.plot(
        theta,
        table["across_px_per_deg"],
        color=BLUE,
        linestyle="--",
        label="fisheye, columns (left and right)",
    )
    axes.set(xlim=(0, 93), ylim=(0, 12))
    axes.legend(loc="center left")
    return figure


def _show(axes: Axes, image: Pixels, aspect: float) -> None:
    axes.imshow(image, interpolation="bilinear", aspect=aspect)
    axes.grid(False)


@style()
def draw_full(table: Table, image: Pixels, title: str) -> Figure:
    figure = new_figure(WIDTH_IN, 4.35)
    axes = panel(figure.add_subplot(), title, "x, pixels", "y, pixels")
    _show(axes, image, 1 / rig.PIXEL_ASPECT)
    names = list(dict.fromkeys(table.words["look"]))
    for name, color in zip(names, (COLORS[4], COLORS[1], COLORS[3]), strict=False):
        of_look = table.where("look", name)
        for kind, line in (("crop", "--"), ("rectified", "-")):
            part = of_look.where("kind", kind)
            axes.plot(part["x_px"], part["y_px"], line, color=color, label=f"{name}, {kind}")
    axes.legend(loc="lower left", labelcolor="white", fontsize=8)
    width, height = printed.PICTURE_SIZE
    axes.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5))
    return figure


@style()
def draw_views(table: Table, picture: Picture, looks: tuple[Look, ...]) -> Figure:
    image = rgb24(picture)
    figure = new_figure(WIDTH_IN, 2.25 * len(looks))
    for row, look in enumerate(looks):
        for column, (kind, shown, aspect) in enumerate(
            (
                ("crop", crop(image, look), 1 / rig.PIXEL_ASPECT),
                ("rectified", rectified(picture, look), 1.0),
            )
        ):
            axes = figure.add_subplot(len(looks), 2, 2 * row + column + 1)
            _show(axes, shown, aspect)
            axes.set(xticks=[], yticks=[])
            axes.set_title(f"{look.name}: {kind}")
    return figure


def section(settings: Settings) -> Section:
    camera = rig.camera()
    simulated = SimulatedCamera(camera, World(pixel_deg(camera)), threads=settings.threads)
    first, second = (simulated.picture(round(s * NS_PER_S)) for s in (FIRST_S, SECOND_S))
    cost, views = costs()
    across = window_fields_deg(FORWARD)[0]
    by_line = printed.WINDOW_SIZE[0] / printed.LINE[1]
    oblique = Look("left and down", -60, -40)
    room = (printed.PICTURE_SIZE[1] - printed.WINDOW_SIZE[1]) / 2
    steepest = 2 * np.degrees(np.arcsin(room / 2 / rig.FOCAL_PX))
    gimbal = gimbal_px_per_deg()
    middle = float(cost["px/deg across"][0])
    share = views[0].source_pixels / views[0].picture_pixels
    return Section(
        name="views",
        title="Full view, crop, rectified view",
        places="Sections 5 and 6, Figs. 15 to 19",
        paper="The whole fisheye picture, 720 × 576; a window of 180 × 144 out of it for a pilot "
        "looking forward and looking left. Undoing the distortion is future work (section 7).",
        ours=(
            "The same pictures from a simulated flight, with the paper's plain crop and freelook's "
            f"rectified view ({RECTIFIED.hfov_deg:.0f} degrees wide) side by side, and a third "
            "look that a crop cannot follow: the head tilted. A crop has no roll at all; and where "
            "it looks both aside and down it adds one that is not there: "
            f"{abs(false_roll_deg(oblique)):.0f} degrees at 60 left and 40 down.",
            "Looking left, a crop squeezes: at 90 degrees things stand there at "
            f"{cost['crop squeezes to'][3]:.2f} of their width. The paper's 180 degrees of "
            "freedom hold from left to right; up and down the window meets the picture's edge at "
            f"about {steepest:.0f} degrees.",
            f"What a view costs: {middle:.1f} pixels per degree in the middle, against "
            f"{gimbal:.1f} for the same sensor behind a {RECTIFIED.hfov_deg:.0f} degree lens on a "
            f"gimbal, {gimbal / middle:.1f} times less. The view takes its pixels from "
            f"{100 * share:.1f} % of the picture, the crop from 6.25 %. Along a radius the "
            "resolution falls from the centre outwards, as the paper says; across it, it grows.",
            f"The window shows {across:.0f} degrees in this simulation and "
            f"{by_line:.0f} by the slope of equation 6. The goggles show about "
            f"{GOGGLES_DEG:.0f}. So everything looked {by_line / GOGGLES_DEG:.1f} to "
            f"{across / GOGGLES_DEG:.1f} times smaller than it is: the “correct distance "
            "perception” that the window was adjusted for is not that of the geometry.",
        ),
        verdict="holds in part",
        because="cropping looks around over 180 degrees; it neither undoes the distortion nor "
        "follows a tilted head, and the scale is not the natural one",
        basis="Simulation without noise: the flight at 0 s (Figs. 15 to 17) and "
        f"{SECOND_S:g} s (Figs. 18, 19); equisolid lens of 1.2 mm, PAL picture. Goggles: 62 inches "
        "at nine feet, as their maker says.",
        exhibits=(
            Exhibit(
                "fig15_full_view",
                "Fig. 15: the full view, with what the views below take from it. A tilted head's "
                "crop is that of looking forward.",
                outlines(LOOKS),
                partial(draw_full, image=rgb24(first), title="Fig. 15: full view"),
                picture=True,
            ),
            Exhibit(
                "fig16_17_views",
                "Figs. 16 and 17, and a tilted head: the paper's crop (left), rectified (right).",
                windows(),
                partial(draw_views, picture=first, looks=LOOKS),
                picture=True,
            ),
            Exhibit(
                "fig18_full_view",
                "Fig. 18: the full view at another moment, in a turn.",
                outlines((FORWARD,)),
                partial(draw_full, image=rgb24(second), title="Fig. 18: full view"),
                picture=True,
            ),
            Exhibit(
                "fig19_views",
                "Fig. 19: crop (left) and rectified view (right) of Fig. 18, looking forward.",
                windows().where("look", FORWARD.name),
                partial(draw_views, picture=second, looks=(FORWARD,)),
                picture=True,
            ),
            Exhibit("views_resolution", "Pixels per degree.", along_the_horizon(), draw_costs),
            Exhibit(
                "views_cost",
                "What crop and rectified view have to work with, in numbers.",
                cost,
                digits={
                    "crop's width, deg": 0,
                    "crop seen, %": 0,
                    "pixels under view": 0,
                    "view seen, %": 0,
                },
            ),
        ),
    )
