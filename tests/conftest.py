"""What pytest settles before the tests: where hypothesis draws from."""

from __future__ import annotations

from hypothesis import settings

# `make test` sees the same examples on every machine; `make test-long` searches on at random, and what it finds
# becomes an @example of the test.
settings.register_profile("fixed", derandomize=True, database=None)
settings.register_profile("random", print_blob=True)
settings.load_profile("fixed")
