"""The effects that were tried, as an engineer reads them."""

from collections.abc import Iterator, Sequence

from core.rounding import plain
from service.models.workbench.candidates import Candidate
from service.models.workbench.diagnosing import Diagnosed
from service.models.workbench.errors_table import ErrorsTable
from service.models.workbench.values import percent
from service.models.workbench.versions import LEFT_OUT, groups


def candidates_table(found: Diagnosed, tried: Sequence[Candidate]) -> ErrorsTable:
    """For the refitted model, the best first.

    Args:
        found: the diagnosis.
        tried: those to tell of.
    """
    without, parted = found.versions[1], groups(found.records)
    errors = [percent(without.error(names).nrmse) for names in parted.values()]
    floors = found.diagnosis.first.over_floor(found.diagnosis.refitted)
    first = ("none", "", *errors, f"{floors:.3g}", "0", "")
    return ErrorsTable(
        "Effects tried, each added by itself and everything fitted anew",
        ("effect", "family", "error", *(["left out"] if LEFT_OUT in parted else []), "noise floors", "ΔBIC", "remark"),
        (first, *_rows(tried)),
        "Error: of the force, root mean square in percent of it. ΔBIC below −10: the records ask for it.",
        sums=0,
        texts=("family", "remark"),
    )


def _rows(tried: Sequence[Candidate]) -> Iterator[tuple[str, ...]]:
    for one in tried:
        outside = [] if one.after_left_out is None else [percent(one.after_left_out.nrmse)]
        remark = one.implausible or ("best, or cannot be distinguished from it" if one.in_set else "")
        size = (percent(one.after.nrmse), *outside, f"{one.floors:.3g}")
        yield (one.effect, one.family, *size, plain(one.delta_bic, 3), remark)
