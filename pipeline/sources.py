"""Tables as they are read from sources, before any edit: a stage of its own for studies.

Scenarios edit what is read once, and the store keeps it: a city is read once for all studies.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from pipeline import ingest
from pipeline.config import Config
from pipeline.execution import Run
from pipeline.ingest_config import IngestSection
from pipeline.progress import Watch
from pipeline.stages import Outcome, Stage, Task
from pipeline.study_folder import StudyFolder

if TYPE_CHECKING:
    from uxsim_geo.demand.demand import Demand
    from uxsim_geo.network.network import Network
    from uxsim_geo.network.telling import Telling


def _run(task: Task) -> Outcome:
    from uxsim_geo.demand.files import write_demand
    from uxsim_geo.network.files import write_network

    network, demand = ingest.read_sources(task.config.ingest, task.watch.drawn)
    task.begin_writing()
    paths = write_network(network, task.folder / ingest.NETWORK)
    paths += write_demand(demand, task.folder / ingest.DEMAND)
    names = [path.relative_to(task.folder.path).as_posix() for path in paths]
    return Outcome(names, ingest.in_words(network, demand))


STAGE = Stage(
    "sources",
    ("ingest",),
    lambda config, _folder: ingest.source_files(config.ingest),
    _run,
    ingest.fetch,
    ingest.downloads,
    storable=True,
)


@dataclass
class Sources:
    """Reads the files of a section once, however many scenarios edit what is in them.

    base
        a configuration, of which ``ingest`` is replaced by what is to be read
    force
        whether they are read again also where the store has what is in them
    """

    base: Config
    folder: StudyFolder
    command: Sequence[str]
    watch: Watch
    force: bool = False
    read: list[tuple[IngestSection, tuple[Network, Demand]]] = field(default_factory=list)

    def __call__(
        self,
        section: IngestSection,
        progress: Telling | None = None,  # noqa: ARG002  the stage tells its own
    ) -> tuple[Network, Demand]:
        """Return network and demand, as :func:`pipeline.ingest.read_sources`."""
        for known, tables in self.read:
            if known == section:
                return tables
        tables = self._read(section)
        self.read.append((section, tables))
        return tables

    def _read(self, section: IngestSection) -> tuple[Network, Demand]:
        from uxsim_geo.demand.files import read_demand
        from uxsim_geo.network.files import read_network

        config = self.base.model_copy(update={"ingest": section})
        folder = self.folder.sources(section)
        run = Run(config, folder, self.watch, self.command, (STAGE,), self.folder.store)
        run.execute(STAGE.name, force=self.force)
        return read_network(folder / ingest.NETWORK), read_demand(folder / ingest.DEMAND)
