"""Ranks of a render over MPI, through mpi4py."""

from __future__ import annotations

import typing as t

import numpy as np
import numpy.typing as npt

#: Bytes of a message: counts of MPI are below 2 GiB.
_MESSAGE = 1 << 28


class Ranks:
    """A communicator of its own, so that no message mixes with those of the caller."""

    def __init__(self, comm: t.Any) -> None:
        try:
            from mpi4py import MPI  # type: ignore[import-not-found,unused-ignore]
        except (ImportError, RuntimeError) as error:
            raise ImportError("comm needs mpi4py and an MPI library: pip install mpi4py") from error
        if not isinstance(comm, MPI.Intracomm):
            raise TypeError(f"comm must be a communicator of mpi4py such as MPI.COMM_WORLD, not {type(comm).__name__}")
        self._byte = MPI.BYTE
        self._comm = comm.Dup()
        self.rank: int = self._comm.Get_rank()
        self.size: int = self._comm.Get_size()

    def exchange(self, fact: str, failed: t.Optional[str]) -> t.List[t.Tuple[str, t.Optional[str]]]:
        """Return what each rank tells."""
        told: t.List[t.Tuple[str, t.Optional[str]]] = self._comm.allgather((fact, failed))
        return told

    def send(self, data: npt.NDArray[np.uint8]) -> None:
        """Send bytes to rank 0, which receives them."""
        for first in range(0, len(data), _MESSAGE):
            self._comm.Send([data[first : first + _MESSAGE], self._byte], dest=0)

    def receive(self, rank: int, size: int) -> npt.NDArray[np.uint8]:
        """Receive the bytes that a rank sends."""
        data = np.empty(size, np.uint8)
        for first in range(0, size, _MESSAGE):
            self._comm.Recv([data[first : first + _MESSAGE], self._byte], source=rank)
        return data

    def free(self) -> None:
        """Free the communicator."""
        self._comm.Free()
