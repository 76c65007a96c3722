"""How the command ends."""

DONE, FAILED, USAGE, UNREADABLE, MISSING_EXTRA, INTERRUPTED = 0, 1, 2, 3, 4, 130
INSTALL_EXTRA = "pip install 'ttc-fast[demo]', in a checkout: pip install '.[demo]'"
EXIT_CODES = f"""\
exit codes:
  {DONE}    done
  {FAILED}    the output could not be written, or the answers of bench differ
  {USAGE}    the command line makes no sense, or the settings of the node
  {UNREADABLE}    the log cannot be read, or makes no sense with these settings
  {MISSING_EXTRA}    an optional package is missing: {INSTALL_EXTRA}
  {INTERRUPTED}  interrupted
"""


class CommandError(Exception):
    """Something went wrong that a person can put right."""

    def __init__(self, code: int, problem: str) -> None:
        super().__init__(problem)
        self.code = code
