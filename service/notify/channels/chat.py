"""Messages to chat services, through Apprise in a separate process.

Apprise supports more than a hundred services, and connects wherever an address points. A separate process keeps it from
reaching inside addresses (see chat_process), can be ended when its time is over, and sees none of our settings.
"""

import os
import subprocess
import sys
from base64 import b64encode
from datetime import datetime

import orjson

from service.notify.channels import DeliveryResult
from service.notify.rendering import Destination, RenderedMessage
from service.settings import Settings
from service.settings.names import PREFIX

COMMAND = (sys.executable, "-m", "service.notify.channels.chat_process")


def send(message: RenderedMessage, to: Destination, settings: Settings, now: datetime) -> DeliveryResult:
    """Send a message to a chat service, with its picture where the service accepts one.

    A repeat has no picture: a refused picture costs one attempt, but does not block the message.

    Returns:
        `delivered` if the service confirmed it; `not_taken` if nothing was sent; otherwise `unknown`, since Apprise
        does not distinguish the two.
    """
    picture = None if message.is_repeat or message.picture is None else b64encode(message.picture).decode()
    request = {
        "address": to.address,
        "title": message.heading,
        "body": message.text,
        "picture": picture,
        "severity": message.severity,
        "allowed": settings.notify.allowed_private_hosts,
    }
    environment = {name: value for name, value in os.environ.items() if not name.startswith(PREFIX)}
    try:
        ended = subprocess.run(
            COMMAND, input=orjson.dumps(request), capture_output=True, timeout=settings.notify.timeout, env=environment
        )
    except subprocess.TimeoutExpired:
        return DeliveryResult("unknown", f"no answer within {settings.notify.timeout:g} s")
    if ended.returncode != 0:
        return DeliveryResult("unknown", f"the process that sends to chat services ended with code {ended.returncode}")
    return DeliveryResult(**orjson.loads(ended.stdout))
