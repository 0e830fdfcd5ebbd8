import pytest

from vlnhijack.agents.vocabulary import CLS, SEP, UNK, Vocabulary
from vlnhijack.errors import InputError

WORDS = Vocabulary.build(["Walk past the sofa.", "Walk to the sofa, then stop!"], min_count=1)


def test_ids_of_known_and_unknown_words() -> None:
    ids = WORDS.encode("WALK past the piano", max_length=20)
    assert ids[0] == CLS
    assert ids[-1] == SEP
    assert [WORDS.tokens[i] for i in ids[1:4]] == ["walk", "past", "the"]
    assert ids[4] == UNK


def test_rare_words_are_left_out() -> None:
    common = Vocabulary.build(["walk past the sofa", "walk to the sofa"], min_count=2)
    assert common.tokens[4:] == ("sofa", "the", "walk")


def test_order_of_sentences_does_not_matter() -> None:
    sentences = ["turn left", "go right", "turn around"]
    assert Vocabulary.build(sentences) == Vocabulary.build(sentences[::-1])


def test_long_texts_keep_their_ends() -> None:
    ids = WORDS.encode("walk " * 50, max_length=7)
    assert len(ids) == 7
    assert (ids[0], ids[-1]) == (CLS, SEP)


@pytest.mark.parametrize(
    "tokens", [("walk",), (*WORDS.tokens[:4], "walk", "walk")], ids=["no specials", "twice"]
)
def test_malformed_vocabularies_are_refused(tokens: tuple[str, ...]) -> None:
    with pytest.raises(InputError, match="vocabulary"):
        Vocabulary(tokens)
