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
        threading.Thread(target=self._listen, args=(reading,), name="ttc_fast.dds", daemon=True).start()

    def of(self, topic: str) -> int:
        """Return how many messages of a DDS topic were refused; of "", packets that tell no topic."""
        with self._lock:
            return self._counts[topic]

    def _listen(self, pipe: int) -> None:
        with os.fdopen(pipe, encoding="utf-8", errors="replace") as lines:
            for line in lines:
                refused = REFUSED.search(line)
                if refused is not None:
                    with self._lock:
                        self._counts[refused["topic"] or ""] += 1


def _configuration(pipe: int) -> str:
    # Of two that say the same, the later one counts: the user's.
    ours = CONFIGURATION.format(pipe, CLOSING)
    return ",".join([ours, *filter(None, [os.environ.get("CYCLONEDDS_URI", "")])])


_domains: dict[int, Refusals] = {}
_lock = threading.Lock()


def refusals(domain: int) -> Refusals:
    """Join a domain, at the first call, and return its counts."""
    with _lock:
        if domain not in _domains:
            _domains[domain] = Refusals(domain)
        return _domains[domain]
