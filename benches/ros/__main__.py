"""From a scan to the brake's answer, and what the node itself takes of that: ``python -m benches.ros --dds``.

A sensor in this process publishes a scan and waits for ``/brake_bool`` from the node, which is another process; every
answer is checked. With ``--soak 100000`` that many scans are sent as fast as they are answered, and the memory of the
node is watched.
"""

from __future__ import annotations

import argparse
import importlib

TRANSPORTS = ("dds", "ros1")


def main() -> None:
    """Measure over one transport."""
    parser = argparse.ArgumentParser(prog="python -m benches.ros", description=__doc__)
    which = parser.add_mutually_exclusive_group(required=True)
    for each in TRANSPORTS:
        which.add_argument(f"--{each}", dest="transport", action="store_const", const=each)
    parser.add_argument("--scans", type=int, default=5000, help="round trips that are timed")
    parser.add_argument("--beams", type=int, default=1080)
    parser.add_argument("--rate", type=float, default=200.0, help="scans a second; 0 is as fast as they are answered")
    parser.add_argument("--soak", type=int, metavar="SCANS", help="look at memory and losses instead")
    arguments = parser.parse_args()
    importlib.import_module(f"benches.ros.{arguments.transport}").measure(arguments)


if __name__ == "__main__":
    main()
