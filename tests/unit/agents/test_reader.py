"""Token ids of instructions: own words, a tokenizer file, or those of the annotation file."""

import json
from pathlib import Path

import pytest
import tokenizers
import torch

from vlnhijack.agents.reader import Reader, TokenizerFile
from vlnhijack.agents.vocabulary import CLS, PAD, SEP, Vocabulary
from vlnhijack.errors import InputError
from vlnhijack.navigation.episode import Episode

WORDS = Vocabulary.build(["walk past the sofa"])


def episode(text: str, encoding: tuple[int, ...] | None = None) -> Episode:
    return Episode(7, "east", ("a", "b"), 0.0, text, "7_0", 1.0, encoding)


@pytest.fixture
def tokenizer(tmp_path: Path) -> TokenizerFile:
    """[CLS] words [SEP], with the padding that some published files switch on."""
    words = {word: number for number, word in enumerate(("[PAD]", "[UNK]", "<s>", "</s>", "go"))}
    made = tokenizers.Tokenizer(tokenizers.models.WordLevel(words, unk_token="[UNK]"))
    made.pre_tokenizer = tokenizers.pre_tokenizers.Whitespace()
    made.post_processor = tokenizers.processors.TemplateProcessing(
        single="<s> $A </s>", special_tokens=[("<s>", 2), ("</s>", 3)]
    )
    made.enable_padding(length=9)
    made.save(str(tmp_path / "tokenizer.json"))
    return TokenizerFile(tmp_path / "tokenizer.json")


def test_batches_are_padded_to_the_longest() -> None:
    ids, mask = Reader(WORDS, len(WORDS))([episode("walk"), episode("walk past the sofa")])
    assert ids.shape == mask.shape == (2, 6)
    assert ids.dtype == torch.int64
    assert mask.sum(1).tolist() == [3, 6]
    assert (ids[0, 3:] == PAD).all()


def test_own_words_are_read_whatever_ids_a_file_has() -> None:
    read = Reader(WORDS, len(WORDS)).read(episode("sofa", (1, 2, 3)))
    assert [read[0], read[-1]] == [CLS, SEP]
    assert WORDS.tokens[read[1]] == "sofa"


def test_ids_of_a_file_are_taken_as_they_are_and_cut_as_hamt_cuts(tokenizer: TokenizerFile) -> None:
    for reader in (Reader(None, 250002, 3), Reader(tokenizer, 250002, 3)):
        ids, mask = reader([episode("go", (0, 250001, 5, 2)), episode("go", (0,))])
        assert ids.tolist() == [[0, 250001, 5], [0, 0, 0]]
        assert mask.tolist() == [[True] * 3, [True, False, False]], "id 0 is XLM-R's <s>"


def test_text_is_tokenised_without_the_padding_of_the_file(tokenizer: TokenizerFile) -> None:
    assert Reader(tokenizer, 5).read(episode("go there")) == [2, 4, 1, 3]
    assert Reader(tokenizer, 5, 2).read(episode("go there")) == [2, 4]


def test_text_without_a_tokenizer_is_refused() -> None:
    with pytest.raises(InputError, match=r"7_0: .*instr_encoding.*--tokenizer") as error:
        Reader(None, 9).read(episode("go"))
    assert "\n" not in str(error.value)


def test_ids_that_the_policy_does_not_know_are_refused() -> None:
    with pytest.raises(InputError, match="7_0: expected .* below 30522, received 30522"):
        Reader(None, 30522).read(episode("go", (101, 30522)))


@pytest.mark.parametrize("content", ["{}", "[CLS]", json.dumps({"model": {"type": "no"}})])
def test_a_file_that_is_no_tokenizer_is_refused(tmp_path: Path, content: str) -> None:
    (tmp_path / "vocab.json").write_text(content)
    with pytest.raises(InputError, match=r"vocab\.json: not a tokenizer\.json"):
        TokenizerFile(tmp_path / "vocab.json")
    with pytest.raises(InputError, match="no such file"):
        TokenizerFile(tmp_path / "none.json")
