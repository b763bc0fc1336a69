"""Encrypted columns for secrets; the key comes from the environment.

The key is a Fernet key (AES-128 in CBC mode with an HMAC of SHA-256). MENSHIN_SECRET_KEY may hold several, separated by
commas: the first one encrypts, all of them decrypt, so that a key can be replaced. Without a key secrets are stored as
they are, and rows that were stored so stay readable after a key was set.
"""

import os
from functools import lru_cache
from typing import TYPE_CHECKING

from sqlalchemy import Dialect, Text, TypeDecorator

if TYPE_CHECKING:  # it takes long to import, and is imported where there is a key
    from cryptography.fernet import MultiFernet

VARIABLE = "MENSHIN_SECRET_KEY"
PREFIX = "fernet:"
"""Prefix of every encrypted value."""


class SecretKeyError(Exception):
    """The secret key is malformed, missing, or not the one that encrypted a value."""


def new_key() -> str:
    """A new random key."""
    from cryptography.fernet import Fernet

    return Fernet.generate_key().decode()


def is_key_set() -> bool:
    """True if secrets are encrypted before they are stored.

    Raises:
        SecretKeyError: MENSHIN_SECRET_KEY does not contain valid keys.
    """
    return _keys(os.environ.get(VARIABLE, "")) is not None


def is_encrypted(stored: str) -> bool:
    """True if a stored value is encrypted."""
    return stored.startswith(PREFIX)


class Encrypted(TypeDecorator[str]):
    """A text column that is encrypted in the database, where it cannot be compared: equal texts differ there."""

    impl = Text
    cache_ok = True

    def process_bind_param(self, value: str | None, dialect: Dialect) -> str | None:
        """Encrypt with the first key, if a key is set."""
        keys = _keys(os.environ.get(VARIABLE, ""))
        if value is None or keys is None:
            return value
        return PREFIX + keys.encrypt(value.encode()).decode()

    def process_result_value(self, value: str | None, dialect: Dialect) -> str | None:
        """Decrypt an encrypted value.

        Raises:
            SecretKeyError: none of the keys, or no key, decrypts it.
        """
        if value is None or not is_encrypted(value):
            return value
        keys = _keys(os.environ.get(VARIABLE, ""))
        if keys is None:
            raise SecretKeyError(
                f"The database holds encrypted secrets. Set {VARIABLE} to the key that encrypted them."
            )
        from cryptography.fernet import InvalidToken

        try:
            return keys.decrypt(value.removeprefix(PREFIX)).decode()
        except InvalidToken:
            raise SecretKeyError(
                f"No key in {VARIABLE} decrypts a secret in the database. Add the key that encrypted it after a comma."
            ) from None


@lru_cache(maxsize=4)
def _keys(given: str) -> "MultiFernet | None":
    """Keys in the variable's value; None if it is empty."""
    names = [name.strip() for name in given.split(",") if name.strip()]
    if not names:
        return None
    from cryptography.fernet import Fernet, MultiFernet

    try:
        return MultiFernet([Fernet(name) for name in names])
    except ValueError:
        raise SecretKeyError(
            f"{VARIABLE} contains no key. `menshin secret new-key` prints one; separate several by commas."
        ) from None
