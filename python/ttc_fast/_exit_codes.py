"""How a command, or the replay of one of many logs, ended; ``ttc-fast --help`` lists what each code means."""

DONE, FAILED, USAGE, UNREADABLE, MISSING_EXTRA, PARTIAL, INTERRUPTED = 0, 1, 2, 3, 4, 5, 130
