"""How the app behaves, apart from what is measured."""

from dataclasses import dataclass

FRAMES_PER_SECOND = 20.0
"""How often the screen asks for a snapshot."""


@dataclass(frozen=True)
class Settings:
    """Choices made on the command line.

    Attributes:
        auto: the virtual hand does the work and every choice is made by itself.
        quit_after: leave as soon as the result is saved.
        muted: start without sounds.
        countdown: seconds the result is shown before the validation begins by itself.
        header_patience: seconds a header is waited for before the operator is asked what the
            columns are: a device that was opened in the middle of its stream prints the next one
            within five.
        predict: the bench tells nothing before a guess when it is opened first.
    """

    auto: bool = False
    quit_after: bool = False
    muted: bool = False
    countdown: float = 20.0
    header_patience: float = 6.0
    predict: bool = False
