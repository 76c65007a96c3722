"""Topics whose type is known only when somebody publishes them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication
from cyclonedds.core import InstanceState, ReadCondition, SampleState, ViewState

from ttc_fast.ros.dds.topic_types import dds_name

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

AT_ONCE = 64


class Publications:
    """Looks out for publishers.

    Parameters
    ----------
    participant : DomainParticipant
        Whose peers to look at.

    Attributes
    ----------
    condition : ReadCondition
        Wakes a waitset when there are new ones.
    """

    def __init__(self, participant: Any) -> None:
        self._reader = BuiltinDataReader(participant, BuiltinTopicDcpsPublication)
        self.condition = ReadCondition(self._reader, ViewState.Any | SampleState.Any | InstanceState.Any)
        self._wanted: dict[tuple[str, str], tuple[str, str, Any, Any]] = {}

    def wait_for(self, dds_topic: str, topic: str, kinds: Mapping[str, tuple[Any, Any]]) -> None:
        """Look out for a topic of any of these types."""
        for name, (decode, take) in kinds.items():
            self._wanted[dds_topic, dds_name(name)] = (topic, name, decode, take)

    def found(self) -> Iterator[tuple[str, str, Any, Any]]:
        """Yield each that is published now, once: topic, type and what takes it."""
        while seen := self._reader.take(AT_ONCE):
            for each in seen:
                wanted = self._wanted.pop((each.topic_name, each.type_name), None)
                if wanted is not None:
                    yield wanted
