"""Rows of patterns: DXF and SVG."""

import os
import pathlib
import re
import shutil
import tempfile
import zlib

import numpy
from held import box, largest
from programs import Row, blender, debian, npm, output, python, told


def dxf_polylines(path):
    """Corners of each closed line by block and layer, mm, from the pairs of the text."""
    words = [line.strip() for line in path.read_text().splitlines()]
    pairs = list(zip(words[::2], words[1::2]))
    block, layer, entity, lines = "drawing", "", "", {}
    point = [0.0, 0.0]
    for code, value in pairs:
        if code == "0":
            entity = value
            block = "drawing" if value == "ENDBLK" else block
        elif code == "2" and entity == "BLOCK":
            block = value
        elif code == "8":
            layer = value
        elif entity == "VERTEX" and code == "10":
            point[0] = float(value)
        elif entity == "VERTEX" and code == "20":
            lines.setdefault(f"{block}:{layer}", []).append([point[0], float(value)])
    return {key: box(points) for key, points in lines.items()}


def pdf_lines(data):
    """Corners of each run of connected lines in a PDF by Qt at 1200 dots an inch, mm."""
    runs, last = [], None
    for stream in re.findall(rb"stream\r?\n(.*?)endstream", data, re.S):
        try:
            text = zlib.decompress(stream.strip(b"\r\n")).decode("latin1")
        except zlib.error:
            continue
        for line in re.findall(r"(\S+) (\S+) m\n(\S+) (\S+) l\nS", text):
            begin, end = [float(word) for word in line[:2]], [float(word) for word in line[2:]]
            if begin != last:
                runs.append([begin])
            runs[-1].append(end)
            last = end
    return [[number * 25.4 / 1200 for number in box(run)] for run in runs]


# Of a page: corners of each named path.
BOXES = """
for (const path of document.querySelectorAll('path[id]')) {
  const { x, y, width, height } = path.getBBox();
  found.textContent += [path.id, x, y, x + width, y + height].join(' ') + '\\n';
}
"""


def single(scale):
    """By how much Blender's Matrix.Scale errs: it keeps 1 + (scale - 1), and that in single precision."""
    one = numpy.float32(1)
    return float(one + (numpy.float32(scale) - one)) / scale


def svg_boxes(path):
    """Corners of each named path, user units."""
    found = {}
    for name, line in re.findall(r'<path id="([^"]+)" d="([^"]+)"', path.read_text()):
        found[name] = box([[float(x), float(y)] for x, y in re.findall(r"(-?[\d.]+),(-?[\d.]+)", line)])
    return found


def pattern_rows(held, exports):
    (dxf, *_) = sorted((exports / "ply/flatten").rglob("pattern.dxf"))
    svg = dxf.with_suffix(".svg")
    lines, outlines = dxf_polylines(dxf), svg_boxes(svg)
    corners = [*numpy.min(list(lines.values()), axis=0)[:2], *numpy.max(list(lines.values()), axis=0)[2:]]
    height = float(re.search(r'viewBox="0 0 \S+ ([\d.]+)"', svg.read_text())[1])
    width = float(re.search(r'viewBox="0 0 (\S+) ', svg.read_text())[1])
    pieces = sum(key.endswith(":1") for key in lines)
    read = f"{pieces} pieces, {len(lines)} closed lines, unit, corners of the header, control square"

    def ezdxf():
        found = python("ezdxf", "ezdxf_judge.py", dxf)
        assert found["unit"] == [4] and found["errors"] == [0], found
        off = max(largest(found, lines), largest({"": found["$EXTMIN"] + found["$EXTMAX"]}, {"": corners}))
        return Row(f"ezdxf {debian('python3-ezdxf')}", "DXF: " + read, off, "mm", 0.001)

    def dxf_parser():
        version, found = npm("dxf-parser", "dxf_parser.mjs", dxf)
        assert found["unit"] == [4], found
        return Row(f"dxf-parser {version}", "DXF: " + read, largest(found, lines), "mm", 0.001)

    def librecad():
        """Its PDF, whose page clips what is painted but whose text has all lines.

        Qt's A4 is 595 x 842 points, which LibreCAD takes for 210 x 297 mm: it prints 0.99984 times the size.
        """
        with tempfile.TemporaryDirectory() as folder:
            file = shutil.copy(dxf, pathlib.Path(folder) / "pattern.dxf")
            places = {"HOME": folder, "XDG_RUNTIME_DIR": folder, "QT_QPA_PLATFORM": "offscreen"}
            output("librecad", "dxf2pdf", "-s", 1.00016, "-c", file, env=os.environ | places, cwd=folder)
            found = pdf_lines((pathlib.Path(folder) / "pattern.pdf").read_bytes())
        sizes = lambda boxes: sorted([b[2] - b[0], b[3] - b[1]] for b in boxes if b[2] - b[0] > 20 and b[3] - b[1] > 20)
        off = float(numpy.abs(numpy.subtract(sizes(found), sizes(lines.values()))).max())
        read = f"DXF: sizes of {len(lines)} closed lines, in its PDF at 1200 dots an inch"
        advice = "print at the scale 1.00016: of its A4 of 595 x 842 points it makes 210 x 297 mm"
        return Row(f"LibreCAD {debian('librecad')}", read, off, "mm", 0.03, advice)

    def assimp():
        info = output("assimp", "info", dxf)
        found = [
            float(word)
            for key in ("Minimum point", "Maximum point")
            for word in re.search(rf"{key} +\((\S+) (\S+) \S+\)", info).groups()
        ]
        off = float(numpy.abs(numpy.subtract(found, corners)).max())
        return Row(
            f"assimp {debian('assimp-utils')}",
            "DXF: corners of everything",
            off,
            "mm",
            0.01,
            "another program: pieces lie on one another",
            "a text in a block resets its base, assimp's fault" if off > 0.01 else "",
        )

    def by_blender():
        version, found = blender("svg", svg)
        names = [name for name in outlines if name.startswith(("cut-", "sew-", "square-"))]
        sizes = lambda boxes: numpy.array([numpy.subtract(boxes[name][2:], boxes[name][:2]) for name in names])
        # The unit's matrix of any SVG: a foot's twelfth over 90 dots, and the same downwards.
        factors = [single(0.3048 / 12 / 90), single(-0.3048 / 12 / 90)]
        off = float(numpy.abs(sizes(found) - sizes(outlines)).max())
        explained = numpy.abs(sizes(found) - factors * sizes(outlines)).max() <= 0.003
        because = (
            f"it makes every SVG {factors[0]:.5f} times as wide and {factors[1]:.5f} times as high, "
            "since its unit's matrix has single precision"
        )
        advice = "a scale by 1.00019 along y; as Debian 12 packs it the import fails ('rU'): take that of blender.org"
        read = f"SVG: sizes of {len(names)} outlines, its reader mended"
        return Row(version, read, off, "mm", 0.003, advice, because if explained else "")

    def rsvg():
        from PIL import Image

        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "a.png"
            output("rsvg-convert", "-d", "25.4", "-p", "25.4", "--unlimited", "-o", file, svg)
            image = Image.open(file).convert("RGBA")
        off = max(abs(image.width - width), abs(image.height - height))
        painted = image.getchannel("A").getbbox()
        cuts = list(outlines.values())
        extent = [*numpy.min(cuts, axis=0)[:2], *numpy.max(cuts, axis=0)[2:]]
        off = max(off, *(abs(a - b) for a, b in zip(painted, extent)))
        return Row(
            f"rsvg-convert {debian('librsvg2-bin')}",
            "SVG: page and painted area, with half a line's width, in whole pixels of a millimetre",
            off,
            "mm",
            1.3,
        )

    def inkscape():
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "pattern.svg"  # lines have a width there, which counts
            file.write_text(re.sub(r'stroke="#\w+"', 'stroke="none"', svg.read_text()))
            text = output("inkscape", "--query-all", file)
        found = {}
        for name, *numbers in (line.split(",") for line in text.splitlines()):
            if name in outlines and len(numbers) == 4:
                x, y, w, h = (float(word) * 25.4 / 96 for word in numbers)
                found[name] = [x, y, x + w, y + h]
        read = f"SVG: {len(outlines)} outlines, without the width of lines, in px of six digits"
        return Row(f"Inkscape {debian('inkscape')}", read, largest(found, outlines), "mm", 0.01)

    def chromium():
        with tempfile.TemporaryDirectory() as folder:
            page = pathlib.Path(folder) / "a.html"
            drawing = re.sub(r"^<\?xml.*?\?>", "", svg.read_text())
            page.write_text(f"<!doctype html><body>{drawing}<pre id=found></pre><script>{BOXES}</script>")
            text = output(
                "chromium",
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                f"--user-data-dir={folder}/profile",
                "--dump-dom",
                f"file://{page}",
            )
        found = told(re.search(r'<pre id="found">(.*?)</pre>', text, re.S)[1])
        return Row(
            f"Chromium {debian('chromium')}", f"SVG: {len(outlines)} outlines", largest(found, outlines), "mm", 0.001
        )

    return [ezdxf, dxf_parser, librecad, assimp, chromium, inkscape, rsvg, by_blender]
