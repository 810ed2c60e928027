"""Exit statuses of the commands."""

DONE = 0
FAILED = 1
INPUT_AT_FAULT = 2
