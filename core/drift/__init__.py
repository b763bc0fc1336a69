"""Drift: changes of a building's quantities at equal amplitude and temperature, event after event.

`monitor` fits the baseline of a series to a reference period and runs the rules over the deviations of later events;
`pooled` does the same for the mean of two directions; `explanations` tests a wrong mass or gain against all series.
docs/operate/drift.md has the method, its measured error rates and its assumptions.
"""
