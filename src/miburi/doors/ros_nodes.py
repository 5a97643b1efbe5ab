"""The messages of rmw_dds_common with which ROS (since Iron) lists a DDS participant's nodes.

This module needs the extra ``ros``.
"""

from collections.abc import Iterable

from miburi.doors.ros_types import ros_message
from miburi.errors import needs_extra

try:
    from cyclonedds.core import Entity
    from cyclonedds.idl import IdlStruct
    from cyclonedds.idl.types import array, bounded_str, sequence, uint8
except ModuleNotFoundError as error:
    raise needs_extra("ros", error) from error


#: The name of the discovery topic, and the data that each participant announces.
DISCOVERY, ENCLAVE = "ros_discovery_info", b"enclave=/;"
#: The node's name, in the partner's namespace.
NODE = "miburi"


@ros_message
class GidMsg(IdlStruct, typename="rmw_dds_common.msg.dds_.Gid_"):
    """rmw_dds_common/Gid, since Iron: the id of a participant, a reader or a writer."""

    data: array[uint8, 16]


@ros_message
class NodeEntitiesInfoMsg(IdlStruct, typename="rmw_dds_common.msg.dds_.NodeEntitiesInfo_"):
    """rmw_dds_common/NodeEntitiesInfo: a node, with its readers and writers."""

    node_namespace: bounded_str[256]
    node_name: bounded_str[256]
    reader_gid_seq: sequence[GidMsg]
    writer_gid_seq: sequence[GidMsg]


@ros_message
class ParticipantEntitiesInfoMsg(
    IdlStruct, typename="rmw_dds_common.msg.dds_.ParticipantEntitiesInfo_"
):
    """rmw_dds_common/ParticipantEntitiesInfo: the nodes of a participant."""

    gid: GidMsg
    node_entities_info_seq: sequence[NodeEntitiesInfoMsg]


def node_of(
    participant: Entity, namespace: str | None, readers: Iterable[Entity], writers: Iterable[Entity]
) -> ParticipantEntitiesInfoMsg:
    """Return the message that lists a participant as a node with its topics."""
    node = NodeEntitiesInfoMsg(
        f"/{namespace or ''}", NODE, [*map(_gid, readers)], [*map(_gid, writers)]
    )
    return ParticipantEntitiesInfoMsg(_gid(participant), [node])


def _gid(entity: Entity) -> GidMsg:
    guid = entity.guid
    return GidMsg(list(guid.bytes if guid else bytes(16)))
