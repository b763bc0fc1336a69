"""Who sends to which kind of receiver?"""

from collections.abc import Callable, Mapping
from datetime import datetime
from types import MappingProxyType

from service.notices import alertmanager, chat, mail, webhook
from service.notices.answer import Answer
from service.notices.letter import Addressee, Letter
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
