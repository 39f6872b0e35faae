"""ONVIF's LensDescription: XML with Offset, Projection (Angle, Radius) and XFactor.

By ONVIF's Media2 specification, annex "Lens description", and `onvif.xsd`: the radius R belongs
to the angle of incidence by a smooth curve through the Projection points, 0 degrees at radius 0
being understood, and nothing is seen beyond the last one. In ONVIF's normalised coordinates, which
run from -1 to 1 between the picture's outer edges with x to the right and y up, a ray lands at

    (x, y) = R (cos, sin) * (XFactor, 1) - Offset

so R = 1 is half the picture's height, and a round image has XFactor = height / width. The standard
does not say three things, for which see here: which spline (ours is `radial_spline`; at the points
all agree), that the angles are degrees, and the sign of Offset: it is taken as in the formula.
The picture's size is that of Bounds, if there is one (VideoSourceConfiguration has it).
"""

from __future__ import annotations

import re
from xml.etree import ElementTree
from xml.sax.saxutils import escape

import numpy as np

from ..camera import WIDEST_RAD, make_camera
from ..errors import ProfileError
from ..lens import RadialSpline, model_name
from ._document import Document
from ._matrix import matrix_of
from ._numbers import picture_size
from ._profile import Choice, Profile
from ._words import word_number

SUFFIX = ".xml"
MODELS = ("radial_spline",)
NAMESPACE = "http://www.onvif.org/ver10/schema"
LARGEST_XML = 2**20  # a device's whole answer has some kB
NOT_XML = re.compile("[^\t\n\r -\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
DEEPEST = 40
MOST_POINTS = 4096
WIDEST_DEG = float(np.degrees(WIDEST_RAD)) - 1e-9


def recognises(document: Document) -> bool:
    text = document.text.lstrip("\ufeff \t\r\n")
    return text.startswith("<") and "LensDescription" in text


def read(document: Document, choice: Choice) -> Profile:
    """The camera; one of several descriptions is picked by its number, from 1."""
    root = _parse(document.text)
    found = [element for element in root.iter() if _tag(element) == "LensDescription"]
    if not found:
        raise ProfileError("no LensDescription in it")
    names = [str(i + 1) for i in range(len(found))]
    lens = found[choice.of(names)]
    size = choice.size or _bounds(root)
    if size is None:
        size = choice.needed_size("ONVIF's coordinates run from -1 to 1 whatever the size")
    angles_deg, radii, dimmest = _points(lens)
    x_factor = _number(_only(lens, "XFactor"), "XFactor")
    if x_factor <= 0:
        raise ProfileError(f"XFactor must be above 0, not {x_factor:g}")
    offset = _only(lens, "Offset")
    off_x, off_y = (word_number(offset.get(k, "0"), f"Offset {k}") for k in ("x", "y"))
    width, height = size
    camera = make_camera(
        size,
        RadialSpline(tuple(angles_deg), tuple(r * height / 2 for r in radii)),
        center=((width - 1 - off_x * width) / 2, (height - 1 + off_y * height) / 2),
        field_deg=2 * min(angles_deg[-1], WIDEST_DEG),
        stretch=np.diag([x_factor * width / height, 1.0]),
    )
    notes = []
    if off_x or off_y:
        notes.append("ONVIF leaves the sign of Offset open; the axis is taken to be at -Offset")
    if dimmest < 1:
        notes.append(f"transmittance falls to {dimmest:g}; views are not brightened for it")
    named = [element.text or "" for element in root.iter() if _tag(element) == "Name"]
    name = named[0].strip() if len(named) == 1 else ""
    return Profile(camera, name, "ONVIF lens description", tuple(notes))


def write(profile: Profile) -> str:
    """A VideoSourceConfiguration with Bounds and LensDescription; `read` needs no size for it.

    ProfileError for a stretch with a skew, which ONVIF has not. The field ends at the last point.
    """
    camera = profile.camera
    lens = camera.lens
    if not isinstance(lens, RadialSpline):
        raise ProfileError(
            f"ONVIF's format cannot hold a {model_name(lens)} lens; it can: radial_spline"
        )
    matrix = matrix_of(camera, 1.0, "ONVIF's format")
    if abs(matrix.skew) > 1e-9 * matrix.fx:
        raise ProfileError("ONVIF's format has no skew, and this camera's stretch has one")
    width, height = camera.size
    off_x = ((width - 1) - 2 * matrix.cx) / width
    off_y = (2 * matrix.cy - (height - 1)) / height
    points = "".join(
        f"<tt:Projection><tt:Angle>{angle!r}</tt:Angle>"
        f"<tt:Radius>{2 * radius * matrix.fy / height!r}</tt:Radius></tt:Projection>\n"
        for angle, radius in zip(lens.angles_deg, lens.radii_px, strict=True)
        if angle > 0
    )
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<tt:VideoSourceConfiguration xmlns:tt="{NAMESPACE}" token="lens">\n'
        f"<tt:Name>{escape(NOT_XML.sub('', profile.name))}</tt:Name>\n"
        "<tt:UseCount>0</tt:UseCount>\n"
        "<tt:SourceToken>lens</tt:SourceToken>\n"
        f'<tt:Bounds x="0" y="0" width="{width}" height="{height}"/>\n'
        "<tt:Extension><tt:Extension><tt:LensDescription>\n"
        f'<tt:Offset x="{off_x!r}" y="{off_y!r}"/>\n'
        f"{points}"
        f"<tt:XFactor>{matrix.fx * height / (matrix.fy * width)!r}</tt:XFactor>\n"
        "</tt:LensDescription></tt:Extension></tt:Extension>\n"
        "</tt:VideoSourceConfiguration>\n"
    )


def _parse(text: str) -> ElementTree.Element:
    """The root element; ProfileError for what is no XML, too large or deep, or has a DTD.

    Without a DTD there are no entities but XML's own five, so nothing can grow or fetch.
    """
    if len(text) > LARGEST_XML:
        raise ProfileError(f"more than {LARGEST_XML >> 20} MiB of XML are no lens description")
    if re.search(r"<!(DOCTYPE|ENTITY|ELEMENT|ATTLIST|NOTATION)", text, re.IGNORECASE):
        raise ProfileError("XML with a document type (DTD) is not read in lens profiles")
    parser = ElementTree.XMLParser(target=_ShallowTree())
    try:
        parser.feed(text.lstrip("\ufeff \t\r\n"))
        root: ElementTree.Element = parser.close()
    except (ElementTree.ParseError, UnicodeEncodeError) as error:
        raise ProfileError(f"not XML: {error}") from None
    return root


class _ShallowTree(ElementTree.TreeBuilder):
    """The usual tree, of a depth that is safe to walk."""

    def __init__(self) -> None:
        super().__init__()
        self._depth = 0

    def start(self, tag: str, attrs: dict[str, str], /) -> ElementTree.Element:
        self._depth += 1
        if self._depth > DEEPEST:
            raise ProfileError("nested too deeply to be a lens description")
        return super().start(tag, attrs)

    def end(self, tag: str, /) -> ElementTree.Element:
        self._depth -= 1
        return super().end(tag)


def _tag(element: ElementTree.Element) -> str:
    """The name without its namespace: devices differ in theirs, and some give none."""
    return str(element.tag).rpartition("}")[2]


def _children(element: ElementTree.Element, tag: str) -> list[ElementTree.Element]:
    return [child for child in element if _tag(child) == tag]


def _only(element: ElementTree.Element, tag: str) -> ElementTree.Element:
    found = _children(element, tag)
    if len(found) != 1:
        raise ProfileError(f"{_tag(element)} must have one {tag}, not {len(found)}")
    return found[0]


def _number(element: ElementTree.Element, where: str) -> float:
    return word_number((element.text or "").strip(), where)


def _points(lens: ElementTree.Element) -> tuple[list[float], list[float], float]:
    """(angles in degrees, radii in units of half the picture's height, smallest transmittance)."""
    points = _children(lens, "Projection")
    if not 1 < len(points) <= MOST_POINTS:
        raise ProfileError(
            f"a LensDescription needs 2 to {MOST_POINTS} Projection points, not {len(points)}"
        )
    angles_deg, radii, dimmest = [0.0], [0.0], 1.0
    for i, point in enumerate(points):
        where = f"Projection[{i}]"
        angle, radius = (_number(_only(point, k), f"{where} {k}") for k in ("Angle", "Radius"))
        if not (angle > angles_deg[-1] and radius > radii[-1]):
            raise ProfileError(
                f"{where} with Angle {angle:g} and Radius {radius:g} must lie beyond the one "
                f"before it ({angles_deg[-1]:g} and {radii[-1]:g}); 0 itself is not given"
            )
        angles_deg.append(angle)
        radii.append(radius)
        for element in _children(point, "Transmittance"):
            dimmest = min(dimmest, _number(element, f"{where} Transmittance"))
    if angles_deg[-1] <= np.pi or angles_deg[-1] > 180:
        raise ProfileError(
            f"the last Angle is {angles_deg[-1]:g}; angles are degrees from the axis, to 180"
        )
    return angles_deg[1:], radii[1:], dimmest


def _bounds(root: ElementTree.Element) -> tuple[int, int] | None:
    """The picture's size if it is said, once."""
    found = [element for element in root.iter() if _tag(element) == "Bounds"]
    if len(found) != 1:
        return None
    sides = [word_number(found[0].get(k, "0"), f"Bounds {k}") for k in ("width", "height")]
    return picture_size(sides, "Bounds")
