"""What ezdxf finds in a drawing: errors of its audit, unit, corners of the header, and corners of each polyline with
its block and layer, where blocks are inserted."""
import sys

import ezdxf

drawing = ezdxf.readfile(sys.argv[1])
print("errors", len(drawing.audit().errors))
print("unit", drawing.header["$INSUNITS"])
for name in ("$EXTMIN", "$EXTMAX"):
    print(name, *drawing.header[name][:2])


def say(block, lines):
    for line in lines:
        if line.dxftype() == "POLYLINE":
            points = list(line.points())
            print(
                f"{block}:{line.dxf.layer}",
                *(min(p[a] for p in points) for a in (0, 1)),
                *(max(p[a] for p in points) for a in (0, 1)),
            )


space = drawing.modelspace()
for insert in space.query("INSERT"):
    say(insert.dxf.name, insert.virtual_entities())
say("drawing", space)
