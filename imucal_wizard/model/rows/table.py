"""The residual table of a fit: every row with its error, its noise, its labels and its derivatives.

Everything that is asked about a fit (which effect is missing, what is disturbed, what a picture
shows) is asked of this table. With small changes ``d`` of the fitted parameters and ``s`` of the
sizes of a new effect, the residual becomes ``residual + columns·d + design_columns·s``.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.core.readings import BoolArray, FloatArray, IntArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.model.rows.decorrelation import Decorrelation
from imucal_wizard.model.rows.source import Rows, RowSource
from imucal_wizard.model.terms import Term


@dataclass(frozen=True, eq=False)
class ResidualTable:
    """n rows at the end of a fit; errors in the unit of each row.

    Attributes:
        sources: the kinds of rows, in the order in which their rows follow one another.
        at: the rows of each source at the calibration that was found.
        residual: error that the fit minimises, shape (n,).
        reported: error with the reference taken as it is, shape (n,).
        held_out: the same without the row's group, shape (n,); None where the others do not
            determine the model.
        columns: derivative of the residual by the fitted parameters, shape (n, p).
        names: of these parameters.
        prior: inverse covariance of these parameters by all but these rows, shape (p, p).
        variance: of each independent row as the fit found it, shape (n,).
        own: variance of each independent row by measured noise alone, shape (n,).
        independent: how independent rows come from these.
        settings: how many settings of effects the data chose.
    """

    sources: tuple[RowSource, ...]
    at: tuple[Rows, ...]
    residual: FloatArray
    reported: FloatArray
    held_out: FloatArray | None
    columns: FloatArray
    names: tuple[str, ...]
    prior: FloatArray
    variance: FloatArray
    own: FloatArray
    independent: Decorrelation
    settings: int = 0

    def __len__(self) -> int:
        return len(self.residual)

    @property
    def sigma(self) -> FloatArray:
        """Standard deviation of each row as the fit found it."""
        return np.sqrt(self.independent.diagonal(self.variance))

    @property
    def floor(self) -> FloatArray:
        """Standard deviation of each row by measured noise alone, where all of it is measured."""
        return np.sqrt(self.independent.diagonal(self.noise))

    @property
    def slow(self) -> FloatArray:
        """Variance of each row by slow noise that long holds show, a part of ``floor`` squared."""
        return np.concatenate([one.slow for one in self.at])

    @property
    def not_shown(self) -> FloatArray:
        """Variance of each row by effects that readings do not show, a part of ``floor`` squared.

        An effect of the hold before does not show in the first hold.
        """
        return np.concatenate([one.not_shown for one in self.at])

    def whitened(self, columns: FloatArray) -> FloatArray:
        """Rows made independent and of variance one by the noise of ``floor``, shape (n, …).

        Each stays as near to what it is as independent rows can be.
        """
        return self.independent.scaled(self.noise**-0.5, columns)

    @property
    def noise(self) -> FloatArray:
        """Variance of each independent row by measured noise, where all of it is measured."""
        measured = np.repeat([one.noise_is_measured for one in self.sources], self._counts)
        return np.where(measured, self.own, self.variance)

    @property
    def kind(self) -> NDArray[np.str_]:
        """What each row measures, see ``RowSource``."""
        return np.repeat([one.kind for one in self.sources], self._counts)

    @property
    def unit(self) -> NDArray[np.str_]:
        """Of each row's error."""
        return np.repeat([one.unit for one in self.sources], self._counts)

    @property
    def moving(self) -> BoolArray:
        """Whether a row was measured while the device rotated, against a reference."""
        return np.repeat([one.moving for one in self.sources], self._counts)

    @property
    def judged(self) -> BoolArray:
        """Whether a row's error is part of the errors that are reported for the sensor."""
        return np.repeat([one.judged for one in self.sources], self._counts)

    @property
    def needs_reference(self) -> BoolArray:
        """Whether a row rests on gravity as the accelerometer's model sees it."""
        return np.repeat([one.needs_reference for one in self.sources], self._counts)

    @property
    def repeats_are_noise(self) -> BoolArray:
        """Whether rows of one pose differ by noise alone."""
        return np.repeat([one.repeats_are_noise for one in self.sources], self._counts)

    @property
    def indifferent(self) -> BoolArray:
        """Rows that speak for and against no model, see ``RowSource``."""
        return np.concatenate([one.indifferent for one in self.sources])

    @property
    def index(self) -> IntArray:
        """Which hold, rotation or group of samples each row is of, by its own number."""
        return np.concatenate([one.labels.index for one in self.sources])

    @property
    def item(self) -> IntArray:
        """The same, unique in the table: hold 7 is not rotation 7."""
        words = [one.item_word for one in self.sources]
        return _unique([one.labels.index for one in self.sources], words)

    @property
    def axis(self) -> IntArray:
        """Which component of its quantity each row is; −1 where there is one only."""
        return np.concatenate([one.labels.axis for one in self.sources])

    @property
    def visit(self) -> IntArray:
        """Number of the rest that a row is a piece of; −1 for rotations. Unique in the table."""
        return numbered([one.labels.visit for one in self.sources])

    @property
    def group(self) -> IntArray:
        """What is left out together; −1 for rows that always stay. Unique in the table."""
        return groups_of(self.sources)

    @property
    def pose(self) -> IntArray:
        """Which rows repeat one another, −1 for those that repeat nothing. Unique in the table."""
        return numbered([one.poses for one in self.sources])

    @property
    def time(self) -> FloatArray:
        """Of each row, s since the session's first sample."""
        return np.concatenate([one.labels.time for one in self.sources])

    @property
    def span(self) -> FloatArray:
        """Beginning and end of each row in the recording's time, s, shape (n, 2)."""
        return np.concatenate([one.labels.span for one in self.sources])

    @property
    def direction(self) -> FloatArray:
        """Up (of a magnetometer: the field) as each row sees it, NaN in motion, shape (n, 3)."""
        return np.concatenate([one.direction for one in self.at])

    @property
    def lever(self) -> FloatArray:
        """How far each row moves with an error of the input on each axis, shape (n, 3)."""
        return np.concatenate([one.lever for one in self.at])

    def spoilt(self, items: Sequence[int]) -> BoolArray:
        """Rows that say nothing where these holds and rotations are disturbed, shape (n,).

        Their own, and those of the rotations that begin or end in one of these holds.
        """
        return np.isin(self.item, items) | self.joins(items).any(axis=(0, 2))

    def tilted(self, items: Sequence[int]) -> FloatArray:
        """How the rows move with up as it is measured in holds, k items.

        Returns:
            Along two components, rad, shape (k, n, 2).
        """
        each = np.concatenate([one.tilts for one in self.at]).reshape(-1, 2, 2)
        return np.asarray(np.einsum("kne,nec->knc", self.joins(items).astype(float), each))

    def joins(self, items: Sequence[int]) -> BoolArray:
        """Whether the hold before and the hold after each row's rotation is each of k items.

        Returns:
            Shape (k, n, 2).
        """
        row = (self.item == np.reshape(items, (-1, 1))).argmax(axis=1)
        joined = np.concatenate([one.joined for one in self.sources])
        own = joined == self.index[row][:, None, None]
        return np.asarray(own & ~self.moving[row][:, None, None])

    def design_columns(self, terms: Sequence[Term]) -> FloatArray:
        """Derivative of the residual by the sizes of effects in turn, per shown unit, (n, p)."""
        return np.concatenate([one.design_columns(terms) for one in self.at])

    def place(self, row: int) -> str:
        """What a row is, in words."""
        source, own = self.source_of(row)
        return source.place(own)

    def first_row(self, item: int) -> int:
        """The first row of a hold, rotation or group of samples."""
        return int(np.flatnonzero(self.item == item)[0])

    def source_of(self, row: int) -> tuple[RowSource, int]:
        """The kind of a row, and its number there."""
        for source, count in zip(self.sources, self._counts, strict=True):
            if row < count:
                return source, row
            row -= count
        raise IndexError(row)

    @property
    def _counts(self) -> list[int]:
        return [len(one.residual) for one in self.at]


def groups_of(sources: Sequence[RowSource]) -> IntArray:
    """What is left out together, over all sources: the same number under the same word."""
    return _unique([one.labels.group for one in sources], [one.group_word for one in sources])


def _unique(parts: Sequence[IntArray], words: Sequence[str]) -> IntArray:
    """Numbers of several sources, unique over all that count under different words; −1 stays."""
    found, distinct = np.concatenate(parts), list(dict.fromkeys(words))
    place = np.repeat([distinct.index(one) for one in words], [len(one) for one in parts])
    return np.where(found < 0, -1, found * len(distinct) + place)


def numbered(parts: Sequence[IntArray]) -> IntArray:
    """Numbers of several sources made unique over all of them; −1 stays."""
    found, first = [], 0
    for part in parts:
        found.append(np.where(part < 0, -1, part + first))
        first += int(part.max(initial=-1)) + 1
    return np.concatenate(found) if found else np.zeros(0, np.int64)
