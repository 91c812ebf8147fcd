"""Action masks: which actions of an agent are valid."""

from __future__ import annotations

import numpy as np

from predprey_env.arrays import ActionMask


def action_mask(acts: np.ndarray | bool, n_actions: int) -> ActionMask:
    """Return a mask with 1 for each valid action, int8 ``(..., n_actions)``.

    For an agent that does not act, because it is caught or out of its turn, only the entry of action 0 is 1, because no
    action can be sampled from an empty mask. The environment ignores that action.
    """
    mask = np.repeat(np.asarray(acts, np.int8)[..., None], n_actions, axis=-1)
    mask[..., 0] = 1
    return mask
