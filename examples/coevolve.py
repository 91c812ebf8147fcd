"""Coevolve predators and prey for 100 generations, and see by cross-play whether later champions are better.

Run: `python examples/coevolve.py`. It takes 8 CPU-seconds, and 14 more the first time, to compile. It prints

    caught in its own generation: 0.39, 0.49, 0.52, 0.51, 0.22
    predators of | caught from the prey of generation     0    20    40    59    79    99
               0 |                                     0.35  0.24  0.29  0.05  0.00  0.04
              20 |                                     0.50  0.51  0.51  0.50  0.03  0.45
              40 |                                     0.48  0.51  0.51  0.20  0.49  0.11
              59 |                                     0.51  0.51  0.51  0.20  0.49  0.15
              79 |                                     0.50  0.47  0.48  0.50  0.47  0.46
              99 |                                     0.55  0.51  0.50  0.47  0.10  0.34

The first predators catch fewer of the later prey, and all later predators catch more of the first prey: both improved.
"""

import argparse

from esp_trainer import FusedEvaluator, History, own_cross_play, preset

parser = argparse.ArgumentParser()
parser.add_argument("--quick", action="store_true", help="few generations of few trials")
QUICK = parser.parse_args().quick
FIELDS = {"generations": 6, "esp.n_trials": 100} if QUICK else {"generations": 100}

config = preset("paper-3v1").with_fields({**FIELDS, "seed": 0})
evaluator = FusedEvaluator(config.env)  # loads the compiled kernel, or compiles it, which takes 15 s
history = History.evolve(config, evaluator)

# Champion against champion of the same generation: this rises and falls with both, and shows no progress.
caught = history.curves["caught"]
print("caught in its own generation: " + ", ".join(f"{value:.2f}" for value in caught[:: len(caught) // 5]))

# Every champion of six generations against every other, all from the same starts.
played = own_cross_play(history, evaluator, n_generations=6, n_episodes=200)
print("predators of | caught from the prey of generation " + " ".join(f"{g:5}" for g in played.prey))
for generation, row in zip(played.predators, played.caught, strict=True):
    print(f"{generation:12} | {'':34} " + " ".join(f"{share:5.2f}" for share in row))
