"""Names of topics and nodes in ROS 2, and of topics in DDS."""

from __future__ import annotations

import re

TOKEN = r"[A-Za-z_]\w*"
NODE_NAME = re.compile(TOKEN, re.ASCII)
NAMESPACE = re.compile(rf"/|(/{TOKEN})+", re.ASCII)
TOPIC = re.compile(rf"(~/|/)?{TOKEN}(/{TOKEN})*", re.ASCII)


class NameNotAllowedError(ValueError):
    """A name that ROS 2 does not allow."""


def resolved(topic: str, node_name: str, namespace: str) -> str:
    """Return the full name of a topic: a relative name is in the namespace, and ~ is the node.

    Examples
    --------
    >>> from ttc_fast.ros.dds.names import resolved
    >>> [resolved(topic, "brake", "/car") for topic in ("scan", "~/cause", "/odom")]
    ['/car/scan', '/car/brake/cause', '/odom']
    """
    if not TOPIC.fullmatch(topic):
        raise NameNotAllowedError(
            f"a topic has letters, digits and _ between its /, and may begin with / or ~/; got {topic!r}"
        )
    if topic.startswith("/"):
        return topic
    base = namespace.rstrip("/")
    if topic.startswith("~/"):
        return f"{base}/{node_name}{topic[1:]}"
    return f"{base}/{topic}"


def dds_topic(resolved_topic: str) -> str:
    """Return the name of a ROS topic in DDS: rt stands for ROS topic."""
    return f"rt{resolved_topic}"


def check_node(node_name: str, namespace: str) -> None:
    """Raise NameNotAllowedError for a node that ROS 2 does not allow."""
    if not NODE_NAME.fullmatch(node_name):
        raise NameNotAllowedError(f"node_name has letters, digits and _, and begins with no digit; got {node_name!r}")
    if not NAMESPACE.fullmatch(namespace):
        raise NameNotAllowedError(f"namespace is / or like /car/front; got {namespace!r}")
