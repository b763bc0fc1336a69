"""Addresses of servers in a form that may be shown: without user names, passwords and tokens."""

import re

ADDRESS = re.compile(r"[a-z][a-z0-9+.-]{0,19}://[^\s<>\"]+", re.IGNORECASE)
CLOSING = ".,;:!?'`)]}…"
"""Punctuation that follows an address in a sentence."""


def without_credentials(text: str) -> str:
    """The text with every address in it cut down to scheme, host, port and path.

    User info, query and fragment may hold secrets and are left out. All other words, and paths of files, stay.
    """
    return ADDRESS.sub(_shown, text) if "://" in text else text


def _shown(found: re.Match[str]) -> str:
    scheme, _, rest = found[0].partition("://")
    kept = re.split(r"[?#]", rest, maxsplit=1)[0]
    address = f"{scheme}://{kept.rpartition('@')[2]}"  # a password may have a / in it
    return address if kept == rest else address + rest[len(rest.rstrip(CLOSING)) :]
