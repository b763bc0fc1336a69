"""Ground motions that people upload for a forecast: checked in the parser's own process, and kept as they came."""

from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import PurePath
from zipfile import ZIP_DEFLATED, ZipFile

from core.errors import RecordError
from core.forecasting.ground_motion import GroundMotion
from service.buildings.description import BuildingFile
from service.errors import ConflictError
from service.formats import Contents, FormatError, read
from service.models import texts
from service.models.motions import motion, of_contents
from service.parsing import process
from service.parsing.process import Limits, ParserDiedError, ParserFailedError
from service.records.originals import Secured, secured
from service.settings import Settings

MOST_FILES = 12
"""Files of one motion: three components, each with its headers apart, and some to spare. A choice."""
LONGEST_NAME = 100
"""Characters of a name that are kept."""


@dataclass(frozen=True, slots=True)
class MotionFile:
    """A file with a ground motion."""

    name: str
    data: bytes


@dataclass(frozen=True, slots=True)
class KeptFile:
    """A file whose bytes a job may name."""

    name: str
    data: Secured


def one_file(files: Sequence[MotionFile]) -> MotionFile:
    """The files of a motion as one: several, such as one for each component, as a ZIP archive.

    Raises:
        ConflictError: they are too many.
    """
    if len(files) > MOST_FILES:
        raise ConflictError(texts.too_many_files(MOST_FILES))
    if len(files) == 1:
        return MotionFile(files[0].name[-LONGEST_NAME:], files[0].data)
    archive = BytesIO()
    with ZipFile(archive, "w", ZIP_DEFLATED) as made:
        for number, one in enumerate(files):
            made.writestr(f"{number}-{one.name[-LONGEST_NAME:]}", one.data)
    return MotionFile(f"{PurePath(files[0].name[-LONGEST_NAME:]).stem}.zip", archive.getvalue())


def check(file: MotionFile, building: BuildingFile, limits: Limits) -> None:
    """Refuse a file that holds no ground motion.

    Raises:
        ConflictError: the reason, in words.
    """
    try:
        _motion(file.name, process.read(file.name, file.data, building.gains, limits), building)
    except (FormatError, RecordError, ParserDiedError, ParserFailedError) as error:
        raise ConflictError(f"{str(error).rstrip('.')}.") from None


def kept(file: MotionFile, settings: Settings) -> KeptFile:
    """The file with its bytes safe, before the transaction that queues its job begins.

    Raises:
        StoreAwayError: as of `originals.secured`.
    """
    return KeptFile(file.name, secured(file.data, settings.storage))


def uploaded_motion(name: str, data: bytes, building: BuildingFile) -> GroundMotion:
    """The ground motion of a file that was checked.

    Raises:
        RecordError: it can no longer be used, after a change of the building file.
    """
    try:
        return _motion(name, read(name, data, building.gains), building)
    except FormatError as error:
        raise RecordError(str(error)) from None


def _motion(name: str, contents: Contents, building: BuildingFile) -> GroundMotion:
    return motion(of_contents(PurePath(name).stem, name, contents, building))
