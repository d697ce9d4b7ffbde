"""Curves as SVG, so that the examples need NumPy alone. With matplotlib: plt.plot(x, y)."""

import html
import pathlib
import sys

import numpy as np

COLORS = ("#1f5fa8", "#c4502e", "#3c8c4a", "#7a4fa3", "#8a6d1f")


def out_folder() -> pathlib.Path:
    """The folder that the command line names, else the one that one is in."""
    folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 and not sys.argv[1].startswith("-") else ".")
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def plot(path, curves, title="", x="", y=""):
    """Writes curves {name: (x values, y values)}; axes are linear and hold all of them."""
    points = [(np.asarray(a, float), np.asarray(b, float)) for a, b in curves.values()]
    low = np.array([min(np.nanmin(a) for a, _ in points), min(np.nanmin(b) for _, b in points)])
    high = np.array([max(np.nanmax(a) for a, _ in points), max(np.nanmax(b) for _, b in points)])
    extent = np.where(high > low, high - low, 1)
    place = lambda a, b: (70 + 500 * (a - low[0]) / extent[0], 310 - 260 * (b - low[1]) / extent[1])
    parts = ['<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 640 360" font-family="sans-serif" font-size="12">',
             '<rect width="640" height="360" fill="white"/>',
             f'<text x="320" y="24" text-anchor="middle" font-size="15">{html.escape(title)}</text>',
             f'<text x="320" y="350" text-anchor="middle">{html.escape(x)}</text>',
             f'<text x="16" y="180" text-anchor="middle" transform="rotate(-90 16 180)">{html.escape(y)}</text>']
    for share in np.linspace(0, 1, 5):
        at = low + share * extent
        column, row = place(at[0], at[1])
        parts += [f'<path d="M70 {row:.1f}H570M{column:.1f} 50V310" stroke="#ddd" fill="none"/>',
                  f'<text x="64" y="{row + 4:.1f}" text-anchor="end">{at[1]:.4g}</text>',
                  f'<text x="{column:.1f}" y="326" text-anchor="middle">{at[0]:.4g}</text>']
    for number, (name, (a, b)) in enumerate(zip(curves, points)):
        color = COLORS[number % len(COLORS)]
        pairs = " ".join("%.2f,%.2f" % place(*pair) for pair in zip(a, b) if np.isfinite(pair).all())
        parts += [f'<polyline points="{pairs}" fill="none" stroke="{color}" stroke-width="1.5"/>',
                  f'<text x="562" y="{66 + 16 * number}" text-anchor="end" fill="{color}">{html.escape(name)}</text>']
    pathlib.Path(path).write_text("\n".join(parts + ["</svg>\n"]), encoding="utf-8")
    print("wrote", path)
