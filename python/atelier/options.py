"""Options as dataclasses, made from what the C++ structs say of themselves."""

from __future__ import annotations

import dataclasses
import difflib
import functools
import keyword
from typing import Any

from . import _atelier, errors as _errors


class Options:
    """Base of all options: `to_dict`, `from_dict`, `check`; the repr shows every value."""

    __slots__ = ()
    _class = ""  # the name of the whole set; "" of a part of one
    _names: dict[str, str] = {}  # attribute by the name in C++

    def to_dict(self) -> dict[str, Any]:
        """Values by name; a nested struct is a dict in the dict."""
        values = {}
        for name, attribute in self._names.items():
            value = getattr(self, attribute)
            values[name] = value.to_dict() if isinstance(value, Options) else value
        return values

    @classmethod
    def from_dict(cls, values: dict[str, Any]):
        """Defaults with these values; names may have dots ("xpbd.substeps"). Raises UsageError for unknown ones."""
        options = cls()
        for name, value in values.items():
            options._set(name, value)
        if cls._class:
            options.check()
        return options

    def check(self) -> None:
        """Raises UsageError with a line for each value that is out of its range. Every function that takes
        options does it, too."""
        if self._class:
            _atelier._check_options(self._class, self.to_dict())

    def _set(self, name: str, value: Any) -> None:
        first, _, rest = name.partition(".")
        if first not in self._names:
            raise unknown(name, self._names)
        attribute = self._names[first]
        part = getattr(self, attribute)
        if (rest or isinstance(value, dict)) and not isinstance(part, Options):
            raise _errors.UsageError(f"option '{first}' is a single value, and has no '{rest or next(iter(value), '')}'")
        if rest:
            part._set(rest, value)
        elif isinstance(value, dict):
            for inner, one in value.items():
                part._set(inner, one)
        elif isinstance(part, Options) and not isinstance(value, type(part)):
            raise _errors.UsageError(f"option '{first}' is a group; give a dict with some of {', '.join(part._names)}")
        else:
            setattr(self, attribute, value)


def unknown(name: str, known) -> _errors.UnknownOption:
    """What is said of a name that no option has."""
    near = difflib.get_close_matches(name.partition(".")[0], known, 1)
    advice = f"did you mean '{near[0]}'?" if near else f"there are {', '.join(known)}"
    return _errors.UnknownOption(f"there is no option '{name}'; {advice}")


def refusing_unknown(made_class: type) -> None:
    """Makes the class say of a wrong keyword which name is near."""
    initialise = made_class.__init__

    @functools.wraps(initialise)
    def __init__(self, *values, **named):
        for name in named:
            if name not in self._names.values():
                raise unknown(name, list(self._names.values()))
        initialise(self, *values, **named)

    made_class.__init__ = __init__


def camel(name: str) -> str:
    return "".join(word.capitalize() for word in name.split("_"))


def attribute_of(name: str) -> str:
    return name + "_" if keyword.iskeyword(name) else name


def made(name: str, fields: list[dict[str, Any]], whole: bool = True) -> dict[str, type]:
    """The dataclass of a set of fields and those of its nested structs, innermost first."""
    own: dict[str, Any] = {}
    groups: dict[str, list[dict[str, Any]]] = {}
    for field in fields:
        first, _, rest = field["name"].partition(".")
        if rest:
            groups.setdefault(first, []).append(field | {"name": rest})
            own.setdefault(first, None)
        else:
            own[first] = field
    classes: dict[str, type] = {}
    members = []
    lines = []
    for first, field in own.items():
        attribute = attribute_of(first)
        if field is None:
            inner = made(name + camel(first), groups[first], whole=False)
            classes |= inner
            part = inner[name + camel(first)]
            members.append((attribute, part, dataclasses.field(default_factory=part)))
            lines.append(f"{attribute}: {part.__name__}")
            continue
        default = field["default"]
        metadata = {key: field[key] for key in ("help", "unit", "range", "choices", "type")}
        if isinstance(default, list):
            value = dataclasses.field(default_factory=lambda default=default: list(default), metadata=metadata)
        else:
            value = dataclasses.field(default=default, metadata=metadata)
        members.append((attribute, field["type"], value))
        unit = f" {field['unit']}" if field["unit"] else ""
        lines.append(f"{attribute} = {default!r}{unit} ({field['range']}): {field['help']}")
    made_class = dataclasses.make_dataclass(name, members, bases=(Options,), slots=True)
    made_class.__module__ = "atelier"
    made_class.__doc__ = "\n".join(lines)
    made_class._class = name if whole else ""
    made_class._names = {first: attribute_of(first) for first in own}
    refusing_unknown(made_class)
    classes[name] = made_class
    return classes


def all_classes() -> dict[str, type]:
    classes: dict[str, type] = {}
    for name, fields in _atelier._options_classes().items():
        classes |= made(name, fields)
    return classes
