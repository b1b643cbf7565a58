"""Which format speaks here, from its first lines."""

from imucal_wizard.devices.formats.lines import LineCutter


class Detector:
    """Looks at lines until one format is plain. The answer depends on the lines alone."""

    def __init__(self) -> None:
        self._cutter = LineCutter()
        self.problem = ""

    def feed(self, data: bytes) -> str:
        """The name of the format; ``""`` while it is not plain."""
        return "csv" if self._cutter.feed(data) else ""
