"""What one more accelerometer would narrow, as a document: the command's file. SI units."""

from pydantic import BaseModel, Field

from core.workbench.added_sensors import AddedSensor, AddedSensors, Today
from service.schema import Number
from service.version import VERSION


class TodayOut(BaseModel):
    """Standard deviations in one direction with the sensors that there are."""

    direction: str
    records: int
    force: Number = Field(description="N.")
    frequency: list[Number] = Field(description="Hz, fixed-base modes.")
    frequency_std: list[Number] = Field(description="Hz.")

    @classmethod
    def of(cls, one: Today) -> "TodayOut":
        """The same of core."""
        return cls(
            direction=one.direction,
            records=one.records,
            force=one.force,
            frequency=one.frequency.tolist(),
            frequency_std=one.frequency_std.tolist(),
        )


class SensorOut(BaseModel):
    """One more accelerometer; ratios are of standard deviations with it to those without."""

    direction: str
    level: str
    force: Number = Field(description="N, standard deviation of the force with it.")
    force_ratio: Number
    frequency_ratios: list[Number] = Field(description="By mode.")
    damping_ratios: list[Number] = Field(description="By mode.")

    @classmethod
    def of(cls, one: AddedSensor) -> "SensorOut":
        """The same of core."""
        return cls(
            direction=one.direction,
            level=one.level,
            force=one.force,
            force_ratio=one.force_ratio,
            frequency_ratios=one.frequency_ratios.tolist(),
            damping_ratios=one.damping_ratios.tolist(),
        )


class AddedSensorsDocument(BaseModel):
    """Every level without an accelerometer, that which narrows the force most first."""

    version: str = VERSION
    building: str
    today: list[TodayOut]
    sensors: list[SensorOut]
    remarks: list[str]


def document(result: AddedSensors) -> AddedSensorsDocument:
    """The result as a document."""
    return AddedSensorsDocument(
        building=result.building,
        today=[TodayOut.of(one) for one in result.today],
        sensors=[SensorOut.of(one) for one in result.sensors],
        remarks=list(result.remarks),
    )
