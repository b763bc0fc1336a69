"""Errors of the formats. Every message gives the cause and the remedy.

FormatError
├── UnknownFormatError  the bytes are of no known format
└── UnknownUnitError    the samples are sound, but their unit is not known
"""


class FormatError(Exception):
    """A file that cannot be used as it is."""


class UnknownFormatError(FormatError):
    """Bytes of no known format."""


class UnknownUnitError(FormatError):
    """Sound samples of channels whose unit is not known yet: a StationXML file may still arrive."""

    def __init__(self, channels: tuple[str, ...]) -> None:
        super().__init__(
            f"the unit of {', '.join(channels)} is not known; send a StationXML file with these channels, or give "
            f"their gain and unit in the building file"
        )
        self.channels = channels
