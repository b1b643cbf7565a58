"""The sheet for the desk: ``python -m assets.drawing.poses`` writes ``assets/poses/``.

Everything on it comes from the program: the poses and their directions, the poses in which
rotations begin, how many, how large and how fast they should be.
"""

from pathlib import Path

from assets.drawing.figures import device_figure, pose_figure, rotation_figure
from assets.drawing.svg import QUIET, document, moved, text
from imucal_wizard.core.limits.procedure import FAST_RATE, FULL_ANGLE_DEG, SLOW_RATE
from imucal_wizard.core.poses import (
    AXES,
    CORNERS,
    EDGES,
    EIGHT_TILTS,
    FACES,
    POSE_TOLERANCE_DEG,
    START_POSES,
)
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.guide.plan import standard
from imucal_wizard.guide.wording import label

FOLDER = Path(__file__).resolve().parents[1] / "poses"
WIDTH, HEIGHT, MARGIN = 210.0, 297.0, 11.0
"""A4, upright, mm."""
ROW = 37.0


def main() -> None:
    """Write the drawings."""
    FOLDER.mkdir(exist_ok=True)
    for name, content in drawings().items():
        (FOLDER / name).write_text(content, encoding="utf-8")
        print(f"written: {FOLDER / name}")


def drawings() -> dict[str, str]:
    """Each file's name and text."""
    return {
        "sheet.svg": document(WIDTH, HEIGHT, sheet()),
        "eighteen.svg": document(WIDTH, 3 * ROW + 6.0, rows([*FACES, *EDGES], 5.0)),
        "eight.svg": document(WIDTH, 2 * ROW + 6.0, rows(list(EIGHT_TILTS), 5.0, columns=4)),
        "rotations.svg": document(WIDTH, 52.0, turns(4.0)),
    }


def sheet() -> list[str]:
    """The whole sheet for a technician's desk."""
    return [
        text((MARGIN, 18.0), "Poses and rotations", 8.0, font_weight="bold"),
        *lines(27.0, _opening()),
        moved(device_figure(6.6), (180.0, 26.0)),
        *heading(51.0, "6 faces", "up/down, and again among the 18 poses"),
        *rows(list(FACES), 53.0),
        *heading(96.0, "12 edges", "with the 6 faces they are the 18 poses"),
        *rows(list(EDGES), 98.0),
        *heading(178.0, "8 corners", "with them 26 poses, for a name to what a model lacks"),
        *rows(list(CORNERS), 179.5, columns=8, size=5.0),
        *heading(215.0, "Rotations", "by hand, from rest to rest; the axis stays level"),
        *turns(217.0),
        *lines(273.0, _ending()),
    ]


def _opening() -> list[str]:
    return [
        "What is named is up (yellow): a face, an edge or a corner. Gravity g points down.",
        f"Any order; {POSE_TOLERANCE_DEG:.0f}° off is as good. Hold it still until it sounds.",
        "The faces are named after the axes that are printed on the board.",
        "Below each name: what x, y, z read at rest, in g.",
    ]


def _ending() -> list[str]:
    step = standard().step(StepKind.ROTATIONS)
    rest, times = f"hold still for {step.seconds:.0f} s", f"{step.per_axis} times about each axis"
    turn = f"turn by {step.minimum_deg:.0f}° to {FULL_ANGLE_DEG:.0f}°, stop anywhere"
    speeds = f"slow (up to {SLOW_RATE:.0f} °/s), middle, and fast ({FAST_RATE:.0f} °/s or more)"
    return [
        f"{rest.capitalize()}, {turn}, {rest}: {times}.",
        f"In both senses and at three speeds: {speeds}.",
        "Left is counter-clockwise for an eye at which the axis points: a positive rate.",
    ]


def heading(y: float, title: str, words: str) -> list[str]:
    """A heading with a few words behind it."""
    return [
        text((MARGIN, y), title, 5.0, font_weight="bold"),
        text((MARGIN + 34.0, y), words, 3.5, fill=QUIET),
    ]


def lines(y: float, words: list[str]) -> list[str]:
    """Lines of text."""
    return [text((MARGIN, y + 5.0 * index), line, 3.5) for index, line in enumerate(words)]


def rows(names: list[str], top: float, columns: int = 6, size: float = 6.4) -> list[str]:
    """Poses in rows from left to right."""
    pitch = (WIDTH - 2 * MARGIN) / columns
    drawn = []
    for index, name in enumerate(names):
        row, column = divmod(index, columns)
        place = MARGIN + (column + 0.5) * pitch, top + row * ROW + 2.0 * size
        drawn.append(moved(pose_figure(name, size), place))
    return drawn


def turns(top: float) -> list[str]:
    """The three rotations side by side."""
    drawn: list[str] = []
    pitch = (WIDTH - 2 * MARGIN) / len(AXES)
    for index, axis in enumerate(AXES):
        x = MARGIN + (index + 0.5) * pitch
        words = f"about {axis}: begin with {label(START_POSES[axis])} up"
        drawn.append(moved(rotation_figure(axis, 8.6), (x - 4.0, top + 19.0)))
        drawn.append(text((x, top + 46.0), words, 3.8, text_anchor="middle", font_weight="bold"))
    return drawn


if __name__ == "__main__":
    main()
