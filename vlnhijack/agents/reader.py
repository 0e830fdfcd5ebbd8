"""How an agent reads instructions: as token ids of its own."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import tokenizers
import torch
from torch import Tensor

from vlnhijack.agents.vocabulary import PAD, Vocabulary
from vlnhijack.artifacts import open_text
from vlnhijack.errors import InputError
from vlnhijack.navigation.episode import Episode

MAX_TOKENS = 60


class TokenizerFile:
    """A `tokenizer.json` of Hugging Face's tokenizers, as BERT and XLM-R have; InputError if none.

    text: content of the file.
    """

    def __init__(self, file: Path) -> None:
        with open_text(file) as opened:
            self.text = opened.read()
        try:
            self._tokenizer = tokenizers.Tokenizer.from_str(self.text)
        except Exception as error:  # the library raises no narrower class
            raise InputError(f"not a tokenizer.json ({error})", file=file) from None
        self._tokenizer.no_padding()
        self._tokenizer.no_truncation()

    def encode(self, text: str, max_length: int) -> list[int]:
        """Ids with the special tokens of the file, cut at the end as HAMT cuts them."""
        return self._tokenizer.encode(text).ids[:max_length]


@dataclass(frozen=True)
class Reader:
    """Instructions to token ids.

    vocab_size: ids that the policy knows; max_tokens: as many are read. With a Vocabulary, the
    text of an episode is read. Else the token ids of its annotation file are, or the text where
    the file has none and there is a tokenizer.
    """

    tokenizer: Vocabulary | TokenizerFile | None
    vocab_size: int
    max_tokens: int = MAX_TOKENS

    def __call__(self, episodes: Sequence[Episode]) -> tuple[Tensor, Tensor]:
        """Token ids (B,T) int64 and mask (B,T) bool, T the length of the longest instruction."""
        rows = [self.read(episode) for episode in episodes]
        longest = max(map(len, rows), default=0)
        ids = torch.tensor([row + [PAD] * (longest - len(row)) for row in rows], dtype=torch.int64)
        return ids, torch.arange(longest) < torch.tensor([len(row) for row in rows])[:, None]

    def read(self, episode: Episode) -> list[int]:
        """The token ids of one instruction.

        Raises InputError where there are none, and where one is unknown to the policy.
        """
        field = f"instruction {episode.instruction_id}"
        if episode.encoding is not None and not isinstance(self.tokenizer, Vocabulary):
            ids = list(episode.encoding[: self.max_tokens])
        elif self.tokenizer is not None:
            ids = self.tokenizer.encode(episode.instruction, self.max_tokens)
        else:
            raise InputError(
                field=field,
                expected="token ids in the file (instr_encoding), or an agent with a tokenizer "
                "(vlnhijack agent convert --tokenizer)",
                received="text alone",
            )
        if not ids or max(ids) >= self.vocab_size:
            expected = f"≥ 1 token id, each below {self.vocab_size}"
            raise InputError(field=field, expected=expected, received=max(ids, default="none"))
        return ids
