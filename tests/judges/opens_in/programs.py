"""How scripts/opens-in runs programs, and a row of its tables."""

import dataclasses
import importlib.util
import json
import os
import pathlib
import re
import subprocess

JUDGES = pathlib.Path(__file__).resolve().parent.parent
ATELIER = os.environ.get("ATELIER_PROGRAM", str(JUDGES.parent.parent / "build/dev/bin/atelier"))


class Absent(Exception):
    """A program that is not installed here."""


@dataclasses.dataclass
class Row:
    """What a program made of an export."""

    program: str  # with its version
    read: str
    off: float  # largest difference, in `unit`
    unit: str
    limit: float  # in `unit`
    advice: str = ""  # what to set
    because: str = ""  # explains a difference above the limit

    def cells(self):
        if self.off == 0:
            off = "none"
        elif self.off < 0.001:
            off = f"below 0.001 {self.unit}".strip()
        else:
            off = f"{self.off:,.2g}" if self.off < 1000 else f"{self.off:,.0f}"
            off = f"{off} {self.unit}".strip()
        return self.program, self.read, f"{off}: {self.because}" if self.because else off, self.advice or "nothing"


def output(*command, **more):
    """Standard output and error of a command. Absent where there is no such program."""
    command = [str(word) for word in command]
    try:
        done = subprocess.run(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=300, check=False, **more
        )
    except FileNotFoundError:
        raise Absent(pathlib.Path(command[0]).name) from None
    text = done.stdout.decode(errors="replace")
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(command)}: exit code {done.returncode}\n{text[-2000:]}")
    return text


def number(text):
    try:
        return float(text)
    except ValueError:
        return None


def told(text, mark=""):
    """Numbers by the word that a line begins with, of lines behind a mark."""
    found = {}
    for line in text.splitlines():
        words = line.split()
        if mark and (not words or words.pop(0) != mark):
            continue
        if words and all(number(word) is not None for word in words[1:]):
            found[words[0]] = [float(word) for word in words[1:]]
    return found


def npm(package, script, *arguments):
    """A script of tests/judges or its folder opens_in: the package's version and what the script tells."""
    script = next(one for one in (JUDGES / script, JUDGES / "opens_in" / script) if one.exists())
    description = script.parent / "node_modules" / package / "package.json"
    if not description.exists():
        raise Absent(f"npm package {package}")
    return json.loads(description.read_text())["version"], told(output("node", script, *arguments))


def python(module, script, *arguments):
    """A script of tests/judges by Debian's Python, which has the module."""
    if not importlib.util.find_spec(module):
        raise Absent(f"Python package {module}")
    return told(output("/usr/bin/python3", JUDGES / script, *arguments))


def blender(*arguments):
    found = told(
        output(
            "blender",
            "--background",
            "--python-exit-code",
            "1",
            "--python",
            JUDGES / "blender_judge.py",
            "--",
            *arguments,
        ),
        "judged",
    )
    return "Blender " + debian("blender"), found


def debian(package):
    """The upstream version of a Debian package."""
    version = output("dpkg-query", "-W", "-f", "${Version}", package).split(":")[-1]
    return re.match(r"[0-9.]+", version)[0].rstrip(".")
