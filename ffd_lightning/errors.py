"""Errors that are shown to the user as one message, without a traceback."""

from __future__ import annotations


class UserError(Exception):
    """Something only the user can mend: the message names it and the way out."""


class ConfigError(UserError):
    """A setting that cannot work, found before anything is built."""


class DataError(UserError):
    """Data that is missing, damaged or too little for what was asked."""


class RejectedModelError(Exception):
    """One model that cannot be used; it is listed with this reason and the rest goes on."""
