"""Which extra brings an optional package, and how it is installed. Every message about a missing package asks here."""

from __future__ import annotations

EXTRAS = {
    "cyclonedds": "dds",
    "distributed": "fleet",
    "fsspec": "fleet",
    "gymnasium": "gym",
    "lz4": "log",
    "matplotlib": "plot",
    "mcap": "log",
    "pyarrow": "parquet",
    "rerun": "rerun",
    "rich": "log",
    "s3fs": "fleet",
    "zstandard": "log",
}
"""The extra that brings a package. A command may name one that brings more."""
DISTRIBUTIONS = {"rerun": "rerun-sdk"}
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
