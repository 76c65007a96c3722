"""The exit codes of the command, and the error that leads to one."""

from ttc_fast._exit_codes import DONE, FAILED, INTERRUPTED, MISSING_EXTRA, PARTIAL, UNREADABLE, USAGE

EXIT_CODES = f"""\
exit codes:
  {DONE}    done
  {FAILED}    the output could not be written, or the answers of bench or doctor differ
  {USAGE}    the command line makes no sense, or the settings of the node
  {UNREADABLE}    the log cannot be read, or makes no sense with these settings
  {MISSING_EXTRA}    an optional package is missing; the message says how to install it
  {PARTIAL}    a part of a log was lost, or one of several logs could not be read; the rest was done
  {INTERRUPTED}  interrupted
"""


class CommandError(Exception):
    """A mistake that the user can put right, with the exit code for it."""

    def __init__(self, code: int, problem: str) -> None:
        super().__init__(code, problem)  # both, so that it pickles: it goes from one process to another
        self.code, self.problem = code, problem

    def __str__(self) -> str:
        """Return the problem."""
        return self.problem
