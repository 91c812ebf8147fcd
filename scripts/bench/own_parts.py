"""A network and an observation from outside the packages, with the paper's rules, so that costs can be compared."""

from __future__ import annotations

from esp_trainer.networks import respond
from esp_trainer.networks.feedforward import FeedForward, feed_forward
from predprey_env import observe
from predprey_env.rules.observation import offsets_seen
from predprey_env.sight import Sight


class OwnNetwork(FeedForward):
    """The paper's network as a class of a user's."""


class OwnSight(Sight):
    """The paper's observation as a class of a user's."""


respond.register(OwnNetwork, feed_forward)
observe.register(OwnSight, offsets_seen)
