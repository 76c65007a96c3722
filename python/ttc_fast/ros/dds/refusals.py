"""How many messages Cyclone DDS refused on their way in, by topic.

Cyclone holds the bytes of a message to the fields of its type before anybody sees them, drops those that do not fit,
and says so in its log; nowhere else. So it is told to write warnings into a pipe as well, where they are counted.
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

LOG = logging.getLogger("ttc_fast.dds")
REFUSED = re.compile(r"deserialization (?P<topic>.*)/[^/]* failed \(|malformed packet received")
CONFIGURATION = "<CycloneDDS><Domain><Tracing><Verbosity>warning</Verbosity><OutputFile>/dev/fd/{}</OutputFile>{}"
CLOSING = "</Tracing></Domain></CycloneDDS>"


class Refusals:
    """Counts the messages that Cyclone refuses in one domain.

    Parameters
    ----------
    domain : int
        Which is configured by the variable CYCLONEDDS_URI as ever. If the configuration traces into a file of its own,
        or the process is in that domain already, all goes on as usual and nothing is counted.
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
            LOG.warning("domain %d is configured already: refused messages are not counted", domain)
        finally:
            os.close(writing)  # Cyclone has opened its own; the pipe ends when Cyclone closes that
        # A thread of its own: Cyclone would wait at a full pipe.
        # It knows the counts only: if it kept all of this, the domain would outlive whoever asks for them.
        arguments = (reading, self._counts, self._lock)
        threading.Thread(target=_listen, args=arguments, name="ttc_fast.dds", daemon=True).start()

    def of(self, topic: str) -> int:
        """Return how many messages of a DDS topic were refused; of "", packets that tell no topic."""
        with self._lock:
            return self._counts[topic]


def _listen(pipe: int, counts: Counter[str], lock: threading.Lock) -> None:
    """Count what is refused, until Cyclone closes its end of the pipe."""
    with os.fdopen(pipe, encoding="utf-8", errors="replace") as lines:
        for line in lines:
            refused = REFUSED.search(line)
            if refused is not None:
                with lock:
                    counts[refused["topic"] or ""] += 1


def _configuration(pipe: int) -> str:
    # Of two that say the same, the later one counts: the user's.
    ours = CONFIGURATION.format(pipe, CLOSING)
    return ",".join([ours, *filter(None, [os.environ.get("CYCLONEDDS_URI", "")])])


_domains: WeakValueDictionary[int, Refusals] = WeakValueDictionary()
"""Cyclone is configured once for each domain. It leaves a domain with the last who was in it."""
_lock = threading.Lock()


def refusals(domain: int) -> Refusals:
    """Join a domain, unless somebody has, and return its counts."""
    with _lock:
        counted = _domains.get(domain)
        if counted is None:
            counted = _domains[domain] = Refusals(domain)
        return counted
