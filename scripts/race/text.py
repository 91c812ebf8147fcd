"""The words of ``docs/race.md`` that do not depend on the measurements."""

HEAD = """# Does the race go on?

{answer}

`race` is the recommended setting: the preset `race-steppe` with two prey, `race-3v1` with one. The *panel* is 20
runs, 10 in the paper's setting and 10 with bias genes and past champions, with six champions each. *Exploiters* are
populations that evolve from nothing for 20 generations against the other side's champion alone, every 25 generations,
and join the pool of opponents. The *zoo* is the first zoo's held-out teams, which are older than the race (there are
none for `steppe`), and the *scripts* are those of the environment. *Beyond chance* is the rate of a behaviour less
its rate where predators and prey come from different episodes. The page tells of {runs} runs, made by `python
scripts/prove_race.py`. The conditions, the endpoints and the tests stand in [the protocol](race-protocol.md), written
before the runs, later changed once and extended six times. What is planned there and missing here has not been run
yet."""

TASK_TITLES = {
    "3v1": "Three predators, one prey",
    "3v2": "Three predators, two prey",
    "steppe": "Three predators, two prey, 40 x 40 cells",
}

METHOD = """## How to read the tables

- **Level**: mean over the last sixth of a run's 24 sampled generations. Intervals are Student's, over seeds.
- **Gain**: the last sixth of the sampled generations less the first, of the whole run or of its second half.
  Intervals count both the runs and the runs of the panel as samples (pigeonhole bootstrap, Owen 2007). The first
  sixth is a mean over generations 0, 66, 130 and 196, so that a gain over the whole run counts what is learned first.
- **†**: fewer than 10 runs. Intervals from so few are too narrow, and such rows are a first look.
- **Genes**: mean absolute gene of a side in the first and in the last generation.
- **Lesser gain**: in each run the smaller of the two sides' gains, which is above 0 only if both improve. It is
  tested against the same runs read backwards, since the smaller of two noisy numbers is below 0 where nothing
  changes. The test rejects that nothing changes, and not that only one side improves.
- **Exploiters**: the runs train against earlier ones, so where exploiters reach less, champions are harder to learn
  against from nothing; it does not say that nobody beats them.
- **Fresh evolution**: 60 generations of evolution from nothing against frozen champions, by the same settings: a
  lower bound, as more generations reach more. The higher of it and of the contemporaries is the least by which
  champions can be beaten.
- **Behaviours**: fraction of the episodes, champion against contemporary champion, in which a detector fires, less
  its rate where predators and prey come from different episodes
  ([definitions](../esp_trainer/analysis/behaviours/registry.py))."""
