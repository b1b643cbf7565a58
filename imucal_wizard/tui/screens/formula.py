"""An effect typed as a formula."""

from collections.abc import Collection
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Input

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.quantities import unit_sign
from imucal_wizard.model.effect import FieldUnit
from imucal_wizard.model.formula import FormulaEffect, size_of, variables_in
from imucal_wizard.tui.text import Line, line, wrapped
from imucal_wizard.tui.widgets.footer import KeyFooter
from imucal_wizard.tui.widgets.lines import Lines


class FormulaInput(Input):
    """A field for a formula."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding(
            "enter", "screen.submit", "test it", key_display="enter",
            tooltip="tests the formula as a suspect",
        )
    ]  # fmt: skip


class FormulaScreen(ModalScreen[FormulaEffect | None]):
    """Asks for a formula; the result is the effect.

    Args:
        sensor: the sensor with the effect.
        taken: names of the existing effects.
        unit: of the field.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "dismiss(None)", "back", tooltip="goes back to the bench")
    ]

    def __init__(self, sensor: str, taken: Collection[str], unit: FieldUnit) -> None:
        super().__init__()
        self._sensor = sensor
        self._taken = taken
        self._unit = unit

    def compose(self) -> ComposeResult:
        """An input field, and the variables of a formula."""
        with Vertical(classes="box guess") as box:
            box.border_title = "an effect of your own"
            yield FormulaInput(placeholder="k*a**3   or   x: k1*ay*az; y: k2*T")
            yield Lines()
        yield KeyFooter()

    def on_mount(self) -> None:
        """Show the variables."""
        self._tell("")

    def action_submit(self) -> None:
        """Read the formula, or show its error."""
        number, name = 1, "formula"
        while name in self._taken:
            number, name = number + 1, f"formula-{number + 1}"
        try:
            effect = FormulaEffect(self.query_one(Input).value, self._sensor, name, self._unit)
        except UsageError as error:
            self._tell(str(error))
            return
        self.dismiss(effect)

    def _tell(self, problem: str) -> None:
        unit = unit_sign(size_of(self._sensor, self._unit).unit)
        rows: list[Line] = wrapped(f"▲ {problem}", 70, "warn", indent="  ") if problem else []
        rows += wrapped(
            f"The error of an axis in {unit}. Other names are coefficients to be fitted. Without "
            "an axis in front, each axis has its own coefficients.", 70, "quiet",
        )  # fmt: skip
        rows += [
            ((f"  {name:<4}", "key"), (meaning, ""))
            for name, meaning in variables_in(self._unit).items()
            if name[1:] in ("", "x")
        ]  # fmt: skip
        rows.append(line("  and the same with y and z", "quiet"))
        self.query_one(Lines).show(rows)
