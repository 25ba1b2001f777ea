"""The processes that do the work."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass

from bench.distribution.processes import by_processes
from bench.distribution.work import Result, Task, Work


@dataclass(frozen=True)
class Workforce:
    """The processes that do the work: so many (`jobs`) of this machine, or the cluster whose Dask scheduler is at an address.

    `local` makes a cluster of so many processes here.
    """

    jobs: int
    cluster: str = ""

    def results(self, work: Work[Result], tasks: Sequence[Task]) -> Generator[Result, None, None]:
        """Give the results as they come, in any order; none is lost with a process that dies.

        Raises InputError where a part ends every process that has it, or there is no such cluster.
        """
        if self.cluster:
            from bench.distribution.cluster import by_cluster

            return by_cluster(work, tasks, self.cluster, self.jobs)
        return by_processes(work, tasks, self.jobs)
