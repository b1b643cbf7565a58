"""The plots of the bench as text and as data."""

import textwrap
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from typing import Any

from imucal_wizard.core.quantities import finite_or_none
from imucal_wizard.diagnose.views import ResidualView
from imucal_wizard.report.plot import scatter

VIEW_COLUMNS, VIEW_ROWS = 79, 21
"""Columns and rows of a plot, for a terminal of 80×24."""
VIEW_SCHEMA = "imucal-wizard/view/1"
MAX_NEAR_NAMES = 3
"""Names that a mistyped one is answered with."""


def view_text(sensor: str, view: ResidualView) -> str:
    """A plot with its title, and what to look for in it."""
    title = view.title if view.slope is not None else f"{view.title}, {view.unit}"
    drawn = scatter(
        view.x, view.y, VIEW_COLUMNS, VIEW_ROWS, x_label=view.x_label, error=view.error,
        slope=view.slope, model=view.model, predicted=view.predicted,
    )  # fmt: skip
    head = f"{sensor.upper()}  {view.part}: {title}"
    legend = f"  {view.legend}" if view.legend else ""
    heads = [head + legend] if len(head + legend) <= VIEW_COLUMNS else [head, legend]
    return "\n".join([*heads, *drawn, "", *textwrap.wrap(view.look_for, VIEW_COLUMNS)])


def view_names(known: Mapping[str, Sequence[ResidualView]]) -> str:
    """The names of all plots, by sensor."""
    rows = []
    for sensor, views in known.items():
        names = " ".join(view.name for view in views)
        rows += [
            sensor,
            *textwrap.wrap(
                names,
                VIEW_COLUMNS,
                initial_indent="  ",
                subsequent_indent="  ",
                break_on_hyphens=False,
            ),
        ]
    return "\n".join(rows)


def no_such_view(name: str, known: Mapping[str, Sequence[ResidualView]]) -> str:
    """The answer to a name that no picture has: the nearest ones, and what kinds there are."""
    every = [f"{sensor}/{view.name}" for sensor, views in known.items() for view in views]
    short = list(dict.fromkeys(one.partition("/")[2] for one in every))
    near = get_close_matches(name, every if "/" in name else short, MAX_NEAR_NAMES)
    groups = dict.fromkeys(
        f"{sensor}: {', '.join(dict.fromkeys(_group(view.name) for view in views))}"
        for sensor, views in known.items()
    )
    meant = f"; nearest {', '.join(near)}" if near else ""
    return f"there is no view {name!r}{meant}. Views: {'; '.join(groups)}"


def _group(name: str) -> str:
    """A name with what varies replaced: ``force-AXIS``, ``model-AXIS-…``, ``suspect-TERM``."""
    first, _, rest = name.partition("-")
    if first in ("suspect", "curve"):
        return f"{first}-TERM"
    if first in ("model", "rest"):
        return f"{first}-AXIS-…"
    if first in ("heading", "dip"):
        return f"{first}-…"
    return f"{first}-AXIS" if rest else first


def view_document(chosen: Sequence[tuple[str, ResidualView]]) -> dict[str, Any]:
    """Plots as data: lists and numbers only."""
    return {
        "schema": VIEW_SCHEMA,
        "views": [{"sensor": sensor, **_data(view)} for sensor, view in chosen],
    }


def _data(view: ResidualView) -> dict[str, Any]:
    return {
        "name": view.name,
        "part": view.part,
        "title": view.title,
        "x_label": view.x_label,
        "unit": view.unit,
        "x": [finite_or_none(value) for value in view.x],
        "y": [finite_or_none(value) for value in view.y],
        "error": None if view.error is None else [finite_or_none(value) for value in view.error],
        "model": None if view.model is None else [finite_or_none(value) for value in view.model],
        "predicted": None
        if view.predicted is None
        else [finite_or_none(value) for value in view.predicted],
        "suspect": view.suspect,
        "slope": view.slope,
        "noise": view.band,
        "source": view.source.tolist(),
        "look_for": view.look_for,
    }
