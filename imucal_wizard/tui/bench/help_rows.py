"""Help for the bench, in plain words."""

from imucal_wizard.tui.text import Line, line, wrapped

_WORDS = (
    (
        "A calibration is a model. Here you see what the model does not explain, find the effect "
        "that does, add it, and see whether the error falls."
    ),
    (
        "1. Look: the plot shows what is left of every pose, against whatever it may depend on "
        "(tab). The dotted lines are what noise alone makes. Points that follow a curve mean that"
        " something is missing; points that scatter between the lines mean that nothing is."
    ),
    (
        "2. Choose a suspect (↑↓). The table says what the error would be with it: fitted (on the"
        " data used) and held out (on poses the fit has not seen). Only the held-out error "
        "counts: any added term lowers the fitted one. p is how often noise alone makes such a "
        "suspect."
    ),
    (
        "3. Read its lesson (l), then add it (enter). The ladder shows every model so far. Where "
        "only the fitted error fell, u takes it back."
    ),
    (
        "4. When two explanations look the same here, n says which poses would tell them apart, "
        "and m leads you through them."
    ),
)
_KEYS = (
    ("↑ ↓", "choose a suspect, or a term when the model is shown"),
    ("enter", "add the suspect; put back a part of the base that was left out"),
    ("l", "lesson: what happens in the sensor, what it looks like, what it costs"),
    ("p", "predict first: hide the answer until you have committed to a guess"),
    ("n", "the verdict in full; the poses to measure next, and what they bring"),
    ("m", "measure exactly these now; the bench opens again with your model and the new holds"),
    ("u", "undo the last change of the model"),
    ("r", "remove the chosen term (2 shows the model); the newest one otherwise"),
    ("tab", "plot against something else: force, number, time, temperature, pose before …"),
    ("v", "what the chosen suspect would explain: points on the line speak for it"),
    ("← →", "pick a point: which pose it is, what was read there"),
    ("t", "the raw trace of the point picked: every reading of that hold or turn"),
    ("a", "other part of the data: each axis measured beside the model; the gyroscope's turns"),
    ("1 2 3", "suspects, model, ladder"),
    ("e", "type an effect of your own as a formula"),
    ("g", "the next sensor"),
    ("esc", "leave the bench"),
)


def help_rows(width: int) -> list[Line]:
    """What the bench is for and what the keys do."""
    rows: list[Line] = []
    for text in _WORDS:
        rows += [*wrapped(text, width), line("")]
    for key, text in _KEYS:
        first, *rest = wrapped(text, width - 8)
        rows.append(((f"{key:<7} ", "key"), first[0]))
        rows += [((" " * 8, ""), row[0]) for row in rest]
    signs = (
        "∘ a pose   ● far outside the noise   ◆ the point picked   ▼ falls   ▲ does not fall   "
        "× what the model says   ⊗ measured and model in one place"
    )
    return [*rows, line(""), *wrapped(signs, width)]
