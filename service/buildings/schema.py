"""Buildings and their sources, as the API answers them."""

from datetime import datetime

from pydantic import BaseModel, ConfigDict, Field

from core.record import Direction, Quantity
from service.models.schema import Numbers
from service.schema import Answer, Number, Page
from service.verdict.schema import VerdictOut


class BuildingRow(Answer):
    """A monitored building."""

    code: str = Field(description="Short name, as addresses have it.")
    name: str = Field(description="As the building file gives it.")
    events: int = Field(description="Number of events so far.")
    last_event: datetime | None = Field(description="Start of the latest event; null before the first.")


class Buildings(Page[BuildingRow]):
    """All monitored buildings."""


class LevelOut(Answer):
    """A level, as the building file gives it."""

    name: str = Field(description="As the building file gives it.")
    role: str = Field(description="`ground`, `base` or `floor`.")
    mass: Number | None = Field(description="kg; null where the file gives none.")
    stiffness: Number | None = Field(description="N/m, design value of the storey below; null where not given.")
    mass_uncertainty: Number = Field(description="Standard deviation of the mass over the mass; 0 where not given.")


class ChannelOut(Answer):
    """A sensor component, as the building file gives it."""

    id: str = Field(description="Network, station, location and channel code.")
    level: str = Field(description="Name of the level it sits on.")
    quantity: Quantity = Field(description="acceleration (m/s²), velocity (m/s), displacement (m) or temperature (°C).")
    direction: Direction | None = Field(description="Null for a temperature.")
    position: tuple[Number, Number] | None = Field(
        description="m, x and y of the sensor from its level's centre of mass; null where not given."
    )
    rotation: Number = Field(description="rad, by which its axes are turned against the building's, from x towards y.")


class AddedSensorsRequest(BaseModel):
    """Earthquakes from whose records the gain of one more sensor is computed."""

    model_config = ConfigDict(extra="forbid", strict=True)

    events: Numbers | None = Field(
        None, description="Numbers of analysed events; without them the ten strongest.", examples=[[1, 2]]
    )


class ContactOut(Answer):
    """A person or an office to call about the building, as the building file gives it."""

    name: str = Field(description="Of the person or office.")
    role: str = Field(description="What they do for the building.")
    phone: str | None = Field(description="Telephone number; null where not given.")
    mail: str | None = Field(description="Mail address; null where not given.")


class BuildingOut(Answer):
    """A building and its current description."""

    code: str = Field(description="Short name, as addresses have it.")
    name: str = Field(description="As the building file gives it.")
    revision: int = Field(description="Number of the description; each update makes a new one.")
    revised_at: datetime = Field(description="Time when the description took effect.")
    rubber_height: Number | None = Field(description="m, displacement of 100 % shear strain; null where not given.")
    design_displacement: Number | None = Field(
        description="m, largest horizontal displacement that the isolation layer is designed for; null where not given."
    )
    moat_clearance: Number | None = Field(
        description="m, smallest gap between the moving building and the surrounding wall; null where not given."
    )
    latitude: Number | None = Field(description="°; null where not given.")
    longitude: Number | None = Field(description="°; null where not given.")
    timezone: str = Field(description="IANA name.")
    verdict: VerdictOut = Field(
        description="On the building now: by its last earthquake, what is open, and whether records arrive."
    )
    levels: list[LevelOut] = Field(description="From the ground up.")
    channels: list[ChannelOut] = Field(description="The sensors.")
    contacts: list[ContactOut] = Field(description="People to call, the first one first.")


class SourceOut(Answer):
    """A building's monitoring server and how it is doing."""

    building: str = Field(description="Code of the building.")
    kind: str = Field(description="Its kind.")
    location: str = Field(description="A path, or an address without user name, password and query.")
    attempted_at: datetime | None = Field(description="Null before the first attempt.")
    succeeded_at: datetime | None = Field(description="Null before the first success.")
    failing_since: datetime | None = Field(description="Null while it answers.")
    error: str | None = Field(description="Latest error; null without one.")


class Sources(Page[SourceOut]):
    """All sources."""
