"""Kinds of network that a controller is made of, each with a compiled rule and a number of genes."""

from esp_trainer.networks.activations import logistic, weighted_sum
from esp_trainer.networks.protocol import Network, respond
from esp_trainer.networks.registry import NETWORKS, network_class

__all__ = ["NETWORKS", "Network", "logistic", "network_class", "respond", "weighted_sum"]
