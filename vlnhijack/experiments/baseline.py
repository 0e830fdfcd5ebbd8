"""Clean features of every house, and the gate that they pass."""

import time
from functools import partial

import torch
from torch import Tensor

from vlnhijack.agents.features import Features, cached_features
from vlnhijack.artifacts import read_json, sha256, write_json
from vlnhijack.errors import InputError
from vlnhijack.evaluation.evaluate import navigate
from vlnhijack.evaluation.gate import check_baseline
from vlnhijack.experiments.context import Context
from vlnhijack.experiments.views import encode_house
from vlnhijack.settings import house_folder


def clean_features(context: Context, scan: str) -> Tensor:
    """Features (M,36,D) of the clean house, at the samples of the evaluation."""
    house, encoder = context.houses[scan], context.agent.encoder
    spp = context.config.rendering.evaluation_spp
    seed = context.seed("views", "evaluation", scan)
    house_hash = sha256(house_folder(scan) / "house.json")

    def encode() -> Features:
        task = context.progress.add_task(
            f"clean views of {scan}", total=36 * len(house.graph.viewpoints)
        )
        advance = partial(context.progress.advance, task)
        return encode_house(house, encoder, spp, seed, advance).numpy()

    features = cached_features(
        context.folder / "baseline" / f"{scan}.hdf5",
        house.graph,
        encoder.feature_size,
        encoder.image_size,
        f"agent {sha256(context.agent.path)}, house {house_hash}, {spp} spp, seed {seed}",
        encode,
    )
    return torch.from_numpy(features)


def baseline(context: Context, scan: str) -> float:
    """Pass the gate or raise CheckError; the seconds that this took when it was done."""
    path = context.folder / "baseline" / f"{scan}.json"
    if path.exists():
        return float(read_json(path)["seconds"])
    started = time.perf_counter()
    features = context.place(clean_features(context, scan), scan)
    episodes = context.scans[scan].val_seen
    scores = navigate(context.agent, context.table, features, episodes)
    successes = int(sum(score.success for score in scores))
    recorded = _recorded_rate(context, scan)
    check_baseline(scan, successes, len(episodes), recorded)
    seconds = time.perf_counter() - started
    write_json(
        path,
        {
            "successes": successes,
            "episodes": len(episodes),
            "recorded_sr": recorded,
            "seconds": seconds,
        },
    )
    return seconds


def _recorded_rate(context: Context, scan: str) -> float:
    """The agent's own clean rate in a house, else the one that the experiment asks for."""
    known = context.agent.metadata.get("val_seen_by_house", {})
    if scan in known:
        return float(known[scan]["sr"])
    if context.config.baseline_sr is not None:
        return context.config.baseline_sr
    raise InputError(
        file=context.agent.path.with_suffix(".json"),
        field="metadata.val_seen_by_house",
        expected=f"the clean rate in {scan} (or baseline_sr in the experiment)",
        received=", ".join(known) or "none",
    )
