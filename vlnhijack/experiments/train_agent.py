"""Make the small agent: views → encoder → features → policy → measured rates → weights.

Every stage leaves a file in the run folder and is skipped when that file is there, so an
interrupted training goes on where it was.
"""

from collections.abc import Sequence
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

import torch
from rich.progress import Progress
from safetensors.torch import load_file, save
from torch import Tensor

from vlnhijack import __version__, seeds
from vlnhijack.agents.checkpoints import Agent, load_agent, save_agent
from vlnhijack.agents.encoder import VitEncoder
from vlnhijack.agents.hamt import Hamt
from vlnhijack.agents.hamt_config import HamtConfig
from vlnhijack.agents.observation import ObservationTable, observation_table
from vlnhijack.agents.reader import Reader
from vlnhijack.agents.training.encoder import EncoderSchedule, ViewTargets, train_encoder
from vlnhijack.agents.training.imitation import ImitationSchedule, Lessons, train_policy
from vlnhijack.agents.vit import VisionTransformer, VitConfig
from vlnhijack.agents.vocabulary import Vocabulary
from vlnhijack.artifacts import append_row, read_json, write_bytes, write_json
from vlnhijack.evaluation.ablations import ablate, blank_features, rates
from vlnhijack.experiments.views import view_targets
from vlnhijack.experiments.yaml_config import Settings, SquareInt, save_config
from vlnhijack.navigation.episode import Episode, load_episodes
from vlnhijack.scenes.house import House
from vlnhijack.scenes.house_files import load_house
from vlnhijack.scenes.procedural.episodes import reword
from vlnhijack.scenes.procedural.furniture import CATEGORIES
from vlnhijack.scenes.procedural.phrases import ROOM_WORDS, word_groups
from vlnhijack.settings import house_folder

_SAVE_EVERY = 200
ROOM_LABELS = tuple(sorted(set(ROOM_WORDS.values())))


class ViewSize(Settings):
    """Views in pixels, and samples per pixel."""

    width: int = 128
    height: int = 96
    spp: SquareInt = 16


class AgentConfig(Settings):
    """What `vlnhijack agent train` needs; see experiments/small_agent.yaml.

    vit and policy hold the options of VitConfig and HamtConfig that differ from their defaults;
    reworded further instructions are written for each training path;
    blind trains the control that never sees anything but a mid-grey image.
    """

    name: str
    seed: int
    train_houses: list[str]
    unseen_houses: list[str]
    views: ViewSize
    vit: dict[str, Any]
    policy: dict[str, Any]
    encoder: EncoderSchedule
    imitation: ImitationSchedule
    reworded: int = 0
    blind: bool = False


def train_agent(config: AgentConfig, folder: Path, progress: Progress) -> Agent:
    """Run all stages in `folder`; the agent's weights end up in `<folder>/<name>.safetensors`."""
    torch.manual_seed(seeds.integer(config.seed, "weights"))
    save_config(folder / "config.yaml", config)
    houses = {
        name: load_house(house_folder(name))
        for name in [*config.train_houses, *config.unseen_houses]
    }
    table = observation_table([house.graph for house in houses.values()])
    data = {name: _views(config, house, folder, progress) for name, house in houses.items()}
    vit = _encoder(config, [data[name] for name in config.train_houses], folder, progress)
    features = _features(vit, list(data.values()), folder)
    train = _episodes(houses, config.train_houses, "train")
    train += _reworded(config, houses, train, folder, progress)
    vocabulary = Vocabulary.build(episode.instruction for episode in train)
    hamt = Hamt(HamtConfig.from_mapping({"vocab_size": len(vocabulary), **config.policy}))
    agent = Agent(
        VitEncoder(vit).eval(),
        hamt,
        Reader(vocabulary, hamt.config.vocab_size),
        {},
        folder / f"{config.name}.safetensors",
    )
    features = what_it_sees(config, agent, features)
    _policy(config, agent, table, features, train, folder, progress)
    metadata = measure(config, agent, table, features, houses)
    save_agent(replace(agent, metadata=metadata))
    write_json(folder / "rates.json", metadata)
    return load_agent(agent.path)


def what_it_sees(config: AgentConfig, agent: Agent, features: Tensor) -> Tensor:
    """The features (M,36,D) of all views, or of a grey image everywhere for a blind agent."""
    return blank_features(agent, features).contiguous() if config.blind else features


def measure(
    config: AgentConfig,
    agent: Agent,
    table: ObservationTable,
    features: Tensor,
    houses: dict[str, House],
) -> dict[str, Any]:
    """Clean rates (val_seen with ablations, per house, and val_unseen) and provenance."""
    agent.policy.eval()
    seen = _episodes(houses, config.train_houses, "val_seen")
    unseen = _episodes(houses, config.unseen_houses, "val_unseen")
    return {
        "config": config.model_dump(mode="json"),
        "version": __version__,
        "views": config.views.model_dump(),
        "val_seen": ablate(agent, table, features, seen, word_groups(), config.seed),
        "val_seen_by_house": {
            name: rates(agent, table, features, [e for e in seen if e.scan == name])
            for name in config.train_houses
        },
        "val_unseen": rates(agent, table, features, unseen),
    }


def _episodes(houses: dict[str, House], names: Sequence[str], split: str) -> list[Episode]:
    return [
        episode
        for name in names
        for episode in load_episodes(
            house_folder(name) / "episodes" / f"{split}.json", {name: houses[name].graph}
        )
    ]


def _reworded(
    config: AgentConfig,
    houses: dict[str, House],
    episodes: Sequence[Episode],
    folder: Path,
    progress: Progress,
) -> list[Episode]:
    found: list[Episode] = []
    for name in config.train_houses:
        path = folder / "reworded" / f"{name}.json"
        if not path.exists():
            task = progress.add_task(f"instructions in {name}", total=None)
            own = [episode for episode in episodes if episode.scan == name]
            further = reword(houses[name], own, config.seed, config.reworded)
            write_json(path, [asdict(episode) for episode in further])
            progress.update(task, total=1, completed=1)
        found += [Episode(**{**row, "path": tuple(row["path"])}) for row in read_json(path)]
    return found


def _views(config: AgentConfig, house: House, folder: Path, progress: Progress) -> ViewTargets:
    path = folder / "views" / f"{house.name}.safetensors"
    names = [field.name for field in fields(ViewTargets)]
    if path.exists():
        return ViewTargets(**load_file(path))
    task = progress.add_task(f"views of {house.name}", total=None)
    found = view_targets(
        house,
        CATEGORIES,
        ROOM_LABELS,
        width=config.views.width,
        height=config.views.height,
        patch=VitConfig(**config.vit).patch,
        spp=config.views.spp,
        seed=seeds.integer(config.seed, "views", house.name),
    )
    write_bytes(path, save({name: getattr(found, name).contiguous() for name in names}))
    progress.update(task, total=1, completed=1)
    return found


def _encoder(
    config: AgentConfig, data: Sequence[ViewTargets], folder: Path, progress: Progress
) -> VisionTransformer:
    vit = VisionTransformer(VitConfig(**config.vit))
    path = folder / "encoder.safetensors"
    if path.exists():
        vit.load_state_dict(load_file(path))
        return vit.eval()
    joined = ViewTargets(
        *(torch.cat([getattr(part, field.name) for part in data]) for field in fields(ViewTargets))
    )
    schedule = config.encoder
    task = progress.add_task(
        "encoder", total=schedule.epochs * (len(joined.images) // schedule.batch)
    )
    losses = []
    for step, loss in train_encoder(
        vit, joined, len(CATEGORIES), len(ROOM_LABELS), schedule, config.seed
    ):
        losses.append(loss)
        progress.update(task, completed=step, description=f"encoder, loss {loss:.3f}")
    write_json(folder / "encoder_loss.json", losses)
    write_bytes(path, save(vit.state_dict()))
    return vit.eval()


@torch.no_grad()
def _features(vit: VisionTransformer, data: Sequence[ViewTargets], folder: Path) -> Tensor:
    path = folder / "features.safetensors"
    if path.exists():
        return load_file(path)["features"]
    encoder = VitEncoder(vit).eval()
    parts = [encoder(part.float() / 255) for views in data for part in views.images.split(288)]
    features = torch.cat(parts).view(-1, 36, encoder.feature_size)
    write_bytes(path, save({"features": features}))
    return features


def _policy(
    config: AgentConfig,
    agent: Agent,
    table: ObservationTable,
    features: Tensor,
    episodes: Sequence[Episode],
    folder: Path,
    progress: Progress,
) -> None:
    schedule, policy = config.imitation, agent.policy
    optimiser = torch.optim.AdamW(
        policy.parameters(), schedule.lr, weight_decay=schedule.weight_decay
    )
    first = _restore(folder, policy, optimiser)
    task = progress.add_task("policy", total=schedule.steps, completed=first)
    losses: list[float] = []
    for step, loss in train_policy(
        policy,
        Lessons(table, features, agent.reader, episodes),
        schedule,
        config.seed,
        optimiser,
        first_step=first,
    ):
        losses.append(loss)
        recent = sum(losses[-50:]) / len(losses[-50:])
        progress.update(task, completed=step, description=f"policy, loss {recent:.3f}")
        if step % _SAVE_EVERY == 0 or step == schedule.steps:
            _checkpoint(folder, policy, optimiser, step)
            append_row(folder / "policy_loss.jsonl", {"step": step, "loss": recent})
    policy.eval().requires_grad_(False)


def _checkpoint(folder: Path, policy: Hamt, optimiser: torch.optim.Optimizer, step: int) -> None:
    names = dict(enumerate(name for name, _ in policy.named_parameters()))
    tensors = {f"policy.{name}": value for name, value in policy.state_dict().items()}
    for index, state in optimiser.state_dict()["state"].items():
        tensors |= {f"optimiser.{key}.{names[index]}": value for key, value in state.items()}
    write_bytes(folder / "policy.safetensors", save(tensors))
    write_json(folder / "policy.json", {"step": step})


def _restore(folder: Path, policy: Hamt, optimiser: torch.optim.Optimizer) -> int:
    if not (folder / "policy.json").exists():
        return 0
    tensors = load_file(folder / "policy.safetensors")
    policy.load_state_dict(
        {
            name.removeprefix("policy."): t
            for name, t in tensors.items()
            if name.startswith("policy.")
        }
    )
    for name, parameter in policy.named_parameters():
        if f"optimiser.step.{name}" in tensors:
            optimiser.state[parameter] = {
                key: tensors[f"optimiser.{key}.{name}"] for key in ("step", "exp_avg", "exp_avg_sq")
            }
    return int(read_json(folder / "policy.json")["step"])
