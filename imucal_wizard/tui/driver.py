"""The terminal's driver: the terminal is left as it was found, however the program is stopped.

Textual restores the terminal when its app ends. This driver adds what happens from outside: a stop
and its continuation (Ctrl-Z, SIGSTOP), an end that comes before the app has closed, and a terminal
that is gone.
"""

import os
import select
import signal
import termios
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import IO, Any, cast

from textual.drivers.linux_driver import LinuxDriver

_LEFT = (
    "\x1b[?2026l\x1b[?2004l\x1b[?7h\x1b[?2048l"  # frames, bracketed paste, line wrap, size reports
    "\x1b[?1000l\x1b[?1003l\x1b[?1015l\x1b[?1006l\x1b[?1016l"  # mouse
    "\x1b[<u\x1b[?1049l\x1b[?25h\x1b[?1004l"  # keyboard protocol, alternate screen, cursor, focus
)
"""The sequences that leave everything that Textual enters."""
_PIXELS_OFF = "\x1b[?1016l"
"""Mouse positions in cells again, which Textual does not restore."""
_HANGUP_CHECK_MS = 200
"""Milliseconds after which a driver that was stopped ends its watch over the terminal."""


class _Output:
    """The terminal's output; what can no longer be written is dropped.

    Textual's writing thread ends at the first error, and then the app waits for it for ever.
    """

    def __init__(self, file: IO[str]) -> None:
        self._file = file

    def write(self, text: str) -> None:
        """Write text, if the terminal is there."""
        with suppress(OSError):
            self._file.write(text)

    def flush(self) -> None:
        """Send it, if the terminal is there."""
        with suppress(OSError):
            self._file.flush()

    def fileno(self) -> int:
        """Number of the file."""
        return self._file.fileno()


class TerminalDriver(LinuxDriver):
    """Textual's driver for Linux and macOS, which also survives stops and a lost terminal."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        output = cast("IO[str]", self._file)
        self._output_number = output.fileno()
        self._file = cast("Any", _Output(output))
        self._drawing = False
        """The app has the terminal."""
        self._handling = False
        """The process is being stopped or continued."""

    def start_application_mode(self) -> None:
        """Take the terminal, and watch whether it is still there."""
        super().start_application_mode()  # type: ignore[no-untyped-call]
        self._drawing = self._key_thread is not None and self._key_thread.is_alive()
        if self._drawing:
            threading.Thread(target=self._watch, name="terminal", daemon=True).start()

    def stop_application_mode(self) -> None:
        """Give the terminal back."""
        self._drawing = False
        self.write(_PIXELS_OFF)
        super().stop_application_mode()

    def leave_at_once(self) -> None:
        """Give the terminal back without the app, which does not answer; nothing waits for it."""
        if not self._drawing:
            return
        with suppress(OSError, termios.error):
            if self.attrs_before is not None:
                termios.tcsetattr(self.fileno, termios.TCSANOW, self.attrs_before)
            termios.tcflush(self.fileno, termios.TCIOFLUSH)
            os.set_blocking(self._output_number, False)
            try:
                os.write(self._output_number, _LEFT.encode())
            finally:
                os.set_blocking(self._output_number, True)  # the shell has the same terminal

    def _sigtstp_application(self, *_: object) -> None:
        self._in_loop(self._stop_job)

    def _sigcont_application(self, *_: object) -> None:
        if not self._handling:
            self._in_loop(self._draw_again)

    def _in_loop(self, handle: Callable[[], None]) -> None:
        """Handle a signal between two tasks of the app.

        The signal has interrupted anything, also the app while it holds the lock of the output, for
        which a handler that writes would wait for ever. Without the app, the terminal is untaken.
        """
        loop = self._app._loop
        if loop is not None:
            with suppress(RuntimeError):  # the loop has been closed
                loop.call_soon_threadsafe(handle)

    def _stop_job(self) -> None:
        """Stop as a shell expects it: with its terminal as before, until it continues the job.

        Where no shell could continue the process, the system ignores the stop.
        """
        if not self._drawing:
            return
        self._handling = True
        self.suspend_application_mode()
        signal.signal(signal.SIGTSTP, signal.SIG_DFL)
        signal.pthread_kill(threading.get_ident(), signal.SIGTSTP)
        signal.signal(signal.SIGTSTP, self._sigtstp_application)
        self._come_back()

    def _draw_again(self) -> None:
        """Take the terminal again after SIGSTOP, which left no time to give it back."""
        if not self._drawing:
            return
        self._handling = True
        self.suspend_application_mode()  # also restores the settings from before the app
        self._come_back()

    def _come_back(self) -> None:
        """Take the terminal again; a job that was continued in the background waits for it."""
        while not self._drawing and os.isatty(self.fileno):
            self.resume_application_mode()
        self._handling = False
        self._app.refresh(layout=True)

    def _watch(self) -> None:
        """The thread: send a hang-up to the program when its terminal is gone."""
        poll = select.poll()
        poll.register(self.fileno, 0)  # only errors and the hang-up
        thread = self._key_thread
        while self._drawing and self._key_thread is thread:
            if poll.poll(_HANGUP_CHECK_MS):
                os.kill(os.getpid(), signal.SIGHUP)
                return

    def _run_input_thread(self) -> None:
        """Read the keys until the app ends or the terminal is gone."""
        try:
            self.run_input_thread()
        except OSError:
            os.kill(os.getpid(), signal.SIGHUP)
        except Exception as error:  # noqa: BLE001 - a fault is reported by the app
            fault = error
            self._app.call_later(lambda: self._app._handle_exception(fault))
