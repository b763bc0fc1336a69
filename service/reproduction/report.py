"""What is printed of a reproduction, whatever it is printed on."""

from dataclasses import dataclass

from service.reproduction.amplitude_tables import amplitude_tables
from service.reproduction.real import RealBuilding
from service.reproduction.real_tables import real_tables
from service.reproduction.remarks import real_remarks, simulated_remarks
from service.reproduction.simulated import Simulated
from service.reproduction.simulated_tables import simulated_tables
from service.reproduction.table import Table

OPENING = (
    'Every number that sections 7 and 8 print of "Using component mode synthesis to estimate the restoring force of '
    'an isolation layer subjected to earthquakes" (John Wiley & Sons, 2008), beside what comes out here, by every '
    "estimator there is; cms is the paper's own. Where the two differ the text says so; nothing was tuned to meet "
    "the paper."
)
WITHOUT_RECORDS = (
    "Section 8 is left out: no records of a real building were given. "
    "The command menshin reproduce FILE... --building FILE takes them."
)


@dataclass(frozen=True, slots=True)
class Section:
    """One section of the paper."""

    title: str
    tables: tuple[Table, ...]
    remarks: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Report:
    """All of it."""

    sections: tuple[Section, ...]
    opening: str = OPENING


def report(simulated: Simulated, real: RealBuilding | None) -> Report:
    """Section 7, and section 8 where there are records."""
    seven = Section("Section 7. Numerical simulation", simulated_tables(simulated), simulated_remarks(simulated))
    title = "Section 8. Application to an actual base-isolated building"
    if real is None:
        return Report((seven, Section(title, (), (WITHOUT_RECORDS,))))
    return Report((seven, Section(title, (*real_tables(real), *amplitude_tables(real)), real_remarks(real))))
