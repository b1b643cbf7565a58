"""The look for garbage is short while samples come."""

import subprocess
import sys
from dataclasses import replace

from imucal_wizard.tui.app import WizardApp
from tests.tui import fakes
from tests.tui.waiting import until


def test_what_is_loaded_is_not_looked_through_again() -> None:
    """In a process of its own, because it lasts: few objects are left to look at."""
    lines = (
        "import gc, textual.app",
        "before = len(gc.get_objects())",
        "from imucal_wizard.tui.options import WizardOptions",
        "from imucal_wizard.tui.services import WizardServices",
        "WizardServices(WizardOptions()).loaded()",
        "assert len(gc.get_objects()) < before / 20, len(gc.get_objects())",
        "assert gc.isenabled()",
    )
    subprocess.run([sys.executable, "-c", "\n".join(lines)], check=True)


async def test_the_app_says_once_that_everything_is_loaded() -> None:
    """When the screens that need numpy have been imported behind the first one."""
    loads: list[bool] = []
    services = replace(fakes.services(fakes.FakeSource()), loaded=lambda: loads.append(True))
    async with WizardApp(services).run_test() as pilot:
        await until(pilot, lambda: bool(loads))
    assert loads == [True]
