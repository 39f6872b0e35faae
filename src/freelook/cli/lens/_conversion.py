"""From a camera to one that a format can write: as it is, or as the nearest of another model."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...camera import Camera
from ...errors import FitError, FreelookError, ProfileError
from ...fitting.refit import Refit, limit_px, measure, refit
from ...formats import FORMATS, Choice, Document, Profile, format_module, parse_profile
from ...lens import MODELS, BentLens, Lens, model_name, vector
from ...rotations import head_angles_deg

Around = Callable[[int], AbstractContextManager[Callable[[], None]]]

# Formats that several programs' files share a suffix with are told apart by words in the name.
NAME_WORDS = {
    "opencv": ("opencv",),
    "ros": ("ros", "ost", "camera_info"),
    "kalibr": ("kalibr", "camchain"),
    "basalt": ("basalt",),
    "ocamcalib": ("ocamcalib", "calib_results"),
    "py-ocamcalib": ("py-ocamcalib", "py_ocamcalib", "pyocamcalib"),
    "colmap": ("colmap", "cameras"),
    "gyroflow": ("gyroflow",),
    "woodscape": ("woodscape",),
}
OTHER_SUFFIXES = {"opencv": (".yaml", ".json"), "ros": (".yml",), "kalibr": (".yml",)}

# Parameters that some formats lack, the least of them first.
_TILT = ("tau_x", "tau_y")
_PRISM = (*_TILT, "s1", "s2", "s3", "s4")
LACKING: dict[str, tuple[tuple[str, ...], ...]] = {
    "polynomial": (("e",),),
    "mei": (("k3",), ("k3", "p1", "p2"), ("k3", "p1", "p2", "k1", "k2")),
    "opencv_rational": (_TILT, _PRISM, (*_PRISM, "k4", "k5", "k6")),
}
_NOTHING: tuple[str, ...] = ()
STRETCHES = ("free", "skew", "aspect", "none")
SAME_PX = 1e-6
READ_BACK_PX = 1e-4  # formats write numbers with 15 to 17 digits; ours are good to 1e-9 px


@dataclass(frozen=True)
class Converted:
    """What can be written, and how it differs from what was given.

    text     of the file
    profile  what it was made from
    fit      how far that is from the camera given
    exact    whether it is the very same lens
    tried    the models refitted, with what came of each: a fit, or why there is none
    """

    text: str
    profile: Profile
    fit: Refit
    exact: bool
    tried: dict[str, Refit | str]


def suffix_formats(suffix: str) -> list[str]:
    """The formats whose files can be called so."""
    return [
        name
        for name in FORMATS
        if suffix in (format_module(name).SUFFIX, *OTHER_SUFFIXES.get(name, ()))
    ]


def target_format(path: Path) -> str:
    """What a file name alone says, or FreelookError listing what it could mean."""
    possible = suffix_formats(path.suffix.lower())
    if not possible:
        known = ", ".join(f"{name} (*{format_module(name).SUFFIX})" for name in FORMATS)
        raise FreelookError(
            f"which format is {path.name} to have? say it with --to FORMAT; known: {known}"
        )
    named = [
        name
        for name in possible
        if any(word in path.stem.lower() for word in NAME_WORDS.get(name, ()))
    ]
    if named:
        return max(named, key=lambda name: len(name))  # "py-ocamcalib" holds "ocamcalib"
    usual = [name for name in possible if path.suffix.lower() == format_module(name).SUFFIX]
    if "freelook" in usual or len(usual) == 1:
        return usual[0]
    raise FreelookError(
        f"a {path.suffix} file can be one of {', '.join(possible)}; say which: --to FORMAT"
    )


def convert(
    profile: Profile,
    target: str,
    *,
    model: str | None = None,
    field_deg: float | None = None,
    limit: float | None = None,
    around: Around = lambda _count: nullcontext(lambda: None),
) -> Converted:
    """The text of a profile in another format; FreelookError if there is none at all.

    A model the format can hold is kept; otherwise, or with `model`, the nearest lens is found:
    of all the format's models the one that is least far off. `field_deg` is the full field to
    keep. `around` shows how far it is: given how many models are tried, a context that yields
    what to call after each.
    """
    camera = _narrowed(profile.camera, field_deg)
    limit = limit_px(camera.size) if limit is None else limit
    held = format_module(target).MODELS
    if model is not None and model not in held:
        raise FreelookError(
            f"the format {target} cannot hold the model '{model}'; it can: {', '.join(held)}"
        )
    why = ""
    if model in (None, model_name(camera.lens)):
        try:
            return _as_it_is(replace(profile, camera=camera), target, limit)
        except ProfileError as error:
            why = str(error)
    names = models_to_try(camera, held, model)
    tried: dict[str, Refit | str] = {}
    found: list[tuple[Refit, str]] = []
    with around(len(names)) as advance:
        for name in names:
            try:
                found.append(_refitted(profile, camera, target, name, limit))
                tried[name] = found[-1][0]
            except FreelookError as error:
                tried[name] = str(error)
            advance()
            if _good_enough(tried[name], camera):
                break
    if not found:
        reasons = "".join(f"\n  {name}: {said}" for name, said in tried.items())
        raise FreelookError(f"the format {target} cannot say this camera: {why}{reasons}")
    fit, text = min(found, key=lambda pair: _badness(pair[0]))
    return Converted(text, replace(profile, camera=fit.camera), fit, False, tried)


def models_to_try(camera: Camera, held: Sequence[str], model: str | None) -> list[str]:
    """The one asked for, or all the format's, its own first; not those that end inside the field.

    Unless all do.
    """
    if model is not None:
        return [model]
    from ...fitting._models import model_end

    far = [name for name in held if model_end(name) >= camera.theta_max - 1e-9]
    return sorted(far or held, key=lambda name: name != model_name(camera.lens))


def _good_enough(said: Refit | str, camera: Camera) -> bool:
    """Whether no other model needs to be tried: the camera's own model, or none is nearer."""
    if isinstance(said, str) or not said.holds:
        return False
    return type(said.camera.lens) is type(camera.lens) or said.max_px < SAME_PX


def _badness(fit: Refit) -> tuple[bool, float, float, int]:
    """Of two that are alike the one with fewer parameters is better."""
    return (
        not fit.holds,
        -round(fit.seen, 3),
        float(f"{fit.max_px:.2g}"),
        len(vector(fit.camera.lens)),
    )


def lost(given: Profile, text: str, read: Profile, target: str) -> list[str]:
    """What a file's text, and what is read from it, leave out of the profile given, in words."""
    said = []
    turned = (given.camera.camera_from_body * read.camera.camera_from_body.inv()).magnitude()
    if turned > 1e-6:
        yaw, pitch, roll = head_angles_deg(given.camera.camera_from_body.inv())
        said.append(
            f"the mounting is not held by {target}: give it along with the lens, "
            f"--mount={yaw:.6g},{pitch:.6g},{roll:.6g}"
        )
    was, now = (float(np.degrees(2 * p.camera.theta_max)) for p in (given, read))
    if abs(was - now) > 0.01:
        said.append(
            f"the end of the field is not held by {target}: {was:.2f} degrees become {now:.2f}"
        )
    for what in ("name", "source"):
        words = getattr(given, what)
        if words and words not in text and words not in getattr(read, what):
            said.append(f"the {what} is not held by {target}: {words}")
    return said


def _narrowed(camera: Camera, field_deg: float | None) -> Camera:
    if field_deg is None:
        return camera
    field = float(np.degrees(2 * camera.theta_max))
    if not 1 <= field_deg <= field + 1e-6:
        raise FreelookError(
            f"--field must be 1 to the lens's own {field:.2f} degrees, not {field_deg:g}"
        )
    return replace(camera, theta_max=min(camera.theta_max, float(np.radians(field_deg / 2))))


def _as_it_is(profile: Profile, target: str, limit: float) -> Converted:
    text = format_module(target).write(profile)
    read = read_back(text, target, profile)
    fit = measure(profile.camera, same_field(read.camera, profile.camera), limit)
    return Converted(text, profile, fit, True, {})


def read_back(text: str, target: str, profile: Profile) -> Profile:
    """What the format itself makes of a text it has written."""
    suffix = format_module(target).SUFFIX
    return parse_profile(
        Document(text, f"lens{suffix}"), Choice(None, profile.camera.size), format=target
    )


def same_field(read: Camera, wanted: Camera) -> Camera:
    """The camera read, with the field it was to have: formats that do not say it guess."""
    return replace(read, theta_max=min(wanted.theta_max, read.lens.hard_limit))


def _refitted(
    profile: Profile, camera: Camera, target: str, model: str, limit: float
) -> tuple[Refit, str]:
    """The nearest lens of a model that the format can write, and the text."""
    stretch, held = _needed_stretch(camera), _NOTHING
    found = refit(camera, model, stretch=stretch, limit=limit)
    said = _sayable(profile, found.camera, target, stretch)
    if said != (stretch, held):
        found = refit(camera, model, stretch=said[0], held=said[1], limit=limit)
    return found, format_module(target).write(replace(profile, camera=found.camera))


def _needed_stretch(camera: Camera) -> str:
    """The least that says the camera's own: what would only follow noise is not sought."""
    (xx, xy), (yx, yy) = camera.stretch.tolist()
    if yx:
        return "free"
    if isinstance(camera.lens, BentLens) or xy:
        return "skew"
    return "aspect" if xx != yy else "none"


def _sayable(
    profile: Profile, camera: Camera, target: str, stretch: str
) -> tuple[str, tuple[str, ...]]:
    """How much of the stretch and which parameters to leave out for the format to take it."""
    first: ProfileError | None = None
    for kept, held, simpler in _simpler(camera, stretch):
        try:
            format_module(target).write(replace(profile, camera=simpler))
            return kept, held
        except ProfileError as error:
            first = first or error
    raise FitError(str(first))


def _simpler(camera: Camera, stretch: str) -> Iterator[tuple[str, tuple[str, ...], Camera]]:
    """The camera with ever more left out: parts of the stretch, then parameters of the lens."""
    (xx, xy), (_, yy) = camera.stretch
    stretches = {
        "free": camera.stretch,
        "skew": np.array([[xx, xy], [0, yy]]),
        "aspect": np.diag([xx, yy]),
        "none": np.diag([xx, xx]),
    }
    for held in ((), *LACKING.get(model_name(camera.lens), ())):
        lens = _without(camera.lens, held)
        for kept in STRETCHES[STRETCHES.index(stretch) :]:
            yield kept, held, replace(camera, lens=lens, stretch=stretches[kept])


def _without(lens: Lens, held: Sequence[str]) -> Lens:
    if not held:
        return lens
    default = MODELS[model_name(lens)](1.0)  # type: ignore[call-arg]
    return replace(lens, **{name: getattr(default, name) for name in held})  # type: ignore[type-var]
