"""A node in a ROS 2 graph: what it reads, what it publishes, and what it says of itself."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

from cyclonedds.core import DDSException, InstanceState, Qos, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.domain import DomainParticipant
from cyclonedds.internal import InvalidSample
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from ttc_fast.ros.dds import qos
from ttc_fast.ros.dds.encode import encoded_discovery
from ttc_fast.ros.dds.names import dds_topic, resolved
from ttc_fast.ros.dds.publications import Publications
from ttc_fast.ros.dds.refusals import refusals
from ttc_fast.ros.dds.settings import DdsSettings
from ttc_fast.ros.dds.topic_types import topic_type, type_hash
from ttc_fast.ros_messages import MessageError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    Decode = Callable[[bytes], Any]
    Take = Callable[[Any], None]

LOG = logging.getLogger("ttc_fast.dds")
ANY = SampleState.Any | ViewState.Any | InstanceState.Any
AT_ONCE = 16
"""How many samples are taken in one go; more than any history that is kept here."""


class Subscription:
    """A topic that is read.

    Attributes
    ----------
    topic : str
        Its full ROS name.
    unreadable : int
        Messages that Cyclone let pass, and that are not what their type says all the same.
    """

    def __init__(self, reader: Any, topic: str, decode: Decode, take: Take) -> None:
        self.reader = reader
        self.topic = topic
        self.unreadable = 0
        self._decode = decode
        self._take = take

    def take(self) -> None:
        """Read what has come, and hand it on."""
        for sample in self.reader.take(AT_ONCE):
            if isinstance(sample, InvalidSample):  # the last publisher has left
                continue
            self.deliver(sample.cdr)

    def deliver(self, cdr: bytes) -> None:
        """Read a message, and hand it on."""
        try:
            message = self._decode(cdr)
        except MessageError as error:
            self.unreadable += 1
            LOG.debug("a message on %s %s", self.topic, error)
        else:
            self._take(message)

    @property
    def lost(self) -> int:
        """How many samples never came, although publishers sent them."""
        return int(self.reader.get_sample_lost_status().total_count)


class Publisher:
    """A topic that is published."""

    def __init__(self, writer: DataWriter[Any], kind: Any, topic: str) -> None:
        self.writer = writer
        self.topic = topic
        self.unsent = 0
        self._kind = kind

    @property
    def has_listeners(self) -> bool:
        """Whether anybody reads it."""
        return bool(self.writer.get_matched_subscriptions())

    def publish(self, cdr: bytes) -> None:
        """Send a serialised message. A reader that is stuck holds nobody up: the message is given up and counted."""
        try:
            self.writer.write(self._kind(cdr))
        except DDSException as error:
            self.unsent += 1
            if str(self.unsent).rstrip("0") == "1":
                LOG.warning("%d messages on %s could not be sent: %s", self.unsent, self.topic, error)


class Participant:
    """A node in a ROS 2 graph.

    Parameters
    ----------
    settings : DdsSettings
        Its name, and the domain.

    Raises
    ------
    DDSException
        If Cyclone cannot join the domain; its log, under ``ttc_fast.dds``, says why.

    Examples
    --------
    >>> from ttc_fast.ros.dds.encode import encoded_bool
    >>> from ttc_fast.ros.dds.participant import Participant
    >>> from ttc_fast.ros.dds.settings import DdsSettings
    >>> node = Participant(DdsSettings(domain_id=117))
    >>> scans = node.subscribe("/scan", "sensor_msgs/LaserScan", bytes, print, sensor_data=True)
    >>> brake = node.publisher("brake_bool", "std_msgs/Bool")
    >>> node.announce()
    >>> brake.publish(encoded_bool(True))
    >>> if node.wait(0.01):
    ...     node.take()
    >>> node.dropped(scans)
    0
    >>> node.close()
    """

    def __init__(self, settings: DdsSettings | None = None) -> None:
        self.settings = DdsSettings() if settings is None else settings
        self._refusals = refusals(self.settings.domain)
        said = qos.with_user_data(Qos(), f"enclave={self.settings.enclave};".encode())
        self._participant = DomainParticipant(self.settings.domain, said)
        self._waitset = WaitSet(self._participant)
        self._conditions: list[ReadCondition] = []
        self._publications: Publications | None = None
        self.subscriptions: list[Subscription] = []
        self.publishers: list[Publisher] = []
        self._discovery = self._writer("ros_discovery_info", "rmw_dds_common/ParticipantEntitiesInfo", qos.DISCOVERY)

    def subscribe(
        self, topic: str, name: str, decode: Decode, take: Take, *, sensor_data: bool = False
    ) -> Subscription:
        """Read a topic.

        Parameters
        ----------
        topic : str
            Its ROS name.
        name : str
            Of its type, like "sensor_msgs/LaserScan".
        decode : callable
            Makes a message of its bytes, or raises MessageError.
        take : callable
            Called with each message, by the ``take`` of the participant.
        sensor_data : bool
            Whether the next message is better than a lost one again.

        Returns
        -------
        Subscription
        """
        full = self._resolved(topic)
        quality = qos.with_user_data(qos.SENSOR_DATA if sensor_data else qos.DEFAULT, self._hash(name))
        reader = DataReader(self._participant, self._topic(dds_topic(full), name), quality)
        self._wake_for(ReadCondition(reader, ANY))
        self.subscriptions.append(Subscription(reader, full, decode, take))
        return self.subscriptions[-1]

    def subscribe_by_type(self, topic: str, kinds: Mapping[str, tuple[Decode, Take]]) -> None:
        """Read a topic that may have one of several types, as soon as somebody publishes it.

        Parameters
        ----------
        topic : str
            Its ROS name.
        kinds : mapping
            For each type the two callables of ``subscribe``.
        """
        if self._publications is None:
            self._publications = Publications(self._participant)
            self._wake_for(self._publications.condition)
        self._publications.wait_for(dds_topic(self._resolved(topic)), topic, kinds)

    def publisher(self, topic: str, name: str) -> Publisher:
        """Publish a topic; arguments as in ``subscribe``."""
        full = self._resolved(topic)
        self.publishers.append(Publisher(self._writer(dds_topic(full), name, qos.DEFAULT), self._type(name), full))
        return self.publishers[-1]

    def announce(self) -> None:
        """Tell the ROS graph which node this is and what is its own; ``ros2 node list`` knows it from there."""
        cdr = encoded_discovery(
            self._gid(self._participant),
            self.settings.namespace,
            self.settings.node_name,
            readers=[self._gid(each.reader) for each in self.subscriptions],
            writers=[self._gid(each.writer) for each in self.publishers],
        )
        self._discovery.write(self._type("rmw_dds_common/ParticipantEntitiesInfo")(cdr))

    def wait(self, timeout: float) -> bool:
        """Wait for messages, at most for as long as this (s), and say whether there are any."""
        return self._waitset.wait(max(int(timeout * 1e9), 0)) > 0

    def take(self) -> None:
        """Hand all messages that have come to who takes them."""
        for each in self.subscriptions:
            each.take()
        if self._publications is not None:
            self._subscribe_to_new(self._publications)

    def dropped(self, subscription: Subscription) -> int:
        """Return how many messages of a topic were no messages: cut short or damaged."""
        return self._refusals.of(dds_topic(subscription.topic)) + subscription.unreadable

    @property
    def malformed(self) -> int:
        """How many packets were none of DDS, whatever they were for."""
        return self._refusals.of("")

    def close(self) -> None:
        """Leave the graph."""
        for condition in self._conditions:
            self._waitset.detach(condition)
        self._conditions.clear()
        self.subscriptions.clear()
        self.publishers.clear()
        self._publications = None
        del self._discovery, self._waitset, self._participant

    def _subscribe_to_new(self, publications: Publications) -> None:
        for topic, name, decode, take in publications.found():
            LOG.info("%s has type %s", topic, name)
            self.subscribe(topic, name, decode, take)
            self.announce()

    def _resolved(self, topic: str) -> str:
        return resolved(topic, self.settings.node_name, self.settings.namespace)

    def _type(self, name: str) -> Any:
        return topic_type(name, gid_size=self.settings.gid_size)

    def _hash(self, name: str) -> bytes:
        return type_hash(name, gid_size=self.settings.gid_size)

    def _topic(self, topic: str, name: str) -> Topic[Any]:
        return Topic(self._participant, topic, self._type(name))

    def _writer(self, topic: str, name: str, quality: Qos) -> DataWriter[Any]:
        said = qos.with_user_data(quality, self._hash(name))
        return DataWriter(self._participant, self._topic(topic, name), said)

    def _wake_for(self, condition: ReadCondition) -> None:
        self._waitset.attach(condition)
        self._conditions.append(condition)

    def _gid(self, entity: Any) -> bytes:
        """Return the Gid of an entity: its GUID, and zeros behind where ROS has more room for it."""
        guid: bytes = entity.guid.bytes
        return guid.ljust(self.settings.gid_size, b"\0")
