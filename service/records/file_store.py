"""Original files outside the database: in a folder, or a bucket of an S3-compatible store, by their SHA-256.

A folder gets a file under another name first, which is renamed when all of it is on the disk; a store takes an object
as a whole. What is read is compared with its SHA-256. Errors never repeat what a server says, which may hold keys.
"""

import errno
import logging
import os
import re
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from hashlib import sha256
from time import time
from typing import Any
from urllib.parse import urlsplit
from uuid import uuid4

from service.errors import StoreAwayError
from service.settings.groups import Storage

log = logging.getLogger(__name__)

CONNECT_TIMEOUT = 5.0
"""s until a store must have taken a connection. Not tuned."""
ATTEMPTS = 2
"""Attempts at a request: the first one may meet a connection that the server has closed."""
UNFINISHED = ".unfinished"
LEFT = 86_400.0
"""s after which a file that is still unfinished was left by a process that was ended."""
PROBE = "menshin-probe"
DIGEST = re.compile(r"[0-9a-f]{64}", re.ASCII)
FAILING: set[str] = set()
"""Stores that this process could not use when it last tried: each is logged once."""

OF_SYSTEM: Mapping[int, tuple[str, str]] = {
    errno.ENOSPC: ("is full", "free some space there"),
    errno.EDQUOT: ("is full: the quota is used up", "raise the quota, or free some space there"),
    errno.EROFS: ("is on a read-only file system", "make it writable"),
    errno.EACCES: ("cannot be used by this account", "give it the right to read and write there"),
    errno.EPERM: ("cannot be used by this account", "give it the right to read and write there"),
}
REFUSED = (
    "rejects these keys, or they lack the required permissions",
    "correct storage.s3_access_key and storage.s3_secret_key",
)
OF_STORE: Mapping[str, tuple[str, str]] = {
    "EndpointConnectionError": ("cannot be reached", "check storage.s3_endpoint, and that the server runs"),
    "ConnectTimeoutError": ("does not take connections", "check storage.s3_endpoint, and that the server runs"),
    "ReadTimeoutError": ("did not answer in time", "check that the server runs, or raise storage.timeout"),
    "NoCredentialsError": ("needs keys", "set storage.s3_access_key and storage.s3_secret_key"),
    "PermissionError": REFUSED,
    "FileNotFoundError": ("does not exist", "make it, or correct storage.originals"),
    "SSLError": ("has no certificate that this machine trusts", "check storage.s3_endpoint and the certificate"),
}
"""Problem and remedy by the number of a system's error, and by the name of a store's."""


class LostFileError(Exception):
    """An original file is missing or damaged; the message says which one and what helps."""


@dataclass(frozen=True, slots=True)
class FileStore:
    """The store of the settings."""

    settings: Storage

    @property
    def url(self) -> str:
        """Its address, which holds no secret."""
        return self.settings.originals or ""

    def put(self, digest: str, data: bytes) -> None:
        """Store the bytes; whatever is there under their digest is replaced.

        Raises:
            StoreAwayError: they are not stored.
        """
        with self._usable() as (files, root):
            if self._is_folder:
                _write_whole(files, _path(root, digest), data)
            else:
                files.pipe_file(_path(root, digest), data)

    def get(self, digest: str) -> bytes:
        """The bytes with this digest.

        Raises:
            StoreAwayError: the store cannot be used.
            LostFileError: they are not there, or damaged.
        """
        with self._usable() as (files, root):
            try:
                data: bytes = files.cat_file(_path(root, digest))
            except FileNotFoundError:
                self._check_root(files, root)
                raise LostFileError(
                    f"the original file {digest} is missing in {self.url}; copy it there from a backup as "
                    f"{_path('', digest)[1:]}, then run `menshin storage check`"
                ) from None
        if sha256(data).hexdigest() != digest:
            raise LostFileError(
                f"the original file {digest} in {self.url} is damaged: its bytes differ from those that were stored; "
                "copy it there from a backup, then run `menshin storage check`"
            )
        return data

    def delete(self, digest: str) -> None:
        """Delete the bytes with this digest, if they are there.

        Raises:
            StoreAwayError: they may still be there.
        """
        with self._usable() as (files, root), suppress(FileNotFoundError):
            files.rm_file(_path(root, digest))

    def digests(self) -> set[str]:
        """The digests of all files that are there, by their names.

        Raises:
            StoreAwayError: the store cannot be used.
        """
        with self._usable() as (files, root):
            names = (path.rpartition("/")[2] for path in files.find(root))
            return {name for name in names if DIGEST.fullmatch(name)}

    def probe(self) -> None:
        """Write, read and delete a small file.

        Raises:
            StoreAwayError: one of these is not possible.
        """
        name, data = f"{PROBE}-{uuid4().hex}", b"menshin"
        with self._usable() as (files, root):
            if self._is_folder:
                self._check_root(files, root)
            files.pipe_file(f"{root}/{name}", data)
            try:
                if files.cat_file(f"{root}/{name}") != data:
                    raise OSError(errno.EIO, os.strerror(errno.EIO))
            finally:
                files.rm_file(f"{root}/{name}")

    def free_bytes(self) -> int | None:
        """Free bytes on the disk of the folder; None of a store that does not say so."""
        if not self._is_folder:
            return None
        with self._usable() as (_, root):
            return shutil.disk_usage(root).free

    def sweep(self) -> int:
        """Remove files that ended processes left unfinished in the folder; their number."""
        if not self._is_folder:
            return 0
        with self._usable() as (files, root):
            left = [one for one in files.glob(f"{root}/*/*{UNFINISHED}") if time() - os.stat(one).st_mtime > LEFT]
            for one in left:
                files.rm_file(one)
        return len(left)

    @property
    def _is_folder(self) -> bool:
        return urlsplit(self.url).scheme == "file"

    @contextmanager
    def _usable(self) -> Iterator[tuple[Any, str]]:
        """The file system and the path of the store; its errors in words, of which the first and the end are logged."""
        try:
            files, root = self._opened()
            yield files, root
        except (LostFileError, StoreAwayError):
            raise
        except Exception as error:  # each file system has errors of its own
            found, helps = _words(error)
            problem = StoreAwayError(f"the store of original files, {self.url}, {found}; {helps}")
            if self.url not in FAILING:
                log.warning("%s; nothing is lost, trying again", problem)
            FAILING.add(self.url)
            raise problem from None
        if self.url in FAILING:
            log.warning("the store of original files, %s, can be used again", self.url)
            FAILING.discard(self.url)

    def _opened(self) -> tuple[Any, str]:
        import fsspec  # most installations need none

        parts = urlsplit(self.url)
        if self._is_folder:
            files = fsspec.filesystem("file")
            self._check_root(files, parts.path)
            return files, parts.path
        try:
            files = fsspec.filesystem("s3", **self._options())
        except ImportError:
            raise StoreAwayError("storage.originals needs s3fs; install it with: pip install 'menshin[s3]'") from None
        files.retries = ATTEMPTS
        return files, f"{parts.netloc}{parts.path}"

    def _options(self) -> dict[str, Any]:
        """Options of the S3 client. Checksums of its own, which not every server knows, are left out."""
        given = self.settings
        keys = (
            {}
            if given.s3_access_key is None or given.s3_secret_key is None
            else {"key": given.s3_access_key.get_secret_value(), "secret": given.s3_secret_key.get_secret_value()}
        )
        config = {
            "connect_timeout": CONNECT_TIMEOUT,
            "read_timeout": given.timeout,
            "retries": {"total_max_attempts": 1},  # ATTEMPTS are made around it, without its pauses
            "request_checksum_calculation": "when_required",
            "response_checksum_validation": "when_required",
        }
        return {**keys, "endpoint_url": given.s3_endpoint, "config_kwargs": config, "use_listings_cache": False}

    def _check_root(self, files: Any, root: str) -> None:  # noqa: ANN401  fsspec has no types
        """Refuse a folder or a bucket that is not there: it may be a disk that is not mounted."""
        if not files.isdir(root if self._is_folder else root.partition("/")[0]):
            raise FileNotFoundError(root)


def store_of(settings: Storage) -> FileStore | None:
    """The store of the settings; None where original files are kept in the database."""
    return None if settings.originals is None else FileStore(settings)


def _path(root: str, digest: str) -> str:
    """Path of a file: 256 folders keep each of them short."""
    return f"{root}/{digest[:2]}/{digest}"


def _write_whole(files: Any, path: str, data: bytes) -> None:  # noqa: ANN401
    """Write a file so that its name never stands for a part of it, even after the power failed."""
    folder, _, name = path.rpartition("/")
    files.makedirs(folder, exist_ok=True)
    unfinished = f"{folder}/.{name}.{uuid4().hex}{UNFINISHED}"
    try:
        with files.open(unfinished, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        files.mv(unfinished, path)
    except BaseException:
        with suppress(OSError):
            files.rm_file(unfinished)
        raise
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)  # the name too
    finally:
        os.close(handle)


def _words(error: Exception) -> tuple[str, str]:
    """Problem and remedy of an error."""
    name = type(error).__name__
    problem, helps = OF_STORE.get(name, (f"cannot be used ({name})", "check storage.originals, and the server's log"))
    if isinstance(error, OSError) and error.filename is not None:  # of this machine: a store's names no file
        problem, helps = OF_SYSTEM.get(error.errno or 0, (problem, helps))
    return problem, helps
