"""Word-level tokenizer of the small agent."""

import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

from vlnhijack.errors import InputError

_SPECIAL = ("[PAD]", "[UNK]", "[CLS]", "[SEP]")
PAD, UNK, CLS, SEP = range(len(_SPECIAL))
_WORD = re.compile(r"[a-z0-9]+(?:'[a-z]+)?")


@dataclass(frozen=True)
class Vocabulary:
    """Lower-case words and their token ids; punctuation is dropped.

    `tokens[i]` is the word of id i; the first four are [PAD], [UNK], [CLS], [SEP].
    """

    tokens: tuple[str, ...]

    def __post_init__(self) -> None:
        if self.tokens[: len(_SPECIAL)] != _SPECIAL:
            first = self.tokens[: len(_SPECIAL)]
            raise InputError(field="vocabulary", expected=f"{_SPECIAL} first", received=first)
        if len(set(self.tokens)) < len(self.tokens):
            word, count = Counter(self.tokens).most_common(1)[0]
            received = f"{word!r} {count} times"
            raise InputError(field="vocabulary", expected="distinct words", received=received)

    @classmethod
    def build(cls, sentences: Iterable[str], min_count: int = 1) -> "Vocabulary":
        """The words that occur at least `min_count` times, in alphabetical order."""
        counts = Counter(word for sentence in sentences for word in split_words(sentence))
        words = sorted(word for word, count in counts.items() if count >= min_count)
        return cls((*_SPECIAL, *words))

    def __len__(self) -> int:
        return len(self.tokens)

    def encode(self, text: str, max_length: int) -> list[int]:
        """[CLS] words [SEP] as ids, at most `max_length` of them (words are cut at the end)."""
        if max_length < 2:
            raise InputError(field="max_length", expected="at least 2", received=max_length)
        ids = [self._ids.get(word, UNK) for word in split_words(text)]
        return [CLS, *ids[: max_length - 2], SEP]

    @cached_property
    def _ids(self) -> dict[str, int]:
        return {token: index for index, token in enumerate(self.tokens)}


def split_words(text: str) -> list[str]:
    return _WORD.findall(text.lower())
