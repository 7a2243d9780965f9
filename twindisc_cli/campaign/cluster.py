"""A Dask cluster in place of this machine's processes: scheduling, retries and motion of data are Dask's.

What travels is a pickled item; a worker whose twindisc differs in a file never gets one. Workers may join late or die;
the client must live, and so must the scheduler.

Source: M. Rocklin, Dask: parallel computation with blocked algorithms and task scheduling, SciPy 2015, 126-132.
"""

from __future__ import annotations

import logging
import pickle
import time
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from twindisc_cli.campaign.pool import Lost
from twindisc_cli.errors import DefinitionError, Problem

if TYPE_CHECKING:
    from distributed import Client, Future

Item = TypeVar("Item")
Outcome = TypeVar("Outcome")
Say = Callable[[str], None]

LIBRARIES = ("numpy", "scipy", "h5py", "matplotlib")
"""Libraries that decide the bytes of a result: a worker must have the versions that are here."""
QUEUED = 2
"""Items a thread of the cluster has before it, so that it does not wait for the next."""
PATIENCE = 30.0
"""Seconds to reach the scheduler and its first worker."""
FETCHED = 5.0
"""Seconds for an answer to come from its worker."""
LOSSES = 3
"""An item is given up when all workers that it went to were lost more often than this, as Dask does with each."""
_LOOK = 0.5  # [s] between looks at the workers: far below the minutes that one may be silent


def each(
    work: Callable[[Item], Outcome], items: Iterable[Item], *, address: str, limit: float, say: Say
) -> Generator[tuple[Item, Outcome | Lost]]:
    """work(item) of every item with its item, in the order in which they finish, on the cluster of a scheduler.

    limit [s] for one item. say: called for every worker that is refused.
    """
    with _connected(address) as client:
        crew = _Crew(client, address, say)
        waiting = iter(items)
        running: dict[Future, _Sent[Item]] = {}
        while True:
            stranded = [running.pop(future) for future in list(running) if not crew.holds(running[future].members)]
            again = [replace(sent, members=crew.members, losses=sent.losses + 1) for sent in stranded]
            for sent in [sent for sent in again if sent.losses > LOSSES]:
                again.remove(sent)
                yield sent.item, Lost(1, f"killed its workers ({sent.losses} times)")
            fresh = (_Sent(item, crew.members) for item in _next(waiting, crew.slots - len(running) - len(again)))
            for sent in (*again, *fresh):
                payload = pickle.dumps((work, sent.item))
                future = client.submit(serve, payload, limit, workers=sent.members, pure=False)
                running[future] = sent
            if not running:
                return
            for future in _finished(client, running, address):
                try:
                    outcome = _outcome(future)
                except TimeoutError:
                    continue  # its worker died with the answer: it is computed again, or stranded
                yield running.pop(future).item, outcome


@dataclass(frozen=True)
class _Sent(Generic[Item]):
    """An item on its way, the workers that may take it, and how often all those it went to were lost with it."""

    item: Item
    members: Sequence[str]
    losses: int = 0


def serve(payload: bytes, limit: float) -> Any:
    """On the worker: work(item) of a pickled (work, item), or what it was lost to."""
    from twindisc_cli.campaign.child import ask

    return ask(payload, limit)


class _Crew:
    """The workers that may be given work: those with the versions that are here, as they come and go."""

    def __init__(self, client: Client, address: str, say: Say) -> None:
        self.client, self.say = client, say
        self.here = _asker(LIBRARIES)()
        self.known: dict[str, bool] = {}
        self.threads: dict[str, int] = {}
        self.looked = 0.0
        deadline = time.monotonic() + PATIENCE
        while not self.slots:
            if self.known and not any(self.known.values()):
                raise _refused(f"no worker of {address} can be used; give them the versions that are here")
            if time.monotonic() > deadline:
                raise _refused(f"the scheduler {address} has no worker; start some with `dask worker {address}`")
            time.sleep(_LOOK)

    @property
    def slots(self) -> int:
        """How many items may be on their way."""
        if time.monotonic() - self.looked > _LOOK:
            self._look()
        return QUEUED * sum(self.threads.values())

    def holds(self, members: Sequence[str]) -> bool:
        """Whether one of so many is still there, or there is none that could take their place."""
        return not self.threads or any(address in self.threads for address in members)

    @property
    def members(self) -> list[str]:
        """The addresses of the workers that may be given work."""
        return list(self.threads)

    def _look(self) -> None:
        now = dict(self.client.nthreads())
        if new := [address for address in now if address not in self.known]:
            answers = self.client.run(_asker(LIBRARIES), workers=new, on_error="ignore")
            for address, there in answers.items():
                self.known[address] = there == self.here
                if there != self.here:
                    self.say(_refusal(address, there, self.here))
        self.threads = {address: count for address, count in now.items() if self.known.get(address)}
        self.looked = time.monotonic()


def _asker(libraries: Sequence[str]) -> Callable[[], dict[str, str]]:
    """A function that travels by value, so that a worker with any version of twindisc, or none, can answer it."""

    def ask() -> dict[str, str]:
        from importlib import import_module, metadata

        versions = {}
        try:
            versions["twindisc"] = str(import_module("twindisc_cli").__version__)
            files = import_module("twindisc_cli.digests").program_digest()
            versions["twindisc"] += f" of files {files[:12]}"
        except (ImportError, AttributeError):
            versions.setdefault("twindisc", "missing")
        for name in libraries:
            try:
                versions[name] = metadata.version(name)
            except metadata.PackageNotFoundError:
                versions[name] = "missing"
        return versions

    return ask


def _refusal(who: str, there: dict[str, str], here: dict[str, str]) -> str:
    other = [f"{name} {there.get(name, 'missing')}, here {version}" for name, version in here.items()
             if there.get(name) != version]  # fmt: skip
    return f"{who} is not used: it has {'; '.join(other)}; results would differ"


def _next(waiting: Iterator[Item], count: int) -> Iterator[Item]:
    for _ in range(count):
        try:
            yield next(waiting)
        except StopIteration:
            return


@contextmanager
def _connected(address: str) -> Iterator[Client]:
    """A client of the scheduler; a sentence where there is none, or where Dask is not installed."""
    try:
        from distributed import Client
    except ImportError:
        raise _refused("Dask is not installed: pip install 'twindisc[cluster]'") from None
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what matters is said in a sentence
    try:
        client = Client(address, timeout=PATIENCE)
    except (OSError, ValueError) as error:
        why = str(error).splitlines()[0] if str(error) else "timed out"
        raise _refused(f"no scheduler answers at {address} ({why})") from error
    except TypeError as error:  # what Dask raises where tls:// is asked for and no certificates are
        what = f"{address} asks for TLS, and Dask's settings name no certificates: distributed.comm.tls.client.cert"
        raise _refused(what) from error
    try:
        yield client
    except (OSError, CancelledError) as error:
        raise _gone(address) from error
    finally:
        client.close(timeout=2)


def _finished(client: Client, running: dict[Future, Any], address: str) -> list[Future]:
    """The futures that are done, waiting a moment where none is."""
    from distributed import wait

    with suppress(TimeoutError):
        wait(list(running), timeout=_LOOK, return_when="FIRST_COMPLETED")
    done = [future for future in running if future.done()]
    if client.status != "running" or any(future.status in ("cancelled", "lost") for future in done):
        raise _gone(address)
    return done


def _gone(address: str) -> DefinitionError:
    return _refused(f"the scheduler {address} is gone; what was computed is there, the same call goes on with the rest")


def _refused(what: str) -> DefinitionError:
    return DefinitionError(Problem(what, key="--scheduler"))


def _outcome(future: Future) -> Any:
    """What an item became; TimeoutError where the answer is not there any more."""
    try:
        return future.result(timeout=FETCHED)
    except (TimeoutError, OSError, CancelledError):
        raise
    except Exception as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        return Lost(1, f"killed its workers ({reason})")
