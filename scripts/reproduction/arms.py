"""What is run: the paper's experiments, what each of their parts does, and one factor at a time around them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from esp_trainer import RunConfig, preset


@dataclass(frozen=True)
class Arm:
    """One setting, to be run with several seeds."""

    name: str
    part: str
    """``paper``, ``ablation``, ``sensitivity``, ``combination``, ``modern`` or ``panel``."""
    meaning: str
    config: RunConfig
    seeds: tuple[int, ...]

    def run(self, seed: int) -> RunConfig:
        """The config of one of its runs."""
        return self.config.replace(preset=self.name, seed=seed)


def _vary(base: str, **sections: dict[str, Any]) -> RunConfig:
    """A preset with some fields of some sections changed; the section ``both`` stands for predators and prey."""
    config = preset(base)
    both = sections.pop("both", {})
    changes = {"predators": both, "prey": both} if both else {}
    for section, fields in {**changes, **sections}.items():
        config = config.replace(**{section: getattr(config, section).replace(**fields)})
    return config


_PAPER = {
    "monolithic-3v2": "one network an agent",
    "monolithic-3v1": "one network an agent, a single prey",
    "monolithic-3v1-wide": "the same, the prey with 30 hidden neurons",
    "paper-3v1": "split networks, a single prey",
    "paper-3v2": "split networks",
}

_BOTH_TASKS: dict[str, tuple[str, dict[str, dict[str, Any]]]] = {
    "no-hall-of-fame": ("nobody mates with a past champion", {"esp": {"hof_mates": 0}}),
    "hall-of-fame-opponents": ("trials against past champions", {"esp": {"pairing": "hall_of_fame"}}),
    "scaled": ("offsets times 0.2", {"both": {"input_scale": 0.2}}),
    "prey-first": ("the prey move, then the predators see it and move", {"env": {"move_order": "prey_first"}}),
    "complementary": ("prey earn 25 minus what predators earn", {"env": {"prey_fitness": "complementary"}}),
    "linear": ("linear outputs", {"both": {"output": "linear"}}),
    "no-idling": ("predators must move", {"env": {"predator_idle": False}}),
}

_SENSITIVITY: dict[str, tuple[str, dict[str, dict[str, Any]]]] = {
    "scale-0.5": ("offsets times 0.5", {"both": {"input_scale": 0.5}}),
    "scale-0.1": ("offsets times 0.1", {"both": {"input_scale": 0.1}}),
    "scale-0.02": ("offsets times 0.02", {"both": {"input_scale": 0.02}}),
    "narrow-start": ("initial weights in [-1, 1]", {"esp": {"init_range": 1.0}}),
    "small-steps": ("Cauchy scale 0.1", {"esp": {"mutation_scale": 0.1}}),
    "large-steps": ("Cauchy scale 1", {"esp": {"mutation_scale": 1.0}}),
    "previous-champion": ("trials against the last champion", {"esp": {"pairing": "previous_champion"}}),
    "mixed": ("trials against drawn teams or past champions", {"esp": {"pairing": "mixed"}}),
    "shared-fitness": (
        "competitive fitness sharing, mixed opponents",
        {"esp": {"pairing": "mixed", "fitness_sharing": True}},
    ),
    "argmax": ("the champion is the best of the trials", {"champion": {"method": "argmax"}}),
    "nearest": ("closeness of the nearest predator", {"env": {"closeness": "nearest"}}),
    "burst": ("burst mutation after 30 stagnant generations", {"esp": {"burst_after": 30}}),
}

_UNMATED = {"hof_mates": 0}

_COMBINATIONS: dict[str, tuple[str, dict[str, dict[str, Any]]]] = {
    "unmated-scaled": ("no past mates, offsets times 0.2", {"esp": _UNMATED, "both": {"input_scale": 0.2}}),
    "unmated-narrow": ("no past mates, initial weights in [-1, 1]", {"esp": _UNMATED | {"init_range": 1.0}}),
    "unmated-mixed": ("no past mates, mixed opponents", {"esp": _UNMATED | {"pairing": "mixed"}}),
    "unmated-scaled-mixed": (
        "no past mates, offsets times 0.2, mixed opponents",
        {"esp": _UNMATED | {"pairing": "mixed"}, "both": {"input_scale": 0.2}},
    ),
}
"""What did best alone, together."""

_DRAWN = "linear outputs, actions drawn by the votes"
_MORE_SEEDS = tuple(range(20))  # signs of ten leave p at 1/512, too much for a correction over 30 claims
_SEEDS = tuple(range(10))
_CONFIRMING_SEEDS = tuple(range(100, 120))  # no part in the choice of what they confirm
_FEWER_SEEDS = tuple(range(5))
_HELD_OUT_SEEDS = (1000, 1001, 1002)
_SHORTER = 300


_ODD_TORUS = Arm(
    "odd-torus-3v1",
    "ablation",
    "a torus of 101 by 101 cells, which has no parity",
    _vary("paper-3v1", env={"size": 101}),
    _SEEDS,
)


def _arms() -> list[Arm]:
    arms = [Arm(name, "paper", meaning, preset(name), _MORE_SEEDS) for name, meaning in _PAPER.items()]
    for name, meaning in {
        "matched-3v2": "one network an agent, as many genes as when split",
        "combiner-3v2": "a network combines the split ones",
        "matched-3v1": "a single prey with one network, as many genes as when split",
        "combiner-3v1": "a network combines the prey's split ones",
        "fleeing-prey": "predators against the fixed prey",
        "fleeing-prey-central": "one network for all predators, against the fixed prey",
    }.items():
        arms.append(Arm(name, "ablation", meaning, preset(name), _SEEDS))
    for task in ("3v2", "3v1"):
        for name, (meaning, changes) in _BOTH_TASKS.items():
            arms.append(Arm(f"{name}-{task}", "ablation", meaning, _vary(f"paper-{task}", **changes), _SEEDS))
        arms.append(Arm(f"drawn-{task}", "ablation", _DRAWN, preset(f"drawn-{task}"), _SEEDS))
    arms.append(_ODD_TORUS)
    for name, (meaning, changes) in _SENSITIVITY.items():
        for task in ("3v2", "3v1"):
            config = _vary(f"paper-{task}", **changes).replace(generations=_SHORTER)
            arms.append(Arm(f"{name}-{task}", "sensitivity", meaning, config, _FEWER_SEEDS))
    for name, (meaning, changes) in _COMBINATIONS.items():
        arms += [
            Arm(f"{name}-{task}", "combination", meaning, _vary(f"paper-{task}", **changes), _SEEDS)
            for task in ("3v2", "3v1")
        ]
    for task in ("3v2", "3v1"):
        meaning = "as `unmated-scaled`, from seeds that had no part in its choice"
        arms.append(Arm(f"modern-{task}", "modern", meaning, preset(f"modern-{task}"), _CONFIRMING_SEEDS))
    return arms + _panel_arms(arms)


def _panel_arms(arms: list[Arm]) -> list[Arm]:
    """For each world that an arm plays in: runs of seeds that no arm has, whose champions everyone is measured against.

    Half of them read raw offsets and half scaled ones, so that no arm meets only its own kind.
    """
    panels: dict[str, Arm] = {}
    for arm in arms:
        task = world_of(arm.config)
        for scale in (1.0, 0.2):
            name = f"panel-{task}-{scale:g}"
            base = preset(f"paper-{arm.config.env.n_predators}v{arm.config.env.n_prey}")
            side = base.predators.replace(input_scale=scale)
            config = base.replace(env=_plain(arm.config), predators=side, prey=side, generations=_SHORTER)
            panels.setdefault(name, Arm(name, "panel", "held-out opponents", config, _HELD_OUT_SEEDS))
    return list(panels.values())


def _plain(config: RunConfig) -> Any:
    """The world of an arm without what concerns only fitness."""
    default = type(config.env)()
    return config.env.replace(prey_fitness=default.prey_fitness, closeness=default.closeness)


def world_of(config: RunConfig) -> str:
    """A name for the world that an arm plays in; the same for arms whose teams can meet."""
    env, default = config.env, type(config.env)()
    name = f"{env.n_predators}v{env.n_prey}"
    for field, short in {"size": "size-", "move_order": "", "predator_idle": "idle-"}.items():
        value = getattr(env, field)
        if value != getattr(default, field):
            name += f"-{short}{str(value).lower().replace('_', '-')}"
    return name


def small(arms: Mapping[str, Arm]) -> dict[str, Arm]:
    """Some of the arms, in a small world and with few generations: each kind, so that everything is run."""
    tiny = {"generations": 12, "checkpoint_every": 6}
    kept = [a for a in arms.values() if a.part == "paper" or a.name in _QUICK]
    found = []
    for arm in kept:
        config = arm.config.replace(
            env=arm.config.env.replace(size=16, max_cycles=30),
            esp=arm.config.esp.replace(subpopulation_size=20, n_trials=60, n_episodes=2, hof_mates=2),
            champion=arm.config.champion.replace(n_candidates=4, n_held_out=32),
            **tiny,
        )
        found.append(replace(arm, config=config, seeds=arm.seeds[:2]))
    return {arm.name: arm for arm in found}


_QUICK = {
    "complementary-3v1",
    "scaled-3v1",
    "fleeing-prey",
    "fleeing-prey-central",
    "scale-0.5-3v2",
    "panel-3v1-1",
    "panel-3v2-1",
}

ARMS = {arm.name: arm for arm in _arms()}
"""Every arm by name, in the order in which they are reported."""

PARITY_ARMS = (
    "paper-3v1",
    "scaled-3v1",
    "modern-3v1",
    "drawn-3v1",
    "prey-first-3v1",
    "no-idling-3v1",
    "odd-torus-3v1",
)
"""Those in which captures are told apart by the parity of the start."""
