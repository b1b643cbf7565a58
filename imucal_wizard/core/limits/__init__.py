"""Named limits by topic: one module per topic, one definition per limit.

A limit is named by what it limits, with its unit in the docstring and the reason for its value::

    MIN_SAMPLES_PER_DIRECTION = 3
    \"\"\"Fewer samples do not give a direction its own noise.\"\"\"

Import the module of the topic, so that the limit's topic shows where it is used::

    from imucal_wizard.core.limits import stillness
    if seconds < stillness.MIN_REST_SECONDS: ...

Limits that only one function uses stay beside it.
"""
