"""Exceptions. Their messages are the sentences that the command prints; each names what is wrong and what to do."""

from __future__ import annotations


class MedialError(Exception):
    """Any error of this package."""


class InputError(MedialError, ValueError):
    """A file, an array or a surface is wrong: it cannot be read, or bounds no solid."""


class ParameterError(MedialError, ValueError):
    """A parameter, a level or a method's name is wrong."""


class UnsupportedError(MedialError, NotImplementedError):
    """The method does not do this: an answer rather than a failure. Raise it in a class of your own, too."""


class FailedError(MedialError, RuntimeError):
    """The method could not do it, and says why."""


class CancelledError(MedialError, RuntimeError):
    """The run was told to stop."""


class InternalError(MedialError, RuntimeError):
    """A fault of this package: please report it with the input."""


class MedialWarning(UserWarning):
    """A result that is not as requested, or that needs attention; also in `.run.warnings` of the result."""
