"""What every stage of a run shares."""

from collections.abc import Iterable, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.progress import Progress
from torch import Tensor

from vlnhijack import seeds
from vlnhijack.agents.checkpoints import Agent, load_agent
from vlnhijack.agents.observation import ObservationTable, observation_table
from vlnhijack.agents.precision import default_precision, set_precision
from vlnhijack.artifacts import sha256
from vlnhijack.errors import InputError
from vlnhijack.experiments.config import (
    DrawnInstances,
    ExperimentConfig,
    PickedInstance,
    StoredInstances,
)
from vlnhijack.experiments.instances.files import load_instances
from vlnhijack.experiments.instances.houses import rendered_places
from vlnhijack.experiments.instances.rules import Scan
from vlnhijack.experiments.views import coverage_table
from vlnhijack.navigation.episode import Episode, load_episodes
from vlnhijack.scenes.house import House
from vlnhijack.scenes.house_files import load_house
from vlnhijack.settings import WEIGHTS, house_folder, scenes_folder


@dataclass(frozen=True, eq=False)
class Context:
    """An experiment's agent and houses, loaded once, and its run folder.

    houses and folders: each house and its folder, by the name of the house.
    """

    config: ExperimentConfig
    folder: Path
    progress: Progress
    agent: Agent
    houses: dict[str, House]
    folders: dict[str, Path]

    @cached_property
    def table(self) -> ObservationTable:
        return observation_table([house.graph for house in self.houses.values()])

    @cached_property
    def rounded_agent(self) -> Agent:
        """The agent that textures are optimised on, at the precisions of the experiment."""
        wanted = self.config.precision
        encoder, policy = deepcopy((self.agent.encoder, self.agent.policy))
        set_precision(encoder, wanted.vision or default_precision(encoder.feature_size))
        set_precision(policy, wanted.policy or default_precision(policy.config.hidden_size))
        return replace(self.agent, vision=encoder, policy=policy)

    @cached_property
    def inputs(self) -> dict[str, dict[str, str]]:
        """SHA-256 of the files that the clean views of every house hang on."""
        agent = {self.agent.path.name: sha256(self.agent.path)}
        return {
            name: agent
            | {
                f"{name}/{file}": sha256(folder / file)
                for file in ("house.json", f"{name}_connectivity.json")
            }
            for name, folder in self.folders.items()
        }

    def rows(self, scan: str) -> slice:
        """Rows of a scan's viewpoints in the table and in feature tensors."""
        graph = self.houses[scan].graph
        first = self.table.index[scan, graph.viewpoints[0]]
        return slice(first, first + len(graph.viewpoints))

    def seed(self, *names: str | int) -> int:
        """The integer seed named by `names` under the experiment's seed."""
        return seeds.integer(self.config.seed, *names)

    @cached_property
    def coverage(self) -> dict[str, NDArray[np.float32]]:
        """Share (M,36,O) of every view that each object fills, of every house."""
        height, width = self.agent.encoder.image_size
        return {name: coverage_table(house, width, height) for name, house in self.houses.items()}

    @cached_property
    def scans(self) -> dict[str, Scan]:
        """What decides the instances of every house."""
        return {
            name: Scan(
                graph=house.graph,
                places=rendered_places(house, self.coverage[name]),
                train=episodes_of(house, self.folders[name], "train"),
                val_seen=episodes_of(house, self.folders[name], "val_seen"),
            )
            for name, house in self.houses.items()
        }

    def scan_of(self, house: str) -> Scan:
        """What decides the instances of a house of the experiment, given by its name or path."""
        wanted = house_folder(house)
        return next(self.scans[name] for name, path in self.folders.items() if path == wanted)

    def place(self, features: Tensor, scan: str) -> Tensor:
        """Features (M,36,D) of one scan in a tensor of all viewpoints of the table."""
        everywhere = features.new_zeros(len(self.table.index), *features.shape[1:])
        everywhere[self.rows(scan)] = features
        return everywhere


def load_context(config: ExperimentConfig, folder: Path, progress: Progress) -> Context:
    """Load the agent and the houses that the experiment names.

    Raises InputError where the agent has no recorded rate in a house or cannot read its episodes,
    or where two houses have the same name.
    """
    found = load_houses(house_list(config.instances))
    agent = load_agent(agent_file(config.agent))
    for path, house in found.items():
        recorded_rate(agent, house.name, path)
        agent.reader(episodes_of(house, path, "val_seen"))
    houses = {house.name: house for house in found.values()}
    folders = {house.name: path for path, house in found.items()}
    return Context(config, folder, progress, agent, houses, folders)


def load_houses(wanted: Iterable[str]) -> dict[Path, House]:
    """Houses given by name or path, by their folders; InputError where two have the same name."""
    houses = {path: load_house(path) for path in dict.fromkeys(map(house_folder, wanted))}
    if len({house.name for house in houses.values()}) < len(houses):
        received = ", ".join(f"{house.name} in {path}" for path, house in houses.items())
        raise InputError(field="house", expected="houses of different names", received=received)
    return houses


def recorded_rate(agent: Agent, scan: str, folder: Path) -> float:
    """The clean success rate on val_seen of a house that is stored with the agent's weights."""
    known = agent.metadata.get("val_seen_by_house", {})
    house = scan if folder == scenes_folder() / scan else folder
    command = f"vlnhijack agent eval {agent.path} --house {house} --record"
    if scan not in known:
        raise InputError(
            file=agent.path.with_suffix(".json"),
            field="metadata.val_seen_by_house",
            expected=f"the clean rate in {scan} ({command})",
            received=", ".join(known) or "none",
        )
    return float(known[scan]["sr"])


def house_list(wanted: list[PickedInstance] | DrawnInstances | StoredInstances) -> list[str]:
    """The houses that an experiment's attacks lie in."""
    if isinstance(wanted, DrawnInstances):
        return list(wanted.houses)
    if isinstance(wanted, StoredInstances):
        return sorted({attack.scan for attack in load_instances(Path(wanted.file))})
    return sorted({picked.house for picked in wanted})


def agent_file(name: str) -> Path:
    """Weights shipped under that name, or a path to a .safetensors file."""
    return Path(name) if name.endswith(".safetensors") else WEIGHTS / f"{name}.safetensors"


def episodes_of(house: House, folder: Path, split: str) -> Sequence[Episode]:
    """Episodes of a split ("train", "val_seen", "val_unseen") of the house in `folder`."""
    return load_episodes(folder / "episodes" / f"{split}.json", {house.name: house.graph})
