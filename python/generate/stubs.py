"""Writes the stubs of the package: stubs.py OUT.pyi, with the package on PYTHONPATH.

Signatures come from the docstrings that pybind11 makes, options from their dataclasses.
"""

import dataclasses
import inspect
import re
import sys

import atelier
from atelier import _atelier, errors

HEAD = '''"""Stubs of the package atelier, made by python/generate/stubs.py."""
import os
import pathlib
from typing import Any, Literal, Mapping, Sequence as _Sequence, overload

from numpy.typing import ArrayLike, NDArray
from typing_extensions import Self

__version__: str

'''

SIGNATURE = re.compile(r"^(?:\d+\. )?\w+\((.*)\) -> (.*)$")


def split_arguments(text: str) -> list[str]:
    """Arguments of a signature; commas inside brackets do not part them."""
    arguments, depth, last = [], 0, 0
    for at, letter in enumerate(text):
        depth += letter in "([{<"
        depth -= letter in ")]}>"
        if letter == "," and depth == 0:
            arguments.append(text[last:at].strip())
            last = at + 1
    arguments.append(text[last:].strip())
    return [argument for argument in arguments if argument]


def named(text: str, is_argument: bool) -> str:
    """A type of a docstring as a type of a stub."""
    text = text.replace("atelier._atelier.", "").replace("os.PathLike", "os.PathLike[str]")
    text = re.sub(r"\bhandle\b|\bobject\b", "Any", text)
    text = re.sub(r"numpy\.ndarray(?!\[)", "NDArray[Any]", text)
    text = text.replace("List[", "list[").replace("Dict[", "dict[").replace("Tuple[", "tuple[")
    text = re.sub(r"\bdict\b(?!\[)", "dict[str, Any]", text)
    text = re.sub(r"Optional\[(.*)\]", r"\1 | None", text)
    text = text.replace("os.PathLike[str]", "str | os.PathLike[str]" if is_argument else "pathlib.Path")
    if is_argument:
        text = text.replace("list[", "_Sequence[")
        if text.startswith("NDArray"):
            return "ArrayLike | None"
        text = text.replace("NDArray[Any]", "ArrayLike")
        if text.endswith("Options"):
            return f"{text} | Mapping[str, Any] | None"
    return text


def documented(text: str | None, indent: str) -> str:
    """A docstring, or the dots of a body without one."""
    text = (text or "").strip().replace("\\", "\\\\").replace('"""', "'''")
    return indent + (f'"""{text} """' if text.endswith('"') else f'"""{text}"""' if text else "...")


def function(name: str, docstring: str, indent: str = "", method: bool = False) -> str:
    lines = []
    first, _, rest = docstring.partition("\n")
    overloads = [line for line in docstring.splitlines() if SIGNATURE.match(line)]
    match = SIGNATURE.match(overloads[-1] if len(overloads) > 1 else first)
    if not match:
        return f"{indent}def {name}(*arguments: Any, **named: Any) -> Any: ...\n"
    arguments = []
    for position, argument in enumerate(split_arguments(match[1])):
        if argument.startswith("*"):
            arguments.append(argument.split(":")[0] + ": Any")
            continue
        what, _, default = argument.partition(" = ")
        word, _, kind = what.partition(": ")
        if method and position == 0:
            arguments.append("self")
            continue
        arguments.append(f"{word}: {named(kind, True)}" + (" = ..." if default else ""))
    result = named(match[2], False)
    lines.append(f"{indent}def {name}({', '.join(arguments)}) -> {result}:")
    text = rest.strip() if len(overloads) <= 1 else ""
    lines.append(documented(text, indent + "    "))
    return "\n".join(lines) + "\n"


def class_of(name: str, kind: type) -> str:
    lines = [f"class {name}:"]
    lines.append(documented(kind.__doc__, "    "))
    members = []
    for member, value in vars(kind).items():
        if isinstance(value, property):
            signature = (value.fget.__doc__ or "").partition("\n")[0]
            match = SIGNATURE.match(signature) or re.match(r"^\((.*)\) -> (.*)$", signature)
            result = named(match[2], False) if match else "Any"
            if result == "Any" and re.match(r"\[", value.__doc__ or ""):
                result = "NDArray[Any]"
            members.append(f"    @property\n    def {member}(self) -> {result}:\n" + documented(value.__doc__, " " * 8))
            if value.fset:
                given = "ArrayLike" if result == "NDArray[Any]" else named(result, True)
                members.append(f"    @{member}.setter\n    def {member}(self, value: {given}) -> None: ...")
        elif member == "__init__" and "__init__(" in (value.__doc__ or ""):
            members.append(function(member, value.__doc__, "    ", True).rstrip())
        elif member in ("__len__", "__getitem__"):
            members.append(function(member, value.__doc__, "    ", True).rstrip())
        elif not member.startswith("_") and callable(value) and value.__doc__:
            members.append(function(member, value.__doc__, "    ", True).rstrip())
    return "\n".join(lines + members) + "\n"


def options_of(name: str, kind: type) -> str:
    lines = [f"class {name}(Options):", documented(kind.__doc__, "    ")]
    arguments = ["self"]
    for field in dataclasses.fields(kind):
        word = field.type if isinstance(field.type, str) else field.type.__name__
        lines.append(f"    {field.name}: {word}")
        arguments.append(f"{field.name}: {word} = ...")
    lines.append(f"    def __init__({', '.join(arguments)}) -> None: ...")
    return "\n".join(lines) + "\n"


def exceptions() -> str:
    names = [name for name, value in vars(errors).items() if inspect.isclass(value) and issubclass(value, Exception)]
    return "from .errors import (" + ", ".join(f"{name} as {name}" for name in names) + ")\n"


def stage_options() -> str:
    """Every stage has a class of its own."""
    kinds = {name: type(atelier.stage_options(name)).__name__ for name in atelier.stage_names()}
    known = "".join(f'@overload\ndef stage_options(stage: Literal["{name}"]) -> {kind}: ...\n'
                    for name, kind in kinds.items())
    return known + "@overload\ndef stage_options(stage: str) -> Options: ...\n"


def main(out: str) -> None:
    parts = [HEAD, exceptions(), '''
class Options:
    """Base of all options."""
    def to_dict(self) -> dict[str, Any]: ...
    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self: ...
    def check(self) -> None: ...
''', stage_options()]
    for name in atelier.__all__:
        value = getattr(atelier, name)
        if dataclasses.is_dataclass(value) and value is not atelier.Options:
            parts.append(options_of(name, value))
    for name, value in vars(_atelier).items():
        if name.startswith("_"):
            continue
        if inspect.isclass(value):
            parts.append(class_of(name, value))
        elif callable(value):
            parts.append(function(name, value.__doc__))
    with open(out, "w", encoding="utf-8") as file:
        file.write("\n".join(parts))


if __name__ == "__main__":
    main(sys.argv[1])
