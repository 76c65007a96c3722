"""Counts of the messages that Cyclone DDS dropped because their bytes do not fit their type, by topic.

Cyclone compares the bytes of a message with the fields of its type before a reader gets them, and drops those that do
not fit. It reports that in its log only: the statuses (sample lost, sample rejected) and the statistics of a reader
stay at 0. So Cyclone writes its warnings into a pipe as well, where they are counted.
"""

from __future__ import annotations

import logging
import os
import re
import threading
from collections import Counter
from weakref import WeakValueDictionary

from cyclonedds.core import DDSException
from cyclonedds.domain import Domain

from ttc_fast.ros.dds import discovery

LOG = logging.getLogger("ttc_fast.dds")
DROPPED = re.compile(r"deserialization (?P<topic>.*)/[^/]* failed \(|malformed packet received")
CONFIGURATION = "<CycloneDDS><Domain><Tracing><Verbosity>warning</Verbosity><OutputFile>/dev/fd/{}</OutputFile>{}"
CLOSING = "</Tracing></Domain></CycloneDDS>"


class MalformedCounts:
    """Counts the messages that Cyclone drops in one domain.

    Parameters
    ----------
    domain : int
        The domain, which the variable CYCLONEDDS_URI configures as ever. If that traces into a file of its own, or the
        process is in the domain already, nothing is counted.
    """

    def __init__(self, domain: int) -> None:
        self._lock = threading.Lock()
        self._counts: Counter[str] = Counter()
        reading, writing = os.pipe()
        try:
            self._domain = Domain(domain, _configuration(writing))  # it lives as long as this does
        except DDSException as error:
            if error.code != DDSException.DDS_RETCODE_PRECONDITION_NOT_MET:
                os.close(reading)
                raise
            LOG.warning("domain %d is configured already: malformed messages are not counted", domain)
        finally:
            os.close(writing)  # Cyclone has opened its own; the pipe ends when Cyclone closes that
        # A thread of its own: Cyclone would wait at a full pipe.
        # It holds the counts only: if it held this object, the domain would outlive the last participant.
        arguments = (reading, self._counts, self._lock)
        threading.Thread(target=_listen, args=arguments, name="ttc_fast.dds", daemon=True).start()

    def of(self, topic: str) -> int:
        """Return the number of messages of a DDS topic that were dropped; for "", of packets without a topic."""
        with self._lock:
            return self._counts[topic]


def _listen(pipe: int, counts: Counter[str], lock: threading.Lock) -> None:
    """Count what the log says was dropped, until Cyclone closes its end of the pipe."""
    with os.fdopen(pipe, encoding="utf-8", errors="replace") as lines:
        for line in lines:
            dropped = DROPPED.search(line)
            if dropped is not None:
                with lock:
                    counts[dropped["topic"] or ""] += 1


def _configuration(pipe: int) -> str:
    # Of two that say the same, the later one counts: the user's.
    parts = CONFIGURATION.format(pipe, CLOSING), discovery.configuration(os.environ)
    return ",".join(filter(None, [*parts, os.environ.get("CYCLONEDDS_URI")]))


_domains: WeakValueDictionary[int, MalformedCounts] = WeakValueDictionary()
"""Cyclone is configured once for each domain. It leaves a domain with the last who was in it."""
_lock = threading.Lock()


def counts_of(domain: int) -> MalformedCounts:
    """Join a domain, unless this process is in it already, and return its counts."""
    with _lock:
        counted = _domains.get(domain)
        if counted is None:
            counted = _domains[domain] = MalformedCounts(domain)
        return counted
