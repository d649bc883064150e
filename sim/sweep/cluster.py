"""A Dask cluster for a sweep: one that runs already, or one started on this computer for as long as the sweep takes."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Iterator
from typing import TYPE_CHECKING

from ibvs_qp.config.errors import ConfigError
from sim.sweep.fingerprint import code_hash
from sim.sweep.pools import Pool, dask_pool

if TYPE_CHECKING:
    from distributed import Client

#: A scheduler that does not answer, and a cluster without a worker, are given up after this long [s].
CONNECT_S, FIRST_WORKER_S = 10.0, 120.0


@contextlib.contextmanager
def cluster_pool(scheduler: str | None, workers: int) -> Iterator[Pool]:
    """A pool on a Dask cluster, closed with the context.

    Args:
        scheduler: Address such as ``tcp://head:8786`` of a cluster that runs; None starts one here.
        workers: Processes of the one started here.

    Yields:
        The pool.

    Raises:
        ConfigError: When Dask is not installed, nobody answers, or the workers cannot be used.
    """
    try:
        import distributed
    except ImportError:
        raise ConfigError(
            "a Dask cluster needs the extra cluster: pip install -c constraints.txt -e '.[cluster]'"
        ) from None
    logging.getLogger("distributed").setLevel(logging.ERROR)
    with contextlib.ExitStack() as stack:
        if scheduler is None:
            local = distributed.LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                dashboard_address=None,  # type: ignore[arg-type]
            )
            client = stack.enter_context(distributed.Client(stack.enter_context(local)))
        else:
            client = stack.enter_context(_connect(scheduler))
        require_usable(client)
        yield dask_pool(client)


def _connect(scheduler: str) -> Client:
    from distributed import Client

    try:
        return Client(scheduler, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        reason = str(error).split("\n")[0]
        raise ConfigError(
            f"no Dask scheduler answers at {scheduler} ({reason}); give the address that `dask scheduler` prints, "
            "such as tcp://head:8786, with --scheduler"
        ) from None


def require_usable(client: Client) -> None:
    """Refuse a cluster without workers, with threaded workers, or whose workers fly other code.

    Raises:
        ConfigError: Naming the worker and the mend.
    """
    try:
        client.wait_for_workers(1, timeout=FIRST_WORKER_S)
    except TimeoutError:
        raise ConfigError(
            f"the cluster has no worker after {FIRST_WORKER_S:.0f} s; start one with `dask worker ADDRESS --nthreads 1`"
        ) from None
    for worker, threads in dict(client.nthreads()).items():  # type: ignore[arg-type]
        if threads != 1:
            raise ConfigError(
                f"worker {worker} has {threads} threads, and flights share the interpreter's lock; "
                f"start it with --nthreads 1 --nworkers {threads}"
            )
    for worker, code in dict(client.run(code_hash)).items():  # type: ignore[arg-type]
        if code != code_hash():
            raise ConfigError(f"worker {worker} flies other code than this computer; install the same version there")
