"""Opens a page of the viewer in headless Chromium and does what it is told, a word each:

    python3 look.py [--offline] ADDRESS [key:X] [shift:X] [eval:EXPRESSION] [wait:EXPRESSION] [shot:FILE] [took:FILE]...

`took` waits for what the page gave out as a download.
Prints the value of each `eval` as a line of JSON, then what the browser logged ("message: ...") and each address that
was asked for and does not begin like the page's own ("outside: ...").
"""
import json
import sys

from chromium import Chromium


def main():
    words = sys.argv[1:]
    offline = words[0] == "--offline"
    address, *steps = words[1:] if offline else words
    with Chromium(offline=offline) as page:
        page.open(address)
        for step in steps:
            what, _, value = step.partition(":")
            if what == "key":
                page.key(value)
            elif what == "shift":
                page.key(value, shift=True)
            elif what == "eval":
                print(json.dumps(page.ask(value)))
            elif what == "wait":
                page.wait(value)
            elif what == "took":
                page.take_download(value)
            elif what == "shot":
                page.screenshot(value)
            else:
                sys.exit(f"no such step: {step}")
        page.ask("new Promise(done => setTimeout(done, 300))")
        home = address.split("#")[0].rsplit("/", 1)[0]
        for message in page.messages:
            print("message:", message)
        for request in page.requests:
            if not request.startswith((home, "data:", "blob:")):
                print("outside:", request)


main()
