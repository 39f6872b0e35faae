"""Run a freelook command until standard input is closed: a child that never outlives its parent.

python -m freelook.cli._leashed COMMAND [ARGUMENT]...
"""

from __future__ import annotations

import _thread
import os
import sys
import threading
import time

from . import main

CLEANUP_S = 2.0


def follow() -> None:
    """Waits for the end of standard input, then ends this process; politely first."""
    while os.read(0, 1024):
        pass
    _thread.interrupt_main()
    time.sleep(CLEANUP_S)
    os._exit(0)


if __name__ == "__main__":
    threading.Thread(target=follow, daemon=True).start()
    sys.exit(main(sys.argv[1:]))
