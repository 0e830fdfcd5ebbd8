"""Which attacks an experiment makes, where they lie, and what of their records is kept."""

from pathlib import Path

import pandas as pd
import pytest

from vlnhijack.errors import InputError
from vlnhijack.experiments.attacks import Attack, make_attacks
from vlnhijack.experiments.config import DrawnInstances, ExperimentConfig, RenderSettings
from vlnhijack.experiments.runner import all_records
from vlnhijack.threat import AttackInstance

ONE = RenderSettings(attack_spp=4)
TWO = [ONE, RenderSettings(rung="prb")]


def _instance(name: str) -> AttackInstance:
    return AttackInstance(name, "alder", "sofa_0", "sofa", "v", 0.5, (), (), (), ())


def _attacks(rendering: RenderSettings | list[RenderSettings], *names: str) -> list[Attack]:
    config = ExperimentConfig(
        name="sample",
        instances=DrawnInstances(kind="single_step", houses=["alder"], count=2),
        rendering=rendering,
    )
    return make_attacks(config, Path("run"), [_instance(name) for name in names or ("a", "b")])


def _frame(stopped: bool) -> pd.DataFrame:
    return pd.DataFrame({"arm": ["clean", "noise_texel", "attacked"], "stopped": stopped})


@pytest.mark.parametrize(
    ("rendering", "folders"),
    [
        (ONE, ["a", "b"]),
        (TWO, ["a-frozen_4spp", "a-prb_16spp", "b-frozen_4spp", "b-prb_16spp"]),
    ],
)
def test_every_instance_meets_every_rendering_in_a_folder_of_its_own(
    rendering: RenderSettings | list[RenderSettings], folders: list[str]
) -> None:
    attacks = _attacks(rendering)
    assert [str(attack.folder) for attack in attacks] == [f"run/attacks/{f}" for f in folders]
    assert [attack.id for attack in attacks] == folders


@pytest.mark.parametrize("wrong", ["a/b", "..", "", ".hidden", "a b", "a\n"])
def test_ids_that_cannot_name_a_folder_are_refused(wrong: str) -> None:
    with pytest.raises(InputError, match="instances: expected distinct ids of letters") as caught:
        _attacks(ONE, "a", wrong)
    assert repr([wrong]) in str(caught.value)


def test_two_attacks_do_not_share_a_folder() -> None:
    with pytest.raises(InputError, match=r"expected distinct ids .* received \['a'\]"):
        _attacks(ONE, "a", "b", "a")


def test_records_tell_rungs_apart_and_hold_controls_once() -> None:
    records = all_records(_attacks(TWO), [_frame(k % 2 == 0) for k in range(4)])
    found = list(zip(records["arm"], records["rung"], records["stopped"], strict=True))
    once = [
        ("clean", "", True),
        ("noise_texel", "", True),
        ("attacked", "frozen_4spp", True),
        ("attacked", "prb_16spp", False),
    ]
    assert found == once + once
