"""Where the vehicle's attitude comes from: one file per kind, found by listing this package.

A module has a docstring whose first line is its row in the documentation, and

    KIND                      the word before the colon in `KIND:ARGUMENT?option=value`
    OPTIONS                   the names of its options
    recognises(argument)      whether an argument without KIND is one of its own
    open(argument, *, options, clock)     the source; AttitudeError when it cannot be

Files whose name begins with an underscore are shared parts. A log is read when it is opened, and
its times are those of its own clock. A live source stamps with `clock`; one that is fed by other
parts of the program is `_pushed.PushedAttitudes`.
"""

from __future__ import annotations

from types import ModuleType

from ..clock import Clock, now_ns
from ..errors import AttitudeError
from ..plugins import modules_by_kind, split_options
from ..types import AttitudeSource


def known_attitudes() -> dict[str, ModuleType]:
    """KIND to module, for every kind of source in this package."""
    return modules_by_kind(__name__)


def open_attitude(spec: str, *, clock: Clock = now_ns) -> AttitudeSource:
    """Open a file by its name, or `KIND:ARGUMENT`, both with `?option=value&...` behind it.

    AttitudeError for what no kind recognises, an unknown option (it lists the known ones), and a
    source that cannot be opened.
    """
    argument, given = split_options(spec, AttitudeError)
    kinds = known_attitudes()
    prefix, colon, rest = argument.partition(":")
    if colon and prefix in kinds:
        module, argument = kinds[prefix], rest
    else:
        module = _recognise(argument, kinds)
    for name in given:
        if name not in module.OPTIONS:
            known = ", ".join(module.OPTIONS) or "none"
            raise AttitudeError(f"attitude {module.KIND}: unknown option '{name}'; known: {known}")
    source: AttitudeSource = module.open(argument, options=given, clock=clock)
    return source


def _recognise(argument: str, kinds: dict[str, ModuleType]) -> ModuleType:
    for module in kinds.values():
        if module.recognises(argument):
            return module
    raise AttitudeError(
        f"'{argument}' is no attitude that is known by its name; write KIND:{argument}, "
        f"where KIND is one of: {', '.join(kinds)}"
    )
