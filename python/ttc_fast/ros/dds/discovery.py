"""How far a participant looks for others: the variables of ROS 2, as rmw_cyclonedds passes them on to Cyclone.

``ROS_AUTOMATIC_DISCOVERY_RANGE`` is SUBNET (the default), LOCALHOST, OFF or SYSTEM_DEFAULT, and ``ROS_STATIC_PEERS``
names other hosts, with a ; between them. ``ROS_LOCALHOST_ONLY=1``, of releases before Iron, is LOCALHOST without peers
[rcl, discovery_options.c and init.c; rmw_cyclonedds_cpp, rmw_node.cpp; both of Jazzy].

Cyclone 11 gives up a peer that has not answered for 30 s, which older ones did not, and if it uses another interface
it ignores what comes to 127.0.0.1, where Fast DDS looks for others. So peers are kept here, and on this host Cyclone
announces the participant each second at every address.
"""

from __future__ import annotations

import logging
import os
from typing import TYPE_CHECKING
from xml.sax.saxutils import quoteattr

if TYPE_CHECKING:
    from collections.abc import Mapping

LOG = logging.getLogger("ttc_fast.dds")
RANGES = ("SUBNET", "LOCALHOST", "OFF", "SYSTEM_DEFAULT")
LONGEST_PEER = 255
NO_MULTICAST = "<General><AllowMulticast>false</AllowMulticast></General>"
NOBODY = "<ParticipantIndex>none</ParticipantIndex><Tag>ros_discovery_off_{}</Tag>"
SEVERAL = "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>"
KEEP_PEERS = "<InitialLocatorPruneDelay>inf</InitialLocatorPruneDelay>"
OFTEN = "<SPDPInterval>1 s</SPDPInterval>"


def configuration(environment: Mapping[str, str]) -> str:
    """Return the configuration of Cyclone that the variables ask for, or "".

    Examples
    --------
    >>> from ttc_fast.ros.dds.discovery import configuration
    >>> configuration({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT"})
    ''
    >>> "AllowMulticast" in configuration({"ROS_LOCALHOST_ONLY": "1"})
    True
    """
    reach, peers = _asked_for(environment)
    if reach == "SYSTEM_DEFAULT":
        return ""
    general, discovery = ("" if reach == "SUBNET" else NO_MULTICAST), SEVERAL
    if reach == "OFF":
        discovery = NOBODY.format(os.getpid())  # a tag that nobody else has
    elif peers:
        discovery += KEEP_PEERS + (OFTEN if reach == "LOCALHOST" else "")
        discovery += "<Peers>" + "".join(f"<Peer address={quoteattr(peer)}/>" for peer in peers) + "</Peers>"
    return f"<CycloneDDS><Domain>{general}<Discovery>{discovery}</Discovery></Domain></CycloneDDS>"


def _asked_for(environment: Mapping[str, str]) -> tuple[str, list[str]]:
    """Return the range, and the addresses of those to ask."""
    if environment.get("ROS_LOCALHOST_ONLY") == "1":
        return "LOCALHOST", ["localhost"]
    reach = environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE") or RANGES[0]
    if reach not in RANGES:
        LOG.warning("ROS_AUTOMATIC_DISCOVERY_RANGE is %r, not one of %s: LOCALHOST is taken", reach, ", ".join(RANGES))
        reach = "LOCALHOST"
    peers = [peer for peer in environment.get("ROS_STATIC_PEERS", "").split(";") if peer]
    for peer in peers:
        if len(peer) > LONGEST_PEER:
            LOG.warning("ROS_STATIC_PEERS: a peer is longer than %d characters, and left out: %s", LONGEST_PEER, peer)
    peers = [peer for peer in peers if len(peer) <= LONGEST_PEER]
    if peers and reach in ("OFF", "SYSTEM_DEFAULT"):
        LOG.warning("ROS_STATIC_PEERS is not used: ROS_AUTOMATIC_DISCOVERY_RANGE is %s", reach)
    return reach, (["localhost", *peers] if reach == "LOCALHOST" else peers)
