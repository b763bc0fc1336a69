"""Write docs/operate/mail.png, the picture of a mail.

    python docs/tools/write_mail.py sqlite:///menshin.sqlite --message 2

It renders a stored message as the notifier mails it; the database may be that of a demonstration, without a recipient.
It needs a Chromium: the system's, or that of `playwright install chromium`.
"""

import base64
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer
from system_chromium import chromium

from service.db.sessions import reading, sessions
from service.notify import queries as notify_queries
from service.notify.channels import mail
from service.notify.rendering import rendered

TARGET = Path(__file__).parents[1] / "operate" / "mail.png"
WIDTH, HEIGHT = 660, 800
"""Pixels of the window; the picture is as high as the mail."""
PUBLIC = "https://menshin.example.org"


def page(database: str, message: int) -> str:
    """A message as HTML, as a recipient of that time gets it; its picture is part of the text."""
    opened = sessions(database)
    with ExitStack() as stack:
        stack.callback(opened.kw["bind"].dispose)
        session = stack.enter_context(reading(opened)())
        stored = notify_queries.message(session, message)
        rendered_message = rendered(session, stored, stored.created_at, "email", PUBLIC, is_repeat=False)
    picture = f"data:image/png;base64,{base64.b64encode(rendered_message.picture or b'').decode()}"
    return mail.page(rendered_message, "picture").replace("cid:picture", picture)


def write(
    database: Annotated[str, typer.Argument(help="SQLAlchemy address.")],
    message: Annotated[int, typer.Option(help="Number of the message.")],
) -> None:
    """Render it."""
    html = page(database, message)
    with chromium() as browser:
        window = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
        window.set_content(html)
        window.screenshot(path=TARGET, full_page=True)


if __name__ == "__main__":
    typer.run(write)
