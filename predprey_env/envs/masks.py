"""Action masks: which actions of an agent count."""

from __future__ import annotations

import numpy as np

from predprey_env.arrays import ActionMask


def action_mask(acts: np.ndarray | bool, n_actions: int) -> ActionMask:
    """Return a mask of 1 for each action that counts, int8 ``(..., n_actions)``.

    An agent that does not act, because it is caught or out of its turn, is left action 0 alone, which is ignored.
    """
    mask = np.repeat(np.asarray(acts, np.int8)[..., None], n_actions, axis=-1)
    mask[..., 0] = 1
    return mask
