"""Opens a page of the viewer in headless Chromium and does what it is told, a word each:

    python3 look.py ADDRESS [key:X] [shift:X] [click:EXPRESSION] [move:EXPRESSION] [drag:EXPRESSION] [eval:EXPRESSION]
                    [wait:EXPRESSION] [shot:FILE] [took:FILE]...

Of `click` and `move` the value is the place [x, y] on the page, of `drag` those of its ends; `took` waits for what the
page gave out as a download. A page of files (file://) is shown without a network.
Prints the value of each `eval` as a line of JSON, then what the browser logged ("message: ...") and each address that
was asked for and does not begin like the page's own ("outside: ...").
"""
import json
import sys

from chromium import Chromium


def main():
    address, *steps = sys.argv[1:]
    with Chromium(offline=address.startswith("file:")) as page:
        page.open(address)
        for step in steps:
            what, _, value = step.partition(":")
            if what == "key":
                page.key(value)
            elif what == "shift":
                page.key(value, shift=True)
            elif what == "click":
                page.mouse("mousePressed mouseReleased", *page.ask(value))
            elif what == "move":
                page.mouse("mouseMoved", *page.ask(value))
            elif what == "drag":
                begin_x, begin_y, x, y = page.ask(value)
                page.mouse("mousePressed", begin_x, begin_y)
                page.mouse("mouseMoved mouseReleased", x, y)
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
