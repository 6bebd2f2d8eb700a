"""What all tests share: Hypothesis draws the same examples on every machine, every time."""

import os

from hypothesis import settings

# A red run has to be red again when somebody looks into it. To search further, now and then:
# HYPOTHESIS_PROFILE=explore make test
settings.register_profile("repeatable", derandomize=True, deadline=None, print_blob=True)
settings.register_profile("explore", max_examples=2_000, deadline=None, print_blob=True)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "repeatable"))
