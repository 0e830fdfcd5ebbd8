"""The baseline gate: no attack on an agent that is already broken."""

from scipy.stats import binomtest

from vlnhijack.errors import CheckError


def check_baseline(scan: str, successes: int, episodes: int, recorded: float) -> None:
    """Raise CheckError if the clean success rate is below the recorded one.

    One-sided binomial test at 1 %; `recorded` is the rate stored with the agent's weights for the
    val_seen episodes of this scan.
    """
    p = float(binomtest(successes, episodes, recorded, alternative="less").pvalue)
    if p < 0.01:
        raise CheckError(
            f"baseline gate: in {scan} the clean agent succeeds in {successes} of {episodes} "
            f"val_seen episodes, its weights record {recorded:.3f} (one-sided binomial p = {p:.2g})"
        )
