"""Small worlds for tests: grids of viewpoints, a tiny agent with random weights, features."""

from pathlib import Path
from typing import NamedTuple

import torch
from torch import Tensor

from tests.grids import WORDS, grid_graph, walks
from vlnhijack import seeds
from vlnhijack.agents.checkpoints import Agent
from vlnhijack.agents.encoder import VitEncoder
from vlnhijack.agents.hamt import Hamt
from vlnhijack.agents.hamt_config import HamtConfig
from vlnhijack.agents.observation import ObservationTable, observation_table
from vlnhijack.agents.reader import Reader
from vlnhijack.agents.vit import VisionTransformer, VitConfig
from vlnhijack.agents.vocabulary import Vocabulary
from vlnhijack.navigation.episode import Episode

VIT = VitConfig((8, 12), patch=4, dim=8, depth=1, heads=2)


class World(NamedTuple):
    """An agent, the table of two scans ("east", "west"), features (24,36,8), episodes of both."""

    agent: Agent
    table: ObservationTable
    features: Tensor
    episodes: list[Episode]


def world(*, no_lang_ca: bool = False, seed: int = 0) -> World:
    """The same world for the same arguments; `no_lang_ca` is HAMT's RxR variant."""
    graphs = [grid_graph("east"), grid_graph("west")]
    agent = tiny_agent(no_lang_ca=no_lang_ca, seed=seed)
    table = observation_table(graphs)
    random = seeds.stream(seed, "features")
    features = torch.from_numpy(random.normal(size=(len(table.index), 36, VIT.dim))).float()
    return World(agent, table, features, [e for graph in graphs for e in walks(graph)])


def tiny_agent(*, no_lang_ca: bool = False, seed: int = 0, scale: float = 0.3) -> Agent:
    """A frozen agent with weights N(0, scale), large enough for decisions that differ."""
    vocabulary = Vocabulary.build(WORDS)
    config = HamtConfig(
        hidden_size=16,
        num_attention_heads=2,
        intermediate_size=32,
        max_position_embeddings=64,
        vocab_size=len(vocabulary),
        max_action_steps=30,
        num_l_layers=1,
        num_x_layers=2,
        num_h_pano_layers=1,
        no_lang_ca=no_lang_ca,
        image_feat_size=VIT.dim,
    )
    encoder, policy = VitEncoder(VisionTransformer(VIT)), Hamt(config)
    generator = torch.Generator().manual_seed(seed)
    for parameter in [*encoder.parameters(), *policy.parameters()]:
        if parameter.dim() > 1:
            torch.nn.init.normal_(parameter, std=scale, generator=generator)
    with torch.no_grad():
        policy.next_action.net[4].weight *= 8
    for model in (encoder, policy):
        model.eval().requires_grad_(False)
    reader = Reader(vocabulary, len(vocabulary))
    return Agent(encoder, policy, reader, {}, Path("tiny.safetensors"))
