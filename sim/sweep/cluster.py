"""A Dask cluster for a sweep: a running one, or one started on this computer for the duration of the sweep."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Iterator
from typing import Any

from ibvs_qp.config.errors import ConfigError
from sim.sweep.fingerprint import code_hash
from sim.sweep.pools import Pool, dask_pool

#: Time-outs of the connection to a scheduler, and of the first worker of a cluster [s].
CONNECT_S, FIRST_WORKER_S = 10.0, 120.0


@contextlib.contextmanager
def cluster_pool(scheduler: str | None, workers: int) -> Iterator[Pool]:
    """A pool on a Dask cluster, closed with the context.

    Args:
        scheduler: Address of a running cluster such as ``tcp://head:8786``; None starts one here.
        workers: Processes of the cluster started here.

    Yields:
        The pool.

    Raises:
        ConfigError: When Dask is not installed, the scheduler does not answer, or a worker is unsuitable.
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
            settings: dict[str, Any] = {"n_workers": workers, "threads_per_worker": 1, "dashboard_address": None}
            client = distributed.Client(stack.enter_context(distributed.LocalCluster(**settings)))
        else:
            try:
                client = distributed.Client(scheduler, timeout=CONNECT_S, set_as_default=False)
            except (OSError, ValueError, TypeError) as error:
                reason = str(error).split("\n")[0]
                raise ConfigError(
                    f"no Dask scheduler answers at {scheduler} ({reason}); give the address that `dask scheduler` "
                    "prints, such as tcp://head:8786, with --scheduler"
                ) from None
        require_usable(stack.enter_context(client))
        yield dask_pool(client)


def require_usable(client: Any) -> None:
    """Refuse a cluster without workers, with threaded workers, or with another version of the code.

    Raises:
        ConfigError: With the worker and the remedy.
    """
    try:
        client.wait_for_workers(1, timeout=FIRST_WORKER_S)
    except TimeoutError:
        raise ConfigError(
            f"the cluster has no worker after {FIRST_WORKER_S:.0f} s; start one with `dask worker ADDRESS --nthreads 1`"
        ) from None
    for worker, threads in client.nthreads().items():
        if threads != 1:
            raise ConfigError(
                f"worker {worker} has {threads} threads, and flights share the interpreter's lock; "
                f"start it with --nthreads 1 --nworkers {threads}"
            )
    for worker, code in client.run(code_hash).items():
        if code != code_hash():
            raise ConfigError(f"worker {worker} has other code than this computer; install the same version there")
