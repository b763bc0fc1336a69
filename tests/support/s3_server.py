"""A real S3-compatible server (moto) as a process on this machine."""

import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import httpx

BUCKET = "originals"
ACCESS, SECRET = "AKIATESTKEY", "c2VjcmV0LW9mLXRoZS1zdG9yZQ"
STARTED = 60.0
"""s for the process to start, on a machine that does much else."""


def free_port() -> int:
    """A port at which nothing listens."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port: int = free.getsockname()[1]
        return port


@contextmanager
def s3_server(port: int) -> Iterator[subprocess.Popen[bytes]]:
    """The server, with an empty bucket."""
    command = [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=dict(os.environ))
    address, end = f"http://127.0.0.1:{port}", time.monotonic() + STARTED
    try:
        while process.poll() is None and time.monotonic() < end:
            try:
                httpx.put(f"{address}/{BUCKET}", trust_env=False, timeout=STARTED).raise_for_status()
                break
            except httpx.TransportError:
                time.sleep(0.05)
        yield process
    finally:
        process.kill()
        process.wait()


def names(port: int) -> list[str]:
    """Names of the objects in the bucket."""
    listed = httpx.get(f"http://127.0.0.1:{port}/{BUCKET}", trust_env=False).text
    return [part.partition("</Key>")[0] for part in listed.split("<Key>")[1:]]


def settings(port: int, prefix: str = "/menshin") -> dict[str, str]:
    """The settings of [storage] for the server."""
    return {
        "originals": f"s3://{BUCKET}{prefix}",
        "s3_endpoint": f"http://127.0.0.1:{port}",
        "s3_access_key": ACCESS,
        "s3_secret_key": SECRET,
    }
