"""Writes docs/mail.png, what a mail looks like: `python docs/write_mail.py sqlite:///menshin.sqlite --message 3`.

It renders a stored message as the notifier would mail it; the database may be that of a demonstration. It needs a
Chromium: the system's, or that of `playwright install chromium`.
"""

import base64
import shutil
from pathlib import Path
from typing import Annotated

import typer
from playwright.sync_api import sync_playwright

from service.notices import mail, writing
from service.queries import told
from service.sessions import reading, sessions

TARGET = Path(__file__).with_name("mail.png")
WIDTH, HEIGHT = 660, 800
"""Pixels of the window; the picture is as high as the mail."""
PUBLIC = "https://menshin.example.org"


def write(
    database: Annotated[str, typer.Argument(help="SQLAlchemy address.")],
    message: Annotated[int, typer.Option(help="Number of the message.")],
) -> None:
    """Render it."""
    with reading(sessions(database))() as session:
        letter = writing.letter(session, told.message(session, message), "email", PUBLIC, is_repeat=False)
    assert letter.picture is not None, "this message shows no loop; another one would do"
    picture = f"data:image/png;base64,{base64.b64encode(letter.picture).decode()}"
    html = mail.page(letter, "picture").replace("cid:picture", picture)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"))
        page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
        page.set_content(html)
        page.screenshot(path=TARGET, full_page=True)
        browser.close()


if __name__ == "__main__":
    typer.run(write)
