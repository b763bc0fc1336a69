"""Errors that core raises. Every message states the fault and what helps.

CoreError
├── RecordError          the record cannot be used (gaps, clipping, wrong length, a missing channel)
├── ModelError           the model is not well posed (negative mass, unknown effect)
└── IdentificationError  the record does not determine what was to be identified
"""


class CoreError(Exception):
    """Base class: the caller may show str(error) to an engineer."""


class RecordError(CoreError):
    """The record cannot be used as it is."""


class ModelError(CoreError):
    """The model is not well posed."""


class IdentificationError(CoreError):
    """The record does not determine what was to be identified."""
