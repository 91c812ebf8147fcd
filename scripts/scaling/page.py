"""The page: what was measured, the arithmetic, and what follows."""

from __future__ import annotations

from scaling.bounded import Kept
from scaling.growth import Grown
from scaling.model import Model, fit
from scaling.sharding import Measured
from scaling.sweeps import Sweep

_CORES = (2, 4, 8, 16, 32, 64, 128, 256)
_TRIALS = (1_000, 10_000, 100_000)
_PER_NODE = (4, 8, 16, 32)


def page(grown: list[Grown], shared: Measured, many: Sweep, kept: list[Kept], machine: str) -> str:
    """``docs/scaling.md``."""
    model = fit(grown, shared)
    return f"""# How it grows

Written by `python scripts/bench_scaling.py`. {machine}. Everything was measured on this one machine; what more machines
would give is computed from it, below, with every assumption. A network was not measured.

**In short.** Distribute independent runs first: `esp-trainer sweep` needs no traffic between them, so N nodes do N times
as many. A single run belongs on one machine as long as its generations are short. Sharding it over two machines of
16 cores pays from {_from(model.pays_from(16, 2))} trials a generation on, {_times(model.pays_from(16, 2))} the paper's.

## A cluster

Install this package with its extra `ray` on every machine, in the same version (workers check it), then:

```bash
ray start --head --port=6379                        # on one of them, here called head
ray start --address=head:6379                       # on each of the others
esp-trainer sweep sweep.toml --address auto         # on any of them, with a directory that all share
esp-trainer train paper-3v2 --address auto          # needs no shared directory: only the driver writes
```

From elsewhere give `--address head:6379`. Where Ray asks for a token, as it does by default from 2.60 on, that takes
`RAY_AUTH_MODE=token` and the token of `ray get-auth-token`. Without a cluster `--address local` starts one for the time of the command.

## More trials, larger subpopulations, one machine

A generation of `paper-3v2`, medians, {grown[0].threads} threads. The rest is champions, held-out episodes and breeding, without files.

| trials | neurons a subpopulation | trials, wall | the rest, wall | peak memory |
| ---: | ---: | ---: | ---: | ---: |
{_growth(grown)}

Trials stream through the kernel in parts of at most 2,048, so that what grows with their number is what must be kept to the
end of the generation: who was in each team, where it started and what it earned,
{_kilobytes(grown):.1f} KB a trial. A test holds it below 0.9 (`test_memory_grows_by_less_than_a_kilobyte_a_trial`).

## A generation in shards

The trials of a generation on a Ray cluster of this machine, {shared.workers} workers for the same cores, beside one process with a
thread for each. The results were checked to be equal.

| trials | one process, wall | shards | on Ray, wall | driver, CPU |
| ---: | ---: | ---: | ---: | ---: |
{_shards(shared)}

So the driver's CPU time for a batch is, by least squares,

    {1e3 * model.driver_fixed:.1f} ms + {1e3 * model.driver_per_shard:.2f} ms x shards + {1e6 * model.driver_per_trial:.2f} us x trials

an empty task there and back takes {1e3 * shared.round_trip:.1f} ms, and a trial of six episodes {1e6 * model.per_trial:.1f} us on a core. Over
the wire go {shared.sent:.0f} bytes a trial to a worker and {shared.returned:.0f} from it, and {shared.common / 1e3:.0f} KB of candidates a generation to each node: at
10 Gbit/s that is {8 * (shared.sent + shared.returned) / 10e3:.2f} us a trial, beside what the driver does for it.

## What more cores would give

Seconds of a generation, files left out, were nothing else in the way:

    one machine   T = rest + {1e6 * model.per_trial:.1f} us x trials / cores
    a cluster     T = rest + round trip + {1e3 * model.driver_fixed:.1f} ms + {1e3 * model.driver_per_shard:.2f} ms x cores + ({model.driver_per_trial * 1e6:.2f} us + {1e6 * model.per_trial:.1f} us / cores) x trials
    rest          {1e3 * model.rest:.1f} ms + {1e6 * model.rest_per_trial:.2f} us x (trials - 1,000)

with a shard for each core, the driver's work not overlapping with the workers', and all cores like these. The cells: one
machine of so many cores / a cluster of so many.

| cores | {" | ".join(f"{n:,} trials" for n in _TRIALS)} |
| ---: | {" | ".join("---:" for _ in _TRIALS)} |
{_cores(model)}

- **Where the driver becomes the bottleneck:** its own work takes longer than the trials from {_and([f"{model.bottleneck(n)} cores at {n:,} trials" for n in _TRIALS])}. The quickest
  generation is that of {_and([f"{model.best(n)[0]} cores at {n:,} ({model.best(n)[1]:.3f} s)" for n in _TRIALS])}.
- **From which size sharding pays:** two machines beat one of them from the trials below on.

| cores a machine | trials a generation |
| ---: | ---: |
{_pays(model)}

## Many runs

{many.n_runs} runs of `paper-3v2`, {many.generations} generations each, one thread a run, process starts included:

| | wall | runs an hour |
| --- | ---: | ---: |
| `sweep --workers 1` | {many.one:.1f} s | {3600 * many.n_runs / many.one:,.0f} |
| `sweep --workers 2` | {many.two:.1f} s | {3600 * many.n_runs / many.two:,.0f} |
| `sweep --address local`, {shared.workers} workers, the cluster's start included | {many.cluster:.1f} s | {3600 * many.n_runs / many.cluster:,.0f} |

Two workers get through {many.one / many.two:.2f} times as many as one. Runs exchange nothing, and the driver only looks at their logs; so N
nodes of k cores do N x k runs in the time of one, until the disk that they share has enough: a run writes two champions of
4 KB and a line of 1 KB a generation, and a checkpoint of up to 3.5 MB every ten.

## What stays bounded

**The hall of fame** holds at most `esp.hof_size` champions a side (1,000). When there are more, every second goes, then every
second of those; the last always stays. The same holds for the checkpoint and for `champions/`. A run with the networks of
`paper-3v2`:

| generations | champions a side | in memory | their files | checkpoint | logs |
| ---: | ---: | ---: | ---: | ---: | ---: |
{_bounded(kept)}

The logs have a line for each generation, and nothing is left out of them.
"""


def _bounded(kept: list[Kept]) -> str:
    return "\n".join(
        f"| {k.generations:,} | {k.champions:,} | {k.memory:.1f} MB | {k.files:.1f} MB | {k.checkpoint:.1f} MB | {k.logs:.1f} MB |"
        for k in kept
    )


def _growth(grown: list[Grown]) -> str:
    return "\n".join(
        f"| {g.n_trials:,} | {g.subpopulation_size:,} | {g.trials:.3f} s | {g.rest:.3f} s | {g.peak:.0f} MB |"
        for g in grown
    )


def _kilobytes(grown: list[Grown]) -> float:
    same = [each for each in grown if each.subpopulation_size == grown[0].subpopulation_size]
    return 1e3 * (same[-1].peak - same[0].peak) / (same[-1].n_trials - same[0].n_trials)


def _shards(shared: Measured) -> str:
    return "\n".join(
        f"| {b.n_trials:,} | {1e3 * b.here:.1f} ms | {b.shards} | {1e3 * b.wall:.1f} ms | {1e3 * b.driver:.1f} ms |"
        for b in shared.batches
    )


def _cores(model: Model) -> str:
    rows = []
    for cores in _CORES:
        cells = [f"{model.alone(n, cores):.3f} / {model.shared(n, cores):.3f} s" for n in _TRIALS]
        rows.append(f"| {cores} | {' | '.join(cells)} |")
    return "\n".join(rows)


def _pays(model: Model) -> str:
    return "\n".join(f"| {cores} | {_from(model.pays_from(cores, 2))} |" for cores in _PER_NODE)


def _from(trials: int | None) -> str:
    return "never" if trials is None else f"{trials:,}"


def _times(trials: int | None) -> str:
    return "however many times" if trials is None else f"{trials / 1000:.1f} times"


def _and(parts: list[str]) -> str:
    return ", ".join(parts[:-1]) + " and " + parts[-1]
