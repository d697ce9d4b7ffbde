"""Plants three faults (plant_faults.py) and looks for them as a new user would: by what the page of `atelier view`
says and shows, its buttons and keys.

    python3 find_faults.py CAPTURE WORKSPACE OUT [SEED]

CAPTURE and WORKSPACE are those of scripts/demo or like them; OUT is new. Prints for each fault what was found, by which
steps and in how many seconds of this machine, and fails where it is not what was planted. OUT/*.png shows each step. ATELIER names the
program, by default that of build/dev.
"""
import json
import os
import pathlib
import re
import subprocess
import sys
import time

from chromium import Chromium

here = pathlib.Path(__file__).resolve().parent
SETTLED = "!atelier.loading && !atelier.dirty"


class User:
    """Does things on a page, one after the other, and takes a picture after each."""

    def __init__(self, page, name, out):
        self.page, self.name, self.out = page, name, out
        self.steps = []
        self.begin = time.monotonic()

    def did(self, step):
        self.page.wait(SETTLED)
        self.page.ask("new Promise(done => setTimeout(done, 400))")  # at rest the picture is drawn finely
        self.steps.append(step)
        self.page.screenshot(self.out / f"{self.name}-{len(self.steps)}.png")

    def read(self, selector):
        return self.page.ask(f"[...document.querySelectorAll({json.dumps(selector)})].map(one => one.innerText)")

    def wait_for(self, words, limit=100):
        """Until the side's tabs or text say so."""
        self.page.wait(f"/{words}/.test(document.getElementById('side').innerText)", limit)

    def finding(self, words):
        """Opens the findings and the first of them that says so. Returns its text."""
        self.page.wait("document.querySelector('#tabs .warning, #tabs .error')", 100)
        tabs = self.read("#side-tabs button")
        self.page.click("#side-tabs button", next(i for i, text in enumerate(tabs) if text.startswith("Findings")))
        self.did("click on the tab Findings")
        self.wait_for(words)
        texts = self.read(".finding")
        number = next(i for i, text in enumerate(texts) if re.search(words, text))
        self.page.click(".finding", number)
        self.did("click on the finding")
        return texts[number]


def find_camera(user):
    user.wait_for("more than twice as far off")
    user.did("look at the red bar and the sentence below the bars")
    names, bars = user.read(".bars button"), user.page.ask("[...document.querySelectorAll('.bar')].map(b => b.className)")
    off = [name for name, bar in zip(names, bars) if "off" in bar]
    user.page.click(".bars button", names.index(off[0]))
    user.did("click on its name, to look through it")
    return off


def find_torn(user):
    return int(re.search(r"frame (\d+)", user.finding("torn:"))[1])


def find_seam(user):
    return int(re.search(r"frame (\d+)", user.finding("strain jumps"))[1])


def main():
    if len(sys.argv) not in (4, 5):
        sys.exit(__doc__.strip())
    capture, workspace, out = map(pathlib.Path, sys.argv[1:4])
    atelier = os.environ.get("ATELIER", here.parent.parent / "build/dev/bin/atelier")
    out.mkdir(parents=True)
    subprocess.run([sys.executable, here / "plant_faults.py", capture, workspace, out / "planted", *sys.argv[4:]],
                   check=True)
    answers = json.loads((out / "planted/answers.json").read_text())
    wrong = 0
    for name, find in {"camera": find_camera, "torn": find_torn, "seam": find_seam}.items():
        subprocess.run([atelier, "view", out / "planted" / name, "--out", out / f"{name}-page"], check=True,
                       stdout=subprocess.DEVNULL)
        with Chromium(1440, 900) as page:
            page.open(f"file://{(out / f'{name}-page/index.html').resolve()}")
            user = User(page, name, out)
            found = find(user)
            seconds = time.monotonic() - user.begin
            planted = answers[name]
            right = [planted] if name == "camera" else int(re.search(r"\d+", planted)[0])
            wrong += found != right
            print(f"{name}: planted {planted}; found {found} in {len(user.steps)} steps and {seconds:.0f} s: "
                  + "; ".join(user.steps))
            for message in page.messages:
                print("  the browser says:", message)
    sys.exit(1 if wrong else 0)


main()
