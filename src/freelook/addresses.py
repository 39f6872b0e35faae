"""Network addresses as people write them."""

from __future__ import annotations

import ipaddress
import re


def is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def is_loopback(host: str) -> bool:
    """Whether only this machine reaches a server listening on `host`."""
    if host.lower() == "localhost":
        return True
    return is_address(host) and ipaddress.ip_address(host).is_loopback


def without_password(url: str) -> str:
    """To be shown: neither user nor password."""
    return re.sub(r"//[^/]*@", "//", url, count=1)
