"""Rows of marker files: TRC by the rules of the readers of OpenSim and Pose2Sim."""

from held import largest
from programs import Row

KEYS = "DataRate CameraRate NumFrames NumMarkers Units OrigDataRate OrigDataStartFrame OrigNumFrames".split()


def by_opensim(text):
    """Names, units, times and rows of numbers, or the exception that TRCFileAdapter (OpenSim 4.5) would throw."""
    lines = [line.split("\t") for line in text.split("\n")]
    full = lambda cells: [cell for cell in cells if cell]
    assert lines[0][0] == "PathFileType", "MissingHeader"
    assert full(lines[1]) == KEYS, "UnexpectedMetaDataKey"
    values = full(lines[2])
    assert len(values) == len(KEYS), "MetaDataLengthMismatch"
    said = dict(zip(KEYS, values))
    count = int(said["NumMarkers"])
    frame, time, *names = full(lines[3])
    assert (frame, time, len(names)) == ("Frame#", "Time", count), "IncorrectNumColumnLabels"
    assert full(lines[4])[: 3 * count] == [f"{axis}{m}" for m in range(1, count + 1) for axis in "XYZ"], lines[4]
    rows = [line for line in lines[5:] if full(line)]
    assert all(len(row) == len(full(row)) == 3 * count + 2 for row in rows), "RowLengthMismatch"
    return said, names, [[float(cell) for cell in row[1:]] for row in rows]


def by_pose2sim(text):
    """Names and rows of numbers: every third cell behind the second, and the columns behind the header's five lines."""
    lines = text.split("\n")
    names = [cell.strip() for cell in lines[3].split("\t")[2::3] if cell.strip()]
    rows = [line.split("\t") for line in lines[5:] if line]
    return names, [[float(cell) for cell in row[1:]] for row in rows]


def trc_rows(held, exports):
    text = (exports / "ply/animate/motion.trc").read_text()
    joints = {f"{name}@{frame}": place for frame in held.shown for name, place in held.joints(frame).items()}
    read = f"{len(held.motion['joint_names'])} markers, {held.frames()}, times"

    def row(program, names, rows):
        assert len(rows) == len(held.ids), len(rows)
        found = {f"{name}@{f}": rows[f][1 + 3 * m : 4 + 3 * m] for f in held.shown for m, name in enumerate(names)}
        late = max(abs(rows[f][0] - f / held.fps) for f in held.shown)
        assert late < 1e-6, late
        return Row(program, read, 1000 * largest(found, joints), "mm", 0.001)

    def opensim():
        said, names, rows = by_opensim(text)
        assert said["Units"] == "m" and abs(float(said["DataRate"]) - held.fps) < 1e-6, said
        assert int(said["NumFrames"]) == len(rows), said
        return row("OpenSim 4.5, its reader's rules", names, rows)

    def pose2sim():
        return row("Pose2Sim 0.10, its reader's rules", *by_pose2sim(text))

    return [opensim, pose2sim]
