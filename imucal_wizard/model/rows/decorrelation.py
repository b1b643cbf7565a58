"""Rows that share noise, turned into rows that do not.

Two rotations that join in a hold share the error of its direction. With the loadings L of the rows
on such latent errors (of variance one) the rows of one kind have the covariance
``Σ = diag(own) + L Lᵀ = Q Λ Qᵀ``; the rows ``Qᵀ r`` have the variances Λ and are independent. What
a variance component adds to all rows alike, ``Σ + e I``, is added to Λ: Q stays as it is.

Where only neighbours in time share noise, long sessions are cut into pieces, so that the cost grows
with the number of rows; a latent error on a cut counts as two. Rows that share an error of the
whole session, as slow noise and rounding make it, stay together.
"""

import itertools
from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.readings import BoolArray, FloatArray, IntArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.model.rows.source import Rows, RowSource

MAX_PIECE = 120
"""Rows of a piece: sixty rotations. One hold in sixty is cut, which costs less than 1 % of the
information in the shared noise."""
MAX_WHOLE = 1000
"""Rows of a piece where a latent error reaches over more than ``MAX_PIECE`` of them: so many cost
a fifth of a second. More are cut, and standard errors are then too large."""


@dataclass(frozen=True, eq=False)
class Decorrelation:
    """The orthogonal change of rows that makes them independent.

    Attributes:
        pieces: rows that are mixed, (m,), their Q, (m, m), and Λ, (m,); other rows stay as they
            are.
    """

    pieces: tuple[tuple[IntArray, FloatArray, FloatArray], ...] = ()

    def own(self, own: FloatArray) -> FloatArray:
        """Variance of independent rows from what the measured ones share with no other, (n,)."""
        out = own.copy()
        for rows, _, values in self.pieces:
            out[rows] = values
        return out

    def rows(self, values: FloatArray) -> FloatArray:
        """Independent rows from those measured, ``Qᵀ x``, shape (n,) or (n, k)."""
        if not self.pieces:
            return values
        out = values.copy()
        for rows, mixed, _ in self.pieces:
            out[rows] = mixed.T @ values[rows]
        return out

    def measured(self, values: FloatArray) -> FloatArray:
        """The rows as they are measured from independent ones, ``Q x``, shape (n,) or (n, k)."""
        if not self.pieces:
            return values
        out = values.copy()
        for rows, mixed, _ in self.pieces:
            out[rows] = mixed @ values[rows]
        return out

    def diagonal(self, values: FloatArray) -> FloatArray:
        """Diagonal of ``Q diag(x) Qᵀ``: variance of each measured row, shape (n,)."""
        out = values.copy()
        for rows, mixed, _ in self.pieces:
            out[rows] = mixed**2 @ values[rows]
        return out

    def combined(
        self, values: FloatArray, part: FloatArray, residual: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Combinations of rows that stay independent if a part of their variance is another.

        Args:
            values: variance x of each independent row, shape (n,).
            part: of the variance of each measured row, which it shares with no other, shape (n,).
            residual: of each independent row, shape (n,).

        Returns:
            Square of each combination over its variance, and which share of that is of the part,
            shape (n,) each.
        """
        squares, shares = residual**2 / values, part / values
        for rows, mixed, _ in self.pieces:
            whitened = mixed / np.sqrt(values[rows])
            shares[rows], turned = np.linalg.eigh((whitened.T * part[rows]) @ whitened)
            squares[rows] = (turned.T @ (residual[rows] / np.sqrt(values[rows]))) ** 2
        return squares, np.clip(shares, 0.0, 1.0)

    def blocks(self, values: FloatArray, groups: IntArray) -> FloatArray:
        """The parts of ``Q diag(x) Qᵀ`` that belong to groups of rows.

        Args:
            values: x, shape (n,).
            groups: rows of each group, shape (g, s).

        Returns:
            Shape (g, s, s).
        """
        size = groups.shape[1]
        out = values[groups][:, :, None] * np.eye(size)
        if not self.pieces:
            return np.asarray(out)
        piece, place = np.full(len(values), -1), np.zeros(len(values), np.int64)
        for k, (rows, *_) in enumerate(self.pieces):
            piece[rows], place[rows] = k, np.arange(len(rows))
        for k, (rows, mixed, _) in enumerate(self.pieces):
            own = piece[groups] == k
            whole = (mixed * values[rows]) @ mixed.T
            at = np.where(own, place[groups], 0)
            both = own[:, :, None] & own[:, None, :]
            out = np.where(both, whole[at[:, :, None], at[:, None, :]], out)
        return np.asarray(out)

    def weighted(
        self, columns: FloatArray, variance: FloatArray, chosen: BoolArray | None = None
    ) -> FloatArray:
        """``Σ⁻¹ X`` over some of the measured rows alone, shape (k, …).

        Args:
            columns: X of these rows, shape (k, …).
            variance: of all independent rows, shape (n,).
            chosen: which of the measured rows they are, shape (n,); None for all.
        """
        every = np.ones(len(variance), bool) if chosen is None else chosen
        shape = (-1, *(1,) * (columns.ndim - 1))
        out = columns / variance[every].reshape(shape)
        place = np.cumsum(every) - 1
        for rows, mixed, _ in self.pieces:
            kept = every[rows]
            if kept.any():
                whole = (mixed[kept] * variance[rows]) @ mixed[kept].T
                at = place[rows[kept]]
                out[at] = np.linalg.solve(whole, columns[at])
        return np.asarray(out)

    def scaled(self, values: FloatArray, columns: FloatArray) -> FloatArray:
        """``Q diag(x) Qᵀ`` times columns, shape (n,) or (n, k).

        With x = Λ^(−1/2) it whitens rows in the way that keeps them nearest to what they are.
        """
        mixed = self.rows(columns)
        return self.measured(mixed * values.reshape(-1, *(1,) * (mixed.ndim - 1)))


def decorrelation(sources: Sequence[RowSource], rows: Sequence[Rows]) -> Decorrelation:
    """The independent rows of these sources."""
    pieces, first = [], 0
    for source, one in zip(sources, rows, strict=True):
        loading = one.loading()
        if loading is not None:
            order = np.argsort(source.labels.time, kind="stable")
            far = _reach(loading.latent[order]) > MAX_PIECE
            count = -(-len(order) // (MAX_WHOLE if far else MAX_PIECE))
            # both rows of a rotation stay together
            borders = 2 * (np.linspace(0, len(order), count + 1).astype(int) // 2)
            borders[-1] = len(order)
            for begin, end in itertools.pairwise(borders.tolist()):
                part = order[begin:end]
                latent, weight = loading.latent[part], loading.weight[part]
                known, column = np.unique(latent, return_inverse=True)
                table = np.zeros((len(part), len(known)))
                lines = np.arange(len(part))[:, None]
                np.add.at(table, (lines, column.reshape(latent.shape)), weight)
                values, mixed = np.linalg.eigh(np.diag(one.own[part]) + table @ table.T)
                pieces.append((first + part, mixed, np.maximum(values, one.own[part].min())))
        first += len(one.own)
    return Decorrelation(tuple(pieces))


def _reach(latent: IntArray) -> int:
    """Over how many rows the farthest latent error reaches; numbers of them in order, (n, k)."""
    row = np.repeat(np.arange(len(latent)), latent.shape[1])
    first = np.full(int(latent.max(initial=0)) + 1, len(latent))
    last = np.zeros(len(first), np.int64)
    np.minimum.at(first, latent.ravel(), row)
    np.maximum.at(last, latent.ravel(), row)
    return int((last - first).max()) + 1
