"""Another network namespace of this machine, linked to this one."""

import itertools
import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

NUMBERS = itertools.count()
WHY = "no network namespace can be made: that needs root, and Debian's iproute2"


@dataclass(frozen=True, slots=True)
class Namespace:
    """A network with one other machine, as it were."""

    address: str
    """Address of this side, as the other one sees it."""
    there: str
    """Address of the other side."""
    inside: tuple[str, ...]
    """Runs a command there."""
    link: str
    """This side's end of the link."""

    def cut(self) -> None:
        """Lose all that is sent from now on, as a network does that fails somewhere: nobody is told."""
        rule = ("tc", "qdisc", "replace", "dev", self.link, "root", "netem", "loss", "100%")
        if shutil.which("tc") is None or subprocess.run(rule, capture_output=True, check=False).returncode != 0:
            subprocess.run(("ip", "link", "set", self.link, "down"), check=True)


@contextmanager
def namespace(*, loopback: bool = False) -> Iterator[Namespace | None]:
    """A namespace that is removed afterwards; None where none can be made.

    Args:
        loopback: whether it has a loopback, through which its processes reach each other. The kernel then also reports
            hosts that cannot be reached.
    """
    if os.geteuid() != 0 or shutil.which("ip") is None:
        yield None
        return
    number = os.getpid() + 1000 * next(NUMBERS)
    name, here, there = f"menshin-{number}", f"mh{number % 10**8}", f"mt{number % 10**8}"
    network, first = f"169.254.{number // 64 % 254 + 1}", number % 64 * 4
    inside = ("ip", "netns", "exec", name)
    commands = (
        ("ip", "netns", "add", name),
        ("ip", "link", "add", here, "type", "veth", "peer", "name", there, "netns", name),
        ("ip", "address", "add", f"{network}.{first + 1}/30", "dev", here),
        ("ip", "link", "set", here, "up"),
        (*inside, "ip", "address", "add", f"{network}.{first + 2}/30", "dev", there),
        (*inside, "ip", "link", "set", there, "up"),
        *([(*inside, "ip", "link", "set", "lo", "up")] if loopback else []),
    )
    try:
        is_made = all(subprocess.run(one, capture_output=True, check=False).returncode == 0 for one in commands)
        yield Namespace(f"{network}.{first + 1}", f"{network}.{first + 2}", inside, here) if is_made else None
    finally:
        subprocess.run(("ip", "netns", "delete", name), capture_output=True, check=False)
