"""What works on this machine, and what to do about what does not.

Exit status 0, or 1 when something freelook cannot fly without is missing.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict

from ..doctor import Check, examine, fit_to_fly


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="print a JSON list instead of lines")


def run(args: argparse.Namespace) -> int:
    checks = []
    for check in examine():
        checks.append(check)
        if not args.json:
            print(line(check), flush=True)
    if args.json:
        print(json.dumps([asdict(check) for check in checks], indent=2))
    return 0 if fit_to_fly(checks) else 1


def line(check: Check) -> str:
    todo = f" -> {check.todo}" if check.todo else ""
    return f"{check.state:4}  {check.name:17}  {check.what}{todo}"
