"""Links and keys as the API and the pages show them, and the requests about them."""

from collections.abc import Mapping
from datetime import datetime, timedelta
from typing import Annotated, Literal, TypedDict

from pydantic import BaseModel, ConfigDict, Field, model_validator

from service.access.links import DAYS, MOST_DAYS
from service.access.roles import Role
from service.access.tables import ApiKey, BuildingLink
from service.schema import Answer

ONE_LINE = r"^[^\x00-\x1f]+$"


Code = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{1,32}$")]
RoleName = Literal["viewer", "engineer", "admin"]
Days = Annotated[int, Field(ge=1, le=3650)]


class LinkRequest(BaseModel):
    """A link to make."""

    model_config = ConfigDict(extra="forbid")

    name: str = Field(
        min_length=1,
        max_length=64,
        pattern=ONE_LINE,
        description="Person or purpose that it is for.",
        examples=["owner"],
    )
    days: int = Field(DAYS, ge=1, le=MOST_DAYS, description="Days until it ends.")


class LinkOut(Answer):
    """A link by which whoever has it reads the pages of one building; its token is not shown."""

    id: int = Field(description="Its number.")
    building: str = Field(description="Code of the building.")
    name: str = Field(description="Person or purpose that it is for.")
    begins_with: str = Field(description="Beginning of its token.")
    created_by: str = Field(description="Caller who made it.")
    created_at: datetime = Field(description="Time when it was made.")
    expires_at: datetime = Field(description="Its end.")
    revoked_at: datetime | None = Field(description="Time when it was revoked; null if it was not.")
    used_at: datetime | None = Field(description="Time of the last use, to about a minute; null before the first.")


class LinkMade(LinkOut):
    """A new link."""

    address: str = Field(description="Its address: shown now and never again.")


class Links(Answer):
    """Links to a building, the latest first; ended and revoked ones too."""

    items: list[LinkOut] = Field(description="The links.")


def link_out(link: BuildingLink) -> LinkOut:
    """A link, without its secret."""
    return LinkOut(
        id=link.id,
        building=link.building.code,
        name=link.name,
        begins_with=link.hash.partition(":")[0],
        created_by=link.created_by,
        created_at=link.created_at,
        expires_at=link.expires_at,
        revoked_at=link.revoked_at,
        used_at=link.used_at,
    )


class Granted(TypedDict):
    """Arguments of a new key: what it may do, and where."""

    name: str
    role: Role
    buildings: list[str] | None
    higher: Mapping[str, Role]


class KeyRequest(BaseModel):
    """A key to make."""

    model_config = ConfigDict(extra="forbid")

    name: str = Field(
        min_length=1,
        max_length=64,
        pattern=ONE_LINE,
        description="Who or what uses it; names are never used again.",
        examples=["dashboard"],
    )
    role: RoleName = Field(description="Role on every building of the key.", examples=["viewer"])
    buildings: list[Code] | None = Field(
        None, min_length=1, max_length=1000, description="Codes of its buildings; null: all."
    )
    higher: dict[Code, RoleName] = Field(
        default_factory=dict,
        max_length=1000,
        description="Higher roles on single buildings, by their codes.",
        json_schema_extra={"additionalProperties": False},
    )
    days: Days | None = Field(None, description="Days until it ends; null: only when it is revoked.")

    def granted(self) -> Granted:
        """The roles that the key gives."""
        higher = {code: Role[role] for code, role in self.higher.items()}
        return {"name": self.name, "role": Role[self.role], "buildings": self.buildings, "higher": higher}


class KeyLimit(BaseModel):
    """New limits of a key; omitted ones stay as they are."""

    model_config = ConfigDict(extra="forbid")

    buildings: list[Code] | None = Field(
        None, min_length=1, max_length=1000, description="Codes of the buildings that remain."
    )
    days: Days | None = Field(None, description="Days from now until it ends; no later than before.")


class KeyForm(KeyRequest):
    """A key to make by the form of the page, where buildings and roles are words."""

    @model_validator(mode="before")
    @classmethod
    def _lists(cls, fields: dict[str, str]) -> dict[str, object]:
        return _split(fields)


class KeyLimitForm(KeyLimit):
    """New limits of a key by the form of the page."""

    @model_validator(mode="before")
    @classmethod
    def _lists(cls, fields: dict[str, str]) -> dict[str, object]:
        return _split(fields)


def _split(fields: dict[str, str]) -> dict[str, object]:
    """The fields with lists of words as lists: `TWR BNCS`, and `TWR=engineer`."""
    words = {name: fields[name].replace(",", " ").split() for name in ("buildings", "higher") if name in fields}
    lists: dict[str, object] = {"buildings": words["buildings"]} if "buildings" in words else {}
    if "higher" in words:
        lists["higher"] = {code: role for code, _, role in (one.partition("=") for one in words["higher"])}
    return fields | lists


class KeyOut(Answer):
    """A key, without its secret."""

    id: int = Field(description="Its number.")
    name: str = Field(description="Who or what uses it.")
    role: str = Field(description="`viewer`, `engineer` or `admin`: on every building of the key.")
    buildings: list[str] | None = Field(description="Codes of its buildings; null: all.")
    higher: dict[str, str] = Field(description="Higher roles on single buildings, by their codes.")
    begins_with: str = Field(description="Beginning of the key.")
    created_at: datetime = Field(description="Time when it was made.")
    expires_at: datetime | None = Field(description="Its end; null: only when it is revoked.")
    revoked_at: datetime | None = Field(description="Time when it was revoked; null if it was not.")
    used_at: datetime | None = Field(description="Time of the last use, to about a minute; null before the first.")


class KeyMade(KeyOut):
    """A new key."""

    key: str = Field(description="The key: shown now and never again.")


class Keys(Answer):
    """All keys, revoked ones too, by name."""

    items: list[KeyOut] = Field(description="The keys.")


def key_out(key: ApiKey) -> KeyOut:
    """A key, without its secret."""
    return KeyOut(
        id=key.id,
        name=key.name,
        role=key.role,
        buildings=key.buildings,
        higher=key.higher or {},
        begins_with=key.hash.partition(":")[0],
        created_at=key.created_at,
        expires_at=key.expires_at,
        revoked_at=key.revoked_at,
        used_at=key.used_at,
    )


def end_of(days: int | None, now: datetime) -> datetime | None:
    """The time after a number of days from now; None without a number."""
    return None if days is None else now + timedelta(days=days)
