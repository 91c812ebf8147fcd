"""Train three predators with TorchRL's PPO, in 128 worlds at once, until they catch a prey that runs from the nearest.

Run: `pip install torchrl`, then `python examples/train_torchrl.py`. It takes 21 CPU-seconds and prints

          0 steps,  0 CPU-seconds: 0.00 of the prey caught
    196,608 steps,  7 CPU-seconds: 0.86 of the prey caught
    393,216 steps, 15 CPU-seconds: 1.00 of the prey caught
"""

import sys
from time import process_time

import torch
from tensordict.nn import TensorDictModule
from torch.distributions import Categorical
from torch.nn import Linear, Sequential, Tanh
from torchrl.collectors import Collector
from torchrl.envs import GymWrapper
from torchrl.modules import ProbabilisticActor, ValueOperator
from torchrl.objectives import ClipPPOLoss
from torchrl.objectives.value import GAE

from esp_trainer import Arena, TorchPolicy
from predprey_env import EnvConfig, vector_env

QUICK = "--quick" in sys.argv  # a smaller torus, fewer steps
PREY, CONFIG = "flee_nearest", EnvConfig(n_prey=1, size=8 if QUICK else 20, reward="dense")
N_UPDATES = 8 if QUICK else 16

torch.set_num_threads(1)  # on a busy machine two threads took 8 times the CPU time of one: networks are too small
torch.manual_seed(0)
arena = Arena(CONFIG, n_episodes=200, seed=1)  # always the same starts, other than those of the training

# A row for each predator, so one network learns for all. "Disabled": TorchRL itself resets worlds that are over.
worlds = vector_env(128, "predators", opponent=PREY, autoreset_mode="Disabled", **CONFIG.model_dump())
env = GymWrapper(worlds, categorical_action_encoding=True)
net, value = (Sequential(Linear(2, 64), Tanh(), Linear(64, 64), Tanh(), Linear(64, n)) for n in (5, 1))
net[-1].weight.data *= 0.01  # nearly equal probabilities at first, so that every action is tried
logits = TensorDictModule(net, ["observation"], ["logits"])
actor = ProbabilisticActor(logits, ["logits"], distribution_class=Categorical, return_log_prob=True)
critic = ValueOperator(value, in_keys=["observation"])
loss = ClipPPOLoss(actor, critic, normalize_advantage=True, entropy_coeff=0.0)
advantage = GAE(gamma=0.99, lmbda=0.95, value_network=critic)
optimiser, begun = torch.optim.Adam(loss.parameters(), lr=1e-3), process_time()

for n, rollout in enumerate(Collector(env, actor, frames_per_batch=64 * worlds.num_envs, total_frames=-1)):
    if n % (N_UPDATES // 2) == 0:
        team = TorchPolicy(net, CONFIG.team("predators"), drawn=True)  # samples its actions, as in training
        caught, seconds = arena.meet(team, "predators", PREY).captured.mean(), process_time() - begun
        print(f"{n * rollout.numel():9,} steps, {seconds:2.0f} CPU-seconds: {caught:.2f} of the prey caught")
    if n == N_UPDATES:
        break
    with torch.no_grad():
        advantage(rollout)
    for rows in [rows for _ in range(5) for rows in torch.randperm(rollout.numel()).split(4096)]:
        terms = loss(rollout.reshape(-1)[rows])
        optimiser.zero_grad()
        (terms["loss_objective"] + terms["loss_critic"]).backward()
        torch.nn.utils.clip_grad_norm_(loss.parameters(), 0.5)
        optimiser.step()
