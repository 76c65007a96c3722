"""How the command ends."""

DONE, FAILED, USAGE, UNREADABLE, MISSING_EXTRA, PARTIAL, INTERRUPTED = 0, 1, 2, 3, 4, 5, 130
EXTRAS = {"rich": "log", "matplotlib": "plot", "pyarrow": "parquet"}
"""Which extra brings a package; a command may need one that brings more."""


def install(extra: str) -> str:
    """Say how to install an extra."""
    return f"pip install 'ttc-fast[{extra}]', in a checkout: pip install '.[{extra}]'"


EXIT_CODES = f"""\
exit codes:
  {DONE}    done
  {FAILED}    the output could not be written, or the answers of bench differ
  {USAGE}    the command line makes no sense, or the settings of the node
  {UNREADABLE}    the log cannot be read, or makes no sense with these settings
  {MISSING_EXTRA}    an optional package is missing; the message says which extra brings it, such as ttc-fast[log]
  {PARTIAL}    a part of a log was lost, or one of several logs could not be read; the rest was done
  {INTERRUPTED}  interrupted
"""


class CommandError(Exception):
    """Something went wrong that a person can put right."""

    def __init__(self, code: int, problem: str) -> None:
        super().__init__(code, problem)  # both, so that it can be sent from one process to another
        self.code, self.problem = code, problem

    def __str__(self) -> str:
        """Say what is wrong."""
        return self.problem
