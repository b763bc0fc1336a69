"""How does a letter go to a chat service? Through Apprise, in a process of its own.

Apprise knows more than a hundred services, and connects wherever an address says. In a process of its own it can be
kept from reaching inside (see chat_process), it can be ended when its time is over, and it sees none of our settings.
"""

import os
import subprocess
import sys
from base64 import b64encode
from datetime import datetime

import orjson

from service.notify.letter import Addressee, Letter
from service.notify.outcome import Answer
from service.settings import PREFIX, Settings

COMMAND = (sys.executable, "-m", "service.notify.channels.chat_process")


def send(letter: Letter, to: Addressee, settings: Settings, now: datetime) -> Answer:
    """Hand a letter to a chat service, with its picture where the service takes one.

    A repeat goes without: a picture that is refused costs one attempt, and holds up no message.

    Returns:
        `delivered` where the service said so; `not_taken` where nothing was sent; else `unknown`, for Apprise does not
        tell which it was.
    """
    picture = None if letter.is_repeat or letter.picture is None else b64encode(letter.picture).decode()
    given = {
        "address": to.address,
        "title": letter.heading,
        "body": letter.text,
        "picture": picture,
        "severity": letter.severity,
        "allowed": settings.notify.allowed_private_hosts,
    }
    kept = {name: value for name, value in os.environ.items() if not name.startswith(PREFIX)}
    try:
        ended = subprocess.run(
            COMMAND, input=orjson.dumps(given), capture_output=True, timeout=settings.notify.timeout, env=kept
        )
    except subprocess.TimeoutExpired:
        return Answer("unknown", f"no answer within {settings.notify.timeout:g} s")
    if ended.returncode != 0:
        return Answer("unknown", f"the process that sends to chat services ended with code {ended.returncode}")
    return Answer(**orjson.loads(ended.stdout))
