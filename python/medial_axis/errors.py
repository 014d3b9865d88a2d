"""Exceptions. Their messages are those of the command: the input, the problem, and advice."""

from __future__ import annotations


class MedialError(Exception):
    """Any error of this package."""


class InputError(MedialError, ValueError):
    """A file, an array or a surface is wrong: it cannot be read, or bounds no solid."""


class ParameterError(MedialError, ValueError):
    """A parameter, a level or a method's name is wrong."""


class UnsupportedError(MedialError, NotImplementedError):
    """The method does not support this. Not a failure; raise it in your class, too."""


class FailedError(MedialError, RuntimeError):
    """The method failed; the message has the reason."""


class CancelledError(MedialError, RuntimeError):
    """The run was cancelled."""


class InternalError(MedialError, RuntimeError):
    """A bug of this package: please report it with the input."""


class MedialWarning(UserWarning):
    """A result that is not as requested, or that needs attention; also in `.run.warnings` of the result."""
