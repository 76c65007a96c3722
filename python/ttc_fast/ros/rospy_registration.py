"""Registers a node of rospy again when the master has forgotten it: rospy itself registers only once."""

from __future__ import annotations

import threading
import time

import rosgraph
import rospy
from rospy.impl.registration import Registration, get_registration_listeners, get_topic_manager

PERIOD = 1.0
"""s between two looks at the master."""


def stay_registered() -> threading.Thread:
    """Look from time to time, in a thread that ends with the process."""
    thread = threading.Thread(target=_watch_master, name="registration", daemon=True)
    thread.start()
    return thread


def _watch_master() -> None:
    master = rosgraph.Master(rospy.get_name())
    while not rospy.is_shutdown():
        time.sleep(PERIOD)
        try:
            master.lookupNode(rospy.get_name())
        except rosgraph.MasterError:
            rospy.logwarn("the master does not know this node any more: registering again")
            _register_all()
        except (OSError, rosgraph.MasterException) as error:
            rospy.logwarn_throttle(10.0, f"the master does not answer: {error}")


def _register_all() -> None:
    topics, listeners = get_topic_manager(), get_registration_listeners()
    for name, kind in topics.get_publications():
        listeners.notify_added(name, kind, Registration.PUB)
    for name, kind in topics.get_subscriptions():
        listeners.notify_added(name, kind, Registration.SUB)
