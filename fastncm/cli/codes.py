"""Exit codes."""

DONE = 0
SOME_FAILED = 1  # done, but some rows failed
BAD_INPUT = 2  # nothing was written
BROKEN_OFF = 3  # a sweep that had begun could not go on; its finished parts stay readable
INTERRUPTED = 130  # Ctrl-C; likewise
