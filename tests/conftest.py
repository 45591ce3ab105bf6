"""Hypothesis profiles: the same examples in every ordinary run, new ones when asked for.

`HYPOTHESIS_PROFILE=explore make test` looks for new counterexamples.
"""

from __future__ import annotations

import os

from hypothesis import settings

settings.register_profile("same", derandomize=True, deadline=None)
settings.register_profile("explore", deadline=None, print_blob=True)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "same"))
