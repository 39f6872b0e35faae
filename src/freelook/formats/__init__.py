"""Lens profiles: one file per format, found by what the text looks like.

A format module has a one-line docstring (its row in docs/lenses.md) and

    SUFFIX                  what its files are usually called at the end, ".json"
    MODELS                  names of the lens models it can hold
    recognises(document)    whether this text is its own; never raises
    read(document, choice)  the `Profile`, or ProfileError saying what is wrong and where
    write(profile)          its text, or ProfileError when the format cannot say this camera
"""

from __future__ import annotations

from importlib import import_module, resources
from pathlib import Path
from types import ModuleType

from ..camera import Camera
from ..errors import ProfileError
from ._document import LARGEST_BYTES, Document
from ._profile import Choice, Profile

FORMATS = (
    "freelook",
    "opencv",
    "ros",
    "kalibr",
    "basalt",
    "ocamcalib",
    "py-ocamcalib",
    "colmap",
    "mrcal",
    "gyroflow",
    "woodscape",
    "onvif",
)

__all__ = [
    "FORMATS",
    "Choice",
    "Document",
    "Profile",
    "builtin_names",
    "format_module",
    "format_of",
    "load_camera",
    "load_profile",
    "parse_camera",
    "parse_profile",
    "read_document",
]


def builtin_names() -> list[str]:
    """Names of the profiles that come with the package; `load_camera` takes them too."""
    folder = resources.files("freelook.lenses")
    return sorted(
        p.name.removesuffix(".json") for p in folder.iterdir() if p.name.endswith(".json")
    )


def load_camera(name: str | Path) -> Camera:
    """Read a lens profile from a file, or one that comes with the package by its name.

    One of several cameras in a file is named after a `#`: `chain.yaml#cam1`. ProfileError when
    there is no such thing or when it is wrong; the message says where.
    """
    return load_profile(name).camera


def load_profile(
    name: str | Path, *, format: str | None = None, size: tuple[int, int] | None = None
) -> Profile:
    """As `load_camera`, with the profile's name, source and notes.

    `format` overrides the guess from what the file looks like; `size` is the picture's, for
    formats that do not say it.
    """
    try:
        document, pick = _find(str(name))
        return parse_profile(document, Choice(pick, size), format=format)
    except ProfileError as error:
        raise ProfileError(f"lens profile {name}: {error}") from None


def parse_camera(text: str) -> Camera:
    """A camera from the text of a profile in any known format."""
    return parse_profile(Document(text)).camera


def parse_profile(
    document: Document, choice: Choice | None = None, *, format: str | None = None
) -> Profile:
    """The profile a document describes; ProfileError if it is none or wrong."""
    profile: Profile = format_module(format or format_of(document)).read(
        document, choice or Choice()
    )
    return profile


def format_module(name: str) -> ModuleType:
    """The module of a format by its name; ProfileError that lists them."""
    if name not in FORMATS:
        raise ProfileError(f"unknown format '{name}'; known: {', '.join(FORMATS)}")
    return import_module(f".{name.replace('-', '_')}", __name__)


def format_of(document: Document) -> str:
    """The name of the format that a text looks like; ProfileError when it is like none."""
    for name in FORMATS:
        if format_module(name).recognises(document):
            return name
    raise ProfileError(_why_none(document))


def _why_none(document: Document) -> str:
    if document.looks_like_json and document.why_not_json:
        return document.why_not_json
    known = f"not a format known here ({', '.join(FORMATS)})"
    data = document.json if document.looks_like_json else document.yaml
    if isinstance(data, dict):
        return f"{known}; its keys are: {', '.join(list(data)[:20]) or 'none'}"
    if document.why_not_yaml and not document.looks_like_json:
        return f"{known}; {document.why_not_yaml}"
    return f"{known}: a {type(data).__name__}" if data is not None else f"{known}: it is empty"


def _find(name: str) -> tuple[Document, str | None]:
    """The text of a file or built-in profile, and what stands behind `#`."""
    path, pick = Path(name), None
    if not path.exists() and "#" in name:
        before, _, pick = name.rpartition("#")
        path = Path(before)
    if not path.exists() and str(path) in builtin_names():
        text = (resources.files("freelook.lenses") / f"{path}.json").read_text("utf-8")
        return Document(text, f"{path}.json"), pick
    return read_document(path), pick


def read_document(path: Path) -> Document:
    """The text of a file; ProfileError if it cannot be read, is too long or is no text."""
    return Document(_read_text(path), path.name)


def _read_text(path: Path) -> str:
    try:
        with path.open("rb") as file:
            data = file.read(LARGEST_BYTES + 1)
    except OSError as error:
        known = ", ".join(builtin_names())
        raise ProfileError(
            f"{error.strerror or error}; give a profile file or one of: {known}"
        ) from None
    except ValueError:  # a name with a NUL in it
        raise ProfileError("not the name of a file") from None
    if len(data) > LARGEST_BYTES:
        raise ProfileError(f"more than {LARGEST_BYTES >> 20} MiB; that is no lens profile")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        raise ProfileError("not a text file") from None
