"""A node in a ROS 2 graph: the topics that it reads and publishes, and its announcement to the graph."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any, TypeVar

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication
from cyclonedds.core import DDSException, InstanceState, Qos, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.domain import DomainParticipant
from cyclonedds.internal import InvalidSample
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from ttc_fast.ros.dds import qos
from ttc_fast.ros.dds.malformed import counts_of
from ttc_fast.ros.dds.names import dds_topic, resolved
from ttc_fast.ros.dds.settings import DdsSettings
from ttc_fast.ros.dds.types import dds_name, message, serialized, topic_type, type_hash
from ttc_fast.ros_messages import MessageError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    Decode = Callable[[bytes], Any]
    Take = Callable[[Any], None]

Entity = TypeVar("Entity")
LOG = logging.getLogger("ttc_fast.dds")
ANY = SampleState.Any | ViewState.Any | InstanceState.Any
AT_ONCE = 16
"""The most samples that are taken at once; more than any history that is kept here."""


class Subscription:
    """A topic that is read.

    Attributes
    ----------
    topic : str
        The full ROS name of the topic.
    unreadable : int
        The number of messages that Cyclone let pass and the decoder refused.
    """

    def __init__(self, reader: Any, topic: str, decode: Decode, take: Take) -> None:
        self.reader = reader
        self.topic = topic
        self.unreadable = 0
        self._decode = decode
        self._take = take

    def take(self) -> None:
        """Read the messages that have come, and hand them on."""
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
        """The number of samples that publishers sent and that never came."""
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
        """Whether there is a reader."""
        return bool(self.writer.get_matched_subscriptions())

    def publish(self, cdr: bytes) -> None:
        """Send a serialised message. If a reader is stuck, the message is given up and counted."""
        try:
            self.writer.write(self._kind(cdr))
        except DDSException as error:
            self.unsent += 1
            if str(self.unsent).rstrip("0") == "1":
                LOG.warning("%d messages on %s could not be sent: %s", self.unsent, self.topic, error)


class Publications:
    """Waits for publishers of topics whose type is not known before.

    Parameters
    ----------
    participant : DomainParticipant
        The participant whose peers may publish them.

    Attributes
    ----------
    condition : ReadCondition
        Wakes a waitset when there are new publishers.
    """

    def __init__(self, participant: Any) -> None:
        self.reader = BuiltinDataReader(participant, BuiltinTopicDcpsPublication)
        self.condition = ReadCondition(self.reader, ANY)
        self._wanted: dict[tuple[str, str], tuple[str, str, Any, Any]] = {}

    def wait_for(self, dds_topic: str, topic: str, kinds: Mapping[str, tuple[Any, Any]]) -> None:
        """Wait for a topic of any of these types."""
        for name, (decode, take) in kinds.items():
            self._wanted[dds_topic, dds_name(name)] = (topic, name, decode, take)

    def found(self) -> Iterator[tuple[str, str, Any, Any]]:
        """Yield topic, type, decoder and receiver of each topic that is published now, once."""
        while seen := self.reader.take(64):
            for each in seen:
                wanted = self._wanted.pop((each.topic_name, each.type_name), None)
                if wanted is not None:
                    yield wanted


class Participant:
    """A node in a ROS 2 graph.

    Parameters
    ----------
    settings : DdsSettings
        The name of the node, and the domain.

    Raises
    ------
    DDSException
        If Cyclone cannot join the domain; its log, under ``ttc_fast.dds``, says why.

    Examples
    --------
    >>> from ttc_fast.ros.dds.participant import Participant
    >>> from ttc_fast.ros.dds.settings import DdsSettings
    >>> from ttc_fast.ros.dds.types import message, serialized
    >>> node = Participant(DdsSettings(domain_id=117))
    >>> scans = node.subscribe("/scan", "sensor_msgs/LaserScan", bytes, print, sensor_data=True)
    >>> brake = node.publisher("brake_bool", "std_msgs/Bool")
    >>> node.announce()
    >>> brake.publish(serialized(message("std_msgs/Bool", data=True)))
    >>> if node.wait(0.01):
    ...     node.take()
    >>> node.dropped(scans)
    0
    >>> node.close()
    """

    def __init__(self, settings: DdsSettings | None = None) -> None:
        self.settings = DdsSettings() if settings is None else settings
        self._malformed = counts_of(self.settings.domain)
        said = qos.with_user_data(Qos(), f"enclave={self.settings.enclave};".encode())
        self._participant = DomainParticipant(self.settings.domain, said)
        self._waitset = WaitSet(self._participant)
        self._conditions: list[ReadCondition] = []
        self._entities: list[Any] = []  # topics, readers and writers, in the order in which they were made
        self._publications: Publications | None = None
        self.subscriptions: list[Subscription] = []
        self.publishers: list[Publisher] = []
        self._discovery = self._writer("ros_discovery_info", "rmw_dds_common/ParticipantEntitiesInfo", qos.DISCOVERY)

    def subscribe(
        self,
        topic: str,
        name: str,
        decode: Decode,
        take: Take,
        *,
        sensor_data: bool = False,
        latched: bool = False,
    ) -> Subscription:
        """Read a topic.

        Parameters
        ----------
        topic : str
            The ROS name of the topic.
        name : str
            The name of its type, like "sensor_msgs/LaserScan".
        decode : callable
            Makes a message from its bytes, or raises MessageError.
        take : callable
            Called with each message, by the ``take`` of the participant.
        sensor_data : bool
            Whether a lost message is not sent again, because the next one is better.
        latched : bool
            Whether what was sent before is received too.

        Returns
        -------
        Subscription
        """
        full = self.resolved(topic)
        chosen = qos.LATCHED if latched else qos.SENSOR_DATA if sensor_data else qos.DEFAULT
        quality = qos.with_user_data(chosen, self._hash(name))
        reader = self._keep(DataReader(self._participant, self._topic(dds_topic(full), name), quality))
        self._wake_for(ReadCondition(reader, ANY))
        self.subscriptions.append(Subscription(reader, full, decode, take))
        return self.subscriptions[-1]

    def resolved(self, topic: str) -> str:
        """Return the full ROS name of a topic."""
        return resolved(topic, self.settings.node_name, self.settings.namespace)

    def subscribe_by_type(self, topic: str, kinds: Mapping[str, tuple[Decode, Take]]) -> None:
        """Read a topic that may have one of several types as sensor data, as soon as it is published.

        Parameters
        ----------
        topic : str
            The ROS name of the topic.
        kinds : mapping
            The two callables of ``subscribe`` for each type.
        """
        if self._publications is None:
            self._publications = Publications(self._participant)
            self._keep(self._publications.reader)
            self._wake_for(self._publications.condition)
        self._publications.wait_for(dds_topic(self.resolved(topic)), topic, kinds)

    def publisher(self, topic: str, name: str) -> Publisher:
        """Publish a topic; arguments as in ``subscribe``."""
        full = self.resolved(topic)
        self.publishers.append(Publisher(self._writer(dds_topic(full), name, qos.DEFAULT), self._type(name), full))
        return self.publishers[-1]

    def announce(self) -> None:
        """Tell the ROS graph the name of the node and its topics, which ``ros2 node list`` shows."""
        entities = self._message(
            "NodeEntitiesInfo",
            node_namespace=self.settings.namespace,
            node_name=self.settings.node_name,
            reader_gid_seq=[self._gid(each.reader) for each in self.subscriptions],
            writer_gid_seq=[self._gid(each.writer) for each in self.publishers],
        )
        info = self._message(
            "ParticipantEntitiesInfo", gid=self._gid(self._participant), node_entities_info_seq=[entities]
        )
        self._discovery.write(self._type("rmw_dds_common/ParticipantEntitiesInfo")(serialized(info)))

    def wait(self, timeout: float) -> bool:
        """Wait for messages, at most this long (s), and return whether there are any."""
        return self._waitset.wait(max(int(timeout * 1e9), 0)) > 0

    def take(self) -> None:
        """Hand over all messages that have come."""
        for each in self.subscriptions:
            each.take()
        if self._publications is not None:
            self._subscribe_to_new(self._publications)

    def dropped(self, subscription: Subscription) -> int:
        """Return the number of messages of a topic that were cut short or damaged."""
        return self._malformed.of(dds_topic(subscription.topic)) + subscription.unreadable

    @property
    def malformed(self) -> int:
        """The number of packets that were none of DDS."""
        return self._malformed.of("")

    def close(self) -> None:
        """Leave the graph at once, and the domain with the last participant of this process in it.

        The objects of Cyclone end here, whoever holds them still, and each before the one that it belongs to.
        """
        for condition in self._conditions:
            self._waitset.detach(condition)
        for entity in (*self._conditions, self._waitset, *reversed(self._entities), self._participant):
            entity.__del__()
        self._conditions.clear()
        self._entities.clear()
        self.subscriptions.clear()
        self.publishers.clear()
        self._publications = None
        del self._discovery, self._waitset, self._participant, self._malformed

    def _subscribe_to_new(self, publications: Publications) -> None:
        for topic, name, decode, take in publications.found():
            LOG.info("%s has type %s", topic, name)
            self.subscribe(topic, name, decode, take, sensor_data=True)
            self.announce()

    def _type(self, name: str) -> Any:
        return topic_type(name, gid_size=self.settings.gid_size)

    def _hash(self, name: str) -> bytes:
        return type_hash(name, gid_size=self.settings.gid_size)

    def _topic(self, topic: str, name: str) -> Topic[Any]:
        return self._keep(Topic(self._participant, topic, self._type(name)))

    def _writer(self, topic: str, name: str, quality: Qos) -> DataWriter[Any]:
        said = qos.with_user_data(quality, self._hash(name))
        return self._keep(DataWriter(self._participant, self._topic(topic, name), said))

    def _keep(self, entity: Entity) -> Entity:
        self._entities.append(entity)
        return entity

    def _wake_for(self, condition: ReadCondition) -> None:
        self._waitset.attach(condition)
        self._conditions.append(condition)

    def _message(self, name: str, **values: Any) -> Any:
        return message(f"rmw_dds_common/{name}", gid_size=self.settings.gid_size, **values)

    def _gid(self, entity: Any) -> Any:
        """Return the Gid of an entity: its GUID, and zeros behind it where ROS has more room."""
        return self._message("Gid", data=entity.guid.bytes.ljust(self.settings.gid_size, b"\0"))
