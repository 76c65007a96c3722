"""Which extra brings an optional package, and how it is installed. Every message about a missing package asks here."""

from __future__ import annotations

import sys
from pathlib import Path

EXTRAS = {
    "bokeh": "report",
    "cyclonedds": "dds",
    "distributed": "fleet",
    "foxglove_schemas_protobuf": "foxglove",
    "fsspec": "fleet",
    "gymnasium": "gym",
    "lz4": "log",
    "matplotlib": "plot",
    "mcap": "log",
    "mcap_protobuf": "foxglove",
    "pandas": "pandas",
    "pyarrow": "parquet",
    "rerun": "rerun",
    "rich": "log",
    "s3fs": "fleet",
    "zstandard": "log",
}
"""The extra that brings a package. A command may name one that brings more."""
DISTRIBUTIONS = {
    "foxglove_schemas_protobuf": "foxglove-schemas-protobuf",
    "mcap_protobuf": "mcap-protobuf-support",
    "rerun": "rerun-sdk",
}
"""The name under which a package is installed, where it is imported under another."""
PUBLISHED = False
"""Whether a package index has ttc-fast. Until then its extras are installed from a checkout."""


def install(extra: str) -> str:
    """Return how an extra is installed.

    Parameters
    ----------
    extra : str
        The name of the extra.

    Returns
    -------
    str

    Examples
    --------
    >>> from ttc_fast._extras import install
    >>> install("log")
    "pip install '.[log]' in the checkout of ttc_fast"
    """
    return f"pip install 'ttc-fast[{extra}]'" if PUBLISHED else f"pip install '.[{extra}]' in the checkout of ttc_fast"


def missing(what: str, package: str) -> ModuleNotFoundError:
    """Return the error that says what needs a package, and how it is installed."""
    hint = f"{what} needs {package}, which is not installed: {install(EXTRAS[package])}"
    return ModuleNotFoundError(hint, name=package)


CHECKOUT = Path(__file__).parents[2]
"""The folder of the project, where the package is used in place."""


def build_again() -> str:
    """Return how the compiled part is built again."""
    from_checkout = (CHECKOUT / "Cargo.toml").exists()
    what = f"--editable '{CHECKOUT}'" if from_checkout else "--force-reinstall ttc-fast"
    return f"build it again: pip install {what}"


def does_not_fit(error: ImportError) -> BaseException:
    """Return the error that says that the compiled part is missing or too old, and how it is built again.

    The command ``ttc-fast`` ends by it with one line. An error that says something else is returned as it is.
    """
    if error.name != "ttc_fast._core":
        return error
    old = f"is older than the Python part ({str(error).partition(' from ')[0]})"
    why = "is missing" if isinstance(error, ModuleNotFoundError) else old
    problem = f"the compiled part of ttc_fast {why}; {build_again()}"
    if Path(sys.argv[0]).stem.startswith("ttc-fast"):
        return SystemExit(f"ttc-fast: {problem}")
    return ImportError(problem, name=error.name)
