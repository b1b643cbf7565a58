"""Short looks for garbage: while Python looks, no thread fetches a byte.

A full look through everything that a Textual app has loaded takes 50 to 200 ms. A terminal's buffer
holds 20 to 40 ms of 2,000 samples a second, so each such look would cost samples.
"""

import gc

_OFTEN = 2
"""Old objects are looked through after so many looks at the young ones: often, hence briefly."""


def look_briefly() -> None:
    """Take what is loaded by now, and stays for good, out of the collector's sight."""
    gc.freeze()
    gc.collect()  # from here on it reckons with what little is left
    gc.set_threshold(*gc.get_threshold()[:2], _OFTEN)
