"""Ways to identify A and C of x(t+1) = A x + B u, y = C x + D u from its input and output: ours and the peers'.

Each takes inputs (m, n), outputs (p, n), the number of block rows and the order. Peers are called as their documents
say, for A and C alone where they can leave out the rest.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from core.arrays import Matrix
from core.identification.projection import project
from core.identification.subspace import extended_observability, moesp

Identify = Callable[[Matrix, Matrix, int, int], tuple[Matrix, Matrix]]


@dataclass(frozen=True, slots=True)
class Identifier:
    """One way."""

    module: str
    identify: Identify


def ours(u: Matrix, y: Matrix, block_rows: int, order: int) -> tuple[Matrix, Matrix]:
    """MOESP by lag products."""
    return extended_observability(project(u, y, block_rows), moesp).system(order)


def slicot(algorithm: str) -> Identify:
    """IB01AD and IB01BD, MOESP, by way of the package ctrlsys; `algorithm` is theirs: C for Cholesky, Q for QR."""

    def identify(u: Matrix, y: Matrix, block_rows: int, order: int) -> tuple[Matrix, Matrix]:
        import ctrlsys
        import numpy as np

        m, p, n = len(u), len(y), u.shape[1]
        columns = np.asfortranarray(u.T), np.asfortranarray(y.T)
        _, r, _, _, info = ctrlsys.ib01ad("M", algorithm, "N", "O", "N", "N", block_rows, m, p, *columns, 0.0, -1.0)
        if info:
            raise RuntimeError(f"IB01AD ended with {info}")
        A, C, *_, info = ctrlsys.ib01bd("M", "C", "N", block_rows, order, m, p, n, r, 0.0)
        if info:
            raise RuntimeError(f"IB01BD ended with {info}")
        return A, C

    return identify


def pyoma(u: Matrix, y: Matrix, block_rows: int, order: int) -> tuple[Matrix, Matrix]:
    """Covariance-driven with inputs ("IOcov"), of one order."""
    from pyoma2.functions.ssi import SSI_fast, build_hank

    hankel, _ = build_hank(y, y, block_rows, "IOcov", U=u)
    _, A, C, _ = SSI_fast(hankel, block_rows, order, step=order)
    return A[-1], C[-1]


def mdof_srim(u: Matrix, y: Matrix, block_rows: int, order: int) -> tuple[Matrix, Matrix]:
    """Juang's SRIM; its horizon is the past and the future together."""
    from mdof.realize import srim

    A, _, C, _ = srim(u, y, horizon=2 * block_rows, order=order, find="AC", full=False)
    return A, C


def sippy(u: Matrix, y: Matrix, block_rows: int, order: int) -> tuple[Matrix, Matrix]:
    """MOESP."""
    from sippy_unipi.OLSims_methods import OLSims

    A, _, C, *_ = OLSims(y, u, block_rows, "MOESP", fixed_order=order)
    return A, C


def nfoursid(u: Matrix, y: Matrix, block_rows: int, order: int) -> tuple[Matrix, Matrix]:
    """Its one method, PO-MOESP, and the system."""
    import numpy as np
    import pandas as pd
    from nfoursid.nfoursid import NFourSID

    inputs, outputs = [f"u{i}" for i in range(len(u))], [f"y{i}" for i in range(len(y))]
    frame = pd.DataFrame(np.vstack([u, y]).T, columns=[*inputs, *outputs])
    way = NFourSID(frame, outputs, inputs, block_rows)
    way.subspace_identification()
    system, _ = way.system_identification(order)
    return system.a, system.c


OURS = "core.identification.subspace"
FASTEST_PEER = "SLICOT, Cholesky"
IDENTIFIERS: Mapping[str, Identifier] = MappingProxyType(
    {
        OURS: Identifier("core.identification.subspace", ours),
        FASTEST_PEER: Identifier("ctrlsys", slicot("C")),
        "SLICOT, QR": Identifier("ctrlsys", slicot("Q")),
        "pyOMA-2": Identifier("pyoma2.functions.ssi", pyoma),
        "mdof, SRIM": Identifier("mdof.realize", mdof_srim),
        "sippy-unipi": Identifier("sippy_unipi", sippy),
        "nfoursid": Identifier("nfoursid.nfoursid", nfoursid),
    }
)
