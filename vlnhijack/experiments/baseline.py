"""Clean features of every house, and the gate that they pass."""

import time
from functools import partial

import torch
from torch import Tensor

from vlnhijack.agents.features import Features, cached_features
from vlnhijack.artifacts import read_json, write_json
from vlnhijack.evaluation.evaluate import navigate
from vlnhijack.evaluation.gate import check_baseline
from vlnhijack.experiments.context import Context, recorded_rate
from vlnhijack.experiments.views import encode_house
from vlnhijack.rendering.variant import activate


def clean_features(context: Context, scan: str) -> Tensor:
    """Features (M,36,D) of the clean house, at the samples of the evaluation."""
    house, encoder = context.houses[scan], context.agent.encoder
    spp = context.config.evaluation_spp
    seed = context.seed("views", "evaluation", scan)

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
        made_by(context, scan, spp, seed),
        encode,
    )
    return torch.from_numpy(features)


def made_by(context: Context, scan: str, spp: int, seed: int) -> str:
    """What the features of a clean house's views hang on."""
    hashes = ", ".join(f"{file} {digest}" for file, digest in context.inputs[scan].items())
    height, width = context.agent.encoder.image_size
    variant = activate().variant()
    return f"{hashes}, {width} × {height}, {variant}, {spp} spp, seed {seed}"


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
    recorded = recorded_rate(context.agent, scan, context.folders[scan])
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
