"""Lock-step: each word of the wizard is acted on a fixed number of samples after what it is about.

The device makes no sample beyond the newest word's reaction time. So the hand moves at the same
samples whatever the speed of the playback, the load of the machine, or the pieces in which the
samples arrive; only a wizard that falls silent altogether is left behind.
"""

from collections import deque

from imucal_wizard.devices.virtual.asks import StatusLike

STANDING = ("source", "result", "save")
"""Steps in which nobody moves the device; the device waits until the wizard is in another."""


class Words:
    """What the wizard has said and the hand has not acted on yet.

    Args:
        reaction: from the sample a word is about to the sample at which the hand acts.
        preview: samples made before the first word, for a reader to see what they are.

    Attributes:
        horizon: no sample from this index on is made before the wizard is heard again; None: any.
    """

    def __init__(self, reaction: int, preview: int) -> None:
        self._reaction = reaction
        self._preview = preview
        self._waiting: deque[tuple[int, StatusLike]] = deque()
        self._step = STANDING[0]
        self._heard = False
        self.horizon: int | None = None

    def listen(self) -> None:
        """Wait for the first word from now on."""
        self._heard, self.horizon = False, self._preview

    def forget(self) -> None:
        """Wait for nothing, until the wizard speaks again."""
        self._waiting.clear()
        self.horizon = None

    def hear(self, status: StatusLike, samples: int) -> None:
        """Take a word.

        Args:
            status: what the wizard says.
            samples: how many samples it has judged when it says so.
        """
        if self._waiting and self._waiting[-1][0] == samples:
            self._waiting.pop()
        self._waiting.append((samples, status))
        if self.horizon is None or status.step not in STANDING or status.step != self._step:
            self.horizon = samples + self._reaction
        self._step, self._heard = status.step, True

    @property
    def halting(self) -> bool:
        """Whether the wizard asks nothing of the hand now, as far as is known."""
        return self.horizon is not None and self._step in STANDING

    @property
    def standing(self) -> bool:
        """The same, and the wizard has said so itself: there is no reason to doubt it is there."""
        return self._heard and self.halting

    def before(self, sample: int) -> int | None:
        """How many samples there are from this one until a word is due; None without one."""
        return self._waiting[0][0] + self._reaction - sample if self._waiting else None

    def take(self, sample: int) -> tuple[int, StatusLike] | None:
        """The oldest word that is due at this sample, with what it is about; None without one."""
        due = self.before(sample)
        return self._waiting.popleft() if due is not None and due <= 0 else None
