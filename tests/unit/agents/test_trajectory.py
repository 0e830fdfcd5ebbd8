import pytest
import torch

from tests.hamt_by_hand import logits_along
from tests.worlds import World, world
from vlnhijack.agents.hamt import Hamt
from vlnhijack.agents.reader import MAX_TOKENS
from vlnhijack.agents.rollout import rows_of
from vlnhijack.agents.trajectory import (
    Trajectories,
    history,
    read_instructions,
    renew_history,
    step_logits,
    trajectories,
)
from vlnhijack.navigation.episode import Episode
from vlnhijack.navigation.views import nearest_view


@pytest.fixture(scope="module", params=[False, True], ids=["r2r", "rxr"])
def given(request: pytest.FixtureRequest) -> World:
    return world(no_lang_ca=request.param)


def some(given: World) -> list[Episode]:
    """Episodes of both scans and of several lengths, one of them a single viewpoint."""
    picked = given.episodes[::17]
    assert len({len(episode.path) for episode in picked}) > 1
    first = picked[0]
    alone = Episode(99, first.scan, first.path[:1], first.heading, "stop", "99_0", 0.0)
    return [*picked, alone]


def walk(given: World, episodes: list[Episode]) -> Trajectories:
    headings = [episode.heading for episode in episodes]
    return trajectories(given.table, [rows_of(given.table, e) for e in episodes], headings)


def every_step(walked: Trajectories) -> tuple[torch.Tensor, torch.Tensor]:
    episodes, steps = (walked.viewpoints >= 0).nonzero().T
    order = torch.randperm(len(steps), generator=torch.Generator().manual_seed(0))
    return episodes[order], steps[order]


def batched(given: World, episodes: list[Episode], features: torch.Tensor) -> torch.Tensor:
    read = read_instructions(given.agent.policy, given.agent.reader, episodes)
    walked = walk(given, episodes)
    rows, steps = every_step(walked)
    past = history(given.agent.policy, given.table, features, walked)
    return step_logits(given.agent.policy, given.table, features, past, read, walked, rows, steps)


def test_all_steps_at_once_are_the_steps_one_by_one(given: World) -> None:
    episodes = some(given)
    logits = batched(given, episodes, given.features)
    walked = walk(given, episodes)
    twins = [logits_along(given, episode, list(episode.path)) for episode in episodes]
    for row, (episode, step) in enumerate(zip(*every_step(walked), strict=True)):
        seen, expected = twins[episode][step]
        torch.testing.assert_close(
            logits[row, : len(expected)], expected, rtol=1e-4, atol=1e-5, msg=f"{episode}, {step}"
        )
        assert (logits[row, len(expected) :] == -torch.inf).all()
        assert walked.views[episode, step] == seen.base


def test_actions_are_the_moves_of_the_path_and_stop(given: World) -> None:
    episodes = some(given)
    walked = walk(given, episodes)
    actions = walked.actions(given.table)
    for row, episode in enumerate(episodes):
        steps = logits_along(given, episode, list(episode.path))
        targets = [*episode.path[1:], None]
        expected = [step.action(to) for (step, _), to in zip(steps, targets, strict=True)]
        assert actions[row, : len(expected)].tolist() == expected
        assert walked.lengths[row] == len(episode.path)
        assert walked.views[row, 0] == nearest_view(episode.heading)


def test_long_instructions_are_cut(given: World) -> None:
    first = given.episodes[0]
    long = Episode(0, first.scan, first.path, 0.0, "walk " * 100, "0_0", 1.0)
    read = read_instructions(given.agent.policy, given.agent.reader, [long, first])
    assert read.mask.shape == (2, MAX_TOKENS)
    assert read.rows(torch.tensor([1, 1, 0])).mask.sum(1).tolist()[2] == MAX_TOKENS


def gradient_of_last_step(given: World, episode: Episode) -> torch.Tensor:
    """Size of the gradient (M,) of the STOP logit at the end of a walk to each panorama."""
    features = given.features.clone().requires_grad_()
    read = read_instructions(given.agent.policy, given.agent.reader, [episode])
    walked = walk(given, [episode])
    last = walked.lengths - 1
    policy, first = given.agent.policy, torch.tensor([0])
    past = history(policy, given.table, features, walked)
    logits = step_logits(policy, given.table, features, past, read, walked, first, last)
    stop = given.table.stops[walked.viewpoints[0, last]]
    logits[0, stop].sum().backward()
    assert features.grad is not None
    return features.grad.abs().amax((1, 2))


def test_gradients_flow_through_observation_and_history(
    given: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    episode = given.episodes[5]
    *past, here = rows_of(given.table, episode)
    both = gradient_of_last_step(given, episode)
    assert (both[[*past, here]] > 0).all()
    both[[*past, here]] = 0
    assert not both.any(), "panoramas that were never seen"

    encode = Hamt.encode_history
    monkeypatch.setattr(Hamt, "encode_history", lambda *given: encode(*given).detach())
    without_history = gradient_of_last_step(given, episode)
    assert without_history[here] > 0
    assert not without_history[past].any()

    monkeypatch.undo()
    embed = Hamt._embed_observation
    monkeypatch.setattr(Hamt, "_embed_observation", lambda *given: embed(*given).detach())
    without_observation = gradient_of_last_step(given, episode)
    assert without_observation[here] == 0
    assert (without_observation[past] > 0).all()


def test_renewing_the_changed_history_is_encoding_it_all(given: World) -> None:
    episodes = some(given)
    policy, walked = given.agent.policy, walk(given, [*episodes, *episodes[::2]])
    changing = torch.zeros(len(given.features), dtype=torch.bool)
    changing[rows_of(given.table, episodes[0])[1:3]] = True
    noise = torch.randn(given.features.shape, generator=torch.Generator().manual_seed(0))
    features = torch.where(changing[:, None, None], given.features + noise, given.features)
    features.requires_grad_()
    with torch.no_grad():
        past = history(policy, given.table, given.features, walked)
    renewed = renew_history(policy, given.table, features, walked, past, changing)
    whole = history(policy, given.table, features, walked)
    taken = torch.arange(whole.shape[1]) < walked.lengths[:, None]
    torch.testing.assert_close(renewed[taken], whole[taken], rtol=1e-5, atol=1e-6)
    assert (renewed[taken] - past[taken]).abs().amax() > 0.01
    weights = (
        torch.randn(whole.shape, generator=torch.Generator().manual_seed(1)) * taken[..., None]
    )
    (fast,) = torch.autograd.grad((renewed * weights).sum(), features)
    (slow,) = torch.autograd.grad((whole * weights).sum(), features)
    torch.testing.assert_close(fast[changing], slow[changing], rtol=1e-4, atol=1e-6)


def test_history_where_nothing_changes_is_the_old_one(given: World) -> None:
    walked = walk(given, some(given))
    past = history(given.agent.policy, given.table, given.features, walked)
    nowhere = torch.zeros(len(given.features), dtype=torch.bool)
    assert (
        renew_history(given.agent.policy, given.table, given.features, walked, past, nowhere)
        is past
    )
