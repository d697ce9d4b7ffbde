"""Exceptions of Atelier, with the fields of the C++ ones."""

from typing import Any


class Error(Exception):
    """Whatever Atelier refuses."""


class DataError(Error, ValueError):
    """Data that cannot be used: a damaged file, an array of another shape, a number that is not finite.

    file      path or name of the data, "" if it has none
    where     place inside it: line, byte, field, frame, vertex
    found     what is there
    expected  what should be there, or what to do
    """

    def __init__(self, file: str, where: str, found: str, expected: str) -> None:
        text = ": ".join(part for part in (file, where, found) if part)
        if expected:
            text += ("; expected " if text else "expected ") + expected
        super().__init__(text)
        self.file = file
        self.where = where
        self.found = found
        self.expected = expected

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.file, self.where, self.found, self.expected)


class UnknownValue(DataError):
    """A value of an option asks for something that is not there: a garment, a frame, a subject."""

    def __init__(self, file: str, where: str, found: str, expected: str, option: str, value: str) -> None:
        super().__init__(file, where, found, expected)
        self.option = option
        self.value = value

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.file, self.where, self.found, self.expected, self.option, self.value)


class EnvironmentError(Error, OSError):  # noqa: A001 (the name that it has in C++)
    """The surroundings failed: disk, memory, device, a missing program.

    place   what failed: a path, a device, a program
    reason  why, as the system says it, and what to do
    """

    def __init__(self, place: str, reason: str) -> None:
        super().__init__(f"{place}: {reason}")
        self.place = place
        self.reason = reason

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.place, self.reason)


class UsageError(Error, ValueError):
    """Options that are wrong, a line for each."""


class UnknownOption(UsageError, TypeError):
    """An option that there is not; the message names the one that is near."""


class NotConverged(Error, RuntimeError):
    """An optimisation that came to nothing of use."""


class LogicError(Error, ValueError):
    """A broken precondition: sizes that do not agree, an index out of range."""
