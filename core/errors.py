"""What core can refuse to do. Every message says what was found and what would do.

CoreError
├── RecordError          the record cannot be used (gaps, clipping, wrong length, a missing channel)
├── ModelError           the model is not well posed (negative mass, unknown effect)
└── IdentificationError  the record holds no mode that could be identified
"""


class CoreError(Exception):
    """Base class: the caller may show str(error) to an engineer."""


class RecordError(CoreError):
    """The record cannot be used as it is."""


class ModelError(CoreError):
    """The model is not well posed."""


class IdentificationError(CoreError):
    """The record does not determine what was asked of it."""
