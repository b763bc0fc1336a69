"""Contact of the base with the wall of its moat: linear, each side with its own gap. Anagnostopoulos (1988)."""

from core.effect import Effect, LogNormal, Parameter


def law(u, gap, gap_back, wall, wall_back):
    return wall * max(u - gap, 0.0) + wall_back * min(u + gap_back, 0.0)


EFFECT = Effect(
    title="Contact with the moat wall",
    law=law,
    linear=("wall", "wall_back"),
    parameters=(
        Parameter("gap", "m", (1e-3, 3.0), LogNormal(0.1, 1.0), "clearance in the positive direction"),
        Parameter("gap_back", "m", (1e-3, 3.0), LogNormal(0.1, 1.0), "clearance in the negative direction"),
        Parameter(
            "wall", "N/m", (0.0, 1e13), LogNormal(1e9, 2.0), "stiffness of the contact in the positive direction"
        ),
        Parameter(
            "wall_back", "N/m", (0.0, 1e13), LogNormal(1e9, 2.0), "stiffness of the contact in the negative direction"
        ),
    ),
    absent={"wall": 0.0, "wall_back": 0.0},
    family="stiffening at large displacement",
    explanation="Beyond {gap} the base meets a stop of stiffness {wall}; in the negative direction, beyond "
    "{gap_back}, one of {wall_back}.",
    suspect_when="The force rises abruptly at the same displacement each time, and floor accelerations show spikes at "
    "that moment.",
    source="Anagnostopoulos (1988): pounding by linear springs across a gap",
)
