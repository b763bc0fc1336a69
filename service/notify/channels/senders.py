"""Who sends to which kind of receiver?"""

from collections.abc import Callable, Mapping
from datetime import datetime
from types import MappingProxyType

from service.notify.channels import alertmanager, chat, mail, webhook
from service.notify.letter import Addressee, Letter
from service.notify.outcome import Answer
from service.settings import Settings

Send = Callable[[Letter, Addressee, Settings, datetime], Answer]

SENDERS: Mapping[str, Send] = MappingProxyType(
    {
        "email": mail.send,
        "webhook": webhook.send,
        "alertmanager": alertmanager.send,
        "apprise": chat.send,
    }
)
"""By the kind of receiver."""
