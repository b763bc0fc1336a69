"""What the formats refuse. Every message says what was found and what would do.

FormatError
├── UnknownFormatError  not the beginning of any format that is known here
└── UnknownUnitError    the samples are sound, but nothing says what they are
"""


class FormatError(Exception):
    """A file that cannot be used as it is."""


class UnknownFormatError(FormatError):
    """Bytes that begin as no known format does."""


class UnknownUnitError(FormatError):
    """Sound samples of channels whose unit nothing gives, yet: a StationXML file may still arrive."""

    def __init__(self, channels: tuple[str, ...]) -> None:
        super().__init__(
            f"nothing says what the numbers of {', '.join(channels)} are; a StationXML file with these channels, or "
            f"the keys gain and unit of these channels in the building file, would do"
        )
        self.channels = channels
