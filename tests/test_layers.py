"""Imports go downward only, and `import freelook` stays light."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import freelook

PACKAGE = Path(freelook.__file__).parent

LAYERS: list[set[str]] = [
    {"types", "errors", "clock"},
    {
        "lens",
        "camera",
        "projections",
        "viewport",
        "rotations",
        "mailbox",
        "axes",
        "pose_script",
        "attitude",
    }
    | {"attitude_track", "rate_integration", "head_recording"}
    | {"color", "datagrams", "addresses", "latency", "plugins"},
    {"renderers", "gimbal", "prediction", "simulation", "media", "fitting", "plots", "calibration"}
    | {"hud"}
    | {"alignment", "stabilisation", "resolution", "view_cost", "comparison", "duel"},
    {"sources", "trackers", "attitudes", "sinks", "formats"},
    {"ingest", "head", "vehicle", "offset_finder", "session", "offline"},
    {"cli", "web", "window", "outputs", "processes", "bench", "paper", "report", "doctor", "egl"},
]
LAYER_OF = {name: number for number, names in enumerate(LAYERS) for name in names}
PLUG_INS = LAYERS[3]
OUTSIDE = {"__init__", "__main__", "lenses"}

HEAVY = ["cv2", "av", "numba", "aiohttp", "aiortc", "scipy", "scipy.signal", "scipy.stats"]
HEAVY += ["matplotlib", "moderngl"]


def modules() -> list[tuple[str, Path]]:
    """(dotted name below freelook, file) of everything in the package."""
    found = []
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        found.append((".".join(parts), path))
    return found


def imports(name: str, path: Path) -> set[str]:
    """Dotted names below freelook that this module imports, wherever in the file."""
    package = name.split(".")[:-1]
    found = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            found |= {a.name.removeprefix("freelook.") for a in node.names if "freelook." in a.name}
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - (node.level - 1)] if node.level else []
            module = (node.module or "").split(".") if node.module else []
            if node.level == 0:
                if module[:1] != ["freelook"]:
                    continue
                module = module[1:]
            whole = [*base, *module]
            found |= {".".join([*whole, a.name]) for a in node.names}
    return {n for n in found if n}


def test_every_module_has_its_layer() -> None:
    tops = {name.split(".")[0] for name, _ in modules()} - OUTSIDE
    assert tops <= set(LAYER_OF), f"give these a layer: {sorted(tops - set(LAYER_OF))}"


def test_imports_go_downward_only() -> None:
    wrong = []
    for name, path in modules():
        top = name.split(".")[0]
        if top not in LAYER_OF:
            continue
        for imported in imports(name, path):
            other = imported.split(".")[0]
            if other in LAYER_OF and other != top and LAYER_OF[other] > LAYER_OF[top]:
                wrong.append(f"{name} (layer {LAYER_OF[top]}) imports {imported}")
    assert not wrong


def test_plug_ins_do_not_know_each_other() -> None:
    """Layer 3: nothing from another role, and of its own only the shared parts."""
    wrong = []
    for name, path in modules():
        top, *rest = name.split(".")
        if top not in PLUG_INS or rest in ([], ["__init__"]) or rest[0].startswith("_"):
            continue
        for imported in imports(name, path):
            other, *inner = imported.split(".")
            sibling = bool(inner) and (PACKAGE / other / f"{inner[0]}.py").is_file()
            if other in PLUG_INS and (other != top or (sibling and inner[0][0] != "_")):
                wrong.append(f"{name} imports {imported}")
    assert not wrong


def test_the_rules_see_the_imports_they_are_about() -> None:
    """Guards the two tests above against looking past everything."""
    found = {name: imports(name, path) for name, path in modules()}
    assert "lens.Lens" in found["camera"]
    assert "axes.AxisMap" in found["trackers.opentrack"]
    assert "trackers._polled.PolledTracker" in found["trackers.wander"]


def test_nothing_below_the_outermost_layer_prints_or_exits() -> None:
    wrong = []
    for name, path in modules():
        if LAYER_OF.get(name.split(".")[0], 5) == 5:
            continue
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.Call):
                called = ast.unparse(node.func)
                if called in ("print", "sys.exit", "exit", "os._exit", "time.sleep"):
                    wrong.append(f"{name}:{node.lineno} calls {called}")
    assert not wrong


def loaded_after(statement: str) -> set[str]:
    """What of `HEAVY` a fresh interpreter has loaded after the statement."""
    script = f"{statement}\nimport sys\nprint(*[m for m in {HEAVY!r} if m in sys.modules])"
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    return set(result.stdout.split())


def test_import_freelook_is_light() -> None:
    assert loaded_after("import freelook") == set()


def test_the_base_needs_only_numpy_and_scipy() -> None:
    base = "from freelook import load_camera, Viewport, body_from_view; load_camera('demo').table"
    assert loaded_after(base) <= {"scipy"}
    trackers = (
        "from freelook.trackers import known_trackers; known_trackers(); import freelook.head"
    )
    assert loaded_after(trackers) <= {"scipy"}


def test_no_command_waits_for_what_it_does_not_use() -> None:
    parser = "from freelook.cli import make_parser; make_parser()"
    assert loaded_after(parser) <= {"scipy", "cv2", "av"}


def test_every_error_raised_on_purpose_has_one_root() -> None:
    from freelook import errors

    kinds = [e for e in vars(errors).values() if isinstance(e, type)]
    assert all(issubclass(kind, errors.FreelookError) for kind in kinds)
    assert len(kinds) > 5
