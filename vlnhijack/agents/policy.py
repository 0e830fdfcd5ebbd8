"""The seam between navigation and an agent's decisions."""

from typing import Protocol

from torch import Tensor

Text = Tensor | tuple[Tensor, ...]


class Policy(Protocol):
    """Chooses among candidates from text, observation features and history.

    B: batch, T: tokens, S: history tokens (the first is the CLS token), N: observation tokens,
    D: image feature size, A: angle feature size, H: hidden size. Masks are true where a token
    exists. Everything is differentiable in the image features, through history too.
    """

    def encode_text(self, token_ids: Tensor, mask: Tensor) -> Text:
        """token_ids (B,T) int64, mask (B,T) bool; the result, one tensor (B,T,…) or several, is
        opaque but for `text_rows`."""
        ...

    def history_cls(self, batch: int) -> Tensor:
        """The first history token, (B,H)."""
        ...

    def encode_history(
        self, image: Tensor, angle: Tensor, pano_image: Tensor, pano_angle: Tensor, step: Tensor
    ) -> Tensor:
        """History tokens (B,H) of steps already taken; without recurrence, so a batch may hold
        any steps of any episodes.

        image (B,D) and angle (B,A): the view and the action taken; pano_image (B,36,D),
        pano_angle (B,36,A): the panorama of that step; step (B,) int64, from 0.
        """
        ...

    def __call__(
        self,
        text: Text,
        text_mask: Tensor,
        history: Tensor,
        history_mask: Tensor,
        ob_image: Tensor,
        ob_angle: Tensor,
        nav_type: Tensor,
        ob_mask: Tensor,
    ) -> Tensor:
        """Logits (B,N), minus infinity where nav_type is 0.

        text_mask (B,T), history (B,S,H), history_mask (B,S), ob_image (B,N,D), ob_angle (B,N,A),
        nav_type (B,N) int64 (0: not navigable or padding, 1: candidate, 2: STOP), ob_mask (B,N).
        """
        ...


def text_rows(text: Text, rows: Tensor, length: int) -> Text:
    """Encoded text of the batch rows (R,) int64, which may repeat; its first `length` tokens."""
    if isinstance(text, tuple):
        return tuple(part[rows, :length] for part in text)
    return text[rows, :length]
