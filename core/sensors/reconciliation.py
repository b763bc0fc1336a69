"""What do all sensors together say of each level's motion?"""

from dataclasses import replace

from core.description import BuildingDescription
from core.quality import Finding
from core.record import Record
from core.sensors.consistency import disagreements
from core.sensors.neighbours import unlike_neighbours
from core.sensors.orientation import along_described_axes, oriented
from core.sensors.rigid import RigidLevels, rigid_levels

KEPT = ("delay", "clock", "neighbour")
"""Kinds of disagreement that leave a channel worth using."""


def reconciled(record: Record, description: BuildingDescription) -> RigidLevels:
    """One motion for each level, quantity and direction, along the building's axes, of the channels that agree.

    Args:
        record: complete channels about their position at rest.
        description: of the building.

    Returns:
        With a finding for whatever was mended or left out.
    """
    along, lost = along_described_axes(record, description)
    unlike = unlike_neighbours(along, description)
    levels = rigid_levels(_without(along, unlike))
    turned_back, turned = oriented(levels.record, description)
    wrong = disagreements(turned_back, description)
    findings = (*lost, *unlike, *levels.findings, *turned, *wrong)
    return RigidLevels(_without(turned_back, wrong), levels.torsion, findings)


def _without(record: Record, findings: tuple[Finding, ...]) -> Record:
    """The record without the channels that something is found against."""
    left_out = {finding.channel for finding in findings if finding.kind not in KEPT}
    kept = [row for row, channel in enumerate(record.channels) if channel.id not in left_out]
    return replace(record, channels=tuple(record.channels[row] for row in kept), samples=record.samples[kept])
