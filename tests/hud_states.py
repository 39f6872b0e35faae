"""States that HUDs are drawn of, and how the page is told of them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from freelook.camera import make_camera
from freelook.hud import (
    Dial,
    HudState,
    LensField,
    Link,
    Recording,
    TrackerState,
    Warned,
)
from freelook.lens import Equidistant
from freelook.rotations import FRD_FROM_RDF, RDF_FROM_FRD, body_from_view, to_wxyz

CAMERA = make_camera((320, 240), Equidistant(f=70.0), field_deg=188)
FULL = HudState(
    body_from_view(25, -6, 8),
    90.0,
    lens=LensField.of(CAMERA),
    link=Link("live", 3),
    tracker=TrackerState("open_track ß", "holding"),
    mode="horizon",
    recording=Recording("live", 1234),
    warnings=(
        Warned("alert", "Video lost 3 s ago: the plug came out of the box on the table, it seems"),
        Warned("warn", "At the lens's edge"),
        Warned("info", "Waiting for a head"),
    ),
    dials={"head": Dial(23.45, 60.0), "video": Dial(4.25, 9.0)},
)
LATE = {"head": Dial(), "video": Dial(1234.5, 3000.0)}
AHEAD_OF_TIME = {"head": Dial(-0.4, 0.2), "video": Dial(-12.0, -3.0)}  # clocks disagree


def attitude(yaw_deg: float, pitch_deg: float, roll_deg: float) -> Rotation:
    return Rotation.from_euler("ZYX", [yaw_deg, pitch_deg, roll_deg], degrees=True)


STATES = {
    "level": replace(FULL, body_from_view=body_from_view(0, 0)),
    "nothing known": HudState(body_from_view(0, 0), 90.0),
    "rolled": replace(FULL, world_from_body=attitude(40, 3, 30)),
    "behind": replace(FULL, body_from_view=body_from_view(-170, 40), dials=LATE),
    "straight up": replace(FULL, body_from_view=body_from_view(0, 90), mode="body"),
    "narrow": replace(FULL, hfov_deg=10.0, world_from_body=attitude(-179.9, 0, 0)),
    "wide": replace(FULL, hfov_deg=150.0, dials=AHEAD_OF_TIME),
    "pannini": replace(FULL, hfov_deg=220.0, projection="pannini"),
    "stereographic": replace(FULL, hfov_deg=290.0, projection="stereographic"),
    "all around": replace(
        FULL, hfov_deg=360.0, projection="cylindrical", world_from_body=attitude(90, -20, -70)
    ),
    "map": replace(FULL, hfov_deg=360.0, projection="equirectangular"),
    "crop": replace(FULL, projection="crop", warnings=()),
}
SIZES = ((640.0, 360.0), (960.0, 540.0), (390.0, 844.0))


def message(state: HudState) -> dict[str, Any]:
    """As web/static/hud.js takes it."""
    world = state.world_from_body
    return {
        "q": to_wxyz(RDF_FROM_FRD * state.body_from_view),
        "world": None if world is None else to_wxyz(RDF_FROM_FRD * world * FRD_FROM_RDF),
        "hfovDeg": state.hfov_deg,
        "projection": state.projection,
        "lens": state.lens
        and {
            "thetaMax": state.lens.theta_max,
            "cameraFromHead": np.ravel(state.lens.camera_from_head).tolist(),
        },
        "link": state.link and vars(state.link),
        "tracker": state.tracker and vars(state.tracker),
        "mode": state.mode,
        "recording": state.recording and vars(state.recording),
        "warnings": [vars(warned) for warned in state.warnings],
        "dials": {
            name: {"median": dial.median_ms, "p95": dial.p95_ms}
            for name, dial in state.dials.items()
        },
    }
