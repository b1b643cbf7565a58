"""What the bench has added to the models, in a row for the screens of the result."""

from imucal_wizard.bench.benches import Benches
from imucal_wizard.tui.report_rows import shown
from imucal_wizard.tui.text import Line, wrapped


def kept_rows(benches: Benches | None, width: int) -> list[Line]:
    """A row for each sensor whose model has effects; none without."""
    rows: list[Line] = []
    if benches is None:
        return rows
    for name, (model, _) in benches.models().items():
        terms = " + ".join(benches.found(name))
        unit = model.fit.unit
        errors = f"{shown(model.rms_fitted, unit)} fitted, {shown(model.rms_held_out, unit)}"
        words = f"✓ from the bench: {name} + {terms}, {errors} held out; saved with it"
        rows += wrapped(words, width, "good", indent="  ")
    return rows


def kept_models(benches: Benches | None) -> dict[str, tuple[str, ...]]:
    """The models that have effects, by sensor."""
    found = {} if benches is None else benches.models()
    return {name: model.model for name, (model, _) in found.items()}
