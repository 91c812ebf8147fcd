"""The words of ``docs/race.md`` that do not depend on the measurements."""

HEAD = """# Does the race go on?

{answer}

`python scripts/prove_race.py`, {runs} runs so far. The conditions, the endpoints and the tests stand in
[the protocol](race-protocol.md), written before the runs, later changed once and extended six times; it tells what
was known at each change. What is planned there and missing here has not been run yet. Levels and gains are measured
against frozen teams, behaviours and exploiters against the run's own champions of the same generation. The
*panel* is 20 runs that nobody trained on, 10 with biases and 10 without, with six champions each. The *zoo* is the
first zoo's held-out teams, which are older than the race (there are none for `steppe`), and the *scripts* are those of
the environment."""

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
  changes.
- **Fresh evolution**: 60 generations of evolution from nothing against frozen champions, by the same settings: a
  lower bound, as more generations reach more.
- **Behaviours**: fraction of the episodes, champion against contemporary champion, in which a detector fires, less
  its rate where predators and prey come from different episodes
  ([definitions](../esp_trainer/analysis/behaviours/registry.py))."""
