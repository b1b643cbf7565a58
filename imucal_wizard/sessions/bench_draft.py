"""The models that were built on the bench, for when it is opened again.

They are written whenever they change, so that a program that ends without a question (a signal, a
crash, a loss of power) has them when the bench of the same recording is opened again. A session is
resumed with the models that its calibration file has.
"""

import hashlib
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

import msgspec

from imucal_wizard.acquire.files import is_session
from imucal_wizard.core.dates import date_text
from imucal_wizard.core.errors import ImucalError
from imucal_wizard.core.output import encode_json, write_atomically
from imucal_wizard.diagnose.bench import ModelChange
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.model.formula import FormulaEffect


class _BuiltModel(msgspec.Struct, frozen=True):
    """The changes of one sensor's model, and the formulas that its effects were typed as."""

    changes: tuple[ModelChange, ...]
    formulas: dict[str, str]


class _Draft(msgspec.Struct, frozen=True):
    """The content of the file.

    Attributes:
        written: seconds since 1970.
        models: the present models, by sensor.
        saved: the models that a calibration file has; None if none has any.
        file: this file.
    """

    written: float
    models: dict[str, _BuiltModel]
    saved: dict[str, _BuiltModel] | None = None
    file: str = ""


class BenchDraft:
    """A file with the models of the benches of one recording.

    Args:
        recorded: the recording, or one session. What was measured identifies it, not its name.

    Attributes:
        in_file: a calibration file has the models that were restored.
    """

    def __init__(self, recorded: Sequence[Path]) -> None:
        self._path = _place_of(recorded)
        self._problem = "what was measured can be read only once" if recorded else ""
        self._own = b""
        self.in_file = False
        self._session = len(recorded) == 1 and is_session(recorded[0])
        self._saved: dict[str, _BuiltModel] | None = None
        self._file = ""

    def write(self, benches: Benches, since: Mapping[str, Sequence[str]]) -> str:
        """Write the present models; those that are in another file are left to that.

        Args:
            benches: their benches.
            since: the models that are in a file, by sensor.

        Returns:
            Why they cannot be written, or "".
        """
        if not benches.changed(since):
            self.give_up()
            return ""
        return self._write(_built(benches))

    def saved(self, benches: Benches, file: Path) -> None:
        """Note that a file has the present models: a session is resumed with them."""
        self._saved, self._file = None, ""
        if self._session and benches.changed({}):
            self._saved, self._file = _built(benches), str(file.absolute())
        self.give_up()

    def _write(self, models: dict[str, _BuiltModel]) -> str:
        if self._path is None:
            return self._problem
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            written = encode_json(_Draft(time.time(), models, self._saved, self._file))
            write_atomically(self._path, written)
        except (ImucalError, OSError) as error:
            return str(error)
        self._own = written
        return ""

    def restore(self, benches: Benches) -> str:
        """Give the benches the models that were left in the file.

        Returns:
            What was restored and what could not be; "" for nothing.
        """
        self.in_file = False
        try:
            self._own = b"" if self._path is None else self._path.read_bytes()
            found = msgspec.json.decode(self._own, type=_Draft)
            if found.saved is not None and Path(found.file).is_file():
                self._saved, self._file = found.saved, found.file
            before, lacking = benches.models, []
            for sensor in (one for one in benches.sensors if one in found.models):
                built, bench = found.models[sensor], benches.bench(sensor)
                if bench is None or not built.changes:
                    continue
                own = [FormulaEffect(text, sensor, name) for name, text in built.formulas.items()]
                bench.retrace(built.changes, own)
                wanted = [name for name, _ in built.changes[-1].terms]
                lacking += [f"{sensor} {one}" for one in wanted if one not in bench.fit.model]
        except (ImucalError, OSError, ValueError, OverflowError):  # a damaged file, other data
            return ""
        changes = "; ".join(benches.changed(before))
        if lacking:
            changes = f"{changes or 'nothing'}; not restored: {', '.join(lacking)}"
        self.in_file = not lacking and found.models == self._saved
        where = f"in {self._file}" if self.in_file else "in no file"
        return f"{changes} ({date_text(found.written)}, {where})" if changes else ""

    def give_up(self) -> None:
        """Keep only the models that a file has; what another program has written stays."""
        if self._saved is not None:
            self._write(self._saved)
            return
        with suppress(OSError):
            if self._path is not None and self._own and self._path.read_bytes() == self._own:
                self._path.unlink()


def _built(benches: Benches) -> dict[str, _BuiltModel]:
    return {
        name: _BuiltModel(
            bench.changes,
            {one.name: one.equation for one in bench.catalogue if isinstance(one, FormulaEffect)},
        )
        for name, bench in benches.opened.items()
    }


def _place_of(recorded: Sequence[Path]) -> Path | None:
    from platformdirs import user_data_path

    from imucal_wizard.acquire.files.session_salvage import fingerprint
    from imucal_wizard.sessions.session_list import session_info

    if not recorded or not all(path.is_file() for path in recorded):
        return None
    try:
        if len(recorded) == 1 and is_session(recorded[0]):
            measured = f"session of {session_info(recorded[0]).created!r}"
        else:
            measured = fingerprint(recorded)
    except ImucalError:
        return None
    name = hashlib.sha256(measured.encode()).hexdigest()[:32]
    return user_data_path("imucal-wizard", appauthor=False) / "models" / f"{name}.json"
